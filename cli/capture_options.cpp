#include "cli/capture_options.h"

#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <set>
#include <system_error>

#include "analyzers/judge/catalogue.h"
#include "analyzers/options/device_files.h"
#include "cli/baseline.h"
#include "cli/config.h"
#include "cli/device_files.h"
#include "cli/families.h"
#include "cli/suggest.h"
#include "decoder/device/profile_registry.h"

namespace ecaudit::cli {
namespace {

/// The whole of `text` as an unsigned number; nothing when it is none or too large for T.
template <typename T>
std::optional<T> ParseUnsigned(std::string_view text, int base) {
  T value{};
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value, base);
  if (text.empty() || code != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::string Quoted(std::string_view text) {
  return "'" + std::string(text) + "'";
}

/// The families that `analysis` may name.
const device::ProfileRegistry& FamiliesOf(const AnalysisOptions& analysis) {
  static const device::ProfileRegistry builtin;
  return analysis.files ? analysis.files->families : builtin;
}

/// Settings of drives that some family knows.
std::set<std::string_view> ParameterNames(const device::ProfileRegistry& families) {
  std::set<std::string_view> names;
  for (const std::string& profile : families.Names()) {
    for (const device::DriveParameter* row : families.Find(profile)->sync.DriveParameters()) {
      names.insert(row->keyword);
    }
    for (const device::FieldbusParameter& row : families.Find(profile)->fieldbus_parameters) {
      if (row.bit || row.value) names.insert(row.parameter);
    }
  }
  return names;
}

/// Errors in a file name the file, those on the command line stand for themselves.
Error In(const std::string& file, const Error& error) {
  return file.empty() ? error : Error{file + ": " + error.message};
}

std::optional<Error> ApplyNames(const std::vector<std::string>& profiles, const std::vector<std::string>& parameters,
                                const std::vector<std::string>& rules, AnalysisOptions& analysis) {
  for (const std::string& profile : profiles) {
    if (auto error = AddProfile(profile, analysis)) return error;
  }
  for (const std::string& parameter : parameters) {
    if (auto error = AddParameter(parameter, analysis)) return error;
  }
  for (const std::string& rule : rules) {
    if (auto error = AddRuleSetting(rule, analysis)) return error;
  }
  return std::nullopt;
}

std::optional<Error> ApplyFailOn(const std::optional<std::string>& text, report::FailOn& fail_on) {
  if (!text) return std::nullopt;
  const auto parsed = report::ParseFailOn(*text);
  if (!parsed) return Error{"--fail-on is " + Quoted(*text) + " but must be error, warning, info or never"};
  fail_on = *parsed;
  return std::nullopt;
}

std::optional<Error> ApplyRequire(const std::optional<std::string>& text, Requirements& required) {
  if (!text) return std::nullopt;
  Result<Requirements> parsed = ParseRequirements(*text);
  if (!parsed) return parsed.error();
  required = std::move(*parsed);
  return std::nullopt;
}

std::optional<Error> ApplyCountFrom(const std::optional<std::string>& text, SlaveNames& names) {
  if (!text) return std::nullopt;
  if (*text != "0" && *text != "1") return Error{"--count-from is " + Quoted(*text) + " but must be 0 or 1"};
  names.from_one = *text == "1";
  return std::nullopt;
}

/// The configuration file for `capture`, if there is one.
Result<std::optional<Config>> ConfigFor(const CaptureOptions& options, const std::string& capture) {
  if (options.no_config) return std::optional<Config>();
  const std::optional<std::string> path = options.config ? options.config : FindConfig(capture);
  if (!path) return std::optional<Config>();
  if (!options.config) {
    if (auto error = CheckConfigOwner(*path)) return *error;
  }
  Result<Config> config = ReadConfig(*path);
  if (!config) return config.error();
  return std::optional<Config>(std::move(*config));
}

std::optional<Error> ReadMoment(std::string_view option, const std::optional<std::string>& text, bool local,
                                MomentRange& range, std::optional<Moment>& moment) {
  if (!text) return std::nullopt;
  Result<Moment> parsed = ParseMoment(option, *text, local);
  if (!parsed) return parsed.error();
  moment = *parsed;
  range.text += std::string(option) + "=" + *text + (local ? " local " : " ");
  return std::nullopt;
}

/// Sets analysis.files from the files that `settings` name.
std::optional<Error> ReadDeviceFiles(const CaptureOptions& options, Settings& settings) {
  const std::tuple names(settings.esi, settings.eni, settings.families);
  auto known = options.files.find(names);
  if (known == options.files.end()) {
    Result<std::shared_ptr<const DeviceFiles>> files =
        LoadDeviceFiles(settings.esi, settings.eni, settings.families, options.skipped);
    if (!files) return files.error();
    known = options.files.emplace(names, std::move(*files)).first;
  }
  settings.analysis.files = known->second;
  // Folders have become the files that were taken from them.
  settings.esi.clear();
  if (known->second) {
    for (const DeviceFiles::Esi& esi : known->second->esi) settings.esi.push_back(esi.path);
  }
  return std::nullopt;
}

/// Limits that do not need the capture are resolved at once.
std::optional<Error> ApplyRange(const CaptureOptions& options, Settings& settings) {
  constexpr double kWindow = 1;  // seconds before and after
  MomentRange& range = settings.moments;
  if (options.around && (options.from || options.to)) return Error{"--around takes the place of --from and --to"};
  if (options.isolate && !options.from && !options.to && !options.around) {
    return Error{"--isolate belongs to --from, --to or --around; give one of them"};
  }
  if (options.window && !options.around) return Error{"--window is the time before and after --around; give both"};
  if (auto error = ReadMoment("--from", options.from, options.local_time, range, range.from)) return error;
  if (auto error = ReadMoment("--to", options.to, options.local_time, range, range.to)) return error;
  if (auto error = ReadMoment("--around", options.around, options.local_time, range, range.around)) return error;
  range.window_s = kWindow;
  if (options.window) {
    const std::string_view text = *options.window;
    const auto [rest, code] = std::from_chars(text.data(), text.data() + text.size(), range.window_s);
    if (text.empty() || code != std::errc() || rest != text.data() + text.size() || !std::isfinite(range.window_s) ||
        range.window_s < 0) {
      return Error{"--window is " + Quoted(text) + " but must be seconds such as 0.5"};
    }
    range.text += "--window=" + std::string(text);
  }
  if (range.needs_capture()) return std::nullopt;
  auto error = PlaceMoments(range, {}, settings.analysis);
  range = {};
  return error;
}

}  // namespace

std::vector<std::string> RuleIds(std::string_view suffix) {
  std::vector<std::string> ids;
  for (const RuleInfo* rule : RuleCatalogue()) ids.push_back(std::string(rule->id) + std::string(suffix));
  return ids;
}

void CaptureOptions::ReportSkipped(Console& console) const {
  for (const std::string& reason : skipped) console.Warning("ignored: " + reason);
  skipped.clear();
}

void CaptureOptions::Declare(OptionSet& options) {
  options.Arguments("CAPTURE", captures, "pcap or pcapng files, also compressed by gzip or zstd; - is standard input");
  options.Group("What to read");
  options.Flag("--join", join, "the captures are one ring buffer: read them as one");
  DeclareSettings(options);
}

void CaptureOptions::DeclareSettings(OptionSet& options) {
  options.Group("What to read");
  options.Values("--slave", "SLAVE", slaves,
                 "report only this slave: position 0 (the first), address 0x1001, or name (repeatable)");
  options.Value("--count-from", "N", count_from,
                "the number of the first slave, in texts and where SLAVE is typed: 0 (default) or 1");
  options.Words({"0", "1"});
  options.Values("--interface", "N", interfaces, "read only interface N of the capture, 0 is the first (repeatable)");
  options.Value("--from", "START", from,
                "start here: seconds from the first frame, #760, 02:13:07.250, or 2026-03-02T02:13Z");
  options.Value("--to", "END", to, "end here, inclusive");
  options.Value("--around", "MOMENT", around, "the part around this time or frame");
  options.Value("--window", "SECONDS", window, "how far before and after --around (default: 1)");
  options.Group("How to evaluate");
  options.Values("--profile", "[SLAVE=]NAME", profiles, "drive family of all slaves or of one (repeatable)");
  options.Words(device::BuiltinProfileNames());
  options.Values("--profiles", "PATH", families,
                 "more drive families: a JSON file or a folder of them, see docs/families.md (repeatable)");
  options.Values("--parameter", "[SLAVE:]NAME=VALUE", parameters,
                 "a drive setting that no SDO shows; NAME as in ecaudit profiles FAMILY (repeatable)");
  options.Words([] {
    std::vector<std::string> settings;
    for (const std::string_view name : ParameterNames(FamiliesOf({}))) settings.push_back(std::string(name) + "=");
    return settings;
  });
  options.Values("--esi", "PATH", esi,
                 "EtherCAT slave information (XML, or a folder of it): objects and PDOs (repeatable)");
  options.Value("--eni", "FILE", eni, "EtherCAT network information (XML): slaves, names and process image");
  options.Value("--config", "FILE", config, "settings (default: .ecaudit.json beside the capture or above it)");
}

void CaptureOptions::DeclareIsolate(OptionSet& options) {
  options.Group("What to read");
  options.Flag("--isolate", isolate, "evaluate the range alone (default: evaluate all, show what touches the range)");
}

void GateOptions::Declare(OptionSet& options) {
  options.Group("How to evaluate");
  options.Value("--fail-on", "SEVERITY", fail_on,
                "least severity for exit status 1 (see below): error (default), warning, info, never");
  options.Words({"error", "warning", "info", "never"});
  options.Values("--rule", "ID=SEVERITY", rules, "error, warning, info, or off for one rule (repeatable)");
  options.Words(RuleIds("="));
  options.Value("--baseline", "FILE", baseline, "known findings, which do not count");
  options.Value("--require", "WHAT", require,
                "exit 1 unless all holds: slaves=N,state=OP,reached=OP,axis=enabled,sync=ok,judged=90%");
  options.Words({"slaves=", "state=OP", "reached=OP", "axis=enabled", "axis=commanded", "axis=follows", "sync=ok",
                 "judged", "judged=90%"});
  options.Value("--write-baseline", "FILE", write_baseline, "write all findings of this run to FILE");
}

Result<SlaveSelector> ParseSlave(std::string_view text, const SlaveNames& names) {
  const bool by_address = text.starts_with("0x") || text.starts_with("0X");
  const auto value =
      by_address ? ParseUnsigned<std::uint16_t>(text.substr(2), 16) : ParseUnsigned<std::uint16_t>(text, 10);
  if (!value) return Error{Quoted(text) + " is not a slave: give a position such as 0, or an address such as 0x1001"};
  if (by_address) return SlaveSelector{true, *value};
  const std::optional<SlavePos> position = names.Position(*value);
  if (!position) return Error{Quoted(text) + " is not a slave: with --count-from 1 the first slave is 1"};
  return SlaveSelector{false, *position};
}

Result<SlaveSelector> ParseShownSlave(std::string_view text, const SlaveNames& names) {
  Result<SlaveSelector> slave = ParseSlave(text, names);
  if (slave) {
    constexpr std::size_t kAddressDigits = 4;
    if (!slave->by_address && text.size() == kAddressDigits) {
      slave->or_address = ParseUnsigned<std::uint16_t>(text, 16).value_or(0);
    }
    return slave;
  }
  // A mistyped number is no name: names of devices begin with a letter.
  if (text.empty() || std::isalpha(static_cast<unsigned char>(text.front())) == 0) return slave.error();
  return SlaveSelector{.name = std::string(text)};
}

std::optional<Error> AddRuleSetting(std::string_view text, AnalysisOptions& analysis) {
  const std::size_t equals = text.find('=');
  if (equals == std::string_view::npos) {
    return Error{"--rule is " + Quoted(text) + " but must be ID=SEVERITY, for example al-timeout=warning"};
  }
  const std::string_view id = text.substr(0, equals);
  const std::string_view severity = text.substr(equals + 1);
  if (FindRule(id) == nullptr) {
    std::vector<std::string_view> ids;
    for (const RuleInfo* rule : RuleCatalogue()) ids.push_back(rule->id);
    return Error{"unknown rule " + Quoted(id) + Suggestion(id, ids, "ecaudit rules")};
  }
  RuleSetting setting;
  setting.off = severity == "off";
  bool known = setting.off;
  for (const Severity s : {Severity::kInfo, Severity::kWarning, Severity::kError}) {
    if (Name(s) != severity) continue;
    setting.severity = s;
    known = true;
  }
  if (!known) {
    return Error{"unknown severity " + Quoted(severity) + " for rule " + std::string(id) +
                 " (error, warning, info or off)"};
  }
  analysis.rules.insert_or_assign(std::string(id), setting);
  return std::nullopt;
}

std::vector<std::pair<std::string, std::string>> RuleSettingTexts(const AnalysisOptions& analysis) {
  std::vector<std::pair<std::string, std::string>> texts;
  for (const auto& [id, setting] : analysis.rules) {
    texts.emplace_back(id, setting.off ? std::string_view("off") : Name(setting.severity));
  }
  return texts;
}

std::optional<Error> AddProfile(std::string_view text, AnalysisOptions& analysis) {
  const std::size_t equals = text.find('=');
  const std::string_view name = equals == std::string_view::npos ? text : text.substr(equals + 1);
  const device::ProfileRegistry& families = FamiliesOf(analysis);
  if (families.Find(name) == nullptr) return UnknownProfile(families, name);
  if (equals == std::string_view::npos) {
    analysis.default_profile = name;
    return std::nullopt;
  }
  const Result<SlaveSelector> slave = ParseSlave(text.substr(0, equals), analysis.slave_names);
  if (!slave) return slave.error();
  // A later setting replaces an earlier one: the command line is applied after the configuration file.
  std::erase_if(analysis.slave_profiles, [&](const auto& entry) {
    return entry.first.by_address == slave->by_address && entry.first.value == slave->value;
  });
  analysis.slave_profiles.emplace_back(*slave, name);
  return std::nullopt;
}

std::optional<Error> AddParameter(std::string_view text, AnalysisOptions& analysis) {
  const std::size_t equals = text.find('=');
  const std::string_view left = text.substr(0, equals);
  const std::size_t colon = left.find(':');
  GivenParameter parameter;
  if (equals == std::string_view::npos) {
    return Error{"--parameter is " + Quoted(text) + " but must be NAME=VALUE, with a NAME of ecaudit profiles FAMILY"};
  }
  if (colon != std::string_view::npos) {
    const Result<SlaveSelector> slave = ParseSlave(left.substr(0, colon), analysis.slave_names);
    if (!slave) return slave.error();
    parameter.slave = *slave;
  }
  parameter.keyword = colon == std::string_view::npos ? left : left.substr(colon + 1);
  const std::set<std::string_view> known = ParameterNames(FamiliesOf(analysis));
  if (!known.contains(parameter.keyword)) {
    const std::vector<std::string_view> names(known.begin(), known.end());
    std::string all;
    for (const std::string_view name : names) all += (all.empty() ? "" : ", ") + std::string(name);
    return Error{"unknown parameter " + Quoted(parameter.keyword) + Suggestion(parameter.keyword, names, "") +
                 " (known: " + all + ")"};
  }
  const std::string_view digits = text.substr(equals + 1);
  const auto value = digits.starts_with("0x") ? ParseUnsigned<std::uint32_t>(digits.substr(2), 16)
                                              : ParseUnsigned<std::uint32_t>(digits, 10);
  if (!value) {
    return Error{"the value of " + parameter.keyword + " is " + Quoted(digits) +
                 " but must be a whole number from 0 to 4294967295"};
  }
  parameter.value = *value;
  analysis.parameters.push_back(std::move(parameter));
  return std::nullopt;
}

Result<std::uint16_t> ParseInterface(std::string_view text) {
  std::uint16_t number = 0;
  const auto [rest, code] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (!text.empty() && code == std::errc() && rest == text.data() + text.size()) return number;
  return Error{"--interface is " + Quoted(text) + " but must be the number of an interface, 0 for the first"};
}

Result<Settings> ResolveSettings(const CaptureOptions& options, const GateOptions& gate, const std::string& capture) {
  const Result<std::optional<Config>> found = ConfigFor(options, capture);
  if (!found) return found.error();

  Settings settings;
  const std::optional<Config>& config = *found;
  // Files first: the names in the other settings may be theirs.
  if (config) {
    settings.esi = config->esi;
    settings.eni = config->eni;
    settings.families = config->families;
  }
  if (!options.esi.empty()) settings.esi = options.esi;
  if (options.eni) settings.eni = options.eni;
  settings.families.insert(settings.families.end(), options.families.begin(), options.families.end());
  if (auto error = ReadDeviceFiles(options, settings)) return *error;

  // Before the first slave is named. A file counts by its own setting, the command line by the options.
  if (config) {
    if (auto error = ApplyCountFrom(config->count_from, settings.analysis.slave_names)) return In(config->path, *error);
  }
  const SlaveNames names_of_file = settings.analysis.slave_names;
  if (auto error = ApplyCountFrom(options.count_from, settings.analysis.slave_names)) return *error;
  const SlaveNames names_typed = settings.analysis.slave_names;

  if (config) {
    settings.analysis.slave_names = names_of_file;
    settings.config = config->path;
    if (auto error = ApplyNames(config->profiles, config->parameters, config->rules, settings.analysis))
      return In(config->path, *error);
    if (auto error = ApplyFailOn(config->fail_on, settings.fail_on)) return In(config->path, *error);
    if (auto error = ApplyRequire(config->require, settings.required)) return In(config->path, *error);
    settings.baseline = config->baseline.value_or("");
    settings.analysis.limits = config->limits;
    settings.analysis.slave_names = names_typed;
  }
  if (auto error = ApplyNames(options.profiles, options.parameters, gate.rules, settings.analysis)) return *error;
  if (auto error = ApplyFailOn(gate.fail_on, settings.fail_on)) return *error;
  if (auto error = ApplyRequire(gate.require, settings.required)) return *error;
  if (gate.baseline) settings.baseline = *gate.baseline;
  if (auto error = ApplyRange(options, settings)) return *error;
  settings.isolated_by = options.isolate ? "--isolate" : options.isolates;
  for (const std::string& text : options.interfaces) {
    const Result<std::uint16_t> interface = ParseInterface(text);
    if (!interface) return interface.error();
    settings.analysis.interfaces.push_back(*interface);
  }
  for (const std::string& text : options.slaves) {
    const Result<SlaveSelector> slave = ParseShownSlave(text, settings.analysis.slave_names);
    if (!slave) return slave.error();
    settings.slaves.push_back(*slave);
  }
  return settings;
}

void AddFiles(const Settings& settings, CommandFiles& files) {
  files.Reads(settings.config, kConfigRole);
  files.Reads(settings.baseline, kBaselineRole);
  files.Reads(settings.esi, kEsiRole);
  files.Reads(settings.eni.value_or(""), kEniRole);
  if (settings.analysis.files) {
    for (const auto& [id, own] : settings.analysis.files->families.own()) files.Reads(own.path, kFamilyRole);
  }
}

std::optional<Error> AddFiles(const CaptureOptions& options, CommandFiles& files) {
  if (options.join) return files.ReadsJoined(options.captures);
  files.Reads(options.captures, kCaptureRole);
  return std::nullopt;
}

std::optional<Error> CheckBaselineIsWhole(const CaptureOptions& options, const GateOptions& gate) {
  if (!gate.write_baseline) return std::nullopt;
  const std::string_view option = !options.slaves.empty() ? "--slave"
                                  : options.around        ? "--around"
                                  : options.from          ? "--from"
                                  : options.to            ? "--to"
                                                          : std::string_view();
  if (option.empty()) return std::nullopt;
  return Error{"--write-baseline does not work with " + std::string(option) +
               ": the file would lack the findings of the rest of the capture"};
}

std::optional<Error> PlanBaseline(const std::optional<std::string>& write_baseline, CommandFiles& files) {
  if (!write_baseline) return std::nullopt;
  if (auto error = files.Writes(*write_baseline, kBaselineRole)) return error;
  return CheckBaselinePath(*write_baseline);
}

}  // namespace ecaudit::cli
