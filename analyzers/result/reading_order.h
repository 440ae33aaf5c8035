/// The order in which a person reads findings: worst first, each cause before its consequences.
#pragma once

#include <cstddef>
#include <vector>

#include "analyzers/result/finding.h"

namespace ecaudit {

/// What of a finding the order depends on.
struct ReadingNode {
  Severity severity = Severity::kInfo;
  FrameNo frame = 0;
  std::size_t caused_by = 0;  ///< beyond the end: none
  bool left_out = false;      ///< not read; what it causes stands for itself
  bool aside = false;         ///< Finding::aside
};

struct ReadingEntry {
  std::size_t index = 0;  ///< of the node
  int depth = 0;          ///< 0: a cause of its own; n: consequence of the nearest entry above with depth n - 1
};

/// All nodes that are not left out. Roots stand by the worst severity among them and their consequences, then by frame;
/// those aside after others of the same severity. A list, or a part of it, that is already in this order stays
/// unchanged.
[[nodiscard]] std::vector<ReadingEntry> ReadingOrder(std::vector<ReadingNode> nodes);

}  // namespace ecaudit
