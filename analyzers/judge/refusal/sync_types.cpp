#include <algorithm>

#include "analyzers/judge/refusal/checks.h"
#include "analyzers/judge/sync_text.h"
#include "analyzers/sync/sync_type.h"
#include "decoder/esc/al.h"

namespace ecaudit::refusal {
namespace {

constexpr Word kSyncTypes{"sync-types", "the synchronisation type (1C32h:1) against 0x0981"};

/// As last read or written; null: the capture does not show it, or it is none that has a meaning here.
const model::ObjectValue* SyncTypeIn(const Case& of, std::uint16_t object) {
  const model::ObjectValue* const value = of.model.objects.Find(object, sync::kSyncTypeEntry);
  return value != nullptr && sync::IsKnownSyncType(value->raw) ? value : nullptr;
}

Arguments Named(std::uint16_t object, const model::ObjectValue& value) {
  const auto type = static_cast<sync::SyncType>(value.raw);
  return {{"object", arg::Object(object, sync::kSyncTypeEntry)},
          {"type", arg::Number(static_cast<std::int64_t>(value.raw), sync::Name(type))}};
}

/// The frame since which the master has it so; 0: the slave has it of its own.
FrameNo WrittenIn(const model::ObjectValue& value) {
  return value.written ? value.since : 0;
}

}  // namespace

void CheckSyncTypes(const Case& of, Outcome& found) {
  const bool unseen = of.SyncNeverSet();
  if (!of.sync0() && !unseen) return;
  const FrameNo changed = of.dc.activation_changed();
  bool fits = false;
  for (const std::uint16_t object : sync::kSyncObjects) {
    const model::ObjectValue* const value = SyncTypeIn(of, object);
    if (value == nullptr) continue;
    // Slaves change it themselves when SYNC0 is activated: what was read before shows nothing of the time after.
    if (!of.Applied(std::max(changed, value->since)) || (!value->written && value->since < changed)) continue;
    const auto type = static_cast<sync::SyncType>(value->raw);
    const bool active = type == sync::SyncType::kSync1 ? of.generates_sync1() : of.sync0().value_or(false);
    // Synchronous to the outputs (0x22) fits both.
    if (sync::NeedsPulses(type) == active || type == sync::SyncType::kSmEventOfInputs) {
      fits = true;
      continue;
    }
    if (!of.Counts(std::max(changed, WrittenIn(*value)))) return;
    Arguments arguments = Named(object, *value);
    arguments.Set("active", arg::Flag(active)).Set("pulse", arg::Of(PulseOf(type)));
    if (unseen) {
      arguments.Set("since", arg::Frame(of.state.set_up_since));
    } else {
      arguments.Set("activation", of.Activation());
    }
    return found.May(kSyncTypeDiffers, std::move(arguments), object == sync::kSyncObjects[1] ? kInputs : kOutputs);
  }
  if (fits && !unseen) found.Right(kSyncTypes);
}

void CheckTypeRejected(const Case& of, Outcome& found) {
  const std::uint16_t object = sync::kSyncObjects[0];
  const model::ObjectValue* const value = SyncTypeIn(of, object);
  if (value == nullptr || !of.Applied(value->since)) return;
  const auto type = static_cast<sync::SyncType>(value->raw);
  const bool free_run = of.refusal.code == esc::al_code::kFreeRun;
  const bool rejected = free_run ? type == sync::SyncType::kFreeRun : sync::NeedsPulses(type);
  if (rejected && of.Counts(WrittenIn(*value))) found.May(kSyncTypeRejected, Named(object, *value));
}

}  // namespace ecaudit::refusal
