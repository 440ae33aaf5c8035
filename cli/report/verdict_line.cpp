#include "cli/report/verdict_line.h"

#include <algorithm>

#include "cli/report/times.h"
#include "decoder/base/text.h"
#include "decoder/base/wrapping.h"

namespace ecaudit::report {
namespace {

/// Digits after the second: a reader looks for the moment, not for the frame, by it.
constexpr std::size_t kDigits = 3;
/// Columns that the event keeps at least, also after a long path.
constexpr std::size_t kLeastSentence = 28;

std::string Joined(const std::vector<std::string>& texts) {
  std::string joined;
  for (const std::string& text : texts) joined += (joined.empty() ? "" : "; ") + OneLine(text);
  return joined;
}

/// What the line shows, in the parts that can be shortened.
struct Parts {
  std::string before;  ///< "error: " where the verdict does not show it
  std::string place;   ///< "slave 0 (AKD, 0x1001): "
  std::string short_place;
  std::string what;
  std::string cause;       ///< ", because: ..." with its frame
  std::string when;        ///< " (frame 760 at 0.759 s)"
  std::string short_when;  ///< " (#760, 0.759 s)"
};

std::string MomentOf(const CaptureDigest& capture, const FindingDigest& f, const TextStyle& style) {
  if (style.time == TimeMode::kRelative) return f.time_s ? Fixed(*f.time_s, kDigits) + " s" : std::string();
  if (!f.time) return {};
  const std::optional<TimeNs> first = ParseIsoTime(capture.first_time, false);
  return MomentText(style.time, {1, first.value_or(0), first.has_value()}, {f.frame, *f.time, true}, kDigits);
}

/// Without what stands in brackets: "refused with 0x001d (invalid output configuration)" loses the name of the code.
std::string WithoutBrackets(std::string text) {
  for (std::size_t open = text.find(" ("); open != std::string::npos; open = text.find(" (", open)) {
    std::size_t close = open + 1;
    for (std::size_t depth = 1; depth > 0;) {
      close = text.find_first_of("()", close + 1);
      if (close == std::string::npos) return text;
      text[close] == '(' ? ++depth : --depth;
    }
    text.erase(open, close + 1 - open);
  }
  return text;
}

/// "akd" of "akd.pcapng.gz".
std::string WithoutEnding(const std::string& name) {
  for (const std::string_view ending : {".pcapng", ".pcap", ".cap"}) {
    const std::size_t at = name.rfind(ending);
    if (at != std::string::npos && at > 0) return name.substr(0, at);
  }
  return name;
}

Parts OfFinding(const CaptureDigest& capture, const MainFinding& main, const std::string& verdict,
                const TextStyle& style) {
  const FindingDigest& worst = capture.findings[main.worst];
  const FindingDigest& root = capture.findings[main.root];
  Parts parts;
  if (verdict != "FAIL") parts.before = std::string(Name(worst.severity)) + ": ";
  parts.place = OneLine(worst.place) + ": ";
  parts.short_place = worst.slave ? "slave " + std::to_string(*worst.slave) + ": " : parts.place;
  parts.what = OneLine(worst.title);
  if (worst.frame != 0) {
    const std::string frame = std::to_string(worst.frame);
    const std::string moment = MomentOf(capture, worst, style);
    parts.when = " (frame " + frame + (moment.empty() ? "" : " at ") + moment + ")";
    parts.short_when = " (#" + frame + (moment.empty() ? "" : ", ") + moment + ")";
  }
  if (main.root != main.worst) parts.cause = ", because: " + OneLine(root.title);
  return parts;
}

Parts PartsOf(const CaptureDigest& capture, const HeadlineParts& headline, const TextStyle& style) {
  if (headline.verdict == "UNMET") return {"", "", "", "required and missing: " + Joined(capture.unmet), "", "", ""};
  const bool shows_no_findings =
      !capture.unreadable.empty() || capture.without_ethercat || !capture.judged || headline.verdict == "ERROR";
  const std::optional<MainFinding> main = shows_no_findings ? std::nullopt : MainFindingOf(capture);
  if (main) return OfFinding(capture, *main, headline.verdict, style);
  return {"", "", "", headline.sentence, "", "", ""};
}

Style StyleOf(const std::string& verdict) {
  if (verdict == "PASS") return Style::kGood;
  if (verdict == "NOT-JUDGED") return Style::kPlain;
  return verdict == "LIMITED" || verdict == "NOTHING-TO-CHECK" ? Style::kWarning : Style::kError;
}

}  // namespace

VerdictLine VerdictLineOf(const CaptureDigest& capture, const TextStyle& style, bool whole_path) {
  const HeadlineParts headline = HeadlinePartsOf(capture);
  const Parts parts = PartsOf(capture, headline, style);
  const std::string path = OneLine(capture.path);
  const std::string name = whole_path ? path : path.substr(WrappingSum(path.rfind('/'), std::size_t{1}));
  const std::string stem = whole_path ? path : WithoutEnding(name);
  const std::string bare = WithoutBrackets(parts.what);
  const auto line = [&](const std::string& of, const std::string& place, const std::string& what,
                        const std::string& when) { return " " + of + ": " + parts.before + place + what + when; };
  if (whole_path && parts.place.empty()) {
    // A summary has no other line for it.
    return {headline.verdict, " " + path + ": " + headline.sentence, StyleOf(headline.verdict)};
  }
  const std::size_t room = kVerdictColumns - std::min(kVerdictColumns, Columns(headline.verdict));
  VerdictLine out{headline.verdict, {}, StyleOf(headline.verdict)};
  for (const std::string& candidate :
       {line(path, parts.place, parts.what + parts.cause, parts.when),
        line(name, parts.place, parts.what + parts.cause, parts.when), line(path, parts.place, parts.what, parts.when),
        line(name, parts.place, parts.what, parts.when), line(name, parts.place, parts.what, parts.short_when),
        line(name, parts.short_place, parts.what, parts.when),
        line(name, parts.short_place, parts.what, parts.short_when),
        line(stem, parts.short_place, parts.what, parts.short_when),
        line(stem, parts.short_place, bare, parts.short_when)}) {
    out.rest = candidate;
    if (Columns(candidate) <= room) return out;
  }
  const std::size_t taken = Columns(line(stem, parts.short_place, "", parts.short_when));
  const std::size_t least = std::min(kLeastSentence, room);
  if (taken + least <= room || whole_path) {
    const std::size_t left = std::max(least, room - std::min(taken, room));
    out.rest = line(stem, parts.short_place, CutToColumns(bare, left), parts.short_when);
    return out;
  }
  // A name that leaves no room for the verdict.
  const std::size_t shown = Columns(stem) - std::min(Columns(stem), taken + least - room);
  out.rest = line(CutToColumns(stem, shown), parts.short_place, CutToColumns(bare, least), parts.short_when);
  return out;
}

std::vector<std::string> VerdictNotes(const CaptureDigest& capture) {
  std::vector<std::string> notes;
  if (!capture.unmet.empty()) notes.push_back("required and missing: " + Joined(capture.unmet));
  if (!capture.limited.empty() && !capture.without_ethercat) notes.push_back("not evaluated: " + OneLine(capture.limited));
  if (const std::string selected = Text(capture.selection); !selected.empty()) {
    notes.push_back("limited by " + OneLine(selected));
  }
  if (!capture.complete && capture.unreadable.empty()) notes.push_back("complete only as far as the capture was read");
  return notes;
}

}  // namespace ecaudit::report
