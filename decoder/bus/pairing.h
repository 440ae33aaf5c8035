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

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "decoder/bus/direction.h"
#include "decoder/bus/drop_pattern.h"
#include "decoder/bus/frame_ledger.h"
#include "decoder/bus/index_sequence.h"
#include "decoder/bus/transaction.h"

namespace ecaudit::bus {

struct PairingStatistics {
  FrameNo last_loose = 0;  ///< frame whose index does not show that it is the next one; 0: there was none
  bool numbered = false;   ///< some master numbers its frames; complete at the end
  std::uint64_t outbound = 0;
  std::uint64_t returned = 0;
  std::uint64_t paired = 0;
  std::uint64_t in_flight = 0;         ///< at the end of the capture those that may still come back
  std::uint64_t identical_stamps = 0;  ///< pairs whose two copies have the same time stamp
  std::uint64_t lost = 0;
  /// No return seen, but it may have come back; by reason.
  std::array<std::uint64_t, kUndecidedReasons> undecided{};
  std::uint64_t duplicated = 0;
  std::uint64_t captured_twice =
      0;  ///< copies on another interface, or directly after: a matter of the capture, left out
  std::uint64_t outbound_twice = 0;      ///< of these, outbound frames: only the capture repeats them like that
  std::uint64_t unmatched_returned = 0;  ///< came back without an outbound copy in the capture
  std::uint64_t missed_outbound = 0;     ///< of these, after the first pair: here the capture itself misses packets
  std::uint64_t gaps = 0;                ///< places where the capture misses frames, by the indices
  FrameRef first_gap;                    ///< the frame after the first of them
  std::uint64_t reordered = 0;           ///< came back after frames that were sent later
  FrameRef first_reordered;              ///< the first of them, as it came back ...
  FrameRef last_reordered;               ///< ... and the last
  FrameRef first_in_doubt;               ///< came back like that, or is the return of a frame that the capture misses
  std::uint64_t altered = 0;
  std::uint64_t flipped = 0;  ///< of these, those that differ in a bit or two
  FrameNo first_flipped = 0;
  std::uint64_t foreign = 0;
  std::uint64_t other_end = 0;           ///< came back at the other end of a redundant line, and no slave took part
  std::uint64_t foreign_answered = 0;    ///< of these, frames that slaves took part in
  std::uint64_t foreign_unreadable = 0;  ///< likewise, no frames of datagrams
  FrameNo first_foreign = 0;
  std::uint64_t other_bus = 0;            ///< of these, on interfaces that were at another bus
  std::uint64_t other_bus_interface = 0;  ///< the first of those interfaces
  std::uint64_t repeated_unanswered = 0;  ///< the frame before once more, which had not come back
  std::uint64_t dropped_every = 0;        ///< the recorder regularly left out one packet in this number; 0: it did not
  std::uint64_t stamped_first = 0;        ///< pairs whose return is stamped before the frame was sent
  bool one_port = false;                  ///< of a redundant line was captured: what it sends comes back at the other
  bool no_answers = false;                ///< frames are repeated after a time-out, and nothing ever came back

  /// Of other masters, each frame once: what came back, and what was only captured on its way out. A few without answer
  /// come from a program that searches for slaves, and are no bus.
  [[nodiscard]] std::uint64_t foreign_ignored() const {
    constexpr std::uint64_t kFewUnanswered = 8;
    const std::uint64_t reported = 2 * foreign_answered + foreign_unreadable;
    const std::uint64_t unanswered = foreign - std::min(foreign, reported);
    return foreign_answered + (unanswered > kFewUnanswered ? unanswered : 0);
  }

