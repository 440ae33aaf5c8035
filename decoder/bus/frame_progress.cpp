#include "decoder/bus/frame_progress.h"

#include "decoder/base/wrapping.h"

namespace ecaudit::bus {

Progress ProgressOf(const wire::FrameView& frame) noexcept {
  Progress progress;
  for (std::size_t i = 0; i < frame.size(); ++i) {
    progress.counted += frame[i].wkc();
    if (wire::IncrementsAdp(frame[i].command())) {
      progress.positions = static_cast<std::uint16_t>(progress.positions + frame[i].adp());
    }
  }
  return progress;
}

std::uint64_t WhatIsAsked(const wire::FrameView& frame) noexcept {
  constexpr std::uint64_t kIndex = 0xFF00;
  std::uint64_t hash = frame.size();
  for (std::size_t i = 0; i < frame.size(); ++i) {
    hash = WrappingProduct(hash ^ (frame[i].KeptHeader() & ~kIndex), std::uint64_t{0x9E3779B97F4A7C15});
    hash ^= hash >> 32U;
  }
  return hash;
}

bool IsAccepted(const wire::FrameView& frame) noexcept {
  bool any = false;
  for (std::size_t i = 0; i < frame.size(); ++i) {
    const wire::Command c = frame[i].command();
    if (!wire::IsNodeAddressed(c) || c == wire::Command::FRMW) continue;  // FRMW all the others take
    if (frame[i].wkc() == 0) return false;
    any = true;
  }
  return any;
}

bool AnyWorkingCounter(const wire::FrameView& frame) noexcept {
  for (std::size_t i = 0; i < frame.size(); ++i) {
    if (frame[i].wkc() != 0) return true;
  }
  return false;
}

bool IsExchanged(const wire::FrameView& frame) noexcept {
  for (std::size_t i = 0; i < frame.size(); ++i) {
    if (wire::IsLogical(frame[i].command()) && frame[i].wkc() > 0) return true;
  }
  return false;
}

std::uint32_t PortOf(const wire::FrameView& frame) noexcept {
  return static_cast<std::uint32_t>(frame.interface_index()) << 8U | (frame.esl().present ? frame.esl().port + 1U : 0U);
}

}  // namespace ecaudit::bus
