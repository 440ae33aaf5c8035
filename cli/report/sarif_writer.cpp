#include "cli/report/sarif_writer.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

#include <QByteArray>
#include <QtGlobal>

#include "cli/report/fingerprint.h"
#include "cli/report/json_text.h"
#include "cli/report/layout.h"
#include "cli/report/project_path.h"
#include "cli/report/times.h"
#include "decoder/base/text.h"

namespace ecaudit::report {
namespace {

std::string_view Level(Severity severity) {
  return severity == Severity::kError ? "error" : severity == Severity::kWarning ? "warning" : "note";
}

/// A message: braces mark placeholders, so literal ones are doubled (SARIF 2.1.0, 3.11.5).
void PutMessage(JsonObject& out, std::string_view text) {
  std::string doubled;
  for (const char c : text) doubled.append(c == '{' || c == '}' ? 2 : 1, c);
  out.Object("message", [&](JsonObject& message) { message.Put("text", doubled); });
}

/// A URI reference (RFC 3986): relative to the folder of the project, where it lies in it.
std::string Uri(std::string_view given, std::string_view folder) {
  const std::string path = PathInProject(given, folder);
  // Names of files are bytes, and need not be text, which QUrl wants.
  const QByteArray name = QByteArray::fromRawData(path.data(), static_cast<qsizetype>(path.size()));
  const bool absolute = std::filesystem::path(path).is_absolute();
  // A drive ("C:/...") is a part of the path, and a colon is none of a scheme.
  return (!absolute ? "" : path.starts_with('/') ? "file://" : "file:///") + name.toPercentEncoding("/").toStdString();
}

/// Text from the catalogue without the empty lines around it.
std::string Trimmed(std::string_view text) {
  const std::size_t begin = text.find_first_not_of(" \n");
  if (begin == std::string_view::npos) return {};
  return std::string(text.substr(begin, text.find_last_not_of(" \n") + 1 - begin));
}

/// A capture has no lines, and yet servers want one.
constexpr std::string_view kLineHelp =
    "\n\n## Where it is shown\nThe line of a result is that of its first frame in the text that `ecaudit decode "
    "CAPTURE` writes.";

void PutRule(JsonObject& out, const RuleInfo& rule, std::string_view homepage) {
  const std::string page = Trimmed(rule.doc) + std::string(kLineHelp);
  const std::string full = std::string(rule.title) + ". Needs: " + std::string(rule.needs) + ".";
  out.Put("id", rule.id);
  out.Object("shortDescription", [&](JsonObject& json) { json.Put("text", rule.title); });
  out.Object("fullDescription", [&](JsonObject& json) { json.Put("text", full); });
  if (!homepage.empty()) out.Put("helpUri", std::string(homepage) + "/docs/rules.md#" + std::string(rule.id));
  out.Object("help", [&](JsonObject& json) {
    json.Put("text", page);
    json.Put("markdown", page);
  });
  out.Object("defaultConfiguration", [&](JsonObject& json) { json.Put("level", Level(rule.severity)); });
  out.Object("properties", [&](JsonObject& json) {
    json.Array("tags", [&](JsonArray& tags) { tags.Add(rule.group); });
    json.Put("source", rule.source);
  });
}

/// Left out where it is unknown.
void PutKnown(JsonObject& out, std::string_view key, JsonScalar value) {
  if (!value.is_null()) out.Put(key, value);
}

/// A JSON array, one element a line.
class List {
 public:
  /// Adds an object that `write(JsonObject&)` fills.
  template <typename Write>
  void Add(Write&& write) {
    JsonText element(JsonText::Layout::kLine);
    element.Object(write);
    text_ += (text_.empty() ? "[\n" : ",\n") + element.Take();
  }
  [[nodiscard]] std::string Take() { return text_.empty() ? "[]" : std::move(text_) + "\n]"; }

 private:
  std::string text_;
};

std::string Quoted(std::string_view text) {
  std::string out;
  JsonScalar(text).AppendTo(out);
  return out;
}

class SarifWriter {
 public:
  SarifWriter(const Digest& digest, std::string_view folder, std::string_view homepage)
      : digest_(digest), folder_(folder), homepage_(homepage) {
    for (const RuleInfo* rule : digest.rules) {
      index_.emplace(rule->id, index_.size());
      rules_.Add([&](JsonObject& json) { PutRule(json, *rule, homepage); });
    }
  }

