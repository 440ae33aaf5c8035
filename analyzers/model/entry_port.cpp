#include "analyzers/model/entry_port.h"

#include "decoder/base/bytes.h"
#include "decoder/base/wrapping.h"
#include "decoder/esc/register_addresses.h"

namespace ecaudit::model {
namespace {

constexpr unsigned kLinkAtPort0 = 0x10;
constexpr MemoryRange kDlStatus = MemoryRange::Of(esc::kDlStatus, 2);
constexpr MemoryRange kReceiveTimes = MemoryRange::Of(esc::kReceiveTimes, esc::kReceiveTimesBytes);

}  // namespace

void EntryPort::On(const track::SlaveAccess& access) {
  const MemoryRange range = access.range();
  if (!range.Meets(kDlStatus) && !range.Meets(kReceiveTimes)) return;
  if (access.acceptance != track::Acceptance::kRefused && !access.written.empty() &&
      track::CoversByte(access.address, access.written.size(), esc::kReceiveTimes)) {
    ++latches_;
  }
  OnRead(access);
}

void EntryPort::OnRead(const track::SlaveAccess& access) {
  if (access.broadcast || access.read.empty()) return;
  for (std::size_t port = 0; port < kPorts; ++port) {
    const ByteSpan time = access.Covered(access.read, static_cast<EscAddress>(esc::kReceiveTimes + 4 * port), 4);
    if (!time.empty()) times_[port] = Time{LittleEndian<std::uint32_t>(time, 0), latches_, access.frame()};
  }
  const ByteSpan word = access.Covered(access.read, esc::kDlStatus, 2);
  if (word.empty()) return;
  const auto status = LittleEndian<std::uint16_t>(word, 0);
  unsigned open = 0;
  for (std::size_t port = 0; port < kPorts; ++port) open += FramesPass(status, port) ? 1U : 0U;
  if (status_ && open <= open_) return;
  status_ = status;
  status_frame_ = access.frame();
  open_ = open;
}

std::optional<std::int64_t> EntryPort::After(std::size_t port) const {
  const auto& first = times_[0];
  const auto& other = times_[port];
  if (!status_ || !first || !other || !FramesPass(*status_, 0) || !FramesPass(*status_, port)) return std::nullopt;
  const bool one_latch =
      first->latch == other->latch && (first->latch != 0 || first->frame.number == other->frame.number);
  if (!one_latch) return std::nullopt;
  const std::int64_t after = static_cast<std::int32_t>(WrappingDifference(other->ns, first->ns));
  if (after == 0 || after < -kLongestWayNs || after > kLongestWayNs) return std::nullopt;
  return after;
}

bool EntryPort::compared() const {
  for (std::size_t port = 1; port < kPorts; ++port) {
    if (After(port)) return true;
  }
  return false;
}

std::optional<EntryPort::Evidence> EntryPort::evidence() const {
  if (!status_) return std::nullopt;
  std::optional<Evidence> evidence;
  std::int64_t earliest = 0;
  for (std::size_t port = 1; port < kPorts; ++port) {
    const std::optional<std::int64_t> after = After(port);
    if (!after || *after >= earliest) continue;
    earliest = *after;
    evidence = Evidence{static_cast<std::uint8_t>(port), status_frame_, times_[port]->frame, -*after};
  }
  if (evidence || (*status_ & kLinkAtPort0) != 0 || FramesPass(*status_, 0) || open_ != 1) return evidence;
  for (std::size_t port = 1; port < kPorts; ++port) {
    if (FramesPass(*status_, port)) evidence = Evidence{static_cast<std::uint8_t>(port), status_frame_, {}, {}};
  }
  return evidence;
}

}  // namespace ecaudit::model
