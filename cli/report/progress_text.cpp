#include "cli/report/progress_text.h"

#include <algorithm>
#include <utility>

#include "cli/report/finding_id.h"
#include "cli/report/times.h"
#include "decoder/base/text.h"

namespace ecaudit::report {
namespace {

/// How much a line shows of what holds a rung.
enum class Detail : std::uint8_t { kWhy, kFinding, kFrames };

/// ", since #807 at 1.201 s"; empty where no frame shows it.
std::string Since(const AnalysisResult& result, const FrameRef& frame) {
  if (!frame.seen()) return {};
  std::string text = ", since #" + std::to_string(frame.number);
  if (const auto seconds = SecondsSince(result.capture.origin, frame)) text += " at " + Fixed(*seconds, 3) + " s";
  return text;
}

/// " (f1)"
std::string FindingText(const AnalysisResult& result, const Rung& rung, Detail detail) {
  const bool named = detail != Detail::kWhy && rung.held_by != kNoFinding;
  return named ? " (" + FindingId(result, rung.held_by) + ")" : std::string();
}

/// "not enabled: a bit that Enable operation needs is 0 in the control word, since #807 at 1.201 s (f1)"
std::string Failed(const AnalysisResult& result, const Rung& rung, std::string_view name, Detail detail) {
  std::string text = (rung.status == RungStatus::kLost ? "no longer " : "not ") + std::string(name);
  if (rung.why != nullptr) text += ": " + std::string(rung.why->text);
  if (detail == Detail::kFrames) {
    text += Since(result, rung.status == RungStatus::kLost && rung.until.seen() ? rung.until : rung.held_since);
  }
  return text + FindingText(result, rung, detail);
}

bool Fails(const Rung* rung) {
  return rung != nullptr && (rung->status == RungStatus::kNotReached || rung->status == RungStatus::kLost);
}

bool Holds(const Rung* rung) {
  return rung != nullptr && rung->status == RungStatus::kReached && !rung->until.seen();
}

void Append(std::string& text, std::string_view part, std::string_view between = ", ") {
  if (!text.empty()) text += between;
  text += part;
}

std::string SlaveText(const AnalysisResult& result, const SlaveSummary& slave, Detail detail) {
  std::string text;
  const Rung* state = nullptr;
  for (const std::string_view code : {"preop", "safeop", "op"}) {
    const Rung* const rung = slave.progress.Find(code);
    if (Holds(rung)) state = rung;
  }
  const Rung* const answers = slave.progress.Find("answers");
  if (Fails(answers)) {
    // Nothing above it shows more.
    text = "gone: " + std::string(answers->why->text);
    if (detail == Detail::kFrames) text += Since(result, answers->until);
    return text + FindingText(result, *answers, detail);
  }
  if (state != nullptr) {
    text = state->rung->text;
    if (detail == Detail::kFrames) text += Since(result, state->since);
  } else {
    text = slave.al_status ? "INIT" : "AL state not in the capture";
  }
  if (Holds(slave.progress.Find("sync"))) text += ", in sync";
  const Rung* const op = slave.progress.Find("op");
  if (op->status == RungStatus::kReached && op->until.seen()) text += "; in OP before, taken down by the master";
  const Rung* const failed = slave.progress.Failed();
  if (failed == nullptr) return text;
  const std::string_view code = failed->rung->code;
  std::string_view name = failed->rung->text;
  if (code == "configured") name = "fully configured";
  if (code == "mailbox") name = "answering its mailbox";
  if (code == "exchange") name = "exchanging process data";
  Append(text, Failed(result, *failed, name, detail), "; ");
  return text;
}

struct AxisWords {
  std::string text;
  bool is_sentence = false;  ///< it has a subject of its own; else the axis is the subject
};

AxisWords AxisText(const AnalysisResult& result, const Ladder& ladder, Detail detail) {
  const auto rung = [&ladder](std::string_view code) { return ladder.Find(code); };
  std::string text;
  if (Holds(rung("enabled"))) {
    text = "enabled";
    if (Holds(rung("follows"))) {
      text += ", follows its set point";
    } else if (Holds(rung("commanded"))) {
      text += ", commanded";
    } else if (rung("commanded")->status == RungStatus::kNotAsked) {
      text += ", not commanded";
    }
    if (detail == Detail::kFrames) text += Since(result, rung("enabled")->since);
  }
  // What the axis stands for shows more than the rung below that shows it first.
  for (const std::string_view code : {"enabled", "no-fault", "voltage", "mode", "commanded", "follows"}) {
    const Rung* const at = rung(code);
    if (!Fails(at)) continue;
    std::string_view name = at->rung->text;
    if (code == "no-fault") {
      Append(text, "in Fault", "; ");
      if (detail == Detail::kFrames) text += Since(result, at->until);
      text += FindingText(result, *at, detail);
      break;
    }
    if (code == "mode") name = "in the mode that was selected";
    if (code == "follows") name = "following its set point";
    Append(text, Failed(result, *at, name, detail), "; ");
    break;
  }
  if (!text.empty()) return {std::move(text)};
  const Rung* const enabled = rung("enabled");
  if (enabled->status == RungStatus::kUnknown) {
    return {enabled->why != nullptr ? std::string(enabled->why->text) : "the state is not in the capture", true};
  }
  if (enabled->status == RungStatus::kReached) return {"enabled before, switched off by the master"};
  return {"not enabled; the master does not ask for it"};
}

/// All lines of one slave.
std::vector<ProgressLine> LinesOf(const AnalysisResult& result, const SlaveSummary& slave, Detail detail) {
  std::vector<ProgressLine> lines;
  ProgressLine line;
  line.text = SlaveText(result, slave, detail);
  if (Fails(slave.progress.Find("answers"))) {
    lines.push_back(std::move(line));
    return lines;
  }
  if (slave.axes.size() == 1 && slave.axes.front().axis == 0) {
    const AxisWords axis = AxisText(result, slave.axes.front().ladder, detail);
    Append(line.text, axis.text, axis.is_sentence ? "; drive: " : "; drive ");
  }
  lines.push_back(std::move(line));
  if (slave.axes.size() == 1 && slave.axes.front().axis == 0) return lines;
  for (const AxisLadder& axis : slave.axes) {
    ProgressLine of_axis;
    of_axis.of_axis = true;
    of_axis.label = "axis " + std::to_string(axis.axis + 1);
    of_axis.text = AxisText(result, axis.ladder, detail).text;
    lines.push_back(std::move(of_axis));
  }
  return lines;
}

bool Alike(const std::vector<ProgressLine>& a, const std::vector<ProgressLine>& b) {
  return std::ranges::equal(
      a, b, [](const ProgressLine& x, const ProgressLine& y) { return x.label == y.label && x.text == y.text; });
}

}  // namespace

std::vector<ProgressLine> ProgressLines(const AnalysisResult& result) {
  std::vector<ProgressLine> lines;
  const std::vector<SlaveSummary>& slaves = result.slaves;
  for (std::size_t i = 0; i < slaves.size();) {
    if (slaves[i].progress.empty()) {
      ++i;
      continue;
    }
    const std::vector<ProgressLine> plain = LinesOf(result, slaves[i], Detail::kWhy);
    std::size_t end = i + 1;
    while (end < slaves.size() && Alike(plain, LinesOf(result, slaves[end], Detail::kWhy))) ++end;
    std::vector<ProgressLine> group = LinesOf(result, slaves[i], end - i == 1 ? Detail::kFrames : Detail::kFinding);
    for (std::size_t other = i + 1; other < end; ++other) {
      if (!Alike(group, LinesOf(result, slaves[other], Detail::kFinding))) group = plain;
    }
    group.front().label = end - i == 1 ? result.slave_names.Of(slaves[i].position)
                                       : result.slave_names.Span(slaves[i].position, slaves[end - 1].position);
    lines.insert(lines.end(), group.begin(), group.end());
    i = end;
  }
  return lines;
}

void WriteProgress(const AnalysisResult& result, TextBuilder& text) {
  constexpr std::size_t kMostLines = 16;
  const std::vector<ProgressLine> lines = ProgressLines(result);
  if (lines.empty()) return;
  text.Line();
  text.Line(text.Styled("Progress", Style::kBold));
  for (std::size_t i = 0; i < lines.size() && i < kMostLines; ++i) {
    text.Field(lines[i].label, lines[i].text, lines[i].of_axis ? 4 : 2);
  }
  if (lines.size() > kMostLines) {
    text.Paragraph("[" + std::to_string(lines.size() - kMostLines) + " more lines; see Slaves, or the JSON report]", 2);
  }
}

}  // namespace ecaudit::report
