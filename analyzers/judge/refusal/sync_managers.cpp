#include <algorithm>
#include <string>

#include "analyzers/judge/refusal/checks.h"
#include "analyzers/judge/refusal/evidence.h"
#include "analyzers/model/sync_manager_demand.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/esc/register_map.h"

namespace ecaudit::refusal {
namespace {

/// What sync manager `n` has to be, as far as it is known; unset where nothing is.
std::optional<model::SyncManagerDemand> DemandOf(const Case& of, std::size_t n) {
  const bool mailbox = n < kOutputs;
  const auto demands =
      mailbox ? model::MailboxDemands(*of.model.profile, of.sii) : model::ProcessDemands(*of.model.profile, of.sii);
  const auto own = std::ranges::find(demands.list, n, &model::SyncManagerDemand::number);
  std::optional<model::SyncManagerDemand> demand;
  if (own != demands.list.end()) demand = *own;
  const std::uint32_t bytes = mailbox ? 0 : of.AssignedBytes(n).value_or(0);
  if (bytes == 0) return demand;
  if (!demand) {
    demand.emplace();
    demand->number = static_cast<std::uint8_t>(n);
    demand->use = n == kOutputs ? device::SyncManagerUse::kProcessOut : device::SyncManagerUse::kProcessIn;
  }
  demand->lengths = {bytes};
  return demand;
}

IgnoredVerdict VerdictOnWrite(const Case& of, const model::SetUpFacts::IgnoredWrite& ignored) {
  const auto demand = DemandOf(of, ignored.manager);
  // The enable bit is not part of what was ignored.
  const auto fits = [&](esc::SyncManager settings) {
    settings.activate = 1;
    return demand && model::FaultsOf(settings, *demand).empty();
  };
  Facts<IgnoredFact> facts{};
  facts.Set(IgnoredFact::kNeedKnown, demand.has_value());
  facts.Set(IgnoredFact::kKeptFits, fits(ignored.kept));
  facts.Set(IgnoredFact::kKeptShown, ignored.shown != 0);
  facts.Set(IgnoredFact::kWrittenFits, fits(ignored.written));
  return Decide(kIgnoredWrites, facts);
}

/// How many the slave controller has; unset: not read.
std::optional<std::uint8_t> ManagersOf(const Case& of) {
  const auto count = of.state.registers.Value<std::uint8_t>(esc::kSyncManagerCount, Certainty::kObserved);
  return count && *count != 0 ? count : std::nullopt;
}

/// "outputs" or "inputs"
Value ContentsOf(std::size_t manager) {
  static constexpr Word kOutputsWord{"outputs", "outputs", true};
  static constexpr Word kInputsWord{"inputs", "inputs", true};
  return arg::Of(manager == kOutputs ? kOutputsWord : kInputsWord);
}

}  // namespace

/// An ESC keeps the settings that an enabled sync manager has. They are a reason if they are not what the slave needs,
/// and those that the master wrote are.
void CheckIgnored(const Case& of, Outcome& found, std::size_t manager) {
  const model::SetUpFacts::IgnoredWrite* const ignored = of.model.set_up.ignored(manager);
  if (ignored == nullptr || !of.Counts(ignored->frame)) return;
  const IgnoredVerdict verdict = VerdictOnWrite(of, *ignored);
  if (verdict == IgnoredVerdict::kNo) return;
  Arguments arguments{{"sync_manager", NumberOf(manager)},
                      {"write_frame", arg::Frame(ignored->frame)},
                      {"kept_start", arg::Hex(ignored->kept.start)},
                      {"kept_length", arg::Number(ignored->kept.length)},
                      {"kept_control", arg::Hex(ignored->kept.control, 2)},
                      {"start", arg::Hex(ignored->written.start)},
                      {"length", arg::Number(ignored->written.length)},
                      {"control", arg::Hex(ignored->written.control, 2)}};
  if (ignored->shown != 0) arguments.Set("shown_frame", arg::Frame(ignored->shown));
  found.Add(verdict == IgnoredVerdict::kYes, kWriteIgnored, std::move(arguments));
}

void CheckThreeBuffers(const Case& of, Outcome& found, std::size_t manager) {
  const auto settings = of.manager(manager);
  if (!settings || !settings->enabled() || settings->length == 0 || !of.Counts(of.manager_changed(manager))) return;
  if (!esc::IsOneBuffer(manager, *settings)) return;
  found.Wrong(kOneBufferFreeRun, {{"sync_manager", NumberOf(manager)}, {"control", arg::Hex(settings->control, 2)}},
              manager);
}

void CheckManagerSet(const Case& of, Outcome& found, std::size_t manager) {
  // Below SAFEOP a slave needs no process data.
  if (of.refusal.requested < static_cast<std::uint8_t>(esc::AlState::SAFEOP)) return;
  if (of.manager(manager) || !of.SetUpIsSeen() || manager >= ManagersOf(of).value_or(esc::kMaxSyncManagers)) return;
  if (of.state.sync_manager_since[manager] > of.state.set_up_since) return;
  const std::optional<std::uint32_t> bytes = of.AssignedBytes(manager);
  if (bytes && *bytes == 0) return;
  Arguments arguments{{"sync_manager", NumberOf(manager)},
                      {"direction", ContentsOf(manager)},
                      {"since", arg::Frame(of.state.set_up_since)}};
  if (bytes) arguments.Set("bytes", Bytes(*bytes));
  found.Add(bytes.has_value(), kManagerUnseen, std::move(arguments), manager);
}

/// A length that differs from the assigned PDOs is a finding of sm-process-config.
void CheckEmpty(const Case& of, Outcome& found, std::size_t manager) {
  const auto set = of.manager(manager);
  const FrameNo changed = of.manager_changed(manager);
  if (!found.none() || !of.requested() || !set || !set->enabled() || set->length != 0 || !of.Counts(changed)) return;
  // Only where nothing is to be exchanged: else a cause before this one made the length wrong.
  const model::ObjectValue* const count = of.model.objects.Find(AssignmentOf(manager), 0);
  const bool nothing =
      of.AssignedBytes(manager) == 0U || (count != nullptr && count->raw == 0 && of.Applied(count->since));
  if (!nothing) return;
  std::erase(found.right, &kLengthsFit);
  Arguments arguments{{"sync_manager", NumberOf(manager)}, {"direction", ContentsOf(manager)}};
  if (changed != 0) arguments.Set("set_frame", arg::Frame(changed));
  found.May(kEnabledWithoutLength, std::move(arguments), manager);
}

/// The process data need SM2 or SM3 if these are set and have bytes, or if PDOs are assigned to them.
void CheckExists(const Case& of, Outcome& found) {
  const auto managers = ManagersOf(of);
  if (!managers || !of.requested()) return;
  for (std::size_t n = std::max<std::size_t>(*managers, kOutputs); n <= kInputs; ++n) {
    const auto set = of.manager(n);
    const bool is_set = set && set->enabled() && set->length != 0 && of.Counts(of.manager_changed(n));
    if (!is_set && of.AssignedBytes(n).value_or(0) == 0) continue;
    return found.Wrong(kNoSuchManager,
                       {{"sync_manager", NumberOf(n)}, {"managers", arg::Count(*managers, "sync manager")}}, n);
  }
}

void CheckRam(const Case& of, Outcome& found) {
  constexpr std::uint32_t kKiB = 1024;
  const auto ram = of.state.registers.Value<std::uint8_t>(esc::kRamSize, Certainty::kObserved);
  if (!ram || *ram == 0 || !of.requested()) return;
  const std::uint32_t ram_end = esc::kProcessRam + *ram * kKiB;
  for (std::size_t n = 0; n <= kInputs; ++n) {
    const auto set = of.manager(n);
    if (!set || !set->enabled() || set->length == 0 || !of.Counts(of.manager_changed(n))) continue;
    if (set->occupied_end() <= ram_end) continue;
    if (found.none()) found.value = arg::Text("SM" + std::to_string(n));
    const bool must = set->end() > ram_end;  // without the other two buffers it may still fit
    return found.Add(must, kBeyondRam,
                     {{"sync_manager", NumberOf(n)},
                      {"start", arg::Hex(set->start)},
                      {"end", arg::Hex(set->occupied_end() - 1)},
                      {"buffered", arg::Flag(set->occupied_bytes() > set->length)},
                      {"ram", arg::Number(*ram)},
                      {"ram_end", arg::Hex(ram_end - 1)}});
  }
}

void CheckTypes(const Case& of, Outcome& found) {
  constexpr std::uint16_t kTypes = 0x1C00;
  constexpr std::uint64_t kOutputType = 3, kInputType = 4;
  const auto type_of = [&](std::size_t n) {
    const model::ObjectValue* type = of.model.objects.Find(kTypes, static_cast<std::uint8_t>(n + 1));
    return type != nullptr && of.Applied(type->since) ? type->raw : 0;
  };
  const auto outputs = of.manager(kOutputs);
  if (type_of(kOutputs) != kInputType || type_of(kInputs) != kOutputType || !outputs || !outputs->enabled()) return;
  if (outputs->direction() != esc::SmDirection::ECAT_WRITES) return;
  found.Wrong(kTypesSwapped, {{"control", arg::Hex(outputs->control, 2)}});
}

void CheckLengths(const Case& of, Outcome& found) {
  const auto fits = [&](std::size_t n) {
    const auto manager = of.manager(n);
    const model::ProcessLayout* const pdos = of.Assigned(n);
    return pdos != nullptr && manager && of.Applied(std::max(pdos->since, of.manager_changed(n))) &&
           of.model.set_up.ignored(n) == nullptr && manager->length == of.AssignedBytes(n);
  };
  if (fits(kOutputs) && fits(kInputs)) found.Right(kLengthsFit);
}

}  // namespace ecaudit::refusal
