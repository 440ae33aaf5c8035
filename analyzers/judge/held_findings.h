/// Findings that wait for the end of the capture: what comes later decides whether and how they are reported.
#pragma once

#include <cstdint>
#include <map>
#include <utility>

#include "analyzers/result/finding.h"

namespace ecaudit {

class HeldFindings {
 public:
  /// Counts one more occasion with what is held already. @return false: nothing is
  [[nodiscard]] bool Repeat(SlaveId slave, std::uint64_t key, const FrameRef& frame) {
    const auto known = held_.find({slave, key});
    if (known == held_.end()) return false;
    ++known->second.count;
    known->second.last = frame;
    return true;
  }
  /// @param finding  of a slave and a key that Repeat() did not know
  void Hold(std::uint64_t key, Finding finding) {
    const SlaveId slave = finding.slave;
    held_.emplace(std::pair(slave, key), std::move(finding));
  }
  /// Calls `visit(key, Finding&&)` for each, by slave and key.
  template <class Visit>
  void Release(Visit visit) {
    for (auto& [id, finding] : held_) visit(id.second, std::move(finding));
    held_.clear();
  }

 private:
  std::map<std::pair<SlaveId, std::uint64_t>, Finding> held_;
};

}  // namespace ecaudit
