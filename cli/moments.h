/// `--from`, `--to` and `--around` as typed, and what they come to in one capture: a clock time means something only
/// where it is known when the capture begins.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "analyzers/options/options.h"
#include "decoder/base/ids.h"
#include "decoder/base/result.h"

namespace ecaudit::cli {

/// A point in time of a capture.
struct Moment {
  enum class Kind : std::uint8_t {
    kSeconds,  ///< from the first packet
    kFrame,
    kClock,  ///< time of the day: the one that is nearest to the beginning of the capture
    kTime,   ///< with its date
  };
  Kind kind = Kind::kSeconds;
  double seconds = 0;
  FrameNo frame = 0;
  std::int64_t ns = 0;  ///< of the day, or TimeNs
  bool local = false;   ///< the day begins at midnight of this machine, not of UTC
};

/// "1.5", "#760", "02:13:07.250", "2026-03-02T02:13:07Z".
/// @param local  clock times without a zone are those of this machine
[[nodiscard]] Result<Moment> ParseMoment(std::string_view option, std::string_view text, bool local);

/// What was asked for.
struct MomentRange {
  std::optional<Moment> from, to, around;
  double window_s = 0;  ///< before and after `around`
  std::string text;     ///< as typed, to distinguish settings

  /// The capture must be examined before it is known what part of it is meant.
  [[nodiscard]] bool needs_capture() const;
};

/// Fills the limits of `analysis`.
/// @param paths  one capture, or the files of one ring buffer; opened and read up to its first time stamp (the frame of
///               `around`) where that is needed
/// @param notices  receives sentences about what the user may not expect; null: not wanted
/// @return why the range means nothing in this capture
[[nodiscard]] std::optional<Error> PlaceMoments(const MomentRange& range, std::span<const std::string> paths,
                                                AnalysisOptions& analysis, std::vector<std::string>* notices = nullptr);

}  // namespace ecaudit::cli
