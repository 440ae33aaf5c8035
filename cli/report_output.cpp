#include "cli/report_output.h"

#include <algorithm>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "cli/output_file.h"
#include "cli/suggest.h"

namespace ecaudit::cli {
namespace {

Result<const report::Format*> NamedFormat(std::string_view name) {
  if (const report::Format* format = report::FindFormat(name)) return format;
  std::vector<std::string_view> names;
  std::string list;
  for (const report::Format& format : report::Formats()) {
    names.push_back(format.name);
    list += (list.empty() ? "" : ", ") + std::string(format.name);
  }
  const std::string suggestion = Suggestion(name, names, "");
  return Error{"unknown format '" + std::string(name) + "'" + (suggestion.empty() ? " (" + list + ")" : suggestion)};
}

bool SameFile(const std::string& a, const std::string& b) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  const auto resolved = [&ignored](const std::string& path) {
    return fs::weakly_canonical(fs::absolute(path, ignored), ignored);
  };
  return a == b || fs::equivalent(a, b, ignored) || resolved(a) == resolved(b);
}

}  // namespace

void OutputOptions::Declare(OptionSet& options) {
  options.Group("Output");
  options.Value("--format", "FORMAT", format, "text (default) or json");
  options.Values("-o,--output", "[FORMAT=]PATH", outputs,
                 "PATH: report there, not to standard output; FORMAT=PATH: there too (repeatable)");
  options.Flag("--no-color", no_color, "no colours (also: NO_COLOR=1; never in files and pipes)");
}

Result<ReportOutput> ReportOutput::Plan(const OutputOptions& options, std::span<const std::string> captures) {
  ReportOutput plan;
  plan.no_color_ = options.no_color;
  const report::Format* chosen = nullptr;
  if (options.format) {
    const auto format = NamedFormat(*options.format);
    if (!format) return format.error();
    chosen = *format;
  }

  bool to_stdout = true;
  for (const std::string& output : options.outputs) {
    Target target;
    // A path whose name holds "=" is written with its folder: ./a=b.txt
    const std::size_t equals = output.find('=');
    const bool names_format = equals != std::string::npos && output.substr(0, equals).find('/') == std::string::npos;
    if (names_format) {
      const auto format = NamedFormat(output.substr(0, equals));
      if (!format) return format.error();
      target = {*format, output.substr(equals + 1)};
    } else {
      const report::Format* by_ending = report::FormatOfPath(output);
      target = {chosen != nullptr ? chosen : by_ending != nullptr ? by_ending : &report::Formats().front(), output};
    }
    if (target.path == "-" || !names_format) to_stdout = false;
    if (target.path != "-") {
      if (auto error = CheckOutputPath(target.path)) return *error;
      for (const std::string& capture : captures) {
        if (SameFile(capture, target.path))
          return Error{target.path + " is read as a capture; name another output file"};
      }
    }
    for (const Target& other : plan.targets_) {
      if (SameFile(other.path, target.path)) return Error{"two reports would go to " + target.path};
    }
    plan.targets_.push_back(std::move(target));
  }
  if (to_stdout) plan.targets_.push_back({chosen != nullptr ? chosen : &report::Formats().front(), "-"});
  std::stable_partition(plan.targets_.begin(), plan.targets_.end(), [](const Target& t) { return t.path != "-"; });
  return plan;
}

std::optional<Error> ReportOutput::Write(const report::Report& report, Console& console) const {
  for (const Target& target : targets_) {
    const bool standard = target.path == "-";
    const report::TextStyle style{standard && console.color() && !no_color_};
    const std::string text = target.format->write(report, style);
    if (auto error = standard ? console.Write(text) : WriteOutputFile(target.path, text)) return error;
  }
  return std::nullopt;
}

}  // namespace ecaudit::cli
