/// in: two frames, or one.  out: what they have in common, and what a frame is for.
#pragma once

#include <cstddef>

#include "decoder/wire/frame_view.h"

namespace ecaudit::bus {

/// Slaves passed by a frame in which no datagram counts them.
inline constexpr int kNotCounted = -1;

/// True when the first `count` datagrams of `returned` can be what became of those of `sent`. Slaves never change what
/// a pure write carries, so a returned write with other data answers another frame.
[[nodiscard]] bool Answers(const wire::FrameView& sent, const wire::FrameView& returned, std::size_t count) noexcept;
[[nodiscard]] bool Answers(const wire::FrameView& sent, const wire::FrameView& returned) noexcept;
/// How many slaves the frame passed, or kNotCounted. A plain number: an optional would cost each frame a round trip
/// through memory.
[[nodiscard]] int Passed(const wire::FrameView& sent, const wire::FrameView& returned) noexcept;
/// True when the first datagrams are the same but for one bit of the index: what a flipped bit makes of a frame.
[[nodiscard]] bool OnlyIndexFlipped(const wire::FrameView& a, const wire::FrameView& b) noexcept;
/// True when the first datagrams have the same index, and the same command or length: one flipped bit leaves two of
/// these three intact.
[[nodiscard]] bool IndexAndMoreKept(const wire::FrameView& a, const wire::FrameView& b) noexcept;
/// True when the frames differ, in what slaves never change, in so few bits that they flipped on the way. Another frame
/// of the same kind, whose own copy the capture misses, differs in more.
[[nodiscard]] bool FewBitsFlipped(const wire::FrameView& sent, const wire::FrameView& returned) noexcept;
/// True when both have the same commands, addresses and lengths, whatever their indices.
[[nodiscard]] bool SameButForIndex(const wire::FrameView& a, const wire::FrameView& b) noexcept;
[[nodiscard]] bool SameFirstIndex(const wire::FrameView& a, const wire::FrameView& b) noexcept;

/// True when it writes to slaves, and more than process data or the time.
[[nodiscard]] bool Instructs(const wire::FrameView& frame) noexcept;
[[nodiscard]] bool IsBroadcastOnly(const wire::FrameView& frame) noexcept;
[[nodiscard]] bool OnlyReads(const wire::FrameView& frame) noexcept;
[[nodiscard]] bool AnyCirculating(const wire::FrameView& frame) noexcept;

}  // namespace ecaudit::bus
