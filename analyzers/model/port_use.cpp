#include "analyzers/model/port_use.h"

#include "decoder/base/bytes.h"
#include "decoder/base/wrapping.h"
#include "decoder/esc/register_addresses.h"

namespace ecaudit::model {
namespace {

constexpr unsigned kLinkAtPort0 = 0x10;
/// Cables and slaves take microseconds. What is longer is an old stamp of a port at which the frame did not come.
constexpr std::int64_t kLongestWay = 1'000'000;

}  // namespace

void PortUse::OnWrite(const track::SlaveAccess& access) {
  if (access.acceptance == track::Acceptance::kRefused || access.written.empty()) return;
  if (track::CoversByte(access.address, access.written.size(), esc::kReceiveTimes)) ++latches_;
}

void PortUse::OnRead(const track::SlaveAccess& access) {
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

std::optional<std::int64_t> PortUse::After(std::size_t port) const {
  const auto& first = times_[0];
  const auto& other = times_[port];
  if (!status_ || !first || !other || !FramesPass(*status_, 0) || !FramesPass(*status_, port)) return std::nullopt;
  const bool one_latch =
      first->latch == other->latch && (first->latch != 0 || first->frame.number == other->frame.number);
  if (!one_latch) return std::nullopt;
  const std::int64_t after = static_cast<std::int32_t>(WrappingDifference(other->ns, first->ns));
  if (after == 0 || after < -kLongestWay || after > kLongestWay) return std::nullopt;
  return after;
}

bool PortUse::compared() const {
  for (std::size_t port = 1; port < kPorts; ++port) {
    if (After(port)) return true;
  }
  return false;
}

std::optional<PortUse::Entry> PortUse::entry() const {
  if (!status_) return std::nullopt;
  std::optional<Entry> entry;
  std::int64_t earliest = 0;
  for (std::size_t port = 1; port < kPorts; ++port) {
    const std::optional<std::int64_t> after = After(port);
    if (!after || *after >= earliest) continue;
    earliest = *after;
    entry = Entry{static_cast<std::uint8_t>(port), status_frame_, times_[port]->frame, -*after};
  }
  if (entry || (*status_ & kLinkAtPort0) != 0 || FramesPass(*status_, 0) || open_ != 1) return entry;
  for (std::size_t port = 1; port < kPorts; ++port) {
    if (FramesPass(*status_, port)) entry = Entry{static_cast<std::uint8_t>(port), status_frame_, {}, {}};
  }
  return entry;
}

}  // namespace ecaudit::model
