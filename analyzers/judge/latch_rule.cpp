#include "analyzers/judge/latch_rule.h"

#include <algorithm>
#include <iterator>

#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/what.h"

namespace ecaudit {
namespace {

constexpr Word kValidBitStart{"valid-bit-start", "the frame in which the valid bit was set"};
constexpr Word kValidBit{"valid-bit", "the valid bit of the latch"};
constexpr Word kInputMapping{"input-mapping", "the mapping of the inputs"};
constexpr Word kOutputMapping{"output-mapping", "the mapping of the outputs"};
constexpr Word kEdgeOfPosition{"edge-of-position", "the edge of the position that was read"};
constexpr Word kPositionObject{"position-object", "the object with the position of this edge"};
constexpr Word kWaitForReading{"wait-for-reading", "the wait for a read of the position (1 s)"};
constexpr Word kControlWordAccepted{"control-word-acceptance", "the acceptance of a control word"};
constexpr Word kControlWord{"latch-control-word", "the latch control word"};
constexpr Word kStatusWordBefore{"status-word-before", "the latch status word before the selector"};
constexpr Word kInputsBefore{"inputs-before", "the inputs just before the selector", true};

using Why = model::LatchNotEvaluable::Why;

/// The reason for each of them, and what it is about; null: nothing in particular.
struct WhyRow {
  Why why;
  ReasonCode code;
  const Word* what;
};
constexpr WhyRow kReasons[] = {
    {Why::kValidFromStart, ReasonCode::kNotInCapture, &kValidBitStart},
    {Why::kValidStayed, ReasonCode::kAmbiguous, &kValidBit},
    {Why::kInputsUnknown, ReasonCode::kNotInCapture, &kInputMapping},
    {Why::kEdgeUndocumented, ReasonCode::kNotInProfile, &kEdgeOfPosition},
    {Why::kPositionUndocumented, ReasonCode::kNotInProfile, &kPositionObject},
    {Why::kEndsWhileUnread, ReasonCode::kCaptureEnds, &kWaitForReading},
    {Why::kEnableBitUncertain, ReasonCode::kNotInCapture, &kControlWordAccepted},
    {Why::kStatusWordMissing, ReasonCode::kNotInCapture, &kStatusWordBefore},
    {Why::kInputsMissing, ReasonCode::kNotInCapture, &kInputsBefore},
    {Why::kNoTimeStamps, ReasonCode::kNoStamps, nullptr},
    {Why::kGap, ReasonCode::kCaptureGap, &kControlWord},
    {Why::kAlStateUnknown, ReasonCode::kNotInCapture, &what::kAlState},
};

Reason ReasonOf(Why why) {
  const auto* row = std::ranges::find(kReasons, why, &WhyRow::why);
  if (row == std::end(kReasons)) return Reason::Of(ReasonCode::kNotInCapture, what::kHistory);
  return row->what == nullptr ? Reason::Of(row->code) : Reason::Of(row->code, *row->what);
}

}  // namespace

void LatchRule::SetCapture(Finding& finding, const model::LatchMisuse& misuse) {
  if (misuse.edge != nullptr) finding.Set("edge", arg::Text(misuse.edge->name));
  finding.Set("by_sdo", arg::Flag(misuse.by_sdo));
  if (misuse.capture.armed.seen()) finding.Set("armed_frame", arg::Frame(misuse.capture.armed.number));
  if (misuse.capture.valid.seen()) finding.Set("valid_frame", arg::Frame(misuse.capture.valid.number));
}

void LatchRule::On(const model::LatchMisuse& misuse) {
  if (misuse.kind != kind_) return;
  const std::uint64_t key = KeyOf(misuse);
  FindingIndex index = Repeat(misuse.slave, key, misuse.frame);
  if (index == kNoFinding) {
    Finding finding = Describe(misuse);
    if (misuse.inferred) finding.confidence = Confidence::kInferred;
    finding.reference = ReferenceTo(context().slave(misuse.slave).profile->latch->source);
    finding.Set("control_word", arg::Hex(misuse.control));
    if (misuse.status) finding.Set("status_word", arg::Hex(*misuse.status));
    // The capture ends before the usual time is over: a later upload cannot be excluded.
    const bool early = misuse.kind == model::LatchMisuse::Kind::kNotMapped && misuse.waited_ns > 0;
    index = Report(key, early ? Severity::kWarning : info().severity, std::move(finding));
    if (index == kNoFinding) return;
  }
  for (const FrameNo frame : misuse.related) {
    if (frame != misuse.frame.number) AddRelated(context().store[index], frame);
  }
  std::vector<std::uint16_t>& words = words_[index];
  if (words.size() < kMaxWords && std::ranges::find(words, misuse.control) == words.end()) {
    words.push_back(misuse.control);
  }
}

void LatchRule::On(const model::LatchNotEvaluable& event) {
  if (event.kind == kind_) NotEvaluable(event.slave, ReasonOf(event.why), event.frame.number);
}

void LatchRule::Finish() {
  for (const auto& [index, words] : words_) {
    if (words.size() < 2) continue;
    std::vector<Value> values;
    for (const std::uint16_t word : words) values.push_back(arg::Hex(word));
    context().store[index].Add(kControlWords, {{"words", arg::List(std::move(values))}});
  }
  NotEvaluableWhere(
      [](const model::SlaveModel& slave) {
        return slave.latch.description() != nullptr && slave.latch.control_words() == 0 &&
               slave.outputs.exchanged > 0 && !slave.process.rx().known();
      },
      Reason::Of(ReasonCode::kNotInCapture, kOutputMapping));
}

}  // namespace ecaudit
