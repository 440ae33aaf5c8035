#include "analyzers/judge/sync_text.h"

#include "analyzers/judge/rule_context.h"
#include "analyzers/model/drive_parameters.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/text.h"

namespace ecaudit {

std::string_view BaseText(sync::TimeBase base) {
  switch (base) {
    case sync::TimeBase::kDc:
      return "by the DC time in the frames";
    case sync::TimeBase::kEsl:
      return "by the probe's stamps";
    case sync::TimeBase::kCapture:
      return "by the capture's stamps";
    case sync::TimeBase::kNone:
      break;
  }
  return "by no clock";
}

std::string PrecisionText(const sync::Interval& interval, TimeNs uncertainty) {
  return ", +-" + Duration(uncertainty) + " " + std::string(BaseText(interval.base));
}

std::optional<TimeNs> DriveCycle(const model::SlaveModel& slave) {
  const device::SyncDescription& family = slave.profile->sync;
  const auto count = model::ValueOf(slave, family.cycle_count);
  if (!count || !family.cycle_base.value || count->value <= 0 || count->value > 1'000'000) return std::nullopt;
  return count->value * *family.cycle_base;
}

void NameCause(RuleContext& context, std::string_view rule, SlaveId slave, FrameNo frame, FindingIndex cause) {
  if (cause == kNoFinding) return;
  for (Finding& finding : context.store.findings()) {
    if (finding.rule == rule && finding.slave == slave && finding.first.number == frame &&
        finding.caused_by == kNoFinding) {
      finding.caused_by = cause;
    }
  }
}

}  // namespace ecaudit