  [[nodiscard]] std::string Write() {
    bool successful = digest_.not_reached == 0;
    for (const CaptureDigest& capture : digest_.captures) {
      const std::size_t artifact = ArtifactIndex(capture.path);
      if (!capture.unreadable.empty()) {
        successful = false;
        AddNotification("error", capture.unreadable, artifact);
        continue;
      }
      if (!capture.judged) AddNotification("note", HeadlinePartsOf(capture).sentence, artifact);
      if (const std::string limits = LimitsText(capture.selection); !limits.empty()) {
        AddNotification("note", "limited by " + OneLine(limits), artifact);
      }
      if (!capture.limited.empty()) AddNotification("warning", "verdict limited: " + capture.limited, artifact);
      for (const std::string& missing : capture.unmet) {
        AddNotification("error", "required and missing: " + missing, artifact);
      }
      std::map<Fingerprint, unsigned> seen;
      for (const FindingDigest& f : capture.findings) {
        const Fingerprint fingerprint = FingerprintOf(f);
        const unsigned which = ++seen[fingerprint];
        results_.Add([&](JsonObject& json) { PutResult(json, capture, f, artifact, fingerprint, which); });
      }
      for (const NotJudged& entry : capture.not_judged) {
        AddNotification(
            "note",
            entry.rule + " not evaluated, " + PlaceOf(entry, capture.slave_names) + ": " + OneLine(entry.reason),
            artifact, &entry.rule);
      }
    }
    List artifacts;
    for (const std::string& uri : artifacts_) artifacts.Add([&](JsonObject& json) { PutArtifact(json, uri); });
    const std::string version = Quoted(digest_.version);
    return R"({"$schema": "https://json.schemastore.org/sarif-2.1.0.json", "version": "2.1.0", "runs": [{)"
           R"("tool": {"driver": {"name": "ecaudit", "version": )" +
           version + R"(, "semanticVersion": )" + version +
           (homepage_.empty() ? "" : R"(, "informationUri": )" + Quoted(homepage_)) + R"(, "rules": )" + rules_.Take() +
           "}},\n" + R"("invocations": [{"executionSuccessful": )" + (successful ? "true" : "false") +
           R"(, "toolExecutionNotifications": )" + notifications_.Take() + "}],\n" + R"("artifacts": )" +
           artifacts.Take() + ",\n" + R"("results": )" + results_.Take() + "}]}\n";
  }

 private:
  /// Rules that this catalogue does not have (a report of another version) are added by their name.
  [[nodiscard]] std::size_t RuleIndex(const std::string& rule) {
    const auto [entry, added] = index_.emplace(rule, index_.size());
    if (added) rules_.Add([&](JsonObject& json) { json.Put("id", rule); });
    return entry->second;
  }

  /// A capture that was read twice is one artifact: the schema wants each once.
  [[nodiscard]] std::size_t ArtifactIndex(const std::string& path) {
    const auto [entry, added] = artifact_index_.emplace(path, artifacts_.size());
    if (added) artifacts_.push_back(Uri(path, folder_));
    return entry->second;
  }

  static void PutArtifact(JsonObject& out, const std::string& uri) {
    out.Object("location", [&](JsonObject& location) { location.Put("uri", uri); });
    out.Array("roles", [](JsonArray& roles) { roles.Add("analysisTarget"); });
  }

  /// @param line  of the text of `decode`; 0: of nothing in particular
  void PutLocation(JsonObject& out, std::size_t artifact, std::uint64_t line = 0) const {
    out.Object("physicalLocation", [&](JsonObject& physical) {
      physical.Object("artifactLocation", [&](JsonObject& location) {
        location.Put("uri", artifacts_[artifact]);
        location.Put("index", artifact);
      });
      if (line > 0) physical.Object("region", [&](JsonObject& region) { region.Put("startLine", line); });
    });
  }

  /// @param rule  that it is about; null: none
  void AddNotification(std::string_view level, std::string_view text, std::size_t artifact,
                       const std::string* rule = nullptr) {
    notifications_.Add([&](JsonObject& json) {
      json.Put("level", level);
      PutMessage(json, text);
      json.Array("locations", [&](JsonArray& locations) {
        locations.AddObject([&](JsonObject& location) { PutLocation(location, artifact); });
      });
      if (rule == nullptr) return;
      json.Object("associatedRule", [&](JsonObject& associated) {
        associated.Put("id", *rule);
        associated.Put("index", RuleIndex(*rule));
      });
    });
  }

