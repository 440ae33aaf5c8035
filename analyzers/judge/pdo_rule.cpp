#include "analyzers/judge/pdo_rule.h"

#include <algorithm>

#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "decoder/mailbox/events.h"
#include "decoder/mailbox/sdo.h"
#include "decoder/process/pdo_mapping.h"

namespace ecaudit {
namespace {

constexpr auto kPreop = static_cast<std::uint8_t>(esc::AlState::PREOP);
constexpr auto kSafeop = static_cast<std::uint8_t>(esc::AlState::SAFEOP);

Value OutcomeOfDownload(const mailbox::SdoTransfer& e) {
  static constexpr Word kAccepted{"accepted", "the slave accepts it"}, kAborted{"aborted", "the slave aborts it"},
      kNotCaptured{"not-captured", "the answer is not in the capture"};
  if (e.outcome == mailbox::SdoOutcome::kAborted) return arg::Of(kAborted);
  return arg::Of(e.outcome == mailbox::SdoOutcome::kNotCaptured ? kNotCaptured : kAccepted);
}

/// True for what only an inference names as a cause.
bool Suspected(const Finding& cause) {
  return cause.confidence == Confidence::kInferred && cause.rule.starts_with("pdo-");
}

/// A refusal that occurs again has the note already.
void AddOnce(Finding& refusal, const MappingSuspicions::Suspect& suspect) {
  const auto equal = [](const Arguments& a, const Arguments& b) {
    return std::ranges::equal(
        a, b, [](const Argument& x, const Argument& y) { return x.name == y.name && x.value == y.value; });
  };
  const bool has = std::ranges::any_of(refusal.notes, [&](const Note& note) {
    return note.kind == suspect.note && equal(note.arguments, suspect.arguments);
  });
  if (!has) refusal.Add(*suspect.note, suspect.arguments);
}

}  // namespace

Value PdoDirectionValue(device::PdoDirection direction) {
  static constexpr Word kRx{"Rx", "Rx"}, kTx{"Tx", "Tx"};
  return arg::Of(direction == device::PdoDirection::kRx ? kRx : kTx);
}

Value PdosValue(const std::vector<std::uint16_t>& pdos) {
  std::vector<Value> list;
  for (const std::uint16_t pdo : pdos) list.push_back(arg::Object(pdo));
  return arg::List(std::move(list));
}

device::PdoDirection DirectionOf(std::uint16_t pdo_object) {
  const bool rx = pdo_object == process::kRxAssignment || process::IsRxMapping(pdo_object);
  return rx ? device::PdoDirection::kRx : device::PdoDirection::kTx;
}

Value MappedValue(std::uint32_t mapping_entry, const device::DeviceDescription& family) {
  const auto entry = process::MappingEntry::FromValue(mapping_entry);
  return arg::Object(entry.index, entry.subindex, family.object_name(entry.index, entry.subindex));
}

PdoRule::PdoRule(const RuleInfo& info, WhenAccepted when_accepted) : Rule(info), when_accepted_(when_accepted) {
  Subscribe<mailbox::SdoTransfer>(&PdoRule::On);
  Subscribe<model::AlRequestJudged>(&PdoRule::On);
  Subscribe<model::AlAnswered>(&PdoRule::On);
}

void PdoRule::On(const mailbox::SdoTransfer& e) {
  using mailbox::SdoOutcome;
  if (e.service != mailbox::SdoService::kDownload || !e.has_object || !process::IsPdoObject(e.index)) return;
  if (e.data_gap || e.data.empty()) return;
  const bool shown = e.outcome == SdoOutcome::kCompleted || e.outcome == SdoOutcome::kNotCaptured ||
                     (e.outcome == SdoOutcome::kAborted && e.aborted_by == mailbox::Direction::kIn);
  if (!shown) return;
  std::vector<Write> writes;
  for (const process::PdoValue& value : process::PdoValuesOf(e)) {
    writes.push_back({e.index, value.subindex, value.value});
  }
  if (e.outcome != SdoOutcome::kAborted) {
    if (written_.size() < kMaxRemembered) written_.emplace(e.slave, e.index);
    // Written again: from the number 0 on, or as a whole.
    if (writes.front().subindex == 0 && (e.complete_access || writes.front().value == 0)) Forget(e.slave, e.index);
  }
  OnDownload(e, writes);
}

void PdoRule::Forget(SlaveId slave, std::uint16_t object) {
  const device::PdoDirection direction = DirectionOf(object);
  std::erase_if(active_, [&](const Active& s) {
    if (s.slave != slave || s.object != object) return false;
    if (context().MappingFault(slave, direction) == s.finding) context().BlameMapping(slave, direction, kNoFinding);
    return true;
  });
}

void PdoRule::ReportDownload(const mailbox::SdoTransfer& e, std::uint16_t object, std::uint64_t key, Finding finding) {
  const FrameRef& frame = FrameOf(e);
  FindingIndex index = Repeat(e.slave, key, frame);
  if (index == kNoFinding) {
    finding.confidence =
        e.outcome == mailbox::SdoOutcome::kNotCaptured ? Confidence::kInferred : ConfidenceOf(e.certainty);
    finding.Set("outcome", OutcomeOfDownload(e));
    if (e.outcome == mailbox::SdoOutcome::kAborted) {
      finding.Set("abort_code", arg::Code(e.abort_code, mailbox::AbortCodeText(e.abort_code), 8));
    }
    if (e.response.seen()) AddRelated(finding, e.response.number);
    index = Report(key, std::move(finding));
  }
  if (index == kNoFinding) return;
  if (active_.size() < kMaxRemembered) active_.push_back({e.slave, object, index});
  context().BlameMapping(e.slave, DirectionOf(object), index);
  if (e.outcome == mailbox::SdoOutcome::kAborted && aborted_.size() < kMaxRemembered) {
    aborted_.push_back({e.slave, e.last.seen() ? e.last.number : frame.number, index});
  }
}

void PdoRule::Predict(const model::AlRequestJudged& e, device::PdoDirection direction, FindingIndex finding) {
  context().BlameMapping(e.slave, direction, finding);
  predictions_.Add(context(), e.slave, e.request.frame.number, finding);
}

void PdoRule::On(const model::AlRequestJudged& e) {
  if (e.request.control.state() != kSafeop || e.request.from != kPreop) return;
  if (e.request.verdict != model::AlVerdict::kLegal) return;
  for (const Active& fault : active_) {
    if (fault.slave != e.slave) continue;
    if (!process::IsAssignment(fault.object)) {
      // A mapping that is not assigned has no effect.
      const auto& layout = context().slave(e.slave).process.Layout(DirectionOf(fault.object));
      const bool assigned = std::ranges::find(layout.pdos, fault.object) != layout.pdos.end();
      if (layout.source != model::LayoutSource::kUnknown && !assigned) continue;
    }
    if (when_accepted_ == WhenAccepted::kBecomesInfo) {
      predictions_.Add(context(), e.slave, e.request.frame.number, fault.finding);
    } else {
      context().ExplainRequest(e.slave, e.request.frame.number, fault.finding);
    }
  }
  OnSafeopRequest(e);
}

void PdoRule::On(const model::AlAnswered& e) {
  predictions_.On(context(), e);
}

void PdoRule::Finish() {
  for (const Aborted& abort : aborted_) {
    for (Finding& finding : context().store.findings()) {
      if (finding.rule == "sdo-abort" && finding.slave == abort.slave && finding.first.number <= abort.frame &&
          finding.last.number >= abort.frame && finding.caused_by == kNoFinding) {
        finding.caused_by = abort.cause;
      }
    }
  }
}

bool PdoRule::WrittenByMaster(SlaveId slave, device::PdoDirection direction,
                              const std::vector<std::uint16_t>& pdos) const {
  const bool rx = direction == device::PdoDirection::kRx;
  return written_.contains({slave, rx ? process::kRxAssignment : process::kTxAssignment}) ||
         std::ranges::any_of(pdos, [&](std::uint16_t pdo) {
           return written_.contains({slave, pdo});
         });
}

void MappingSuspicions::Add(SlaveId slave, const FrameRef& request, std::vector<Suspect> suspects) {
  open_.erase(slave);
  if (!suspects.empty()) open_[slave] = {request, std::move(suspects), 0, {}, kNoFinding};
}

std::optional<MappingSuspicions::Suspicion> MappingSuspicions::On(const RuleContext& context,
                                                                  const model::AlAnswered& e) {
  if (e.outcome != model::AlAnswered::Outcome::kRefused) {
    open_.erase(e.slave);
    return std::nullopt;
  }
  return e.code ? Confirm(context, e.slave, e.frame, *e.code) : std::nullopt;
}

std::optional<MappingSuspicions::Suspicion> MappingSuspicions::On(const RuleContext& context,
                                                                  const model::AlErrorCode& e) {
  return Confirm(context, e.slave, e.frame, e.code);
}

std::optional<MappingSuspicions::Suspicion> MappingSuspicions::Confirm(const RuleContext& context, SlaveId slave,
                                                                       const FrameRef& frame, std::uint16_t code) {
  const auto found = open_.find(slave);
  if (found == open_.end() || code == 0) return std::nullopt;
  Suspicion suspicion = std::move(found->second);
  open_.erase(found);
  using namespace esc;
  const bool outputs = code == al_code::kOutputs || code == al_code::kOutputMapping;
  const bool inputs = code == al_code::kInputs || code == al_code::kInputMapping;
  if (!outputs && !inputs && code != al_code::kSyncManagers) return std::nullopt;
  for (Suspect& suspect : suspicion.suspects) {
    suspect.by_code = suspect.direction == device::PdoDirection::kRx ? !inputs : !outputs;
  }
  suspicion.code = code;
  suspicion.shown = frame;
  const std::vector<Finding>& findings = context.store.findings();
  for (std::size_t end = findings.size(); end > 0 && suspicion.refusal == kNoFinding; --end) {
    const std::size_t i = end - 1;
    const Finding& f = findings[i];
    if (f.rule != "al-refused" || f.slave != slave) continue;
    const auto& related = f.related_frames;
    if (std::ranges::find(related, suspicion.request.number) == related.end()) continue;
    if (f.caused_by != kNoFinding && !Suspected(findings[f.caused_by])) return std::nullopt;
    suspicion.refusal = static_cast<FindingIndex>(i);
  }
  return suspicion;
}

void MappingSuspicions::Blame(RuleContext& context, const Suspicion& suspicion, FindingIndex cause) {
  if (suspicion.refusal == kNoFinding || cause == kNoFinding) return;
  Finding& refusal = context.store[suspicion.refusal];
  if (refusal.caused_by == kNoFinding) refusal.caused_by = cause;
  for (const Suspect& suspect : suspicion.suspects) {
    if (suspect.by_code) AddOnce(refusal, suspect);
  }
}

}  // namespace ecaudit
