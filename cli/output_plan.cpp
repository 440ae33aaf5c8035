#include "cli/output_plan.h"

#include <algorithm>
#include <filesystem>
#include <system_error>

#include "cli/output_file.h"
#include "cli/suggest.h"

namespace ecaudit::cli {
namespace {

Result<std::size_t> NamedFormat(std::string_view name, std::span<const OutputFormat> formats) {
  std::vector<std::string_view> names;
  std::string list;
  for (std::size_t i = 0; i < formats.size(); ++i) {
    if (formats[i].name == name) return i;
    names.push_back(formats[i].name);
    list += (list.empty() ? "" : ", ") + std::string(formats[i].name);
  }
  const std::string suggestion = Suggestion(name, names, "");
  return Error{"unknown format '" + std::string(name) + "'" + (suggestion.empty() ? " (" + list + ")" : suggestion)};
}

std::optional<std::size_t> FormatOfPath(std::string_view path, std::span<const OutputFormat> formats) {
  for (std::size_t i = 0; i < formats.size(); ++i) {
    if (path.ends_with(formats[i].extension)) return i;
  }
  return std::nullopt;
}

}  // namespace

bool SameFile(const std::string& a, const std::string& b) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  const auto resolved = [&ignored](const std::string& path) {
    return fs::weakly_canonical(fs::absolute(path, ignored), ignored);
  };
  return a == b || fs::equivalent(a, b, ignored) || resolved(a) == resolved(b);
}

void OutputOptions::Declare(OptionSet& options, const std::string& formats) {
  options.Group("Output");
  options.Value("--format", "FORMAT", format, formats);
  options.Values("-o,--output", "[FORMAT=]PATH", outputs,
                 "PATH: write there, not to standard output; FORMAT=PATH: there too (repeatable)");
  options.Flag("--no-color", no_color, "no colours (also: NO_COLOR=1; never in files and pipes)");
}

Result<std::vector<OutputTarget>> PlanOutputs(const OutputOptions& options, std::span<const OutputFormat> formats,
                                              std::span<const std::string> captures) {
  std::vector<OutputTarget> targets;
  std::optional<std::size_t> chosen;
  if (options.format) {
    const Result<std::size_t> format = NamedFormat(*options.format, formats);
    if (!format) return format.error();
    chosen = *format;
  }

  bool to_stdout = true;
  for (const std::string& output : options.outputs) {
    OutputTarget target;
    // A path whose name holds "=" is written with its folder: ./a=b.txt
    const std::size_t equals = output.find('=');
    const bool names_format = equals != std::string::npos && output.substr(0, equals).find('/') == std::string::npos;
    if (names_format) {
      const Result<std::size_t> format = NamedFormat(output.substr(0, equals), formats);
      if (!format) return format.error();
      target = {*format, output.substr(equals + 1)};
    } else {
      const std::optional<std::size_t> by_ending = FormatOfPath(output, formats);
      target = {chosen ? *chosen : by_ending.value_or(0), output};
    }
    if (target.standard() || !names_format) to_stdout = false;
    if (!target.standard()) {
      if (auto error = CheckOutputPath(target.path)) return *error;
      for (const std::string& capture : captures) {
        if (SameFile(capture, target.path)) {
          return Error{target.path + " is read as a capture; name another output file"};
        }
      }
    }
    for (const OutputTarget& other : targets) {
      if (SameFile(other.path, target.path)) return Error{"two outputs would go to " + target.path};
    }
    targets.push_back(std::move(target));
  }
  if (to_stdout) targets.push_back({chosen.value_or(0), "-"});
  std::stable_partition(targets.begin(), targets.end(), [](const OutputTarget& t) { return !t.standard(); });
  return targets;
}

}  // namespace ecaudit::cli
