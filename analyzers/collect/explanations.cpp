#include "analyzers/collect/explanations.h"

namespace ecaudit {

void Explanations::Add(SlaveId slave, FrameNo request, FindingIndex finding) {
  if (finding == kNoFinding) return;
  newest_[next_++ % newest_.size()] = {slave, request, finding};
}

FindingIndex Explanations::Of(SlaveId slave, FrameNo request) const {
  for (std::size_t back = 1; back <= newest_.size() && back <= next_; ++back) {
    const Entry& e = newest_[(next_ - back) % newest_.size()];
    if (e.slave == slave && e.request == request) return e.finding;
  }
  return kNoFinding;
}

std::vector<FindingIndex> Explanations::AllOf(SlaveId slave, FrameNo request) const {
  std::vector<FindingIndex> all;
  for (std::size_t back = 1; back <= newest_.size() && back <= next_; ++back) {
    const Entry& e = newest_[(next_ - back) % newest_.size()];
    if (e.slave == slave && e.request == request) all.push_back(e.finding);
  }
  return all;
}

void Explanations::BlameMapping(SlaveId slave, device::PdoDirection direction, FindingIndex finding) {
  mapping_faults_[{slave, direction}] = finding;
}

FindingIndex Explanations::MappingFault(SlaveId slave, device::PdoDirection direction) const {
  const auto found = mapping_faults_.find({slave, direction});
  return found == mapping_faults_.end() ? kNoFinding : found->second;
}

}  // namespace ecaudit
