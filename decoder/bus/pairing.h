/// in: FrameView with Direction.  out: BusTransaction (see transaction.h).
///
/// Pairs the returned copy of a frame with its outbound copy by sender, content and order, never by time stamps alone:
/// frames do not overtake each other on the wire. A return with the address of no sender may belong to any of them.
/// Only where a master repeated a frame (same key twice in flight) do good time stamps decide which of the two came
/// back.
///
/// A frame is called lost only where the capture shows that it must have come back: the same sender's later frames did,
/// or it went on sending while nothing came back any more. Frames of a sender whose returns are not captured at all,
/// frames from before the first return where each direction has its own interface, and frames of which a packet cut by
/// the snap length may be the return, are undecided. So are frames in flight where the capture has a gap: where the
/// indices of a master that numbers its frames do not follow each other, and, where indices do not show, where it was
/// silent for much longer than before, and where a frame comes back whose outbound copy is not in the capture, unless
/// its index shows that it is only that copy. A master that sends the same frame again after a silence has shown that
/// it was its time-out: the first one is lost. While no slave answers, nothing is lost or taken as done.
///
/// Where one port of a redundant line was captured, what it sends comes back at the other one, and is taken as done
/// when what that one sent arrives; what comes back here shows that the line is broken.
#pragma once

#include <cstdint>

#include "decoder/bus/capture_gaps.h"
#include "decoder/bus/early_returns.h"
#include "decoder/bus/frame_losses.h"
#include "decoder/bus/pairing_context.h"
#include "decoder/bus/pairing_statistics.h"
#include "decoder/bus/return_matching.h"

namespace ecaudit::bus {

class Pairing {
 public:
  Pairing(const DirectionLearner& directions, BusSink& sink);
  Pairing(const Pairing&) = delete;
  Pairing& operator=(const Pairing&) = delete;

  /// Takes one packet in file order; those that are no EtherCAT frames only matter as neighbours of lost ones.
  void Push(const wire::FrameView& frame) noexcept;
  /// Takes one frame that is the packet before it once more (doubled_packets.h).
  void PushOnceMore(const wire::FrameView& /*frame*/) noexcept { ++context_.statistics.captured_twice; }
  /// Takes one EtherCAT frame that was captured at another bus (interface_groups.h).
  void PushOtherBus(const wire::FrameView& frame) noexcept;
  /// The capture ends: frames that were overtaken are lost, the others are in flight.
  void Finish() noexcept;

  [[nodiscard]] const PairingStatistics& statistics() const { return context_.statistics; }

 private:
  [[nodiscard]] std::uint8_t NumberOf(const wire::FrameView& frame) noexcept {
    return context_.senders.IndexOf(frame, context_.directions);
  }
  void PushOther(const wire::FrameView& packet) noexcept;
  void PushForeign(const wire::FrameView& frame) noexcept;
  void PushUnreadable(const wire::FrameView& frame, Direction direction) noexcept;
  void PushByPair(const wire::FrameView& frame) noexcept;
  void PushOutbound(const wire::FrameView& frame, bool before_first_return) noexcept;
  void PushSent(const wire::FrameView& frame, std::uint8_t number, bool before_first_return) noexcept;
  void PushReturned(const wire::FrameView& frame, SentFrame* sent) noexcept;
  void PushFromOtherEnd(const wire::FrameView& frame) noexcept;
  void PushCopyOfAnswer(SentFrame& sent) noexcept;
  void PushAltered(SentFrame& sent, const wire::FrameView& frame) noexcept;
  void PushOrphan(const wire::FrameView& frame, Sender& sender) noexcept;
  void AnswerInFlight(SentFrame& sent, const wire::FrameView& frame) noexcept;
  void AnswerBoth(SentFrame& sent, const SentFrame& again, const wire::FrameView& frame) noexcept;
  void AnswerDamaged(SentFrame& sent, const wire::FrameView& frame, bool readable) noexcept;
  void Answer(SentFrame& sent, const wire::FrameView& returned, ByteSpan datagrams) noexcept;
  void CountOrder(const SentFrame& sent, const FrameRef& returned) noexcept;
  void HandOver(BusTransaction transaction) noexcept;
  void Settle(std::uint64_t sequence) noexcept;

  PairingContext context_;
  CaptureGaps gaps_;
  FrameLosses losses_;
  ReturnMatching matching_;
  EarlyReturns early_;
  FrameRef last_;  ///< last packet with a time stamp
};

}  // namespace ecaudit::bus
