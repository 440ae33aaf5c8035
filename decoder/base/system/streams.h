/// Terminals, and streams over memory.
#pragma once

#include <cstddef>
#include <cstdio>
#include <optional>
#include <span>

namespace ecaudit::system {

[[nodiscard]] bool IsTerminal(std::FILE* stream);
/// A terminal that understands the escape sequences of colours, or does from now on.
[[nodiscard]] bool ShowsColors(std::FILE* stream);
[[nodiscard]] std::optional<std::size_t> ColumnsOf(std::FILE* stream);
/// Whether a failed write to a stream (errno) means that its reader has gone.
[[nodiscard]] bool ReaderHasGone(int reason);
/// A stream to read `bytes`, which must outlive it; null when there can be none.
[[nodiscard]] std::FILE* OpenBytes(std::span<unsigned char> bytes);

}  // namespace ecaudit::system