  /// What became of the outbound frames; balances at any moment.
  [[nodiscard]] FrameLedger frames() const { return {outbound, paired, lost, in_flight, undecided}; }
};

class Pairing {
 public:
  static constexpr std::size_t kSlots = 256;
  /// A frame is given up when this many frames sent later came back, and more where others came back late: see
  /// GivenUpAfter().
  static constexpr std::uint32_t kOvertakenLimit = 32;
  /// At the end of the capture a frame is given up when it is older than this many round trips and this many ns, ...
  static constexpr std::int64_t kSilentRoundTrips = 100;
  static constexpr std::int64_t kSilentNs = 50'000'000;
  /// ... and its sender has sent this many frames more (without time stamps: kSilentFrames).
  static constexpr std::uint32_t kSilentFramesWithTime = 3;
  static constexpr std::uint32_t kSilentFrames = 64;
  /// A second copy counts as duplicate when so few frames lie between, and so little time.
  static constexpr std::uint64_t kDuplicateFrames = 8;
  static constexpr std::int64_t kDuplicateNs = 10'000'000;
  static constexpr std::int64_t kDuplicateRoundTrips = 16;
  /// A master was silent if it sent nothing for this multiple of the longest distance of kWindow frames and more
  /// before.
  static constexpr std::int64_t kSilentTimes = 4;
  static constexpr std::uint32_t kWindow = 64;
  static constexpr std::uint32_t kLeast = 16;
  /// If at most this number of distances is known, and the index does not continue, for this multiple of the longest of
  /// them.
  static constexpr std::uint32_t kFew = 4;
  static constexpr std::int64_t kSilentTimesOfFew = 64;
  /// Stamps are not those of single frames if more than one in this number is no later than the stamp before. Two such
  /// stamps alone do not count.
  static constexpr int kShared = 16;
  static constexpr int kFewShared = 2 * kShared;
  static constexpr int kManyShared = 16 * kShared;
  /// Masters that do not number their frames repeat them after no longer than this.
  static constexpr std::int64_t kRetryNs = 20'000'000;
  /// The shortest frame takes this long on the wire, with what lies between frames: 84 bytes at 100 Mbit/s.
  static constexpr std::int64_t kShortestFrameNs = 6'720;
  /// By so much the distance of two stamps may be too short.
  static constexpr std::int64_t kStampsNs = 100'000;
  /// No master waits longer for a frame before it sends it again.
  static constexpr std::int64_t kLongestTimeOutNs = 100'000'000;
  /// An outbound frame directly after an equal one, and no later than this, may be the same packet captured twice.
  static constexpr std::int64_t kCopyNs = 50'000;
  /// Slaves passed by a frame in which no datagram counts them.
  static constexpr int kNotCounted = -1;

  Pairing(const DirectionLearner& directions, BusSink& sink);

  /// Takes one packet in file order; those that are no EtherCAT frames only matter as neighbours of lost ones.
  void Push(const wire::FrameView& frame) noexcept;
  /// Takes one frame that is the packet before it once more (doubled_packets.h).
  void PushOnceMore(const wire::FrameView& /*frame*/) noexcept { ++statistics_.captured_twice; }
  /// Takes one EtherCAT frame that was captured at another bus (interface_groups.h).
  void PushOtherBus(const wire::FrameView& frame) noexcept;
  /// The capture ends: frames that were overtaken are lost, the others are in flight.
  void Finish() noexcept;

  [[nodiscard]] const PairingStatistics& statistics() const { return statistics_; }

 private:
  enum class SlotState : std::uint8_t { kFree, kOpen, kAnswered, kLost };
  /// When and with which indices a master sends.
  struct Rhythm {
    IndexSequence indices;
    FrameRef last;
    std::int64_t mean_ns = 0;            ///< running average of the distances between frames
    std::int64_t longest_ns = 0;         ///< longest one of the frames counted in `frames` ...
    std::int64_t longest_before_ns = 0;  ///< ... and of the kWindow frames before
    std::int64_t shortest_ns = 0;        ///< of all frames so far; 0: not known yet
    std::uint32_t frames = 0;
    int shared_score =
        0;  ///< grows by kShared with each stamp that is not later than the one before, and falls by 1 else

    void CompareStamps(std::int64_t apart) noexcept;
    /// Stamps are those of an interrupt or of several clocks: many frames have the one of the frame before.
    [[nodiscard]] bool HasSharedStamps() const { return shared_score > kFewShared; }
  };
  struct Sender {
    std::uint64_t mac = 0;
    bool answered = false;         ///< something came back to it
    bool paired = false;           ///< both copies of one of its frames were seen
    bool assumed = false;          ///< its returns are not captured: what it sends is taken as done
    bool own_return_port = false;  ///< outbound and returned copies were captured on two interfaces
    std::uint64_t newest = 0;      ///< one more than the sequence number of its last frame; 0: none
    Rhythm rhythm;
  };
  struct Slot {
    SlotState state = SlotState::kFree;
    std::uint8_t sender = 0;
    bool followed_by_other = false;  ///< the very next packet was no EtherCAT frame
    bool undecided = false;          ///< may have come back unseen ...
    Undecided reason{};              ///< ... because of this
    Loss loss{};                     ///< of one that is lost
    bool other_end = false;          ///< sent at the other end of a redundant line
    bool copy = false;               ///< may be the packet before it, captured twice
    bool again = false;              ///< the frame before once more, which was in flight
    bool answered_again = false;     ///< ... which slaves had answered
    bool slaves_counted = false;     ///< slaves took part in it
    std::uint32_t round = 0;         ///< see RepeatedFrame::may_miss_round_of
    bool before_gap = false;         ///< counted as overtaken once because the indices after it skip
    std::uint32_t overtaken = 0;
    std::uint64_t key = 0;
    std::uint64_t sequence = 0;
    std::uint64_t sent_before = 0;  ///< outbound frames up to this one
    FrameRef returned;
    std::uint16_t returned_interface = 0;
    wire::FrameView view;
    std::vector<std::uint8_t> bytes;           ///< grows to the largest frame, then stays
    std::vector<std::uint8_t> returned_bytes;  ///< datagrams of the returned copy; empty: unreadable
  };
  /// A returned copy that stands before its outbound one: several interfaces or receive queues were captured.
  struct Early {
    std::uint64_t key = 0;
    FrameRef ref;
    std::uint16_t interface_index = 0;
    bool used = false;
    bool counted_as_missed = false;
  };

