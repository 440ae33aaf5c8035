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
#include <optional>

#include "decoder/bus/direction_evidence.h"
#include "decoder/bus/thresholds.h"
#include "decoder/wire/frame_view.h"

namespace ecaudit::bus {

enum class Direction : std::uint8_t {
  kOutbound,  ///< on its way from the master
  kReturned,  ///< on its way back, all slaves passed
  kByPair,    ///< decided by whether a frame in flight matches (Pairing does that)
  kForeign,   ///< sent by a sender that is not a master of the bus
};

/// How far a frame has come. Of two copies of one frame the one that has come
/// less far is the earlier one.
struct Progress {
  std::uint16_t positions = 0;  ///< sum of the position counters modulo 65536;
                                ///< its start does not matter
  std::uint32_t counted = 0;    ///< sum of the working counters

  bool operator==(const Progress&) const = default;
};

[[nodiscard]] Progress ProgressOf(const wire::FrameView& frame) noexcept;
/// True when `later` has passed more slaves than `earlier`; both are of copies
/// of one frame. The position counters decide where they moved (they do so also
/// when no slave takes part), else the working counters.
[[nodiscard]] constexpr bool Further(const Progress& later, const Progress& earlier) {
  const auto moved = static_cast<std::int16_t>(static_cast<std::uint16_t>(later.positions - earlier.positions));
  return moved != 0 ? moved > 0 : later.counted > earlier.counted;
}

/// The same for frames that ask for the same of the same slaves, whatever index
/// they carry.
[[nodiscard]] std::uint64_t WhatIsAsked(const wire::FrameView& frame) noexcept;

/// True when the frame names slaves by their addresses, and each of these took
/// part.
[[nodiscard]] bool IsAccepted(const wire::FrameView& frame) noexcept;

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
  struct Open {
    bool used = false;
    std::uint64_t key = 0;
    Progress progress;
    std::uint32_t port = 0;
    FrameRef frame;
    bool mac_bit = false;
  };
  /// What a frame asks for, whatever its index.
  struct Asked {
    std::uint64_t what = 0;
    std::uint64_t key = 0;
    FrameRef frame;
    std::uint8_t index = 0;
    bool dummy = false;  ///< one broadcast and nothing else
    bool taken = false;  ///< each slave that it names took part
  };
  struct Sender {
    std::uint64_t mac = 0;  ///< with bit 1 of the first byte cleared
    std::uint32_t bit_clear = 0;
    std::uint32_t bit_set = 0;
    std::uint32_t counted = 0;        ///< frames with a working counter above 0
    std::uint32_t pairs = 0;          ///< frames that have come further than an earlier copy
    std::uint32_t pairs_by_port = 0;  ///< ... from port_out to port_back
    std::uint32_t pairs_counted = 0;  ///< ... whose earlier copy had a working counter above 0
    std::uint32_t back_first = 0;     ///< returns on another interface, stamped
                                      ///< shortly before their outbound copy
    std::uint32_t flag_in = 0;
    std::uint32_t flag_out = 0;
    std::uint32_t port_out = 0;
    std::uint32_t port_back = 0;
    std::uint32_t turns = 0;              ///< frames directly after one of another sender
    std::uint32_t twins = 0;              ///< frames that another sender has sent just before
    std::uint32_t alike = 0;              ///< frames that ask for what another sender has asked for lately ...
    std::uint32_t copies = 0;             ///< ... of these, at once
    std::uint32_t both_accepted = 0;      ///< ... of these, where the slave named took part in both
    std::uint32_t passed_no_slave = 0;    ///< broadcasts that came back and counted no slave
    std::uint32_t dummies = 0;            ///< broadcasts alone under the index of another
                                          ///< sender's frame, at once
    std::uint32_t exchanged = 0;          ///< frames with process data that slaves took part in
    bool moved = false;                   ///< a frame of it passed a slave
    std::uint32_t echoes = 0;             ///< frames with a copy of another sender within a round trip
    bool other_end = false;               ///< of a redundant line
    bool one_port = false;                ///< the only one of a redundant line that was captured
    std::optional<std::uint16_t> slaves;  ///< that a frame has passed on its way back
    bool answered = false;                ///< some of its frames were seen coming back
    bool unanswered = false;              ///< it repeats what it sends, and nothing comes back
    std::uint64_t last_content = 0;       ///< of the frame before ...
    std::uint8_t last_index = 0;          ///< ... and the index of its first datagram
    bool last_only_broadcast = false;     ///< ... which is a broadcast and the only one
    FrameRef last;
    std::uint32_t repeated = 0;       ///< frames like the one before, after a pause
    std::uint32_t index_changes = 0;  ///< frames with another index than the one before
    Reading reading = Reading::kUnknown;
    std::array<Open, 32> open{};  ///< frames not answered yet, a small ring
    std::uint8_t open_next = 0;
    std::array<Asked, 16> asked{};  ///< by its last frames
    std::uint8_t asked_next = 0;

    [[nodiscard]] std::uint32_t frames() const { return bit_clear + bit_set; }
    /// True when all but a few of its frames are among `part`.
    [[nodiscard]] bool NearlyAll(std::uint32_t part) const {
      return part >= frames() || (frames() - part) * threshold::kNoCopyOneIn <= frames();
    }
    [[nodiscard]] bool Exchanges() const { return exchanged >= threshold::kTurns; }
  };

  Sender* Find(std::uint64_t mac) noexcept;
  [[nodiscard]] const Sender* Find(std::uint64_t mac) const noexcept;
  void LearnTurn(Sender& sender, const wire::FrameView& frame) noexcept;
  [[nodiscard]] bool IsUnderIndexOfAnother(const Sender& sender, const wire::FrameView& frame) const noexcept;
  bool LearnCopy(Sender& sender, const wire::FrameView& frame) noexcept;
  void LearnEcho(Sender& sender, const Asked& asked) noexcept;
  [[nodiscard]] bool ReadBothCopies() noexcept;
  void ReadOneCopies() noexcept;
  void AssessCopies() noexcept;
  void EvaluateOnePort() noexcept;
  void IgnoreOtherBuses() noexcept;
  static bool LearnBackFirst(Sender& sender, const wire::FrameView& frame) noexcept;
  static void LearnPair(Sender& sender, const wire::FrameView& frame) noexcept;
  static void LearnRepetition(Sender& sender, const wire::FrameView& frame) noexcept;

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

/// True when a slave visibly acted on any datagram: a working counter above 0.
[[nodiscard]] bool AnyWorkingCounter(const wire::FrameView& frame) noexcept;

/// Source address of a frame, the same before and after it passed slaves:
/// without bit 1 of the first byte.
[[nodiscard]] inline std::uint64_t SenderOf(const wire::FrameView& frame) {
  return frame.source_mac() & ~(std::uint64_t{1} << 41U);
}

}  // namespace ecaudit::bus
