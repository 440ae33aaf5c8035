#include "decoder/bus/frame_likeness.h"

#include <algorithm>
#include <bit>

#include "decoder/bus/thresholds.h"

namespace ecaudit::bus {
namespace {

template <class Predicate>
bool Any(const wire::FrameView& frame, const Predicate& predicate) {
  for (std::size_t i = 0; i < frame.size(); ++i) {
    if (predicate(frame[i])) return true;
  }
  return false;
}

bool OnlyWrites(wire::Command command) {
  return wire::Writes(command) && !wire::Reads(command);
}

bool SameAddress(const wire::DatagramView& a, const wire::DatagramView& b) {
  return a.ado() == b.ado() && (wire::IncrementsAdp(a.command()) || a.adp() == b.adp());
}

}  // namespace

bool Answers(const wire::FrameView& sent, const wire::FrameView& returned, std::size_t count) noexcept {
  for (std::size_t i = 0; i < count; ++i) {
    const wire::DatagramView a = sent[i];
    const wire::DatagramView b = returned[i];
    if (a.KeptHeader() != b.KeptHeader()) return false;  // the key alone could be made to collide
    if (!OnlyWrites(a.command())) continue;
    const ByteSpan x = a.data();
    const ByteSpan y = b.data();
    if (!std::equal(x.begin(), x.end(), y.begin(), y.end())) return false;
  }
  return true;
}

bool Answers(const wire::FrameView& sent, const wire::FrameView& returned) noexcept {
  return sent.size() == returned.size() && Answers(sent, returned, sent.size());
}

int Passed(const wire::FrameView& sent, const wire::FrameView& returned) noexcept {
  for (std::size_t i = 0; i < sent.size() && i < returned.size(); ++i) {
    if (!wire::IncrementsAdp(sent[i].command())) continue;
    return static_cast<std::uint16_t>(returned[i].adp() - sent[i].adp());
  }
  return kNotCounted;
}

bool OnlyIndexFlipped(const wire::FrameView& a, const wire::FrameView& b) noexcept {
  const auto flipped = static_cast<std::uint8_t>(a[0].index() ^ b[0].index());
  return std::has_single_bit(flipped) && a[0].command_byte() == b[0].command_byte() && a[0].length() == b[0].length() &&
         SameAddress(a[0], b[0]);
}

bool IndexAndMoreKept(const wire::FrameView& a, const wire::FrameView& b) noexcept {
  return a[0].index() == b[0].index() && (a[0].command_byte() == b[0].command_byte() || a[0].length() == b[0].length());
}

bool FewBitsFlipped(const wire::FrameView& sent, const wire::FrameView& returned) noexcept {
  if (sent.size() != returned.size()) return false;
  int flipped = 0;
  for (std::size_t i = 0; i < sent.size() && flipped <= threshold::kFlippedBits; ++i) {
    const wire::DatagramView a = sent[i];
    const wire::DatagramView b = returned[i];
    flipped += std::popcount(a.KeptHeader() ^ b.KeptHeader());
    if (!OnlyWrites(a.command()) || a.length() != b.length()) continue;
    for (std::size_t k = 0; k < a.data().size(); ++k) {
      flipped += std::popcount(static_cast<std::uint8_t>(a.data()[k] ^ b.data()[k]));
    }
  }
  return flipped > 0 && flipped <= threshold::kFlippedBits;
}

bool SameButForIndex(const wire::FrameView& a, const wire::FrameView& b) noexcept {
  bool same = a.size() == b.size();
  for (std::size_t i = 0; same && i < a.size(); ++i) {
    same = a[i].command() == b[i].command() && a[i].length() == b[i].length() && SameAddress(a[i], b[i]);
  }
  return same;
}

bool SameFirstIndex(const wire::FrameView& a, const wire::FrameView& b) noexcept {
  return !a.empty() && !b.empty() && a[0].index() == b[0].index();
}

bool Instructs(const wire::FrameView& frame) noexcept {
  return Any(frame, [](const wire::DatagramView& d) {
    const wire::Command c = d.command();
    return wire::Writes(c) && !wire::IsLogical(c) && c != wire::Command::ARMW && c != wire::Command::FRMW;
  });
}

bool IsBroadcastOnly(const wire::FrameView& frame) noexcept {
  return !frame.empty() && !Any(frame, [](const wire::DatagramView& d) { return !wire::IsBroadcast(d.command()); });
}

bool OnlyReads(const wire::FrameView& frame) noexcept {
  return !Any(frame, [](const wire::DatagramView& d) { return wire::Writes(d.command()); });
}

bool AnyCirculating(const wire::FrameView& frame) noexcept {
  return Any(frame, [](const wire::DatagramView& d) { return d.circulating(); });
}

}  // namespace ecaudit::bus