  void PutResult(JsonObject& out, const CaptureDigest& capture, const FindingDigest& f, std::size_t artifact,
                 const Fingerprint& fingerprint, unsigned which) {
    const std::string slave = f.slave ? std::to_string(*f.slave) : "bus";
    std::string text = f.place + ": " + f.title;
    if (f.frame != 0) text += " (frame " + std::to_string(f.frame) + ")";
    text += ".";
    if (!f.message.empty()) text += " " + f.message;
    const std::string identity = f.rule + "\n" + slave + "\n" + fingerprint.identity;
    out.Put("ruleId", f.rule);
    out.Put("ruleIndex", RuleIndex(f.rule));
    out.Put("level", Level(f.severity));
    PutMessage(out, text);
    out.Array("locations", [&](JsonArray& locations) {
      locations.AddObject([&](JsonObject& location) {
        // A result without a line is not shown by all; the whole capture begins in the first.
        PutLocation(location, artifact, std::max<std::uint64_t>(f.line, 1));
        location.Array("logicalLocations", [&](JsonArray& logical) {
          logical.AddObject([&](JsonObject& json) {
            json.Put("name", f.slave ? capture.slave_names.Of(*f.slave) : slave);
            json.Put("fullyQualifiedName", OneLine(f.place));
            json.Put("kind", "resource");
          });
        });
      });
    });
    out.Object("partialFingerprints", [&](JsonObject& json) {
      const std::string hash = Hex(StableHash(identity), 16).substr(2) + ":" + std::to_string(which);
      json.Put("ecauditFinding/v1", hash);
      // The name under which servers follow an alert from run to run. Otherwise they would hash the line of a text
      // that they do not have.
      json.Put("primaryLocationLineHash", hash);
    });
    if (f.known) PutSuppression(out, capture, f);
    out.Object("properties", [&](JsonObject& json) { PutProperties(json, capture, f); });
  }

  static void PutSuppression(JsonObject& out, const CaptureDigest& capture, const FindingDigest& f) {
    out.Array("suppressions", [&](JsonArray& suppressions) {
      suppressions.AddObject([&](JsonObject& json) {
        json.Put("kind", "external");
        const std::string baseline = capture.baseline.empty() ? "the baseline" : capture.baseline;
        json.Put("justification",
                 "known: listed in " + baseline + (f.known_because.empty() ? "" : " (" + f.known_because + ")"));
      });
    });
  }

  static void PutProperties(JsonObject& out, const CaptureDigest& capture, const FindingDigest& f) {
    if (f.frame != 0) {
      out.Put("frame", f.frame);
      out.Put("last_frame", f.last_frame);
    }
    out.Put("count", f.count);
    PutKnown(out, "time_s", f.time_s);
    if (f.time) out.Put("time", IsoTime(*f.time));
    PutKnown(out, "slave", f.slave);
    PutKnown(out, "station_address", f.station_address);
    if (!f.related_frames.empty()) out.Values("related_frames", f.related_frames);
    out.Put("confidence", f.confidence == Confidence::kObserved ? "observed" : "inferred");
    if (f.caused_by < capture.findings.size()) out.Put("caused_by", capture.findings[f.caused_by].rule);
    if (const std::string source = ReferenceText(f.document, f.section); !source.empty()) out.Put("reference", source);
    if (!f.wireshark_filter.empty()) out.Put("wireshark_filter", f.wireshark_filter);
  }

  const Digest& digest_;
  std::string_view folder_;
  std::string_view homepage_;
  List rules_;
  List notifications_;
  List results_;
  std::vector<std::string> artifacts_;                     ///< URIs
  std::map<std::string, std::size_t> artifact_index_;      ///< by path
  std::map<std::string, std::size_t, std::less<>> index_;  ///< of each rule, by its id
};

}  // namespace

std::string WriteSarif(const Digest& digest, std::string_view folder, std::string_view homepage) {
  return SarifWriter(digest, folder, homepage).Write();
}

std::string QtVersion() {
  return qVersion();
}

}  // namespace ecaudit::report
