#include "cli/report/startup_text.h"

#include <algorithm>
#include <span>

#include "analyzers/result/further_startups.h"
#include "cli/report/esi_text.h"
#include "cli/report/layout.h"
#include "cli/report/progress_text.h"
#include "decoder/base/text.h"
#include "decoder/esc/al.h"

namespace ecaudit::report {
namespace {

constexpr std::size_t kTitleColumn = 20;
constexpr std::size_t kFrameColumn = 9;
constexpr std::size_t kStepIndent = 5;
constexpr std::size_t kHanging = kStepIndent + kFrameColumn;
/// Values longer than this are cut; the JSON has them whole.
constexpr std::size_t kLongestValue = 160;

std::string FrameText(const FrameRef& frame) {
  return frame.seen() ? "#" + std::to_string(frame.number) : "-";
}

/// Writes the start-ups of one capture.
class CaptureStartup {
 public:
  CaptureStartup(const CaptureReport& capture, TextBuilder& text) : result_(capture.result), text_(text) {}

  void Write() {
    const StartupSummary& bus = result_.bus.startup;
    if (bus.seen && !bus.steps.empty()) {
      text_.Line();
      text_.Line(text_.Styled("All slaves at once", Style::kBold) + WhenText(bus));
      Steps(bus, std::nullopt);
    }
    if (result_.slaves.empty()) {
      text_.Line();
      text_.Line("No slave is addressed in this capture: it holds no start-up.");
    }
    for (std::size_t i = 0; i < result_.slaves.size();) {
      std::size_t end = i + 1;
      while (end < result_.slaves.size() && Alike(result_.slaves[i], result_.slaves[end])) ++end;
      if (end - i < 3) end = i + 1;
      Slave(result_.slaves[i]);
      if (end - i > 1) {
        const std::string same =
            result_.slave_names.Span(result_.slaves[i + 1].position, result_.slaves[end - 1].position);
        text_.Line();
        text_.Paragraph("S" + same.substr(1) +
                            ": the same device and the same steps with the same values (addresses and times apart); "
                            "--slave shows one of them",
                        0, 2);
      }
      i = end;
    }
  }

 private:
  /// Devices of one kind that were started alike: process data lie elsewhere, the rest is equal.
  [[nodiscard]] static bool Alike(const SlaveSummary& a, const SlaveSummary& b) {
    const auto same = [](const StartupStep& x, const StartupStep& y) {
      const bool fmmu = x.key.kind == StartupKey::Kind::kWrite && x.key.address >= 0x0600 && x.key.address < 0x0700;
      return x.key == y.key && x.phase == y.phase && x.outcome == y.outcome && x.code == y.code &&
             (x.volatile_value || fmmu || x.data == y.data);
    };
    return a.identity.vendor_id == b.identity.vendor_id && a.identity.product_code == b.identity.product_code &&
           a.identity.revision == b.identity.revision && a.startup.seen && a.startup.reached == b.startup.reached &&
           a.startup.steps_left_out == b.startup.steps_left_out &&
           std::ranges::equal(a.startup.steps, b.startup.steps, same);
  }

  [[nodiscard]] static std::string WhenText(const StartupSummary& startup) {
    if (startup.phases.empty()) return "";
    const FrameRef& first = startup.phases.front().first;
    std::string text = " (frames " + std::to_string(first.number) + " to " + std::to_string(startup.end.number);
    if (first.has_time && startup.end.has_time) text += ", " + Duration(startup.end.time - first.time);
    return text + ")";
  }

  void Slave(const SlaveSummary& slave) {
    Phases(slave);
    WriteEsiDemands(std::span(&slave, 1), result_.slave_names, text_);
  }

  void Phases(const SlaveSummary& slave) {
    const StartupSummary& startup = slave.startup;
    text_.Line();
    std::string head = ": ";
    if (!startup.seen) {
      text_.Line(text_.Styled(SlaveLabel(result_, slave.id), Style::kBold) + ": no start-up in this capture" +
                 (startup.first_state ? ", in " + esc::StateName(*startup.first_state) + " when it begins" : ""));
      return;
    }
    head += startup.reached == 0 ? "state not seen" : esc::StateName(startup.reached) + " reached";
    const auto failed = std::ranges::find_if(startup.phases, &StartupPhaseSummary::failed);
    if (failed != startup.phases.end()) head += ", " + failed->result;
    text_.Line(text_.Styled(SlaveLabel(result_, slave.id), Style::kBold) + head + WhenText(startup));
    if (startup.again > 0) {
      text_.Paragraph("The master starts it " + Count(startup.again, "time") + " more, from frame " +
                          std::to_string(startup.again_frame.number) + " on; shown is the attempt that came furthest.",
                      2);
    }
    for (const StartupPhaseSummary& phase : startup.phases) {
      std::string line = Padded(Title(phase.phase), kTitleColumn);
      line += Padded(FrameText(phase.first), kFrameColumn);
      std::string rest = phase.duration ? Duration(*phase.duration) : "";
      if (!phase.result.empty()) rest += (rest.empty() ? "" : ", ") + phase.result;
      std::ranges::replace(line, kHardSpace, ' ');
      text_.Line(phase.failed ? line + text_.Styled(rest, Style::kError) : line + rest, 2);
      Steps(startup, phase.phase);
    }
    if (startup.steps_left_out > 0) {
      text_.Line(Count(startup.steps_left_out, "further step") + " not shown", kStepIndent);
    }
  }

