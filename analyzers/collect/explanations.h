/// Which finding explains that a slave cannot do what a request asks for, and what is wrong with its PDO mapping.
#pragma once

#include <array>
#include <cstddef>
#include <map>
#include <utility>
#include <vector>

#include "analyzers/result/finding.h"
#include "decoder/base/ids.h"
#include "decoder/device/object_dictionary.h"

namespace ecaudit {

class Explanations {
 public:
  /// Keeps the newest; older requests are not asked for any more.
  /// Does nothing for kNoFinding.
  void Add(SlaveId slave, FrameNo request, FindingIndex finding);
  /// What was added for it last; kNoFinding when nothing was.
  [[nodiscard]] FindingIndex Of(SlaveId slave, FrameNo request) const;
  /// All of them, the newest first.
  [[nodiscard]] std::vector<FindingIndex> AllOf(SlaveId slave, FrameNo request) const;

  /// @param finding  kNoFinding: nothing is wrong any more
  void BlameMapping(SlaveId slave, device::PdoDirection direction, FindingIndex finding);
  /// What was blamed last; kNoFinding when nothing was.
  [[nodiscard]] FindingIndex MappingFault(SlaveId slave, device::PdoDirection direction) const;

 private:
  struct Entry {
    SlaveId slave = kNoSlave;
    FrameNo request = 0;
    FindingIndex finding = kNoFinding;
  };
  std::array<Entry, 64> newest_{};
  std::size_t next_ = 0;
  std::map<std::pair<SlaveId, device::PdoDirection>, FindingIndex> mapping_faults_;
};

}  // namespace ecaudit