  /// How an outbound frame looks beside the one that its sender sent before, as far as that one is still in flight.
  enum class Repeats : std::uint8_t {
    kNo,
    kIndex,     ///< same header: a master may repeat it, changed
    kAll,       ///< the same once more
    kAnswered,  ///< the same once more, although it came back
  };

  void PushOutbound(const wire::FrameView& frame, std::uint64_t key, bool before_first_return) noexcept;
  GapBefore AppearsLate(const Sender& master, const wire::FrameView* sent, const FrameRef& behind) noexcept;
  [[nodiscard]] bool IsWaitedForByOthers(const Sender& sender) noexcept;
  void PushReturned(const wire::FrameView& frame, std::uint64_t key, Slot* slot) noexcept;
  void PushFromOtherEnd(const wire::FrameView& frame, std::uint64_t key) noexcept;
  void Overtake(std::uint8_t sender, std::uint64_t sequence) noexcept;
  void HandOver(BusTransaction&& transaction) noexcept;
  void AnswerInFlight(Slot& slot, const wire::FrameView& frame) noexcept;
  bool IsSecondCopy(const Sender& sender, const wire::FrameView& frame, std::uint64_t key) noexcept;
  bool IsAltered(const wire::FrameView& frame) noexcept;
  void PushByPair(const wire::FrameView& frame, std::uint64_t key) noexcept;
  void PushUnusable(const wire::FrameView& frame) noexcept;
  void PushForeign(const wire::FrameView& frame) noexcept;
  void DoubtAll(Undecided reason) noexcept;
  static void Doubt(Slot& slot, Undecided reason) noexcept;
  [[nodiscard]] Repeats RepeatsLast(std::uint8_t sender, std::uint64_t key, ByteSpan kept) noexcept;
  /// What a frame shows of those before it.
  enum class Copy : std::uint8_t {
    kPlain,
    kProvesGap,  ///< a return: its outbound copy is missing
  };
  [[nodiscard]] GapBefore Follow(std::uint8_t sender, const wire::FrameView& frame, Repeats repeats,
                                 Copy copy = Copy::kPlain) noexcept;
  enum class Like : std::uint8_t { kIndex, kKey };
  [[nodiscard]] bool WasSent(std::uint8_t sender, const wire::FrameView& frame, Like like) noexcept;
  [[nodiscard]] bool AnyOverdue(std::uint8_t sender, const FrameRef& now) noexcept;
  [[nodiscard]] bool HasWaited(const FrameRef& before, const FrameRef& now) const noexcept;
  [[nodiscard]] bool AnyInFlight(std::uint8_t sender) noexcept;
  [[nodiscard]] bool HasTimeFor(const Rhythm& rhythm, const FrameRef& from, const FrameRef& to) const noexcept;
  void ReportLate(const Slot& slot) noexcept;
  [[nodiscard]] bool HasRhythm(const Slot& slot) const noexcept;
  [[nodiscard]] bool BrokeRhythm(const Slot& first, const Slot& second) const noexcept;
  bool WasWaitedFor(const Slot& slot, const Slot& again) noexcept;
  void AnswerWaitedFor(Slot& slot, const Slot& again, const wire::FrameView& frame) noexcept;
  [[nodiscard]] bool IsSentAgain(std::uint8_t sender, const wire::FrameView& frame, Repeats repeats) const noexcept;
  void ReportAnswered(const Slot& slot, const wire::FrameView& returned) noexcept;
  [[nodiscard]] static std::uint32_t IndicesThatMayBeMissing(const Rhythm& rhythm, std::int64_t apart) noexcept;
  [[nodiscard]] FrameRef RepeatedSince(const Slot& slot) noexcept;
  [[nodiscard]] bool MayAnswerLater(const Slot& slot, const wire::FrameView& returned) const noexcept;
  [[nodiscard]] bool ProvesGap(const Sender& sender, const wire::FrameView& orphan) const noexcept;
  [[nodiscard]] static bool OnlyOneFits(const Rhythm& rhythm, const FrameRef& last, const FrameRef& returned) noexcept;
  [[nodiscard]] static bool IsSilence(Rhythm& rhythm, std::int64_t apart) noexcept;
  void DoubtInFlight(std::uint8_t sender, Undecided reason) noexcept;
  void OnGap(std::uint8_t sender) noexcept;
  [[nodiscard]] GapBefore FindGapBefore(const wire::FrameView& orphan) noexcept;
  [[nodiscard]] GapBefore TakeGap(std::uint64_t sequence) noexcept;
  std::uint8_t SenderIndex(const wire::FrameView& frame) noexcept;
  /// Whose a frame is, by its address.
  struct Owner {
    static constexpr std::uint8_t kAnybody = 0xFF;
    std::uint8_t sender = kAnybody;
    [[nodiscard]] bool MayBe(std::uint8_t other) const noexcept { return sender == kAnybody || sender == other; }
  };
  [[nodiscard]] Owner OwnerOf(const wire::FrameView& returned) const noexcept;
  [[nodiscard]] Slot* FindOpen(const wire::FrameView& frame, std::uint64_t key) noexcept;
  [[nodiscard]] bool PassedOthers(const Slot& slot, const wire::FrameView& frame) const noexcept;
  [[nodiscard]] bool IsTooOld(const Slot& slot, const wire::FrameView& frame) const noexcept;
  [[nodiscard]] Slot* FindCut(const wire::FrameView& frame) noexcept;
  [[nodiscard]] Slot* FindAlike(const wire::FrameView& frame) noexcept;
  [[nodiscard]] const Slot* FindOriginal(const wire::FrameView& frame, std::uint64_t key) noexcept;
  [[nodiscard]] bool IsSoon(const FrameRef& first, const FrameRef& second) const noexcept;
  [[nodiscard]] bool WasEarly(const wire::FrameView& frame, std::uint64_t key) noexcept;
  [[nodiscard]] bool MayBeOfLater(const Slot& slot) noexcept;
  [[nodiscard]] bool MayBeOfMissing(const Slot& slot) noexcept;
  void Answer(Slot& slot, const wire::FrameView& returned, ByteSpan datagrams) noexcept;
  void DoubtSentWithoutAnswer(const Slot& first_answered) noexcept;
  void Lose(Slot& slot, Loss loss) noexcept;
  void ReportLost(std::uint64_t sequence) noexcept;
  void Count(Undecided reason) noexcept { ++statistics_.undecided[static_cast<std::size_t>(reason)]; }
  /// As often as a frame that did come back was overtaken, one that has not may still be: twice that is added.
  [[nodiscard]] std::uint32_t GivenUpAfter() const noexcept { return kOvertakenLimit + 2 * latest_; }
  void DropAnsweredTail() noexcept;
  [[nodiscard]] bool MayBeCopy(const wire::FrameView& frame, ByteSpan kept) noexcept;
  void DoubtOvertakenBy(const Slot& slot) noexcept;
  [[nodiscard]] bool IsSilent(const FrameRef& sent, std::uint32_t later) const noexcept;
  void TakeWarmSlot() noexcept;
  Slot& At(std::uint64_t sequence) { return slots_[place_[sequence % kSlots]]; }

