/// `--color`, `--time` and `--quiet`: how text for a person is written.
#pragma once

#include <optional>
#include <string>

#include "cli/console.h"
#include "cli/options.h"
#include "cli/report/layout.h"
#include "decoder/base/result.h"

namespace ecaudit::cli {

/// As typed.
struct TextOptions {
  std::optional<std::string> color;
  bool no_color = false;
  std::optional<std::string> time;
  bool quiet = false;

  void DeclareColor(OptionSet& options);
  void DeclareTime(OptionSet& options);
  void DeclareQuiet(OptionSet& options);

  /// What is wrong with them.
  [[nodiscard]] std::optional<Error> Check() const;
  /// @param standard  for standard output, else for a file: as wide as a page, and never coloured
  [[nodiscard]] report::TextStyle Style(const Console& console, bool standard) const;
  /// Colours are wanted on standard output.
  [[nodiscard]] bool Colors(const Console& console) const;
  [[nodiscard]] report::TimeMode time_mode() const;
};

}  // namespace ecaudit::cli
