#include "cli/report/github_writer.h"

#include "cli/report/finding_order.h"
#include "cli/report/layout.h"
#include "cli/report/project_path.h"

namespace ecaudit::report {
namespace {

std::string_view Command(Severity severity) {
  return severity == Severity::kError ? "error" : severity == Severity::kWarning ? "warning" : "notice";
}

/// What ends a command, or a property, is written as %XX.
std::string Escaped(std::string_view text, bool property) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '%':
        out += "%25";
        break;
      case '\r':
        out += "%0D";
        break;
      case '\n':
        out += "%0A";
        break;
      case ':':
        out += property ? "%3A" : ":";
        break;
      case ',':
        out += property ? "%2C" : ",";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string Line(std::string_view command, const std::string& file, std::uint64_t line, std::string_view title,
                 std::string_view message) {
  std::string out = "::" + std::string(command) + " file=" + Escaped(file, true);
  if (line > 0) out += ",line=" + std::to_string(line);
  return out + ",title=" + Escaped(title, true) + "::" + Escaped(message, false) + "\n";
}

}  // namespace

std::string WriteGithub(const Digest& digest, std::string_view folder) {
  std::string out;
  for (const CaptureDigest& capture : digest.captures) {
    const std::string file = PathInProject(capture.path, folder);
    if (!capture.unreadable.empty()) {
      out += Line("error", file, 0, "capture not read", capture.unreadable);
      continue;
    }
    for (const OrderedFinding& entry : OrderForReading(capture)) {
      const FindingDigest& f = capture.findings[entry.index];
      std::string text = f.place + ": " + OneLine(f.title);
      if (f.frame != 0) text += " (frame " + std::to_string(f.frame) + ")";
      if (!f.message.empty() && f.message != f.title) text += "\n" + f.message;
      out += Line(Command(f.severity), file, f.line, f.rule, text);
    }
    for (const std::string& missing : capture.unmet) {
      out += Line("error", file, 0, "required and missing", missing);
    }
    if (!capture.limited.empty()) out += Line("warning", file, 0, "verdict limited", capture.limited);
  }
  return out;
}

}  // namespace ecaudit::report
