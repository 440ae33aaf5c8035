#include "cli/report/digest_json.h"

#include <functional>
#include <map>
#include <string_view>
#include <vector>

#include "cli/report/layout.h"
#include "cli/report/times.h"

namespace ecaudit::report {
namespace {

constexpr std::string_view kSchema = "ecaudit.report/1";
constexpr std::string_view kSchemaName = "ecaudit.report/";

/// Reads fields of one document and remembers the first that is missing or of a wrong kind.
class Fields {
 public:
  [[nodiscard]] const std::string& problem() const { return problem_; }

  [[nodiscard]] JsonValue Object(JsonValue parent, std::string_view key) {
    const JsonValue value = parent.member(key);
    return value.is_object() ? value : Failed(key);
  }
  [[nodiscard]] std::vector<JsonValue> Array(JsonValue parent, std::string_view key) {
    const JsonValue value = parent.member(key);
    if (!value.is_array()) Fail(key);
    return value.Elements();
  }
  [[nodiscard]] std::string Text(JsonValue parent, std::string_view key) {
    const std::string_view* text = parent.member(key).text();
    if (text == nullptr) Fail(key);
    return text == nullptr ? std::string() : PrintableLines(*text);
  }
  [[nodiscard]] std::string TextOrNull(JsonValue parent, std::string_view key) {
    return parent.member(key).is_null() ? std::string() : Text(parent, key);
  }
  [[nodiscard]] bool Flag(JsonValue parent, std::string_view key) {
    const std::optional<bool> flag = parent.member(key).boolean();
    if (!flag) Fail(key);
    return flag.value_or(false);
  }
  [[nodiscard]] std::uint64_t Number(JsonValue parent, std::string_view key) {
    const std::optional<std::uint64_t> number = parent.member(key).natural();
    if (!number) Fail(key);
    return number.value_or(0);
  }
  [[nodiscard]] std::uint64_t NumberOrNull(JsonValue parent, std::string_view key) {
    return parent.member(key).is_null() ? 0 : Number(parent, key);
  }
  [[nodiscard]] std::optional<std::uint16_t> WordOrNull(JsonValue parent, std::string_view key) {
    if (parent.member(key).is_null()) return std::nullopt;
    const std::uint64_t value = Number(parent, key);
    if (value > 0xFFFF) Fail(key);
    return static_cast<std::uint16_t>(value);
  }
  [[nodiscard]] std::optional<double> SecondsOrNull(JsonValue parent, std::string_view key) {
    if (parent.member(key).is_null()) return std::nullopt;
    const std::optional<double> seconds = parent.member(key).number();
    if (!seconds) Fail(key);
    return seconds.value_or(0);
  }

  void Fail(std::string_view key) {
    if (problem_.empty()) problem_ = "'" + std::string(key) + "' is missing or no such value";
  }

 private:
  [[nodiscard]] JsonValue Failed(std::string_view key) {
    Fail(key);
    return {};
  }

  std::string problem_;
};

std::optional<Severity> ParseSeverity(std::string_view text) {
  for (const Severity s : {Severity::kInfo, Severity::kWarning, Severity::kError}) {
    if (Name(s) == text) return s;
  }
  return std::nullopt;
}

/// Findings by their ids: of a part of a capture, the ids have gaps.
class FindingPlaces {
 public:
  explicit FindingPlaces(const std::vector<JsonValue>& findings) {
    for (std::size_t i = 0; i < findings.size(); ++i) {
      if (const std::string_view* id = findings[i].member("id").text()) places_.emplace(*id, i);
    }
  }

  [[nodiscard]] std::size_t Find(std::string_view id, Fields& fields) const {
    const auto found = places_.find(id);
    if (found == places_.end()) fields.Fail("caused_by");
    return found == places_.end() ? FindingDigest::kNoCause : found->second;
  }

 private:
  std::map<std::string, std::size_t, std::less<>> places_;
};

/// What findings show of their slaves. Looked up, not searched for: a report may have thousands of both.
class SlaveTexts {
 public:
  /// Of two slaves at one position the last one counts.
  SlaveTexts(const std::vector<JsonValue>& slaves, const SlaveNames& names, Fields& fields) : names_(names) {
    for (const JsonValue slave : slaves) {
      if (const auto position = fields.WordOrNull(slave, "position")) slaves_[*position].json = slave;
    }
  }

  [[nodiscard]] static std::string Product(JsonValue slave) {
    const JsonValue identity = slave.member("identity");
    return ProductText(Number(identity, "vendor_id"), Number(identity, "product_code"));
  }

  /// Fills in what is known of its slave.
  void Describe(FindingDigest& f, Fields& fields) {
    f.place = "bus";
    if (!f.slave) return;
    const auto slave = slaves_.find(*f.slave);
    if (slave != slaves_.end() && !slave->second.read) Read(slave->second, fields);
    f.place =
        SlaveLabel(names_, *f.slave, slave == slaves_.end() ? std::string() : slave->second.name, f.station_address);
    if (slave != slaves_.end()) f.product = slave->second.product;
  }

