/// All numbers that decide whether a setting is the reason of a refusal, each with its unit and its reason.
///
/// Units: `Frames`, `Modules` counts; `OneIn` one of this number.
#pragma once

#include <cstddef>
#include <cstdint>

#include "analyzers/sync/time_base.h"
#include "decoder/base/ids.h"

namespace ecaudit::refusal::threshold {

/// Frames with process data before it can be seen how they come against SYNC0: fewer are a start.
inline constexpr std::uint64_t kRhythmFrames = 20;
/// Intervals of SYNC0 without a frame, or with two: one in this number is more than a slave has to bear.
inline constexpr std::uint64_t kMissedOneIn = 20;
/// Frames at the pulse: one in this number shows that the phase is wrong, and not that some frames come late.
inline constexpr std::uint64_t kAtPulseOneIn = 2;
/// The time of a frame is no better known than this part of the SYNC0 cycle: before or after a pulse is a guess.
inline constexpr TimeNs kVagueOneIn = 8;
/// Frames after which a slave has counted what it misses: one that ran for longer did not leave OP for its rhythm.
inline constexpr FrameNo kShortlyFrames = 1000;
/// A clock that is further away (0x092C) has not settled: a settled one is within 1 us.
inline constexpr TimeNs kClockAwayNs = 100'000;
/// Outputs that arrived so shortly before do not let the watchdog expire: it has 100 ms by default.
inline constexpr TimeNs kNoPauseNs = 50'000'000;
/// Modules that differ, each with a note of its own: if one is missing, all after it differ.
inline constexpr std::size_t kShownModules = 3;

}  // namespace ecaudit::refusal::threshold
