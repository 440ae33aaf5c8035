/// in: answers to reads of the DC system time (0x0910).  out: one clock for the whole capture (esc-reference 10.3).
#pragma once

#include <cstdint>
#include <optional>

#include "analyzers/sync/time_base.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/track/events.h"

namespace ecaudit::sync {

/// Follows the reference clock: the slave that ARMW and FRMW read, or, while there is none, the slave whose system time
/// was read first. Clocks of 32 bit are extended, every wrap (4.29 s) counted once: between two samples at most one can
/// be seen, so after a pause of the reads of more than that (by the stamps) a new epoch begins.
class DcClock {
 public:
  /// Whether the answer holds the low half of the time, which On() needs.
  [[nodiscard]] static bool Concerns(const track::Answered& answer) {
    return answer.address <= esc::kSystemTime && answer.address + answer.length >= esc::kSystemTime + 4;
  }
  /// A sample of the reference clock, if this answer holds one.
  std::optional<DcTime> On(const track::Answered& answer);
  /// The clock of `slave` was set (0x0920 or 0x0928 written).
  void WasSet(SlaveId slave);

  [[nodiscard]] SlaveId reference() const { return reference_; }
  [[nodiscard]] std::uint64_t samples() const { return samples_; }
  /// The last sample; epoch shows whether it still counts.
  [[nodiscard]] const std::optional<DcTime>& last() const { return last_; }
  [[nodiscard]] const FrameRef& last_frame() const { return last_frame_; }
  [[nodiscard]] std::uint32_t epoch() const { return epoch_; }
  /// It has 64 bit, and so has last().
  [[nodiscard]] bool is_64_bit() const { return wide_ && full_; }

  // Distribution of the time: frames with ARMW or FRMW of 0x0910, or with BWR of a time that goes on.
  [[nodiscard]] std::uint64_t distributions() const { return distributions_; }
  [[nodiscard]] const FrameRef& first_distribution() const { return first_distribution_; }
  [[nodiscard]] const FrameRef& last_distribution() const { return last_distribution_; }
  /// Longest gap between two of them by the capture's stamps, ns, and the frame that ended it.
  [[nodiscard]] TimeNs longest_gap() const { return longest_gap_; }
  [[nodiscard]] const FrameRef& longest_gap_end() const { return longest_gap_end_; }

 private:
  void NoteWritten(const track::Answered& answer);
  void NoteDistribution(const FrameRef& frame);
  [[nodiscard]] bool ReferenceGave(ByteSpan data, ByteSpan sent, std::uint16_t sent_wkc) const;

  SlaveId reference_ = kNoSlave;
  bool distributed_ = false;  ///< the reference is known from ARMW or FRMW
  bool wide_ = false;         ///< upper half seen in use
  bool full_ = false;         ///< since its epoch began the upper half was read
  std::optional<DcTime> last_;
  FrameRef last_frame_;
  std::uint32_t epoch_ = 0;
  std::uint64_t samples_ = 0;
  std::uint64_t distributions_ = 0;
  std::optional<std::uint32_t> written_;  ///< time that was broadcast last, lower half
  FrameRef first_distribution_, last_distribution_, longest_gap_end_;
  TimeNs longest_gap_ = 0;
};

}  // namespace ecaudit::sync
