/// Columns of a text line, two spaces apart.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "cli/report/layout.h"

namespace ecaudit::cli {

/// "12.000000345"; "-" when unknown.
[[nodiscard]] std::string SecondsText(std::optional<std::int64_t> ns);

/// The column that shows when: seconds from the first packet, or a clock time.
struct TimeColumn {
  report::TimeMode mode = report::TimeMode::kRelative;
  FrameRef origin;  ///< first time stamp of the capture

  [[nodiscard]] std::string_view title() const;
  [[nodiscard]] std::size_t width() const { return 16; }
  /// @param since_start_ns  of `frame`
  [[nodiscard]] std::string Text(const FrameRef& frame, std::optional<std::int64_t> since_start_ns) const;
  /// For JSON and CSV: ISO 8601 with the zone; empty where times are relative, or there is none.
  [[nodiscard]] std::string Iso(const FrameRef& frame) const;
};

class Columns {
 public:
  /// Appends to `out`, which must outlive this. Text given to it is trusted.
  Columns(std::string& out, bool color) : out_(out), color_(color) {}

  /// Text that is wider than its column pushes the rest to the right.
  Columns& Left(std::string_view text, std::size_t width, report::Style style = report::Style::kPlain);
  Columns& Right(std::string_view text, std::size_t width, report::Style style = report::Style::kPlain);
  /// Without padding after it.
  void Last(std::string_view text, report::Style style = report::Style::kPlain);

 private:
  void Gap();

  std::string& out_;
  bool color_;
  bool first_ = true;
};

}  // namespace ecaudit::cli
