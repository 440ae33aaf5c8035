/// Frames that a master sends again: which ones they are, and what became of the first one.
#pragma once

#include <cstdint>

#include "decoder/bus/pairing_context.h"

namespace ecaudit::bus {

/// How an outbound frame looks beside the one that its sender sent before.
enum class Repeats : std::uint8_t {
  kNo,
  kIndex,     ///< same header, and the one before is in flight: a master may repeat it, changed
  kAll,       ///< the same once more, and the one before is in flight
  kAnswered,  ///< the same once more after a time-out, although the one before returned; its master numbers frames
};

/// @param kept bytes of the frame without what follows the datagrams
[[nodiscard]] Repeats RepeatsLast(PairingContext& context, std::uint8_t number, const wire::FrameView& frame,
                                  ByteSpan kept) noexcept;
/// True when the very packet before this one holds the same bytes, and no master repeats a frame so soon.
[[nodiscard]] bool MayBeCopy(PairingContext& context, const wire::FrameView& frame, ByteSpan kept) noexcept;
/// True when the master sent the same frame again, and has sent nothing else since: it was waiting for this one.
[[nodiscard]] bool IsRepeatedSince(PairingContext& context, const SentFrame& sent) noexcept;
/// True when the master sent nothing between a frame and the same one again, and that is its rhythm no more: it had
/// waited. Both came back, so none is lost and none came back twice.
[[nodiscard]] bool WasWaitedFor(PairingContext& context, const SentFrame& sent, const SentFrame& again) noexcept;
/// Both of such frames came back: the sink gets it where the rhythm of the master shows the time-out.
void ReportWaitedFor(PairingContext& context, const SentFrame& sent, const SentFrame& again) noexcept;
/// The return of a frame that was sent again: the sink gets what that shows of the first one.
void ReportRepetition(PairingContext& context, const SentFrame& again, const wire::FrameView& returned) noexcept;

}  // namespace ecaudit::bus
