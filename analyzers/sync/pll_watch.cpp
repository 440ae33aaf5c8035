#include "analyzers/sync/pll_watch.h"

#include "analyzers/model/drive_parameters.h"

namespace ecaudit::sync {

bool PllWatch::Concerns(const mailbox::SdoTransfer& transfer, const model::SlaveModel& slave) {
  if (transfer.service != mailbox::SdoService::kUpload || transfer.outcome != mailbox::SdoOutcome::kCompleted) {
    return false;
  }
  const auto& parameter = slave.profile->sync.sync_actual;
  return parameter && parameter->object && !transfer.complete_access && transfer.index == parameter->object->index &&
         transfer.subindex == parameter->object->subindex;
}

std::optional<PllMeasured> PllWatch::On(const mailbox::SdoTransfer& transfer, const model::SlaveModel& slave,
                                        bool evaluated, std::uint64_t frames_in_op) {
  const device::SyncDescription& family = slave.profile->sync;
  const auto actual = model::ValueOf(slave, family.sync_actual);
  if (!actual) return std::nullopt;
  ++reads_;
  if (!evaluated) return std::nullopt;
  PllMeasured e;
  e.slave = transfer.slave;
  e.frame = transfer.response;
  e.actual = actual->value;
  e.inferred = actual->certainty == Certainty::kInferred;
  if (const auto distance = model::ValueOf(slave, family.sync_distance)) e.distance = distance->value;
  if (const auto window = model::ValueOf(slave, family.sync_window)) e.window = window->value;
  if (const auto threshold = model::ValueOf(slave, family.pll_threshold)) e.threshold = threshold->value;
  // The PLL may still be pulling in.
  if (e.threshold && *e.threshold > 0 && frames_in_op <= static_cast<std::uint64_t>(*e.threshold)) return std::nullopt;
  if (!e.inside().value_or(true)) ++outside_;
  return e;
}

std::optional<PllSummary> PllWatch::Summary(const model::SlaveModel& slave) const {
  const device::SyncDescription& family = slave.profile->sync;
  const auto value = [&](const std::optional<device::DriveParameter>& parameter) -> std::optional<std::int64_t> {
    const auto known = model::ValueOf(slave, parameter);
    return known ? std::optional(known->value) : std::nullopt;
  };
  PllSummary summary;
  summary.distance = value(family.sync_distance);
  summary.window = value(family.sync_window);
  summary.threshold = value(family.pll_threshold);
  summary.reads = reads_;
  summary.outside = outside_;
  summary.actual_last = value(family.sync_actual).value_or(0);
  if (!summary.distance && !summary.window && !summary.threshold && summary.reads == 0) return std::nullopt;
  return summary;
}

}  // namespace ecaudit::sync
