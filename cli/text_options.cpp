#include "cli/text_options.h"

#include <algorithm>
#include <filesystem>
#include <system_error>

namespace ecaudit::cli {

void TextOptions::DeclareColor(OptionSet& options) {
  options.Value("--color", "WHEN", color,
                "auto (default: on terminals, unless NO_COLOR=1), always, never; not in files");
  options.Words({"auto", "always", "never"});
  options.Flag("--no-color", no_color, "as --color=never");
}

void TextOptions::DeclareTime(OptionSet& options) {
  options.Value("--time", "HOW", time, "relative (default: seconds from the first packet), utc or local: clock times");
  options.Words({"relative", "utc", "local"});
}

void TextOptions::DeclareQuiet(OptionSet& options) {
  options.Flag("--quiet", quiet, "text: only the verdict of each capture, one line");
}

std::optional<Error> TextOptions::Check() const {
  if (color && *color != "auto" && *color != "always" && *color != "never") {
    return Error{"--color is '" + *color + "' but must be auto, always or never"};
  }
  if (color && no_color && *color != "never") return Error{"--color=" + *color + " contradicts --no-color"};
  if (time && !report::ParseTimeMode(*time)) {
    return Error{"--time is '" + *time + "' but must be relative, utc or local"};
  }
  return std::nullopt;
}

bool TextOptions::Colors(const Console& console) const {
  if (no_color || color == "never") return false;
  return color == "always" || console.color();
}

report::TimeMode TextOptions::time_mode() const {
  return time ? report::ParseTimeMode(*time).value_or(report::TimeMode::kRelative) : report::TimeMode::kRelative;
}

report::TextStyle TextOptions::Style(const Console& console, bool standard) const {
  report::TextStyle style;
  style.color = standard && Colors(console);
  if (standard) style.width = console.width().value_or(report::kLineWidth);
  if (standard)
    style.verdict_width = std::min(console.width().value_or(report::kVerdictColumns), report::kVerdictColumns);
  style.quiet = quiet;
  style.time = time_mode();
  std::error_code ignored;
  style.folder = std::filesystem::current_path(ignored).generic_string();
  return style;
}

}  // namespace ecaudit::cli
