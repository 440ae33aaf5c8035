/// in: findings about datagrams, and which slaves have a part in them.  out: the slave that is missing from all.
#pragma once

#include <cstdint>
#include <vector>

#include "analyzers/judge/rule_context.h"
#include "analyzers/model/logical_expectation.h"
#include "analyzers/result/finding.h"
#include "decoder/track/events.h"

namespace ecaudit::wkc {

class Datagrams {
 public:
  /// @param before  what the counter was, or should be
  void Add(FindingIndex finding, const model::LogicalExpectation& expected, const track::LogicalAccess& access,
           int before);
  /// Drops of several datagrams in one frame are those of one slave if only one has all shares that are missing.
  void NameDropped(RuleContext& context) const;
  /// What shows after the effect is its cause only if it may have begun before it, lasted until it showed, and is about
  /// a slave with a part in the datagram.
  [[nodiscard]] bool MayHaveBegunBefore(const RuleContext& context, const Finding& cause, const Finding& own) const;
  /// The same slave is missing from another datagram since the same frame.
  [[nodiscard]] FindingIndex SameDropBefore(const RuleContext& context, const Finding& own) const;

 private:
  /// A datagram that a finding is about, and the slaves that have a part in it.
  struct Datagram {
    FindingIndex finding = kNoFinding;
    std::uint64_t key = 0;
    int missing = 0;  ///< of the working counter; 0: not known
    struct Part {
      SlaveId slave = kNoSlave;
      int worth = 0;
    };
    std::vector<Part> parts;
    bool all_parts = false;  ///< they explain the working counter before exactly
  };
  [[nodiscard]] const Datagram* Find(const RuleContext& context, const Finding& own) const;
  [[nodiscard]] bool FitsAllSince(const RuleContext& context, SlaveId slave, FrameNo first) const;

  std::vector<Datagram> datagrams_;
};

}  // namespace ecaudit::wkc
