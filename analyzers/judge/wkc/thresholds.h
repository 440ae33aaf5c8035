/// All numbers that decide about working counters, each with its unit and its reason.
///
/// Units: `Ns` nanoseconds; `Frames`, `Accesses`, `Slaves` counts.
#pragma once

#include <cstddef>
#include <cstdint>

#include "decoder/base/ids.h"

namespace ecaudit::wkc::threshold {

// --- What did the counter use to be? ---

/// Frames with one value until it is what the slaves count, whatever the capture does not show.
inline constexpr std::uint32_t kHabitFrames = 200;
/// The same where FMMUs explain the value, or outputs are missing, which no mailbox counts for.
inline constexpr std::uint32_t kRightFrames = 20;
/// Frames in which slaves with known FMMUs have counted: the counter is theirs.
inline constexpr std::uint32_t kHeldFrames = 3;

// --- Who is missing? ---

/// Frames in which inputs return unchanged before that shows anything: a value may repeat.
inline constexpr std::uint64_t kSilentFrames = 3;
/// Slaves that a sentence names; the others are counted.
inline constexpr std::size_t kNamedSlaves = 6;

// --- What is the cause? ---

/// Frames after the effect in which its cause may still show: masters read states now and then.
inline constexpr FrameNo kLaterFrames = 2000;
/// Frames within which both are one event.
inline constexpr FrameNo kAtOnceFrames = 20;

// --- Is no slave there? ---

/// A master that set its bus up before the capture accesses a station for as long: it waits for this slave.
inline constexpr TimeNs kStationNs = 500'000'000;
/// The same where it assigns addresses in the capture, or accesses positions: it may still be looking for slaves.
inline constexpr TimeNs kLookingNs = 1'000'000'000;
/// ... at least as often.
inline constexpr std::uint64_t kLookingAccesses = 10;
/// A master that looks for new slaves does so no more often.
inline constexpr TimeNs kNewSlavesNs = 250'000'000;

}  // namespace ecaudit::wkc::threshold
