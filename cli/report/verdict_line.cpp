#include "cli/report/verdict_line.h"

#include <algorithm>
#include <utility>

#include "cli/report/times.h"
#include "decoder/base/system/names.h"
#include "decoder/base/text.h"

namespace ecaudit::report {
namespace {

/// A sentence keeps at least this number of columns where a long name stands before it.
constexpr std::size_t kLeastSentence = 28;
/// Digits of a second: a reader searches for the moment by it.
constexpr std::size_t kDigits = 3;

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
  std::string what;         ///< the root cause
  std::string consequence;  ///< "; consequence: SAFEOP refused"
  std::string when;         ///< " (frame 760 at 0.759 s)"
  std::string short_when;   ///< " (#760, 0.759 s)"
  std::string frame;        ///< " (#760)"
  std::string tail = {};    ///< ", but the capture misses packets": never cut
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
  parts.place = OneLine(root.place) + ": ";
  parts.short_place = root.slave ? "slave " + capture.slave_names.Number(*root.slave) + ": " : parts.place;
  parts.what = OneLine(root.title);
  if (root.frame != 0) {
    const std::string frame = std::to_string(root.frame);
    const std::string moment = MomentOf(capture, root, style);
    parts.when = " (frame " + frame + (moment.empty() ? "" : " at ") + moment + ")";
    parts.short_when = " (#" + frame + (moment.empty() ? "" : ", ") + moment + ")";
    parts.frame = " (#" + frame + ")";
  }
  if (main.root != main.worst) parts.consequence = "; consequence: " + OneLine(worst.title);
  return parts;
}

Parts JustWhat(std::string what) {
  Parts parts;
  parts.what = std::move(what);
  return parts;
}

Parts PartsOf(const CaptureDigest& capture, const HeadlineParts& headline, const TextStyle& style) {
  if (headline.verdict == "UNMET") return JustWhat("required and missing: " + Joined(capture.unmet));
  const bool shows_no_findings =
      !capture.unreadable.empty() || capture.without_ethercat || !capture.judged || headline.verdict == "ERROR";
  const std::optional<MainFinding> main = shows_no_findings ? std::nullopt : MainFindingOf(capture);
  if (main) return OfFinding(capture, *main, headline.verdict, style);
  return JustWhat(headline.sentence);
}

/// What makes a PASS less than it seems stands where the line is not cut, like the frame of a finding.
void KeepReservation(const HeadlineParts& headline, Parts& parts) {
  if (headline.reservation.empty() || headline.verdict == "UNMET") return;
  std::string rest;
  if (const std::size_t at = parts.what.find(headline.reservation); at != std::string::npos) {
    rest = parts.what.substr(at + headline.reservation.size());
    parts.what.resize(at);
  }
  parts.when += headline.reservation + rest;
  // The frame leads to the time, so the time goes first.
  if (const std::size_t comma = parts.short_when.find(','); comma != std::string::npos) {
    parts.short_when = parts.short_when.substr(0, comma) + ")";
  }
  parts.short_when += headline.short_reservation;
  parts.frame += headline.short_reservation;
  parts.tail = headline.short_reservation;
}

Style StyleOf(const std::string& verdict) {
  if (verdict == "PASS") return Style::kGood;
  if (verdict == "NOT-JUDGED") return Style::kPlain;
  return verdict == "LIMITED" || verdict == "NOTHING-TO-CHECK" ? Style::kWarning : Style::kError;
}

}  // namespace

VerdictLine VerdictLineOf(const CaptureDigest& capture, const TextStyle& style, bool whole_path) {
  const HeadlineParts headline = HeadlinePartsOf(capture);
  Parts parts = PartsOf(capture, headline, style);
  KeepReservation(headline, parts);
  const std::string path = OneLine(capture.path);
  // Of files that are read as one, the folder of the last would go and the others stay.
  whole_path = whole_path || path.find(", ") != std::string::npos;
  const std::string name = whole_path ? path : std::string(system::NameOf(path));
  const std::string stem = whole_path ? path : WithoutEnding(name);
  const std::string bare = WithoutBrackets(parts.what);
  const auto line = [&](const std::string& of, const std::string& place, const std::string& what,
                        const std::string& when) {
    return (of.empty() ? " " : " " + of + ": ") + parts.before + place + what + when;
  };
  if (whole_path && parts.place.empty()) {
    // A summary has no other line for it.
    return {headline.verdict, " " + WithName(capture, headline.sentence), StyleOf(headline.verdict)};
  }
  const std::size_t room = style.verdict_width - std::min(style.verdict_width, Columns(headline.verdict));
  VerdictLine out{headline.verdict, {}, StyleOf(headline.verdict)};
  const std::string all = parts.what + parts.consequence;
  for (const std::string& candidate :
       {line(path, parts.place, all, parts.when), line(name, parts.place, all, parts.when),
        line(path, parts.place, parts.what, parts.when), line(name, parts.place, parts.what, parts.when),
        line(name, parts.place, parts.what, parts.short_when), line(name, parts.short_place, parts.what, parts.when),
        line(name, parts.short_place, parts.what, parts.short_when),
        line(stem, parts.short_place, parts.what, parts.short_when),
        line(stem, parts.short_place, parts.what, parts.frame)}) {
    out.rest = candidate;
    if (Columns(candidate) <= room) return out;
  }
  if (whole_path) return out;
  if (parts.place.empty()) {
    // No finding: which capture has none matters more than the end of the sentence.
    const std::size_t taken = Columns(line(stem, "", "", parts.tail));
    const std::size_t least = std::min(kLeastSentence, room);
    const std::size_t left = std::max(least, room - std::min(taken, room));
    const std::size_t shown = Columns(stem) - std::min(Columns(stem), taken + least - std::min(room, taken + least));
    out.rest =
        line(taken + least <= room ? stem : CutToColumns(stem, shown), "", CutToColumns(parts.what, left), parts.tail);
    return out;
  }
  // The cause stays whole: the reader knows which file it is, and the finding has its frame.
  for (const std::string& candidate :
       {line("", parts.short_place, parts.what, parts.short_when), line("", parts.short_place, parts.what, parts.frame),
        line("", parts.short_place, parts.what, parts.tail), line("", parts.short_place, bare, parts.frame)}) {
    out.rest = candidate;
    if (Columns(candidate) <= room) return out;
  }
  const std::size_t taken = Columns(line("", parts.short_place, "", parts.frame));
  out.rest = line("", parts.short_place, CutToColumns(bare, room - std::min(taken, room)), parts.frame);
  return out;
}

std::vector<std::string> VerdictNotes(const CaptureDigest& capture) {
  std::vector<std::string> notes;
  if (!capture.unmet.empty()) notes.push_back("required and missing: " + Joined(capture.unmet));
  if (!capture.limited.empty() && !capture.without_ethercat)
    notes.push_back("not evaluated: " + OneLine(capture.limited));
  if (const std::string selected = LimitsText(capture.selection); !selected.empty()) {
    notes.push_back("limited by " + OneLine(selected));
  }
  if (!capture.complete && capture.unreadable.empty()) notes.push_back("complete only as far as the capture was read");
  return notes;
}

}  // namespace ecaudit::report