  void Steps(const StartupSummary& startup, std::optional<StartupPhase> phase) {
    for (const StartupStep& step : startup.steps) {
      if (phase && step.phase != *phase) continue;
      const bool failed = step.outcome == StartupOutcome::kRefused || step.outcome == StartupOutcome::kUnanswered;
      const bool marked = failed && !step.broadcast;
      std::string line = Padded(FrameText(step.frame), kFrameColumn) + StepLine(step);
      if (marked && line.size() + kStepIndent < text_.width()) {
        std::ranges::replace(line, kHardSpace, ' ');
        text_.Line(text_.Styled(line, step.key.kind == StartupKey::Kind::kWrite ? Style::kWarning : Style::kError),
                   kStepIndent);
      } else {
        text_.Paragraph(line, kStepIndent, kHanging);
      }
    }
  }

  const AnalysisResult& result_;
  TextBuilder& text_;
};

/// What the verdict rests on, and what else there is to see.
std::string Compared(const CaptureReport& capture, const TextStyle& style) {
  TextBuilder text(style);
  std::uint64_t steps = 0;
  for (const SlaveSummary& slave : capture.result.slaves) steps += slave.startup.steps.size();
  text.Line();
  text.Paragraph("Compared with " + OneLine(capture.expectation) + ": " + Count(steps, "step") + " of " +
                     Count(capture.result.slaves.size(), "slave") +
                     " in this capture. Without --expect, ecaudit startup shows them all.",
                 0);
  WriteEsiDemands(capture.result.slaves, capture.result.slave_names, text);
  if (const FrameNo next = startup::NextStartup(capture.result); next != 0) {
    text.Paragraph("The master starts slaves again from frame " + std::to_string(next) +
                       " on. Compared is the start-up before it; --from '#" + std::to_string(next) +
                       "' compares that one.",
                   0);
  }
  if (capture.other_errors + capture.other_warnings > 0) {
    text.Paragraph("Apart from the expectation, ecaudit check finds " + Count(capture.other_errors, "error") + " and " +
                       Count(capture.other_warnings, "warning") + " in this capture.",
                   0);
  }
  return text.Take();
}

}  // namespace

std::string StepLine(const StartupStep& step) {
  std::string line;
  switch (step.key.kind) {
    case StartupKey::Kind::kWrite:
      line = step.text.empty() ? step.name : step.text;
      break;
    case StartupKey::Kind::kDownload:
      line = step.name + (step.text.empty() ? "" : " = " + step.text);
      break;
    case StartupKey::Kind::kUpload:
      line = "read " + step.name + (step.text.empty() ? "" : ": " + step.text);
      break;
    case StartupKey::Kind::kEeprom:
      line = step.name + " = " + step.text;
      break;
    case StartupKey::Kind::kRequest:
      line = step.name;
      break;
    case StartupKey::Kind::kDrive:
      line = step.name + " (" + step.text + ")";
      break;
  }
  line = Shortened(OneLine(line), kLongestValue);
  if (step.count > 1) line += " (" + Count(step.count, "time") + ")";
  if (!step.note.empty()) line += ": " + OneLine(step.note);
  if (!step.read_text.empty()) {
    line += "; read back in #" + std::to_string(step.read_back_frame.number) + ": " +
            Shortened(OneLine(step.read_text), kLongestValue);
  } else if (step.read_back_frame.seen()) {
    line += "; read back the same in #" + std::to_string(step.read_back_frame.number);
  }
  return line;
}

std::string WriteStartupText(const Report& report, const TextStyle& style) {
  std::string out;
  for (std::size_t i = 0; i < report.captures.size(); ++i) {
    const CaptureReport& capture = report.captures[i];
    TextBuilder text(style);
    if (i > 0) text.Line();
    if (!capture.expectation.empty()) {
      out += WriteVerdict(capture, style);
      out += (style.quiet ? std::string() : Compared(capture, style));
      continue;
    }
    text.Line(text.Styled(OneLine(capture.result.capture.file.path), Style::kBold));
    if (const std::string limits = LimitsText(capture.selection); !limits.empty()) {
      text.Paragraph("limited by " + OneLine(limits), 0);
    }
    if (!capture.result.capture.complete) text.Paragraph("incomplete: only a part of the capture was read", 0);
    if (const FrameNo next = startup::NextStartup(capture.result); next != 0) {
      text.Paragraph("The master starts slaves again from frame " + std::to_string(next) +
                         " on. Shown is the start-up before it; --from '#" + std::to_string(next) + "' shows that one.",
                     0);
    }
    WriteProgress(capture.result, text);
    CaptureStartup(capture, text).Write();
    out += text.Take();
  }
  return out + UnreadableText(report, style);
}

}  // namespace ecaudit::report
