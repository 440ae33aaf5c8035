#include "analyzers/judge/axis_lead.h"

#include <string>
#include <utility>

#include "analyzers/model/drive_events.h"
#include "analyzers/progress/axis_signals.h"
#include "analyzers/progress/axis_view.h"
#include "analyzers/result/argument.h"
#include "analyzers/words/drive_text.h"

namespace ecaudit {
namespace {

using progress::Quantity;
using progress::Role;

Role TargetOf(Quantity quantity) {
  switch (quantity) {
    case Quantity::kVelocity:
      return Role::kTargetVelocity;
    case Quantity::kTorque:
      return Role::kTargetTorque;
    case Quantity::kSpeed:
      return Role::kTargetSpeed;
    default:
      return Role::kTargetPosition;
  }
}

Role ActualOf(Quantity quantity) {
  switch (quantity) {
    case Quantity::kVelocity:
      return Role::kVelocity;
    case Quantity::kTorque:
      return Role::kTorque;
    case Quantity::kSpeed:
      return Role::kSpeed;
    default:
      return Role::kPosition;
  }
}

/// "+1200": how far it went from `before`.
std::string Change(std::int64_t before, std::int64_t now, Quantity quantity) {
  const std::int64_t change = quantity == Quantity::kPosition ? progress::Apart(before, now)
                                                              : progress::Bounded(now) - progress::Bounded(before);
  return (change < 0 ? "" : "+") + std::to_string(change);
}

}  // namespace

void AddLead(Finding& finding, const progress::AxisLead& lead, const device::DeviceDescription& family,
             std::uint8_t axis) {
  const progress::AxisMoment& last = lead.last;
  if (!last.frame.seen() || !last.control) return;
  Arguments of_note;
  of_note.Set("at", arg::Frame(last.frame.number)).Set("control", arg::Hex(*last.control));
  if (last.status) of_note.Set("status", arg::Hex(*last.status));
  if (last.mode) {
    of_note.Set("mode", arg::Text(family.drive ? ModeText(*family.drive, *last.mode) : std::to_string(*last.mode)));
  }
  const auto object = [&](Role role) { return arg::Object(model::ObjectOfAxis(progress::ObjectOf(role), axis), 0); };
  const bool same = lead.earlier && lead.earlier->quantity == last.quantity && lead.earlier->frame.has_time;
  if (same) of_note.Set("span", arg::Ms(Elapsed(lead.earlier->frame.time, last.frame.time)));
  if (last.target) {
    of_note.Set("target_object", object(TargetOf(last.quantity))).Set("target", arg::Number(*last.target));
    if (same && lead.earlier->target) {
      of_note.Set("target_change", arg::Text(Change(*lead.earlier->target, *last.target, last.quantity)));
    }
  }
  if (last.actual) {
    of_note.Set("actual_object", object(ActualOf(last.quantity))).Set("actual", arg::Number(*last.actual));
    if (same && lead.earlier->actual) {
      of_note.Set("actual_change", arg::Text(Change(*lead.earlier->actual, *last.actual, last.quantity)));
    }
  }
  finding.Add(kLeadNote, std::move(of_note));
}

}  // namespace ecaudit
