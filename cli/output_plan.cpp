#include "cli/output_plan.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <utility>

#include "cli/suggest.h"
#include "decoder/base/system/names.h"

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

/// In small letters, and with the usual name for another one: "REP.HTM" gives "rep.html".
std::string PlainEnding(std::string_view given) {
  std::string path(given);
  std::ranges::transform(path, path.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const auto& [other, usual] : {std::pair(".htm", ".html"), std::pair(".markdown", ".md")}) {
    if (path.ends_with(other)) return path.substr(0, path.rfind('.')) + usual;
  }
  return path;
}

std::optional<std::size_t> FormatOfPath(std::string_view given, std::span<const OutputFormat> formats) {
  const std::string path = PlainEnding(given);
  for (std::size_t i = 0; i < formats.size(); ++i) {
    if (path.ends_with(formats[i].extension)) return i;
  }
  return std::nullopt;
}

/// Endings that a reader opens by their name, so that they must hold what they promise.
constexpr std::array<std::string_view, 9> kKnownEndings{".json",  ".jsonl",  ".csv",  ".html", ".xml",
                                                        ".sarif", ".pcapng", ".pcap", ".md"};

/// What keeps the default format out of `path`.
std::optional<Error> CheckEnding(const std::string& path, std::span<const OutputFormat> formats) {
  for (const std::string_view ending : kKnownEndings) {
    if (!PlainEnding(path).ends_with(ending)) continue;
    std::string list;
    for (const OutputFormat& format : formats) list += (list.empty() ? "" : ", ") + std::string(format.name);
    return Error{"no format of this command has the ending " + std::string(ending) + " (" + list + "); -o " +
                 std::string(formats.front().name) + "=" + path + " writes " + std::string(formats.front().name) +
                 " there"};
  }
  return std::nullopt;
}

}  // namespace

void OutputOptions::Declare(OptionSet& options, std::span<const OutputFormat> formats, const std::string& help) {
  options.Group("Output");
  std::string list = help;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < formats.size(); ++i) {
    names.emplace_back(formats[i].name);
    if (!help.empty()) continue;
    list += (i == 0 ? "" : i + 1 == formats.size() ? " or " : ", ") + names.back() + (i == 0 ? " (default)" : "");
  }
  options.Value("--format", "FORMAT", format, list);
  options.Words(std::move(names));
  options.Values("-o,--output", "[FORMAT=]PATH", outputs,
                 "PATH: write there, not to standard output; FORMAT=PATH: there too (repeatable)");
  text.DeclareColor(options);
}

Result<std::vector<OutputTarget>> PlanOutputs(const OutputOptions& options, std::span<const OutputFormat> formats,
                                              CommandFiles& files) {
  if (auto error = options.text.Check()) return *error;
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
    const std::string before = output.substr(0, std::min(equals, output.size()));
    const bool names_format = equals != std::string::npos && system::NameOf(before) == before;
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
      if (auto error = files.Writes(target.path)) return *error;
    } else if (std::ranges::any_of(targets, [](const OutputTarget& t) { return t.standard(); })) {
      return Error{"two outputs have standard output as their path"};
    }
    if (!target.standard() && !names_format && !chosen && !FormatOfPath(output, formats)) {
      if (auto error = CheckEnding(output, formats)) return *error;
    }
    targets.push_back(std::move(target));
  }
  if (to_stdout) targets.push_back({chosen.value_or(0), "-"});
  std::stable_partition(targets.begin(), targets.end(), [](const OutputTarget& t) { return !t.standard(); });
  return targets;
}

}  // namespace ecaudit::cli
