#include "cli/report/markdown_writer.h"

#include <algorithm>
#include <string_view>

#include "cli/report/finding_order.h"
#include "cli/report/layout.h"
#include "cli/report/times.h"
#include "decoder/base/text.h"

namespace ecaudit::report {
namespace {

/// Findings of one capture that are listed: a summary of a job has a limit of its own, and so have readers.
constexpr std::size_t kListed = 50;

/// Names and texts of devices must not become marks, links or HTML.
std::string Escaped(std::string_view text) {
  constexpr std::string_view kMarks = "\\`*_{}[]<>|#~$@!&";
  std::string out;
  for (const char c : OneLine(text)) {
    if (kMarks.find(c) != std::string_view::npos) out += '\\';
    out += c;
  }
  return out;
}

std::string Row(std::initializer_list<std::string> cells) {
  std::string row = "|";
  for (const std::string& cell : cells) row += " " + cell + " |";
  return row + "\n";
}

std::string CountsText(const Summary& s) {
  std::string text = Count(s.errors, "error") + ", " + Count(s.warnings, "warning") + ", " + Count(s.infos, "info");
  if (s.known > 0) text += ", " + Grouped(s.known) + " known";
  return text;
}

std::string FrameText(const FindingDigest& f) {
  if (f.frame == 0) return "";
  std::string text = std::to_string(f.frame);
  if (f.time_s) text += " (" + Fixed(*f.time_s, 3) + " s)";
  if (f.count > 1) text += ", " + Grouped(f.count) + " times";
  return text;
}

std::string Findings(const CaptureDigest& capture) {
  if (capture.findings.empty()) return {};
  std::string out = "\n" + Row({"", "rule", "where", "what", "frame"}) + "|---|---|---|---|---|\n";
  const auto known = static_cast<std::uint64_t>(std::ranges::count_if(capture.findings, &FindingDigest::known));
  std::size_t listed = 0;
  for (const OrderedFinding& entry : OrderForReading(capture)) {
    const FindingDigest& f = capture.findings[entry.index];
    if (f.known) continue;
    if (++listed > kListed) continue;
    const std::string severity(Name(f.severity));
    const std::string what = Escaped(f.title) + (f.next.empty() ? "" : "<br>do: " + Escaped(f.next));
    out += Row({f.severity == Severity::kError ? "**error**" : severity,
                (entry.depth > 0 ? "↳ " : "") + ("`" + f.rule + "`"), Escaped(f.place), what, FrameText(f)});
  }
  if (listed == 0) out.clear();
  if (listed > kListed) out += "\n" + Grouped(listed - kListed) + " more findings are in the other formats.\n";
  if (known > 0) out += "\n" + Count(known, "finding") + " known from the baseline.\n";
  return out;
}

std::string Section(const CaptureDigest& capture, bool of_several) {
  const HeadlineParts headline = HeadlinePartsOf(capture);
  std::string out = std::string(of_several ? "###" : "##") + " " + headline.verdict + ": " + Escaped(capture.path) +
                    "\n\n" + Escaped(headline.sentence) + "\n";
  if (!capture.unreadable.empty() || !capture.judged) return out;
  for (const std::string& missing : capture.unmet) out += "\n- required and missing: " + Escaped(missing) + "\n";
  return out + Findings(capture);
}

}  // namespace

std::string WriteMarkdown(const Digest& digest) {
  const bool several = digest.captures.size() > 1;
  std::string out;
  if (several) {
    out = "## ecaudit: " + Count(digest.captures.size(), "capture") + ", " + CountsText(Summarise(digest)) + "\n\n" +
          Row({"verdict", "capture", "what"}) + "|---|---|---|\n";
    for (const CaptureDigest& capture : digest.captures) {
      const HeadlineParts headline = HeadlinePartsOf(capture);
      out += Row({headline.verdict, Escaped(capture.path), Escaped(headline.sentence)});
    }
    if (digest.not_reached > 0) out += "\n" + Grouped(digest.not_reached) + " captures were not checked.\n";
  }
  for (const CaptureDigest& capture : digest.captures) {
    // The table has all there is of a capture without findings.
    if (several && capture.findings.empty() && capture.unmet.empty()) continue;
    out += (out.empty() ? "" : "\n") + Section(capture, several);
  }
  return out + "\necaudit " + Escaped(digest.version) + "\n";
}

}  // namespace ecaudit::report
