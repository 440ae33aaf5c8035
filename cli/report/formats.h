/// The report formats by name: adding one is a writer and a line in formats.cpp.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "cli/report/digest.h"
#include "cli/report/json_text.h"
#include "cli/report/report.h"
#include "cli/report/text_writer.h"

namespace ecaudit::report {

struct Format {
  std::string_view name;       ///< as in --format and -o FORMAT=PATH
  std::string_view extension;  ///< a file name with this ending gets the format when none is named
  std::string (*write)(const Report& report, const TextStyle& style);
  /// The summary of many captures; null for formats that have none.
  std::string (*write_summary)(const Digest& digest, const TextStyle& style) = nullptr;
  bool draws = false;  ///< uses CaptureReport::timeline
  /// Why this program cannot write it, empty when it can; null: it always can.
  std::string_view (*missing)() = nullptr;
  bool lines =
      false;  ///< shows lines of the text of `decode`, or what is made from it may: CaptureReport::decode_lines
  /// As `write`, piece by piece, for a format that may become large; null: in one go.
  void (*write_pieces)(const Report& report, const TextSink& sink) = nullptr;
};

/// The first one is the default.
[[nodiscard]] std::span<const Format> Formats();
/// Those that write summaries, in the same order.
[[nodiscard]] std::vector<Format> SummaryFormats();
/// For the help of --format: "text (default), json, junit or sarif".
[[nodiscard]] std::string FormatList(std::span<const Format> formats);

}  // namespace ecaudit::report
