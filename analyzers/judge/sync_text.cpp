#include "analyzers/judge/sync_text.h"

#include <cmath>

#include "analyzers/judge/rule_context.h"
#include "analyzers/model/drive_parameters.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/progress/progress_model.h"
#include "analyzers/sync/sync_model.h"

namespace ecaudit {

const Word& WordOf(sync::TimeBase base) {
  static constexpr Word kDc{"dc", "the DC time in the frames"};
  static constexpr Word kProbe{"esl", "the stamps of the probe", true};
  static constexpr Word kCapture{"capture", "the stamps of the capture", true};
  static constexpr Word kNone{"none", "no clock"};
  switch (base) {
    case sync::TimeBase::kDc:
      return kDc;
    case sync::TimeBase::kEsl:
      return kProbe;
    case sync::TimeBase::kCapture:
      return kCapture;
    case sync::TimeBase::kNone:
      break;
  }
  return kNone;
}

const Word* WordOf(sync::OutputGap::End end) {
  static constexpr Word kLeftOp{"left-op", "the slave is seen to have left OP"};
  static constexpr Word kRequest{"request", "the master requests another state"};
  static constexpr Word kCapture{"capture-end", "the capture ends"};
  switch (end) {
    case sync::OutputGap::End::kFell:
      return &kLeftOp;
    case sync::OutputGap::End::kRequest:
      return &kRequest;
    case sync::OutputGap::End::kCapture:
      return &kCapture;
    case sync::OutputGap::End::kOutputs:
      break;
  }
  return nullptr;
}

std::optional<TimeNs> DriveCycle(const model::SlaveModel& slave) {
  const device::SyncDescription& family = slave.profile->sync;
  const auto count = model::ValueOf(slave, family.cycle_count);
  if (!count || !family.cycle_base.value || count->value <= 0 || count->value > 1'000'000) return std::nullopt;
  return count->value * *family.cycle_base;
}

bool NeedsOneFrameACycle(const model::SlaveModel& slave) {
  return !slave.profile->sync.source_with_dc.empty();
}

double CycleDeviation(const model::SlaveModel& slave, double measured_ns, TimeNs configured_ns) {
  const double ratio = measured_ns / static_cast<double>(configured_ns);
  const double nearest = NeedsOneFrameACycle(slave) ? 1.0
                         : ratio >= 1               ? std::round(ratio)
                                                    : 1.0 / std::round(1.0 / ratio);
  return std::abs(ratio / nearest - 1);
}

std::optional<std::int8_t> ModeWithoutSync0(const RuleContext& context, SlaveId slave) {
  const auto& activation = context.sync().dc(slave).activation();
  const progress::AxisWatch* const axis = context.progress().axis(slave, 0);
  if (!activation || activation->sync0() || axis == nullptr) return std::nullopt;
  const auto mode = axis->now().mode_asked();
  return mode.value_or(0) >= progress::kInterpolated ? mode : std::nullopt;
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
