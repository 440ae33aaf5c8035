#include "analyzers/model/probe_conflict.h"

namespace ecaudit::model {
namespace {

std::uint16_t ProbeBit(std::size_t n) {
  return static_cast<std::uint16_t>(1U << n);
}

}  // namespace

void ProbeConflict::SetFamily(const device::LatchDescription* latch) {
  latch_ = latch;
  latch_enable_ = {};
  if (latch == nullptr) return;
  for (const device::LatchEdge& edge : latch->edges) {
    if (edge.touch_probe == 0) continue;
    std::uint16_t& enable = latch_enable_.at(edge.touch_probe - 1U);
    enable = static_cast<std::uint16_t>(enable | edge.enable);
  }
}

void ProbeConflict::Check(const LatchWord& word) {
  if (!control_.known || !known_) return;
  std::uint16_t conflict = 0;
  for (std::size_t probe = 0; probe < kTouchProbeEnable.size(); ++probe) {
    if ((control_.value & latch_enable_[probe]) != 0 && (probe_ & kTouchProbeEnable[probe]) != 0) {
      conflict = static_cast<std::uint16_t>(conflict | ProbeBit(probe));
    }
  }
  const auto appeared = static_cast<std::uint16_t>(conflict & ~conflict_);
  conflict_ = conflict;
  for (std::size_t probe = 0; probe < kTouchProbeEnable.size(); ++probe) {
    if ((appeared & ProbeBit(probe)) == 0) continue;
    LatchMisuse misuse = report_.Misuse(LatchMisuse::Kind::kTouchProbeConflict, word);
    misuse.control = control_.value;
    misuse.value = probe_;
    for (std::size_t n = 0; n < edges_.size(); ++n) {
      const device::LatchEdge& edge = latch_->edges[n];
      if (misuse.edge == nullptr && edge.touch_probe == probe + 1 && (edge.enable & control_.value) != 0) {
        misuse.edge = &edge;
        misuse.capture = edges_[n].capture;
        misuse.related[0] = edges_[n].capture.armed.number;
      }
    }
    if (misuse.edge != nullptr) report_.Emit(misuse);
  }
}

}  // namespace ecaudit::model