  const DirectionLearner& directions_;
  BusSink& sink_;
  std::array<Slot, kSlots> slots_;
  std::array<std::uint16_t, kSlots> place_;  ///< where in slots_ the slot of a sequence number lies
  std::uint64_t head_ = 0;                   ///< sequence number of the next slot to fill
  std::uint64_t tail_ = 0;                   ///< oldest slot that may still be open
  std::array<Sender, 2 * DirectionLearner::kMaxMasters> senders_{};
  std::uint8_t sender_count_ = 0;
  std::array<Early, 8> early_{};
  std::uint8_t next_early_ = 0;
  bool any_early_ = false;    ///< ever was one
  bool files_early_ = false;  ///< and its outbound copy followed it
  bool any_cut_ = false;
  bool unreadable_ = false;                 ///< a packet since the last pair that may have been any frame
  GapBefore gap_ = GapBefore::kNone;        ///< not handed on yet ...
  std::uint64_t after_gap_ = 0;             ///< ... and the first frame after it
  FrameRef last_;                           ///< last packet with a time stamp
  int passed_ = kNotCounted;                ///< slaves that the last frame addressed by position passed
  std::uint32_t latest_ = 0;                ///< frames that overtook a numbered one which came back then, at most
  std::int64_t typical_round_trip_ns_ = 0;  ///< running average over unambiguous pairs; 0 until there was one
  DropPattern drops_;
  PairingStatistics statistics_;
};

}  // namespace ecaudit::bus
