/// Findings that wait for the end of the capture: what comes later decides whether and how they are reported.
#pragma once

#include <cstdint>
#include <map>
#include <utility>

#include "analyzers/result/finding.h"

namespace ecaudit {

/// Findings by slave and key. The rule that keeps them reports them at the end: with more arguments, another severity,
/// or not at all.
class PendingFindings {
 public:
  /// Counts one more occasion with the finding of this key. @return false: there is none
  [[nodiscard]] bool Repeat(SlaveId slave, std::uint64_t key, const FrameRef& frame) {
    const auto known = pending_.find({slave, key});
    if (known == pending_.end()) return false;
    ++known->second.count;
    known->second.last = frame;
    return true;
  }
  /// @param finding  of a slave and a key that Repeat() did not know
  void Keep(std::uint64_t key, Finding finding) {
    const SlaveId slave = finding.slave;
    pending_.emplace(std::pair(slave, key), std::move(finding));
  }
  /// Calls `visit(key, Finding&&)` for each, by slave and key.
  template <class Visit>
  void Release(Visit visit) {
    for (auto& [id, finding] : pending_) visit(id.second, std::move(finding));
    pending_.clear();
  }

 private:
  std::map<std::pair<SlaveId, std::uint64_t>, Finding> pending_;
};

}  // namespace ecaudit
