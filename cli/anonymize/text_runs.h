/// Text among bytes, and how it is made unreadable.
#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <span>
#include <string>

namespace ecaudit::cli::anonymize {

using Bytes = std::span<std::uint8_t>;

/// What was taken out: byte strings that the copy must not hold anywhere.
using Secrets = std::set<std::string>;

/// Shorter ones are no names, and stand in any file by chance.
inline constexpr std::size_t kShortestSecret = 5;

/// Letters and digits become x; the length, blanks and signs between them stay. Texts go to `secrets`.
void BlotText(Bytes bytes, Secrets& secrets);
/// Only runs of at least `shortest` printable characters with two letters among them.
void BlotRuns(Bytes bytes, std::size_t shortest, Secrets& secrets);
/// Wherever one of `secrets` stands.
void BlotSecrets(Bytes bytes, const Secrets& secrets);
void Clear(Bytes bytes);
/// All but zeros become x: where both copies of a datagram differed, they mostly still do.
void Cross(Bytes bytes);

/// Whether any of `secrets` stands in `bytes`.
[[nodiscard]] bool HoldsSecret(std::span<const std::uint8_t> bytes, const Secrets& secrets);

}  // namespace ecaudit::cli::anonymize
