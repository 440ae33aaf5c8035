#include "analyzers/judge/latch_rule.h"

#include <algorithm>

#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/text.h"

namespace ecaudit {

std::string EdgeText(const model::LatchMisuse& misuse) {
  return misuse.edge == nullptr ? "the latch" : misuse.edge->name;
}

std::string FrameText(const model::LatchMisuse& misuse) {
  return (misuse.by_sdo ? "by SDO in frame " : "in frame ") + std::to_string(misuse.frame.number);
}

std::string CaptureText(const model::LatchCapture& capture) {
  std::string text;
  if (capture.armed.seen()) text += "armed in frame " + std::to_string(capture.armed.number);
  if (capture.valid.seen()) {
    text += (text.empty() ? "" : ", ") + std::string("valid since frame ") + std::to_string(capture.valid.number);
  }
  return text.empty() ? text : " (" + text + ")";
}

void LatchRule::On(const model::LatchMisuse& misuse) {
  if (misuse.kind != kind_) return;
  const std::uint64_t key = KeyOf(misuse);
  FindingIndex index = Repeat(misuse.slave, key, misuse.frame);
  if (index == kNoFinding) {
    Finding finding;
    finding.slave = misuse.slave;
    finding.first = misuse.frame;
    finding.confidence = misuse.inferred ? Confidence::kInferred : Confidence::kObserved;
    finding.reference = ReferenceTo(context().slave(misuse.slave).profile->latch->source);
    Describe(misuse, finding);
    finding.evidence.push_back(HexNumber("control_word", misuse.control));
    if (misuse.status) finding.evidence.push_back(HexNumber("status_word", *misuse.status));
    index = Report(key, std::move(finding));
    if (index == kNoFinding) return;
  }
  for (const FrameNo frame : misuse.related) {
    if (frame != misuse.frame.number) AddRelated(context().store[index], frame);
  }
  std::vector<std::uint16_t>& words = words_[index];
  if (words.size() < kMaxWords && std::find(words.begin(), words.end(), misuse.control) == words.end()) {
    words.push_back(misuse.control);
  }
}

void LatchRule::On(const model::LatchNotJudged& event) {
  if (event.kind == kind_) NotEvaluable(event.slave, std::string(event.reason), event.frame.number);
}

void LatchRule::Finish() {
  for (const auto& [index, words] : words_) {
    if (words.size() < 2) continue;
    std::string text;
    for (const std::uint16_t word : words) text += (text.empty() ? "" : ", ") + Hex(word);
    context().store[index].message += " Control words that did it: " + text + ".";
  }
  NotEvaluableWhere(
      [](const model::SlaveModel& slave) {
        return slave.latch.description() != nullptr && slave.latch.control_words() == 0 &&
               slave.outputs.exchanged > 0 && !slave.process.rx().known();
      },
      "what the outputs hold is not known: the latch control word may be among them");
}

}  // namespace ecaudit
