/// in: datagrams whose working counter is wrong, and the data that returned.  out: which slaves take no part in them.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "analyzers/judge/rule_context.h"
#include "analyzers/model/logical_expectation.h"
#include "analyzers/result/finding.h"
#include "decoder/track/events.h"

namespace ecaudit::wkc {

/// One kind of mismatch: which slaves' inputs were refreshed while it lasted.
struct Episode {
  std::uint64_t key = 0;
  FindingIndex finding = kNoFinding;
  SlaveId only_candidate = kNoSlave;
  std::optional<Note> hint;
  std::uint64_t frames = 0;
  struct Watched {
    SlaveId slave = kNoSlave;
    std::uint64_t refreshed = 0;  ///< frames in which the inputs differ from what the master sent there
    int worth = 0;                ///< what it adds to the working counter
  };
  int missing = 0;
  std::vector<Watched> slaves;
};

class Episodes {
 public:
  void Watch(std::uint64_t key, const model::LogicalExpectation& expected, const track::LogicalAccess& access);
  /// Null: there were too many before.
  [[nodiscard]] Episode* Find(std::uint64_t key);
  /// Adds to the findings which slave is missing: by its share, or because its inputs returned unchanged while those of
  /// all others were refreshed.
  void NameMissing(RuleContext& context) const;
  /// If several shares fit, that of the slave which left its state is missing.
  void AddWhoLeftItsState(RuleContext& context, Finding& own, Finding& cause) const;

 private:
  std::vector<Episode> episodes_;
};

}  // namespace ecaudit::wkc
