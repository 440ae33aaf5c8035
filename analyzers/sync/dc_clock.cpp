#include "analyzers/sync/dc_clock.h"

#include <algorithm>
#include <utility>

#include "decoder/base/time.h"
#include "decoder/base/wrapping.h"
#include "decoder/esc/register_addresses.h"

namespace ecaudit::sync {
namespace {

constexpr std::uint64_t kWrap = std::uint64_t{1} << 32U;
constexpr TimeNs kTooLongFor32Bit = 4'000'000'000;
/// Frames are stamped late at times, when the capturing machine is busy, but not by so much.
constexpr std::uint64_t kLateStampNs = 500'000'000;

/// The clock went on by more than the time that passed by the stamps: it was set by something that is not in the
/// capture, or what was read of it is damaged.
bool Leaps(std::uint64_t step, const FrameRef& from, const FrameRef& to) {
  if (!from.has_time || !to.has_time || to.time < from.time) return false;
  return step > kLateStampNs && step - kLateStampNs > static_cast<std::uint64_t>(Elapsed(from.time, to.time));
}

}  // namespace

/// A master may write its own time to all clocks, which follow it as they follow that of a reference. What does not go
/// on from the write before is no time (zeros of a scan, a first value).
void DcClock::NoteWritten(const track::Answered& answer) {
  if (answer.wkc == 0 || answer.circulating || answer.address > esc::kSystemTime) return;
  const auto at = static_cast<std::size_t>(esc::kSystemTime - answer.address);
  const ByteSpan data = Slice(answer.returned_data, at, 4);
  if (data.size() < 4) return;
  const auto time = LittleEndian<std::uint32_t>(data, 0);
  const std::optional<std::uint32_t> before = std::exchange(written_, time);
  if (!before || *before == 0 || time == *before || WrappingDifference(time, *before) >= kWrap / 2) return;
  NoteDistribution(answer.returned);
}

void DcClock::NoteDistribution(const FrameRef& frame) {
  if (distributions_++ == 0) first_distribution_ = frame;
  if (last_distribution_.has_time && frame.has_time) {
    const TimeNs gap = Elapsed(last_distribution_.time, frame.time);
    if (gap > longest_gap_) {
      longest_gap_ = gap;
      longest_gap_end_ = frame;
    }
  }
  last_distribution_ = frame;
}

/// Slaves that only write count as well: the data, which it changes, show whether the reference itself answered. Where
/// the outbound copy was captured downstream of slaves that counted, they may be changed there already, and go on from
/// frame to frame.
bool DcClock::ReferenceGave(ByteSpan data, ByteSpan sent, std::uint16_t sent_wkc) const {
  if (!SameBytes(sent, data)) return true;
  if (sent_wkc == 0) return false;
  const auto time = LittleEndian<std::uint32_t>(data, 0);
  return time != 0 && (!last_ || time != static_cast<std::uint32_t>(last_->ns));
}

std::optional<DcTime> DcClock::On(const track::Answered& answer) {
  if (answer.command == wire::Command::BWR) {
    NoteWritten(answer);
    return std::nullopt;
  }
  const bool distributes = answer.command == wire::Command::ARMW || answer.command == wire::Command::FRMW;
  const bool reads = answer.command == wire::Command::APRD || answer.command == wire::Command::FPRD;
  // A broadcast that one slave answered holds the time of that one.
  const bool of_one = answer.command == wire::Command::BRD && answer.wkc == 1;
  if ((!distributes && !reads && !of_one) || answer.wkc == 0 || answer.circulating) return std::nullopt;
  if (answer.address > esc::kSystemTime) return std::nullopt;
  const auto at = static_cast<std::size_t>(esc::kSystemTime - answer.address);
  const ByteSpan data = Slice(answer.returned_data, at, 8);
  if (data.size() < 4) return std::nullopt;
  if (reads && answer.wkc != 1) return std::nullopt;
  if (distributes) {
    if (!ReferenceGave(data, Slice(answer.sent_data, at, 8), answer.sent_wkc)) return std::nullopt;
    NoteDistribution(answer.returned);
  }
  const bool first = samples_ == 0;
  if (first || (distributes && (!distributed_ || answer.slave != reference_))) {
    if (!first && answer.slave != reference_) WasSet(reference_);
    reference_ = answer.slave;
    distributed_ = distributed_ || distributes;
  } else if (answer.slave != reference_) {
    return std::nullopt;
  }

  const bool eight = data.size() == 8;
  const std::uint64_t raw = eight ? LittleEndian<std::uint64_t>(data, 0) : LittleEndian<std::uint32_t>(data, 0);
  if (raw == 0) return std::nullopt;
  if (eight && raw >= kWrap) wide_ = true;
  DcTime time{raw, epoch_};
  if (!last_ || last_->epoch != epoch_) full_ = false;
  if (last_ && last_->epoch == epoch_) {
    const bool full = eight && (wide_ || raw > last_->ns);
    if (!full) {
      if (last_frame_.has_time && answer.returned.has_time &&
          Elapsed(last_frame_.time, answer.returned.time) > kTooLongFor32Bit) {
        ++epoch_;
        time = {raw, epoch_};
        full_ = false;
      } else {
        const auto since = WrappingDifference(static_cast<std::uint32_t>(raw), static_cast<std::uint32_t>(last_->ns));
        time.ns = WrappingSum(last_->ns, std::uint64_t{since});
        if (Leaps(since, last_frame_, answer.returned)) {
          time = {raw, ++epoch_};
          full_ = false;
        }
      }
    } else if (raw <= last_->ns || (!full_ && raw - last_->ns >= kWrap) ||
               Leaps(raw - last_->ns, last_frame_, answer.returned)) {
      time.epoch = ++epoch_;  // set by something that is not in the capture, or read in full for the first time
    }
  }
  full_ = full_ || eight;
  last_ = time;
  last_frame_ = answer.returned;
  ++samples_;
  return time;
}

void DcClock::WasSet(SlaveId slave) {
  if (slave == reference_) ++epoch_;
}

}  // namespace ecaudit::sync
