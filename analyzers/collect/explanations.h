/// Which finding says why a slave cannot do what a request asks for.
#pragma once

#include <array>
#include <cstddef>

#include "analyzers/result/finding.h"
#include "decoder/base/ids.h"

namespace ecaudit {

/// Keeps the newest; older requests are not asked for any more.
class Explanations {
 public:
  /// Does nothing for kNoFinding.
  void Add(SlaveId slave, FrameNo request, FindingIndex finding);
  /// What was added for it last; kNoFinding when nothing was.
  [[nodiscard]] FindingIndex Of(SlaveId slave, FrameNo request) const;

 private:
  struct Entry {
    SlaveId slave = kNoSlave;
    FrameNo request = 0;
    FindingIndex finding = kNoFinding;
  };
  std::array<Entry, 64> newest_{};
  std::size_t next_ = 0;
};

}  // namespace ecaudit
