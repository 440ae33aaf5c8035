/// What Pairing counts: each outbound frame once, and what the capture and the line did to frames.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "decoder/base/ids.h"
#include "decoder/bus/frame_ledger.h"
#include "decoder/bus/thresholds.h"

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
  /// Copies on another interface, or directly after: a matter of the capture, left out.
  std::uint64_t captured_twice = 0;
  std::uint64_t outbound_twice = 0;      ///< of these, outbound frames: only the capture repeats them like that
  std::uint64_t unmatched_returned = 0;  ///< came back without an outbound copy in the capture
  std::uint64_t missed_outbound = 0;     ///< of these, after the first pair: here the capture itself misses packets
  std::uint64_t gaps = 0;                ///< places where the capture misses frames, by the indices
  FrameRef first_gap;                    ///< the frame after the first of them
  std::uint64_t skips = 0;         ///< places where the indices skip, and nothing else shows that frames are missing
  FrameRef first_skip;             ///< likewise
  std::uint64_t likely_skips = 0;  ///< of these, the first ones lately: frames are missing most likely
  std::uint64_t reordered = 0;     ///< came back after frames that were sent later
  FrameRef first_reordered;        ///< the first of them, as it came back ...
  FrameRef last_reordered;         ///< ... and the last
  FrameRef first_in_doubt;         ///< came back like that, or is the return of a frame that the capture misses
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

  /// Frames whose return is unknown for this reason.
  [[nodiscard]] std::uint64_t of(Undecided reason) const { return undecided[static_cast<std::size_t>(reason)]; }
  /// Of frames whose return is unknown.
  void Count(Undecided reason) { ++undecided[static_cast<std::size_t>(reason)]; }
  /// The capture misses frames before this one.
  void CountGap(const FrameRef& after) {
    if (gaps++ == 0) first_gap = after;
  }
  void CountSkip(const FrameRef& after) {
    if (skips++ == 0) first_skip = after;
  }
  /// A packet that was captured twice, and so was sent once only.
  void CountSentTwice() {
    Count(Undecided::kCapturedTwice);
    ++captured_twice;
    ++outbound_twice;
  }

  /// Of other masters, each frame once: what came back, and what was only captured on its way out. A few without answer
  /// come from a program that searches for slaves, and are no bus.
  [[nodiscard]] std::uint64_t foreign_ignored() const {
    const std::uint64_t reported = 2 * foreign_answered + foreign_unreadable;
    const std::uint64_t unanswered = foreign - std::min(foreign, reported);
    return foreign_answered + (unanswered > threshold::kForeignUnansweredFrames ? unanswered : 0);
  }

  /// What became of the outbound frames; balances at any moment.
  [[nodiscard]] FrameLedger frames() const { return {outbound, paired, lost, in_flight, undecided}; }
};

}  // namespace ecaudit::bus
