#include "analyzers/model/probe_conflict.h"

#include <array>

namespace ecaudit::model {
namespace {

/// Which latch edges use the capture unit of a touch probe: 20A0h and 20A1h belong to CAP0, 20A2h and 20A3h to CAP1
/// (MKD, 5.3.3); touch probe 1 is enabled by bit 0 of 60B8h, touch probe 2 by bit 8 (CiA 402).
struct CaptureUnit {
  std::uint16_t latch_enable;
  std::uint16_t probe_enable;
};
constexpr std::array<CaptureUnit, 2> kCaptureUnits = {{{0x0003, 0x0001}, {0x000C, 0x0100}}};

std::uint16_t ProbeBit(std::size_t n) {
  return static_cast<std::uint16_t>(1U << n);
}

}  // namespace

void ProbeConflict::Judge(const LatchWord& word) {
  if (!control_.known || !known_) return;
  std::uint16_t conflict = 0;
  for (std::size_t unit = 0; unit < kCaptureUnits.size(); ++unit) {
    const CaptureUnit& bits = kCaptureUnits[unit];
    if ((control_.value & bits.latch_enable) != 0 && (probe_ & bits.probe_enable) != 0) {
      conflict = static_cast<std::uint16_t>(conflict | ProbeBit(unit));
    }
  }
  const auto appeared = static_cast<std::uint16_t>(conflict & ~conflict_);
  conflict_ = conflict;
  for (std::size_t unit = 0; unit < kCaptureUnits.size(); ++unit) {
    if ((appeared & ProbeBit(unit)) == 0) continue;
    LatchMisuse misuse = report_.Misuse(LatchMisuse::Kind::kTouchProbeConflict, word);
    misuse.control = control_.value;
    misuse.value = probe_;
    for (std::size_t n = 0; n < edges_.size(); ++n) {
      const device::LatchEdge& edge = latch_->edges[n];
      if (misuse.edge == nullptr && (edge.enable & control_.value & kCaptureUnits[unit].latch_enable) != 0) {
        misuse.edge = &edge;
        misuse.capture = edges_[n].capture;
        misuse.related[0] = edges_[n].capture.armed.number;
      }
    }
    report_.Emit(misuse);
  }
}

}  // namespace ecaudit::model
