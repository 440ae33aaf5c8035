/// in: what is published of one frame.  out: the process data in it, and when it was sent by each clock.
///
/// Its time may come with a later datagram than its process data, so both are kept until another frame begins.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "analyzers/sync/dc_clock.h"
#include "analyzers/sync/sent_frames.h"
#include "analyzers/sync/slave_delays.h"
#include "analyzers/sync/time_base.h"
#include "decoder/wire/command.h"

namespace ecaudit::sync {

struct ProcessDatagram {
  wire::Command command = wire::Command::NOP;
  std::uint32_t address = 0;
  std::uint16_t length = 0;
  std::uint16_t wkc = 0;
  bool assumed = false;
  SlaveId slave = kNoSlave;  ///< whose memory it addresses; kNoSlave: logical memory

  /// Slaves may take outputs from it.
  [[nodiscard]] bool brings_outputs() const { return command != wire::Command::LRD && (wkc != 0 || assumed); }
};

class FrameAtHand {
 public:
  [[nodiscard]] bool Is(const FrameRef& sent, const FrameRef& returned) const {
    return sent.number == sent_.number && returned.number == returned_.number;
  }
  /// Another frame, of which nothing is known yet.
  void Begin(const FrameRef& sent, const FrameRef& returned) {
    sent_ = sent;
    returned_ = returned;
    time_.dc.reset();
    count_ = 0;
  }
  /// @return false: there is no room for it. It is not measured
  bool Add(const ProcessDatagram& datagram) {
    if (count_ == datagrams_.size()) return false;
    datagrams_[count_++] = datagram;
    return true;
  }
  void SetTime(const DcTime& time) { time_.dc = time; }
  /// All of it was published: time and length can be asked for.
  /// @return false: there is no frame with process data
  [[nodiscard]] bool Complete(const SentFrames& frames, const DcClock& clock, SlaveDelays& delays);

  [[nodiscard]] const FrameRef& sent() const { return sent_; }
  [[nodiscard]] const FrameRef& returned() const { return returned_; }
  /// As sent where captured.
  [[nodiscard]] const FrameRef& frame() const { return sent_.seen() ? sent_ : returned_; }
  [[nodiscard]] std::span<const ProcessDatagram> datagrams() const { return std::span(datagrams_).first(count_); }
  [[nodiscard]] const FrameTime& time() const { return time_; }
  /// By the distributed clock. Where the frame carried no DC time, but one shortly before did, by the stamps of both.
  [[nodiscard]] const std::optional<DcTime>& dc() const { return time_.dc ? time_.dc : by_stamps_; }
  /// How much later than its DC time the last byte reaches a slave with this delay.
  [[nodiscard]] TimeNs WayTo(TimeNs delay) const { return delay + way_ns_; }
  /// The clock of its DC time has 64 bit.
  [[nodiscard]] bool has_wide_clock() const { return wide_clock_; }

 private:
  FrameRef sent_, returned_;
  FrameTime time_;
  std::optional<DcTime> by_stamps_;
  TimeNs way_ns_ = 0;  ///< to the last byte, from the delay of the reference clock on
  bool wide_clock_ = false;
  std::array<ProcessDatagram, 16> datagrams_{};
  std::size_t count_ = 0;
};

}  // namespace ecaudit::sync
