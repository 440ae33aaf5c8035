/// in: FrameView.  out: its Direction. Learns the masters' MAC addresses from
/// the first frames of a capture.
///
/// Every ESC sets bit 1 of the first byte of the source MAC, so a set bit shows
/// "has passed a slave" - unless the master's own address has it (virtual NICs,
/// KickCAT), or the tap sits between slaves. Then the copies are distinguished
/// by the port of a probe or the capture interface, by what the file states of
/// the direction, or by pairs: of two copies the one with the lower position
/// counter and working counter is the outbound one (esc-reference 3.1).
///
/// Several senders may be masters of one bus: with a redundant line the same
/// frames or indices go out at both ends. A sender has a bus of its own in
/// these cases:
/// - it sends in turns with the master, its frames differ, and its broadcasts
/// pass another number of slaves;
/// - it exchanges process data beside those of the master;
/// - it sends the same as the master, in step with it, and the slaves answer
/// both. A sender is the other end of a redundant line if it sends the same as
/// the master at the same time, or if its frames return without having passed a
/// slave: while the line is whole, they meet the slaves on the way back only.
/// If only one port of such a line was captured, frames of the other end arrive
/// there unchanged, and frames of this port return at the other end: the
/// arrival of the one shows that the other has arrived as well.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "decoder/bus/direction_evidence.h"
#include "decoder/bus/sender_tally.h"
#include "decoder/wire/frame_view.h"

namespace ecaudit::bus {

enum class Direction : std::uint8_t {
  kOutbound,  ///< on its way from the master
  kReturned,  ///< on its way back, all slaves passed
  kByPair,    ///< decided by whether a frame in flight matches (Pairing does that)
  kForeign,   ///< sent by a sender that is not a master of the bus
};

class DirectionLearner {
 public:
  static constexpr std::size_t kMaxMasters = 16;

  /// Examines one frame of the look-ahead window, before any call of
  /// Classify().
  void Learn(const wire::FrameView& frame) noexcept;
  /// Ends the look-ahead: fixes how each MAC address is read.
  void Finish() noexcept;
  [[nodiscard]] Direction Classify(const wire::FrameView& frame) const noexcept;
  /// True where the clocks of two interfaces differ by so much that returns are
  /// stamped before their outbound copies.
  [[nodiscard]] bool returns_stamped_first() const { return returns_stamped_first_; }

  /// True when the window held frames of the master and none that came back:
  /// then returns are not waited for.
  [[nodiscard]] bool outbound_only() const { return outbound_only_; }
  /// True when the window held only frames that came back.
  [[nodiscard]] bool returned_only() const { return returned_only_; }
  /// True when the window held frames of the master, repeated under one index
  /// after a time-out, and none that came back: no slave is there to answer.
  [[nodiscard]] bool no_answers() const { return no_answers_; }
  /// True where frames come back without the bit that slaves set: downstream of
  /// a switch or a card that rewrites addresses.
  [[nodiscard]] bool bit_is_no_evidence() const { return bit_is_no_evidence_; }
  /// True for a sender that is not in the window, on a bus whose master is.
  [[nodiscard]] bool JoinedLate(const wire::FrameView& frame) const noexcept;
  /// True for a sender of whom the window held no frame that can be read, while
  /// it held those of others.
  [[nodiscard]] bool IsForeignSender(const wire::FrameView& frame) const noexcept;
  /// True when frames of this sender are captured, and none that came back to
  /// it: what it sends is taken as done.
  [[nodiscard]] bool Unanswered(const wire::FrameView& frame) const noexcept;
  /// True when outbound copies of this sender have already been counted by
  /// slaves: the tap sits downstream of slaves.
  [[nodiscard]] bool IsTappedAfterSlaves(const wire::FrameView& frame) const noexcept;
  /// True for the second port of a redundant line: working counters of 0 there
  /// show nothing about the slaves.
  [[nodiscard]] bool IsOtherEnd(const wire::FrameView& frame) const noexcept;
  /// True where one port of a redundant line was captured, and what it sends
  /// was not seen to come back.
  [[nodiscard]] bool HasOnePort() const { return one_port_; }
  /// True for the port of a redundant line at which alone was captured, where
  /// what it sends was not seen to come back.
  [[nodiscard]] bool IsOnePort(const wire::FrameView& frame) const noexcept;

 private:
  struct Sender {
    std::uint64_t mac = 0;  ///< with bit 1 of the first byte cleared
    FrameSigns signs;
    CopyPairs pairs;
    Repetitions repetitions;
    Likeness likeness;
    // What follows from these:
    Reading reading = Reading::kUnknown;
    bool other_end = false;   ///< of a redundant line
    bool one_port = false;    ///< the only one of a redundant line that was captured
    bool answered = false;    ///< some of its frames were seen coming back
    bool unanswered = false;  ///< it repeats what it sends, and nothing comes back

    [[nodiscard]] std::uint32_t frames() const { return signs.frames(); }
  };

  [[nodiscard]] std::span<Sender> senders() { return std::span(senders_).first(count_); }
  [[nodiscard]] std::size_t PlaceOf(std::uint64_t mac) const noexcept;
  [[nodiscard]] const Sender* Find(const wire::FrameView& frame) const noexcept {
    const std::size_t place = PlaceOf(frame.sender());
    return place < count_ ? &senders_[place] : nullptr;
  }
  void LearnLikeness(Sender& sender, const wire::FrameView& frame) noexcept;
  [[nodiscard]] bool ReadBothCopies() noexcept;
  [[nodiscard]] const Sender* MainOfCopies() noexcept;
  void AssessCopies() noexcept;
  void EvaluateOnePort() noexcept;
  void IgnoreOtherBuses() noexcept;
  void ReadOneCopies() noexcept;

  std::array<Sender, kMaxMasters> senders_{};
  std::size_t count_ = 0;
  const Sender* last_ = nullptr;  ///< whose frame was the last
  bool redundant_ = false;        ///< a sender is the other end
  bool one_port_ = false;         ///< ... of a line of which one port was captured
  bool master_proven_ = false;
  bool bit_is_no_evidence_ = false;
  bool outbound_only_ = false;
  bool returned_only_ = false;
  bool no_answers_ = false;
  bool returns_stamped_first_ = false;
};

}  // namespace ecaudit::bus
