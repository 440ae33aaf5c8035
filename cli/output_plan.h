/// `--format` and `-o` of every command that writes: which formats go where, asked before any work is done.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "cli/command_files.h"
#include "cli/options.h"
#include "cli/text_options.h"
#include "decoder/base/result.h"

namespace ecaudit::cli {

/// A format that a command offers.
struct OutputFormat {
  std::string_view name;       ///< as in --format and -o FORMAT=PATH
  std::string_view extension;  ///< a file name with this ending gets the format when none is named
};

/// As typed.
struct OutputOptions {
  std::optional<std::string> format;
  std::vector<std::string> outputs;
  TextOptions text;

  /// @param formats  what --format takes, the default first
  /// @param help  in place of their list: "csv (default) or jsonl: one JSON object a line"
  void Declare(OptionSet& options, std::span<const OutputFormat> formats, const std::string& help = {});
};

/// One destination. "-o PATH" takes the place of standard output, "-o FORMAT=PATH" comes in addition to it.
struct OutputTarget {
  std::size_t format = 0;  ///< place in the list of formats
  std::string path;        ///< "-": standard output

  [[nodiscard]] bool standard() const { return path == "-"; }
};

/// Reads the options and asks whether every file can be written.
/// @param formats  the first one is the default
/// @param files  of the command line: what is read is known to them; what is written is added
/// @return the destinations, standard output last so that a closed pipe costs nothing
[[nodiscard]] Result<std::vector<OutputTarget>> PlanOutputs(const OutputOptions& options,
                                                            std::span<const OutputFormat> formats, CommandFiles& files);

}  // namespace ecaudit::cli
