/// Other ways in which the same bus could have been captured, or the same master could have done the same: none of them
/// changes what a report finds.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "tests/property/wire_packets.h"

namespace ecaudit::test {

/// What may differ behind a rewrite.
enum class Keeps : std::uint8_t {
  kAll,     ///< nothing
  kFrames,  ///< how many frames there are, and so how many were lost or came back twice
  kRules,   ///< how often a rule fired: where frames may be missing it is left out, and the report says so
  kSaid,    ///< what only numbers show may go, if the report says so: that a pause was none of the capture's
};

struct RewriteLaw {
  std::string_view name;
  /// Nothing where the capture cannot be presented like that.
  std::optional<std::vector<Packet>> (*rewrite)(const WireCapture& capture);
  Keeps keeps = Keeps::kAll;
  bool renumbers = false;
};

[[nodiscard]] std::span<const RewriteLaw> RewriteLaws();

}  // namespace ecaudit::test