 private:
  /// Each finding repeats the name of its slave, so one of megabytes would cost that for each of them. Names that a
  /// slave has are 255 bytes at most, four times that when none can be printed.
  static constexpr std::size_t kMaxNameBytes = 1'024;

  [[nodiscard]] static std::optional<std::uint32_t> Number(JsonValue identity, const char* key) {
    const auto value = identity.member(key).natural();
    return value ? std::optional(static_cast<std::uint32_t>(*value)) : std::nullopt;
  }

  struct Slave {
    JsonValue json;
    bool read = false;
    std::string name, product;
  };
  static void Read(Slave& slave, Fields& fields) {
    slave.read = true;
    slave.name = fields.TextOrNull(slave.json, "name").substr(0, kMaxNameBytes);
    slave.product = Product(slave.json);
  }

  SlaveNames names_;
  std::map<SlavePos, Slave> slaves_;
};

FindingDigest ReadFinding(JsonValue json, const FindingPlaces& places, SlaveTexts& slaves, Fields& fields) {
  FindingDigest f;
  f.rule = fields.Text(json, "rule");
  const std::optional<Severity> severity = ParseSeverity(fields.Text(json, "severity"));
  if (!severity) fields.Fail("severity");
  f.severity = severity.value_or(Severity::kError);
  if (json.member("kind").there()) f.kind = fields.TextOrNull(json, "kind");
  if (json.member("identity").there()) f.identity = fields.TextOrNull(json, "identity");
  if (json.member("next_step").there()) f.next = fields.TextOrNull(json, "next_step");
  f.title = fields.Text(json, "title");
  f.message = fields.Text(json, "message");
  f.slave = fields.WordOrNull(json, "slave");
  f.station_address = fields.WordOrNull(json, "station_address");
  slaves.Describe(f, fields);
  f.frame = fields.NumberOrNull(json, "frame");
  f.last_frame = fields.NumberOrNull(json, "last_frame");
  f.count = fields.Number(json, "count");
  f.time_s = fields.SecondsOrNull(json, "time_s");
  if (json.member("time").there()) f.time = ParseIsoTime(fields.TextOrNull(json, "time"), false);
  for (const JsonValue frame : fields.Array(json, "related_frames")) {
    const std::optional<FrameNo> number = frame.natural();
    if (!number) {
      fields.Fail("related_frames");
    } else {
      f.related_frames.push_back(*number);
    }
  }
  const std::string cause = fields.TextOrNull(json, "caused_by");
  if (!cause.empty()) f.caused_by = places.Find(cause, fields);
  if (json.member("holds").there()) f.holds = fields.TextOrNull(json, "holds");
  f.aside = json.member("aside").there() && fields.Flag(json, "aside");
  f.confidence = fields.Text(json, "confidence") == "observed" ? Confidence::kObserved : Confidence::kInferred;
  const JsonValue reference = fields.Object(json, "reference");
  f.document = fields.TextOrNull(reference, "document");
  f.section = fields.TextOrNull(reference, "section");
  f.wireshark_filter = fields.TextOrNull(json, "wireshark_filter");
  f.known = fields.Flag(json, "known");
  if (json.member("known_because").there()) f.known_because = fields.Text(json, "known_because");
  if (json.member("decode_line").there()) f.line = fields.Number(json, "decode_line");
  return f;
}

/// Reports of the first versions have none of it.
void ReadCoverage(JsonValue json, CaptureDigest& out, Fields& fields) {
  const JsonValue summary = fields.Object(json, "summary");
  if (summary.member("limited_because").there()) out.limited = fields.TextOrNull(summary, "limited_because");
  if (json.member("required").there() && !json.member("required").is_null()) {
    const JsonValue required = fields.Object(json, "required");
    out.required = fields.Text(required, "asked");
    for (const JsonValue missing : fields.Array(required, "missing")) {
      if (missing.is_text()) out.unmet.push_back(PrintableLines(*missing.text()));
    }
  }
  if (!json.member("coverage").there()) return;
  for (const JsonValue rule : fields.Array(fields.Object(json, "coverage"), "rules")) {
    out.coverage.push_back({fields.Text(rule, "rule"),
                            {fields.Number(rule, "judged"), fields.Number(rule, "partly"),
                             fields.Number(rule, "not_judged"), fields.Number(rule, "not_applicable")},
                            fields.TextOrNull(rule, "not_applicable_because")});
  }
}

CaptureDigest ReadCapture(JsonValue json, Fields& fields) {
  CaptureDigest out;
  const JsonValue capture = fields.Object(json, "capture");
  out.path = fields.Text(capture, "path");
  out.packets = fields.Number(capture, "packets");
  out.ethercat_frames = fields.Number(capture, "ethercat_frames");
  out.without_ethercat = out.ethercat_frames == 0 && fields.Number(capture, "malformed_frames") == 0 &&
                         fields.Number(capture, "cut_frames") == 0 && fields.Number(capture, "crc_error_frames") == 0;
  out.first_time = fields.TextOrNull(capture, "first_time");
  out.duration_s = fields.SecondsOrNull(capture, "duration_s");
  out.complete = fields.Flag(capture, "complete");
  const JsonValue settings = fields.Object(json, "settings");
  const std::optional<FailOn> fail_on = ParseFailOn(fields.Text(settings, "fail_on"));
  if (!fail_on) fields.Fail("fail_on");
  out.fail_on = fail_on.value_or(FailOn::kError);
  if (settings.member("config").there()) out.config = fields.TextOrNull(settings, "config");
  out.baseline = fields.TextOrNull(settings, "baseline");
  // Reports of the first versions do not have these.
  if (settings.member("judged").there()) out.judged = fields.Text(settings, "judged") != "nothing";
  if (settings.member("count_from").there()) out.slave_names.from_one = fields.Number(settings, "count_from") == 1;
  if (settings.member("slaves").there()) {
    for (const JsonValue slave : fields.Array(settings, "slaves")) {
      if (slave.is_text()) out.selection.slaves.push_back(PrintableLines(*slave.text()));
    }
  }
  if (settings.member("interfaces").there()) {
    for (const JsonValue interface : fields.Array(settings, "interfaces")) {
      if (const auto number = interface.number(); number && *number <= 0xFFFF) {
        out.selection.interfaces.push_back(static_cast<std::uint16_t>(*number));
      }
    }
  }
  if (settings.member("range").there() && !settings.member("range").is_null()) {
    const JsonValue range = fields.Object(settings, "range");
    const auto frame = [&](const char* key) {
      const FrameNo number = fields.NumberOrNull(range, key);
      return number == 0 ? std::nullopt : std::optional(number);
    };
    out.selection.from_s = fields.SecondsOrNull(range, "from_s");
    out.selection.to_s = fields.SecondsOrNull(range, "to_s");
    out.selection.from_frame = frame("from_frame");
    out.selection.to_frame = frame("to_frame");
    if (range.member("isolated_by").there()) out.selection.isolated_by = fields.TextOrNull(range, "isolated_by");
    if (range.member("outside").there()) {
      const JsonValue outside = fields.Object(range, "outside");
      out.selection.outside = {fields.Number(outside, "errors"), fields.Number(outside, "warnings"),
                               fields.Number(outside, "infos")};
    }
  }
  if (settings.member("rules").there()) {
    const JsonValue rules = fields.Object(settings, "rules");
    for (const auto& [id, severity] : rules.Members()) out.rules.emplace_back(id, fields.Text(rules, id));
  }
  const std::vector<JsonValue> slaves = fields.Array(json, "slaves");
  out.slaves = slaves.size();
  const bool whole = out.selection.slaves.empty();
  if (const JsonValue bus = json.member("bus"); whole && bus.there() && bus.member("slave_count").there()) {
    out.slaves_there = fields.NumberOrNull(bus, "slave_count");
  }
  SlaveTexts texts(slaves, out.slave_names, fields);
  for (const JsonValue slave : slaves) out.devices.push_back(SlaveTexts::Product(slave));
  SortDevices(out.devices);
  const std::vector<JsonValue> findings = fields.Array(json, "findings");
  const FindingPlaces places(findings);
  for (const JsonValue finding : findings) out.findings.push_back(ReadFinding(finding, places, texts, fields));
  for (const JsonValue entry : fields.Array(json, "not_evaluable")) {
    out.not_judged.push_back({fields.Text(entry, "rule"), fields.WordOrNull(entry, "slave"),
                              fields.Text(entry, "reason"),
                              entry.member("scope").there() && fields.Text(entry, "scope") == "all-slaves",
                              entry.member("code").there() ? fields.Text(entry, "code") : std::string()});
  }
  ReadCoverage(json, out, fields);
  return out;
}

Origin ReadOrigin(JsonValue document, Fields& fields) {
  if (!document.member("made_from").there()) return {};
  const JsonValue json = fields.Object(document, "made_from");
  return {fields.Text(json, "settings"), fields.Number(json, "bytes"), fields.Text(json, "modified")};
}

}  // namespace

Result<ReportDigest> ReadReportDigest(JsonValue document) {
  const std::string_view* schema = document.member("schema").text();
  if (schema == nullptr) {
    return Error{"not a report of ecaudit (\"schema\": \"" + std::string(kSchema) + "\")"};
  }
  if (*schema != kSchema) {
    const std::string name = OneLine(*schema);
    return Error{(name.starts_with(kSchemaName) ? "written in another version of the report, " : "no report but ") +
                 name + "; this program reads " + std::string(kSchema)};
  }
  Fields fields;
  ReportDigest out;
  out.version = fields.Text(fields.Object(document, "tool"), "version");
  out.origin = ReadOrigin(document, fields);
  for (const JsonValue report : fields.Array(document, "reports")) out.captures.push_back(ReadCapture(report, fields));
  if (document.member("unreadable").there()) {
    for (const JsonValue entry : fields.Array(document, "unreadable")) {
      out.captures.emplace_back();
      out.captures.back().path = fields.Text(entry, "path");
      out.captures.back().unreadable = fields.Text(entry, "message");
    }
  }
  if (!fields.problem().empty()) return Error{"not a complete report: " + fields.problem()};
  return out;
}

}  // namespace ecaudit::report
