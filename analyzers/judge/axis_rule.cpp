#include "analyzers/judge/axis_rule.h"

#include "analyzers/judge/axis_lead.h"
#include "analyzers/judge/drive_knowledge.h"
#include "analyzers/judge/padded_struct.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/model/terminal_objects.h"
#include "analyzers/objects/relatives.h"
#include "analyzers/progress/progress_model.h"
#include "analyzers/words/drive_text.h"

namespace ecaudit {

AxisRule::AxisRule(const RuleInfo& info, std::span<const Row> rows) : Rule(info), rows_(rows) {
  Subscribe<model::DriveFaultExplained>(&AxisRule::On);
}

void AxisRule::On(const model::DriveFaultExplained& e) {
  explained_.insert_or_assign({e.slave, e.axis}, e);
}

std::optional<Reason> AxisRule::Unevaluated(const progress::AxisWatch&) const {
  return std::nullopt;
}

void AxisRule::Finish() {
  context().progress().ForEachAxis([&](SlaveId slave, std::uint8_t number, const progress::AxisWatch& axis) {
    slave_ = slave;
    axis_ = number;
    bool reported = false;
    for (const progress::AxisRecord& record : axis.records()) {
      for (const Row& row : rows_) {
        if (row.fact != record.fact) continue;
        ReportOf(slave, number, axis, record, KindOf(record, *row.kind));
        reported = true;
      }
    }
    if (reported) return;
    if (auto reason = Unevaluated(axis)) NotEvaluable(slave, std::move(*reason));
  });
  NotEvaluableFor([](const model::SlaveModel& slave) { return DriveWordsMissing(slave, true); });
}

void AxisRule::ReportOf(SlaveId slave, std::uint8_t number, const progress::AxisWatch& axis,
                        const progress::AxisRecord& record, const FindingKind& kind) {
  const device::DeviceDescription& family = *context().slave(slave).profile;
  Finding finding = Found(kind, slave, record.since.seen() ? record.since : record.frame);
  finding.last = record.last;
  finding.count = record.count;
  finding.confidence = record.inferred ? Confidence::kInferred : Confidence::kObserved;
  finding.Set("shown_frame", arg::Frame(record.frame.number));
  if (record.frame.number != finding.first.number) AddRelated(finding, record.frame.number);
  if (record.lasted > 0) finding.Set("lasted_ms", arg::Ms(record.lasted));
  if (record.control) finding.Set("control_word", arg::Hex(*record.control));
  if (record.status) finding.Set("status_word", arg::Hex(*record.status));
  if (record.state) finding.Set("state", arg::Text(StateText(record.state)));
  if (record.mode) finding.Set("mode", ModeOf(*record.mode));
  if (record.limited) finding.Set("limited", arg::Flag());
  if (record.fault) finding.Set("fault", arg::Flag());
  SetFault(finding, slave, number, axis);
  Describe(finding, record, axis);
  AddLead(finding, record.lead, family, number);
  if (const std::uint32_t word = model::TerminalObjects::ControlWordOf(context().slave(slave), number); word != 0) {
    finding.Set("control_object", arg::Object(static_cast<std::uint16_t>(word >> 8U), static_cast<int>(word & 0xFFU)));
  }
  if (family.drive) finding.reference = ReferenceTo(family.drive->source);
  NameAxis(finding, number);
  const std::uint64_t key =
      AxisKey(number) | static_cast<std::uint64_t>(record.fact) << 8U | static_cast<std::uint64_t>(record.quantity);
  if (record.healthy || record.solved) {
    (void)Report(key, Severity::kInfo, std::move(finding));
  } else {
    (void)Report(key, std::move(finding));
  }
}

/// What the drive itself shows of its fault, from whichever source the capture has.
void AxisRule::SetFault(Finding& finding, SlaveId slave, std::uint8_t number, const progress::AxisWatch& axis) const {
  const device::DeviceDescription& family = *context().slave(slave).profile;
  if (const auto found = explained_.find({slave, number}); found != explained_.end()) {
    finding.Set("reason", arg::Text(FaultText(family, found->second)));
  } else if (axis.error_code().value_or(0) != 0) {
    model::DriveFaultExplained code;
    code.source = model::DriveFaultExplained::Source::kErrorCode;
    code.code = *axis.error_code();
    finding.Set("reason", arg::Text(FaultText(family, code)));
  }
}

Value AxisRule::ObjectOf(std::int64_t index) const {
  const auto object = model::ObjectOfAxis(static_cast<std::uint16_t>(index), axis_);
  return arg::Object(object, progress::SubindexOf(static_cast<std::uint16_t>(index)));
}

std::uint32_t AxisRule::PaddingBefore(std::uint16_t index) const {
  const model::ProcessLayout& outputs = context().slave(slave_).process.rx();
  const model::Signal* const signal = outputs.Find(model::ObjectOfAxis(index, axis_), 0);
  if (signal == nullptr) return 0;
  const auto padded = PaddedStruct::Of(outputs, signal->sync_manager);
  return padded ? padded->PaddingBefore(signal->bit_offset) : 0;
}

std::string AxisRule::UnitOf(std::uint16_t index) const {
  const model::Signal* const signal = context().slave(slave_).process.tx().Find(model::ObjectOfAxis(index, axis_), 0);
  return signal != nullptr ? signal->unit : std::string();
}

Value AxisRule::ModeOf(std::int64_t mode) const {
  const device::DeviceDescription& family = *context().slave(slave_).profile;
  const auto value = static_cast<std::int8_t>(mode);
  return arg::Text(family.drive ? ModeText(*family.drive, value) : std::to_string(value));
}

}  // namespace ecaudit
