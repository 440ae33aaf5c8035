/// All numbers that decide in decoder/bus, each with its unit and its reason: one list, sorted by question. Sizes of
/// buffers are not here: they lie beside what they limit.
///
/// Units: `Ns` nanoseconds; `OneIn` one of this number; `Times` a multiple; else what the name counts.
#pragma once

#include <cstddef>
#include <cstdint>

#include "decoder/base/ids.h"

namespace ecaudit::bus::threshold {

// --- Is a frame lost, or still in flight? ---

/// Frames sent later that returned, before a frame is given up; FrameLosses adds what it saw return later.
inline constexpr std::uint32_t kOvertakenFrames = 32;
/// Frames of the same sender after one that never returned: below this, the capture may just end too early.
inline constexpr std::uint32_t kSilentFrames = 3;
/// The same without time stamps: more than any master has in flight.
inline constexpr std::uint32_t kSilentFramesUntimed = 64;
/// No frame is in flight for longer. A master that waits for a time-out is not silent for longer.
inline constexpr std::int64_t kSilentNs = 50'000'000;
/// The same as a multiple of the usual round trip.
inline constexpr std::int64_t kSilentRoundTrips = 100;
/// Overtaken by this number, a frame is no candidate for a damaged return: its index may be in use again.
inline constexpr std::uint32_t kStaleFrames = 8;

// --- Which of two copies is it, and does it come late? ---

/// Outbound frames in which a second copy, or the repetition of a frame, is searched for.
inline constexpr std::uint64_t kRecentFrames = 8;
/// A second copy arrives within this time, whatever the usual round trip.
inline constexpr std::int64_t kRecentNs = 10'000'000;
/// A return is late after this multiple of the usual round trip.
inline constexpr std::int64_t kLateTimes = 16;
/// Of two equal frames in flight the first one is late after this multiple: the second one is the better candidate.
inline constexpr std::int64_t kLateOfTwoTimes = 8;
/// Longer round trips are steps of coarse stamps.
inline constexpr std::int64_t kFineRoundTripNs = 500'000;
/// An equal outbound frame within this time may be the same packet captured twice: no master repeats sooner.
inline constexpr std::int64_t kCopyNs = 50'000;
/// Bits that flip in one frame; two different frames differ in more.
inline constexpr int kFlippedBits = 2;
/// Margin for frames that the capture misses between two with the same index.
inline constexpr std::uint64_t kMissingTimes = 2;

// --- Does a master send a frame again? ---

/// No master waits longer for a frame before it sends it again.
inline constexpr std::int64_t kTimeOutNs = 100'000'000;
/// Masters that do not number their frames repeat them no later than this.
inline constexpr std::int64_t kRetryNs = 20'000'000;

// --- Does the capture miss frames? ---

/// Indices from which on the next one after a gap is no coincidence.
inline constexpr std::uint32_t kNoCoincidenceIndices = 64;
/// A master was silent after this multiple of its longest distance between frames ...
inline constexpr std::int64_t kSilenceTimes = 4;
/// ... in this number of frames, ...
inline constexpr std::uint32_t kRhythmFrames = 64;
/// ... or, at the beginning, in at least this number.
inline constexpr std::uint32_t kRhythmKnownFrames = 16;
/// With less, at least this number, and an index that does not continue, ...
inline constexpr std::uint32_t kRhythmFewFrames = 4;
/// ... it takes this multiple.
inline constexpr std::int64_t kSilenceOfFewTimes = 64;
/// Frames may follow one another faster than those before by this part.
inline constexpr std::int64_t kFasterByOneIn = 5;
/// Stamps of an interrupt: more than one of this number is no later than the stamp before, ...
inline constexpr int kSharedOneIn = 16;
/// ... and more than two of them; ...
inline constexpr int kSharedScore = 2 * kSharedOneIn;
/// ... forgotten after this number of others.
inline constexpr int kSharedScoreMost = 16 * kSharedOneIn;
/// The shortest frame with its gap on the wire: 84 bytes at 100 Mbit/s.
inline constexpr std::int64_t kShortestFrameNs = 6'720;
/// The distance of two stamps may be too short by this.
inline constexpr std::int64_t kStampErrorNs = 100'000;
/// Pairs after which a master that appears comes from another program or another capture.
inline constexpr std::uint64_t kLateMasterPairs = 32;
/// Unanswered foreign frames that may come from a program that searches for slaves.
inline constexpr std::uint64_t kForeignUnansweredFrames = 8;

// --- Which way does a frame run? ---

/// Clocks of two interfaces differ by no more than this, if they are to be compared at all.
inline constexpr std::int64_t kSkewNs = 1'000'000;
/// No master repeats a frame sooner; a packet that was captured twice may come so soon.
inline constexpr std::int64_t kPauseNs = 100'000;
/// Repetitions that show a time-out, ...
inline constexpr std::uint32_t kRepeatedFrames = 3;
/// ... at least one of this number of frames, ...
inline constexpr std::uint32_t kRepeatedOneIn = 2;
/// ... with this number of other indices: where one index serves for all, equal polls show nothing.
inline constexpr std::uint32_t kIndexChanges = 2;
/// Turns with another sender that are not two recordings one after the other; also the answers that prove two masters.
inline constexpr std::uint32_t kTurns = 8;
/// Nearly all frames of a redundant line are twins.
inline constexpr std::uint32_t kTwinsOneIn = 8;
/// The other end of a redundant line sends within this time.
inline constexpr std::int64_t kAtOnceNs = 50'000;
/// What the other end sends arrives within this: a round trip.
inline constexpr std::int64_t kEchoNs = 500'000;
/// Frames that show the other end of a redundant line, ...
inline constexpr std::uint32_t kEndFrames = 8;
/// ... of which one of this number may be no copy.
inline constexpr std::uint32_t kNoCopyOneIn = 8;
/// Returns before their outbound copies that show different clocks.
inline constexpr std::uint32_t kBackFirstFrames = 8;
/// Index changes of a master that numbers its frames: of both copies one has another index than the packet before.
inline constexpr std::uint32_t kNumberedOneIn = 4;
/// Both copies of nearly every frame; unanswered polls form no pairs.
inline constexpr std::uint32_t kPairsOneIn = 8;
/// Pairs that run from one port to the other, all but one of this number, show the ports.
inline constexpr std::uint32_t kOtherPortOneIn = 10;
/// Masters send working counters of 0: with one of this number above 0 the frames returned.
inline constexpr std::uint32_t kReturnedOneIn = 4;
/// Outbound copies with a working counter show a tap after slaves: this number, ...
inline constexpr std::uint32_t kCountedFrames = 3;
/// ... and one of this number of pairs. One slave before the tap leaves most frames uncounted.
inline constexpr std::uint32_t kCountedOneIn = 32;

}  // namespace ecaudit::bus::threshold
