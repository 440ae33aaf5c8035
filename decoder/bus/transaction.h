/// out: BusTransaction, what was sent and what came back, and the sink that receives it.
#pragma once

#include <cstdint>

#include "decoder/base/ids.h"
#include "decoder/bus/direction.h"
#include "decoder/wire/frame_view.h"

namespace ecaudit::bus {

/// Whether the capture misses frames right before one.
enum class GapBefore : std::uint8_t {
  kNone,
  kRounds,    ///< as kPossible, but all frames are matched and the indices go on: whole rounds of them would be missing
  kPossible,  ///< no frame was sent for much longer than before, or the stamps go back; the indices do not show why
  kSkip,      ///< the indices skip, but both copies of all frames are there: the master may have skipped numbers
  kLikelySkip,  ///< the same, and the master has left out no number lately
  kCertain,     ///< the indices show it, or another master is there
};

/// Stands for a copy that is not in the capture.
inline constexpr FrameRef kNotCaptured{};

/// One frame's journey. The views are valid during the call that hands the transaction over.
struct BusTransaction {
  const wire::FrameView* sent = nullptr;      ///< null: the outbound copy is not in the capture
  const wire::FrameView* returned = nullptr;  ///< null: only outbound frames are captured
  /// Returns are not captured at all (outbound-only capture): accesses are assumed to be done.
  bool assumed = false;
  /// Before the first frame that became known after it.
  GapBefore gap = GapBefore::kNone;
  /// Sent at the other end of a redundant line. Such frames are handed over only where a slave took part, which shows
  /// that the line is broken.
  bool other_end = false;
  /// `gap` lies before the returned copy: it may answer a frame whose outbound copy the capture misses.
  bool gap_at_return = false;
  /// Put together of both ends, or held back for that: the views lie in no packet.
  bool joined = false;

  [[nodiscard]] const wire::FrameView& any() const { return returned != nullptr ? *returned : *sent; }
  [[nodiscard]] std::size_t size() const { return any().size(); }
  [[nodiscard]] const FrameRef& sent_ref() const { return sent != nullptr ? sent->ref() : kNotCaptured; }
  /// The first copy in the capture.
  [[nodiscard]] const FrameRef& first_ref() const { return sent != nullptr ? sent->ref() : returned->ref(); }
  /// The first copy after `gap`.
  [[nodiscard]] const FrameRef& after_gap() const { return gap_at_return ? returned_ref() : first_ref(); }
  [[nodiscard]] const FrameRef& returned_ref() const { return returned != nullptr ? returned->ref() : kNotCaptured; }
};

enum class Loss : std::uint8_t {
  kOvertaken,  ///< later frames came back, this one did not
  kSilence,    ///< nothing came back any more
  kUndecided,  ///< no return seen, but the capture may just not hold it: what it wrote is unknown, and that is all
};

/// Why a returned frame was ignored.
enum class Unusable : std::uint8_t {
  kMalformed,  ///< inconsistent lengths, or marked bad by the probe
  kAltered,    ///< matches a frame in flight but for fields that slaves never change: bits flipped on the wire
};

/// A frame that was sent again although slaves had answered it, or before its answer came.
struct RepeatedFrame {
  const wire::FrameView& frame;  ///< as it was sent
  FrameRef before;               ///< when it was sent first
  FrameRef again;                ///< when it was sent again
  FrameRef returned;             ///< what came back of the first one
  std::int64_t usual_ns = 0;     ///< round trip of other frames; 0: not known
  /// Not 0: the number of indices of the master, and the time-out is long enough for one round of them, less one frame,
  /// which the capture may miss.
  std::uint32_t may_miss_round_of = 0;
  bool brought_news = false;  ///< it only reads, and the second time it brought other data: a poll

  /// It came back before it was sent again.
  [[nodiscard]] bool answered() const { return returned.number < again.number; }
};

class BusSink {
 public:
  virtual ~BusSink() = default;
  /// Every EtherCAT frame in file order, before what follows from it: for `decode` and for counting.
  virtual void OnFrame(const wire::FrameView& frame, Direction direction) = 0;
  /// An outbound frame was seen that writes to slaves, and more than process data or the time; what it does is not
  /// known yet. Not called when `assumed` transactions follow at once.
  virtual void OnSent(const wire::FrameView& frame) = 0;
  virtual void OnTransaction(const BusTransaction& transaction) = 0;
  /// A frame sent later came back before `sent`, or `sent` came back damaged: whether slaves took it is open. Called
  /// before the frame that overtook it is handed over; OnLost() or OnTransaction() may still follow.
  virtual void OnDoubtful(const wire::FrameView& sent) = 0;
  /// No return of `sent` will come any more. Comes later than the frames that overtook it.
  /// @param followed_by_other the packet directly after it in the capture was no EtherCAT frame
  virtual void OnLost(const wire::FrameView& sent, Loss loss, bool followed_by_other) = 0;
  /// `returned` is byte for byte what frame `original` already brought back.
  virtual void OnDuplicate(const wire::FrameView& returned, FrameNo original) = 0;
  virtual void OnUnusable(const wire::FrameView& frame, Unusable reason, bool own_master) = 0;
  /// A master sent a frame again, byte for byte. One that does not number its frames: after it had waited for it.
  virtual void OnRepeated(const RepeatedFrame& repeated) = 0;
};

}  // namespace ecaudit::bus
