#include "cli/report/sarif_writer.h"

#include <algorithm>
#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include <nlohmann/json.hpp>

#include "cli/report/fingerprint.h"
#include "cli/report/layout.h"
#include "decoder/base/text.h"

namespace ecaudit::report {
namespace {

using Json = nlohmann::ordered_json;

std::string_view Level(Severity severity) {
  return severity == Severity::kError ? "error" : severity == Severity::kWarning ? "warning" : "note";
}

/// A message: braces mark placeholders, so literal ones are doubled (SARIF 2.1.0, 3.11.5).
Json Message(std::string_view text) {
  std::string out;
  for (const char c : text) out.append(c == '{' || c == '}' ? 2 : 1, c);
  return {{"text", out}};
}

/// A URI reference (RFC 3986): relative paths stay relative.
std::string Uri(std::string_view path) {
  constexpr std::string_view kKept = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-._~/";
  constexpr std::string_view kHex = "0123456789ABCDEF";
  std::string uri = path.starts_with('/') ? "file://" : "";
  for (const char c : path) {
    if (kKept.find(c) != std::string_view::npos) {
      uri += c;
    } else {
      const auto byte = static_cast<unsigned char>(c);
      uri += '%';
      uri += kHex[byte >> 4U];
      uri += kHex[byte & 15U];
    }
  }
  return uri;
}

/// Text from the catalogue without the empty lines around it.
std::string Trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \n");
  if (begin == std::string_view::npos) return {};
  return std::string(text.substr(begin, text.find_last_not_of(" \n") + 1 - begin));
}

Json RuleJson(const RuleInfo& rule) {
  const std::string page = Trimmed(rule.doc);
  Json json;
  json["id"] = rule.id;
  json["shortDescription"] = {{"text", rule.title}};
  json["fullDescription"] = {{"text", std::string(rule.title) + ". Needs: " + std::string(rule.needs) + "."}};
  json["help"] = {{"text", page}, {"markdown", page}};
  json["defaultConfiguration"] = {{"level", Level(rule.severity)}};
  json["properties"] = {{"tags", {rule.group}}, {"source", rule.source}};
  return json;
}

template <typename T>
void AddIf(Json& json, const char* name, const std::optional<T>& value) {
  if (value) json[name] = *value;
}

std::string Dump(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

/// A JSON array, one element a line, kept as text: the results of thousands of captures are large as objects.
class List {
 public:
  void Add(const Json& element) { text_ += (text_.empty() ? "[\n" : ",\n") + Dump(element); }
  [[nodiscard]] std::string Take() { return text_.empty() ? "[]" : std::move(text_) + "\n]"; }

 private:
  std::string text_;
};

class SarifWriter {
 public:
  explicit SarifWriter(const Digest& digest) : digest_(digest) {
    for (const RuleInfo* rule : digest.rules) {
      index_.emplace(rule->id, rules_.size());
      rules_.push_back(RuleJson(*rule));
    }
  }

  [[nodiscard]] std::string Write() {
    bool successful = digest_.not_reached == 0;
    for (const CaptureDigest& capture : digest_.captures) {
      const std::size_t artifact = ArtifactIndex(capture.path);
      if (!capture.unreadable.empty()) {
        successful = false;
        notifications_.Add(Notification("error", capture.unreadable, artifact));
        continue;
      }
      if (!capture.judged) notifications_.Add(Notification("note", HeadlinePartsOf(capture).sentence, artifact));
      if (const std::string limits = Text(capture.selection); !limits.empty()) {
        notifications_.Add(Notification("note", "limited by " + OneLine(limits), artifact));
      }
      std::map<Fingerprint, unsigned> seen;
      for (const FindingDigest& f : capture.findings) {
        const Fingerprint fingerprint = FingerprintOf(f);
        results_.Add(Result(capture, f, artifact, fingerprint, ++seen[fingerprint]));
      }
      for (const NotJudged& entry : capture.not_judged) {
        Json note = Notification("note", entry.rule + " not judged, " + PlaceOf(entry) + ": " + OneLine(entry.reason),
                                 artifact);
        note["associatedRule"] = {{"id", entry.rule}, {"index", RuleIndex(entry.rule)}};
        notifications_.Add(note);
      }
    }
    List rules, artifacts;
    for (const Json& rule : rules_) rules.Add(rule);
    for (const Json& artifact : artifacts_) artifacts.Add(artifact);
    const std::string version = Dump(digest_.version);
    return R"({"$schema": "https://json.schemastore.org/sarif-2.1.0.json", "version": "2.1.0", "runs": [{)"
           R"("tool": {"driver": {"name": "ecaudit", "version": )" +
           version + R"(, "semanticVersion": )" + version + R"(, "rules": )" + rules.Take() + "}},\n" +
           R"("invocations": [{"executionSuccessful": )" + (successful ? "true" : "false") +
           R"(, "toolExecutionNotifications": )" + notifications_.Take() + "}],\n" + R"("artifacts": )" +
           artifacts.Take() + ",\n" + R"("results": )" + results_.Take() + "}]}\n";
  }

 private:
  /// Rules that this catalogue does not have (a report of another version) are added by their name.
  [[nodiscard]] std::size_t RuleIndex(const std::string& rule) {
    const auto [entry, added] = index_.emplace(rule, rules_.size());
    if (added) rules_.push_back({{"id", rule}});
    return entry->second;
  }

  /// A capture that was read twice is one artifact: the schema wants each once.
  [[nodiscard]] std::size_t ArtifactIndex(const std::string& path) {
    const auto [entry, added] = artifact_index_.emplace(path, artifacts_.size());
    if (added) artifacts_.push_back({{"location", {{"uri", Uri(path)}}}, {"roles", {"analysisTarget"}}});
    return entry->second;
  }

  [[nodiscard]] Json Location(std::size_t artifact) const {
    const Json& uri = artifacts_[artifact]["location"]["uri"];
    return {{"physicalLocation", {{"artifactLocation", {{"uri", uri}, {"index", artifact}}}}}};
  }

  [[nodiscard]] Json Notification(std::string_view level, std::string_view text, std::size_t artifact) const {
    Json json;
    json["level"] = level;
    json["message"] = Message(text);
    json["locations"] = Json::array({Location(artifact)});
    return json;
  }

  [[nodiscard]] Json Result(const CaptureDigest& capture, const FindingDigest& f, std::size_t artifact,
                            const Fingerprint& fingerprint, unsigned which) {
    Json location = Location(artifact);
    location["logicalLocations"] = Json::array({{{"name", f.slave ? "slave " + std::to_string(*f.slave) : "bus"},
                                                 {"fullyQualifiedName", OneLine(f.place)},
                                                 {"kind", "resource"}}});
    std::string text = f.place + ": " + f.title;
    if (f.frame != 0) text += " (frame " + std::to_string(f.frame) + ")";
    text += ".";
    if (!f.message.empty()) text += " " + f.message;
    const std::string identity =
        f.rule + "\n" + (f.slave ? std::to_string(*f.slave) : "bus") + "\n" + fingerprint.title;
    Json json;
    json["ruleId"] = f.rule;
    json["ruleIndex"] = RuleIndex(f.rule);
    json["level"] = Level(f.severity);
    json["message"] = Message(text);
    json["locations"] = Json::array({std::move(location)});
    json["partialFingerprints"] = {
        {"ecauditFinding/v1", Hex(StableHash(identity), 16).substr(2) + ":" + std::to_string(which)}};
    if (f.known) {
      json["suppressions"] = Json::array(
          {{{"kind", "external"},
            {"justification", "known: listed in " + (capture.baseline.empty() ? "the baseline" : capture.baseline)}}});
    }
    json["properties"] = Properties(capture, f);
    return json;
  }

  [[nodiscard]] static Json Properties(const CaptureDigest& capture, const FindingDigest& f) {
    Json json;
    if (f.frame != 0) {
      json["frame"] = f.frame;
      json["last_frame"] = f.last_frame;
    }
    json["count"] = f.count;
    AddIf(json, "time_s", f.time_s);
    AddIf(json, "slave", f.slave);
    AddIf(json, "station_address", f.station_address);
    if (!f.related_frames.empty()) json["related_frames"] = f.related_frames;
    json["confidence"] = f.confidence == Confidence::kObserved ? "observed" : "inferred";
    if (f.caused_by < capture.findings.size()) json["caused_by"] = capture.findings[f.caused_by].rule;
    if (const std::string source = ReferenceText(f.document, f.section); !source.empty()) json["reference"] = source;
    if (!f.wireshark_filter.empty()) json["wireshark_filter"] = f.wireshark_filter;
    return json;
  }

  const Digest& digest_;
  List results_;
  List notifications_;
  std::vector<Json> rules_;
  std::vector<Json> artifacts_;
  std::map<std::string, std::size_t> artifact_index_;      ///< by path
  std::map<std::string, std::size_t, std::less<>> index_;  ///< by rule id
};

}  // namespace

std::string WriteSarif(const Digest& digest) {
  return SarifWriter(digest).Write();
}

}  // namespace ecaudit::report
