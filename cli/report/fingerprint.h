/// What stays the same when the same fault is captured again. Baselines and SARIF recognise findings by it.
#pragma once

#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "cli/report/digest.h"

namespace ecaudit::report {

/// No frame numbers, times or counts.
struct Fingerprint {
  std::string rule;
  std::optional<SlavePos> slave;  ///< position; nothing for the whole bus
  std::string identity;           ///< kind and distinguishing values: IdentityOf(Finding)

  auto operator<=>(const Fingerprint&) const = default;
};

[[nodiscard]] Fingerprint FingerprintOf(const FindingDigest& finding);
/// IdentityOf(), printable.
[[nodiscard]] std::string IdentityText(const Finding& finding);

/// FNV-1a, 64 bits: the same on every machine and in every version; not for secrets.
[[nodiscard]] std::uint64_t StableHash(std::string_view bytes);

}  // namespace ecaudit::report
