#include "cli/report/gitlab_writer.h"

#include <algorithm>
#include <map>

#include "cli/report/finding_order.h"
#include "cli/report/fingerprint.h"
#include "cli/report/json_text.h"
#include "cli/report/layout.h"
#include "cli/report/project_path.h"
#include "decoder/base/text.h"

namespace ecaudit::report {
namespace {

std::string_view SeverityName(Severity severity) {
  return severity == Severity::kError ? "critical" : severity == Severity::kWarning ? "major" : "info";
}

/// What GitLab shows of one entry, and knows it by.
struct Entry {
  std::string check;
  std::string description;
  std::string body;
  std::string identity;
  std::string_view severity;
  std::uint64_t line = 1;
};

class EntryList {
 public:
  explicit EntryList(std::string_view folder) : folder_(folder) {}

  void Add(const std::string& path, const Entry& entry) {
    const std::string file = PathInProject(path, folder_);
    // The same fault twice in one capture is two entries, and GitLab wants two fingerprints.
    const std::string identity = file + "\n" + entry.identity;
    const unsigned which = ++seen_[identity];
    JsonText text(JsonText::Layout::kLine);
    text.Object([&](JsonObject& json) {
      json.Put("type", "issue");
      json.Put("check_name", entry.check);
      json.Put("description", entry.description);
      if (!entry.body.empty()) json.Object("content", [&](JsonObject& content) { content.Put("body", entry.body); });
      json.Array("categories", [](JsonArray& categories) { categories.Add("Bug Risk"); });
      json.Put("severity", entry.severity);
      json.Put("fingerprint", Hex(StableHash(identity + "\n" + std::to_string(which)), 16).substr(2));
      json.Object("location", [&](JsonObject& location) {
        location.Put("path", file);
        location.Object("lines", [&](JsonObject& lines) { lines.Put("begin", entry.line); });
      });
    });
    text_ += (text_.empty() ? "[\n" : ",\n") + text.Take();
  }

  [[nodiscard]] std::string Take() { return text_.empty() ? "[]\n" : std::move(text_) + "\n]\n"; }

 private:
  std::string_view folder_;
  std::map<std::string, unsigned> seen_;
  std::string text_;
};

}  // namespace

std::string WriteGitlab(const Digest& digest, std::string_view folder) {
  EntryList list(folder);
  for (const CaptureDigest& capture : digest.captures) {
    if (!capture.unreadable.empty()) {
      list.Add(capture.path, {"capture-unreadable", capture.unreadable, "", "unreadable", "blocker"});
      continue;
    }
    for (const OrderedFinding& ordered : OrderForReading(capture)) {
      const FindingDigest& f = capture.findings[ordered.index];
      std::string description = f.place + ": " + OneLine(f.title);
      if (f.frame != 0) description += " (frame " + std::to_string(f.frame) + ")";
      const std::string slave = f.slave ? std::to_string(*f.slave) : "bus";
      list.Add(capture.path, {f.rule, description, f.message == f.title ? "" : f.message,
                              f.rule + "\n" + slave + "\n" + FingerprintOf(f).identity, SeverityName(f.severity),
                              std::max<std::uint64_t>(f.line, 1)});
    }
    for (const std::string& missing : capture.unmet) {
      list.Add(capture.path,
               {"requirement", "required and missing: " + missing, "", "required\n" + missing, "blocker"});
    }
  }
  return list.Take();
}

}  // namespace ecaudit::report
