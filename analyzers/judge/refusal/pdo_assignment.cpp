#include <algorithm>

#include "analyzers/judge/refusal/checks.h"

namespace ecaudit::refusal {

void CheckCount(const Case& of, Outcome& found, std::size_t manager) {
  const std::uint16_t assignment = AssignmentOf(manager);
  const process::PdoObject* const list = of.model.process.seen().Find(assignment);
  const model::ObjectValue* const count = of.model.objects.Find(assignment, 0);
  if (list == nullptr || count == nullptr || !count->written || count->raw > 0xFF || !of.Counts(count->since)) return;
  const std::uint8_t* const counted = list->count.if_observed();
  const std::uint8_t shown = list->highest();
  if (counted == nullptr || *counted != count->raw || shown >= *counted) return;
  Arguments arguments{{"object", arg::Object(assignment, 0)},
                      {"entries", arg::Count(*counted, "entry")},
                      {"count_frame", arg::Frame(count->since)}};
  if (shown > 0) arguments.Set("shown", arg::Count(shown, "entry"));
  found.May(kCountExceeds, std::move(arguments), manager);
}

void CheckPdosExist(const Case& of, Outcome& found, std::size_t manager) {
  const process::PdoMapping& seen = of.model.process.seen();
  const std::uint16_t assignment = AssignmentOf(manager);
  const process::PdoObject* const list = seen.Find(assignment);
  const std::uint8_t* const count = list != nullptr ? list->count.if_observed() : nullptr;
  if (count == nullptr || !of.Counts(list->since)) return;
  for (const auto& [subindex, pdo] : list->values) {
    const FrameNo* const missing = seen.MissingSince(static_cast<std::uint16_t>(pdo));
    if (subindex > *count || missing == nullptr || !of.Counts(*missing)) continue;
    return found.May(kPdoMissing,
                     {{"object", arg::Object(assignment, subindex)},
                      {"pdo", arg::Object(static_cast<std::uint16_t>(pdo))},
                      {"assigned_frame", arg::Frame(list->since)},
                      {"missing_frame", arg::Frame(*missing)},
                      {"sync_manager", NumberOf(manager)}},
                     manager);
  }
}

void CheckEntries(const Case& of, Outcome& found, std::size_t manager) {
  const process::PdoMapping& seen = of.model.process.seen();
  const auto pdos = seen.Assigned(AssignmentOf(manager));
  if (!pdos || !of.SetUpIsSeen()) return;
  for (const std::uint16_t pdo : *pdos) {
    const process::PdoObject* const entries = seen.Find(pdo);
    const model::ObjectValue* const count = of.model.objects.Find(pdo, 0);
    if (entries == nullptr || count == nullptr || !count->written || !of.Counts(count->since)) continue;
    const std::uint8_t left_out = entries->left_out();
    if (left_out == 0 || left_out > count->raw || entries->highest() > count->raw) continue;
    return found.May(kEntryLeftOut,
                     {{"object", arg::Object(pdo, 0)},
                      {"entry", arg::Object(pdo, left_out)},
                      {"entries", arg::Count(count->raw, "entry")},
                      {"count_frame", arg::Frame(count->since)}},
                     manager);
  }
}

namespace {

/// The slave assigns no PDO to the sync manager when it answers.
bool AssignsNone(const Case& of, std::size_t manager) {
  const model::ObjectValue* const count = of.model.objects.Find(AssignmentOf(manager), 0);
  return of.requested() && count != nullptr && count->raw == 0 && of.Applied(count->since) && of.manager(manager);
}

Arguments DescribeNone(const Case& of, std::size_t manager) {
  const std::uint16_t assignment = AssignmentOf(manager);
  const model::ObjectValue* const count = of.model.objects.Find(assignment, 0);
  return {{"object", arg::Object(assignment, 0)},
          {"count_frame", arg::Frame(count->since)},
          {"sync_manager", NumberOf(manager)}};
}

}  // namespace

void CheckLengthWithoutPdo(const Case& of, Outcome& found, std::size_t manager) {
  if (!AssignsNone(of, manager)) return;
  const auto set = of.manager(manager);
  if (!set->enabled() || set->length == 0) return;
  Arguments arguments = DescribeNone(of, manager);
  arguments.Set("bytes", Bytes(set->length));
  found.May(kNoPdoAssigned, std::move(arguments), manager);
}

/// The code is about these process data: it wants some where the sync manager has no length, and refuses them where it
/// has.
void CheckAssigned(const Case& of, Outcome& found, std::size_t manager) {
  if (!AssignsNone(of, manager)) return;
  const auto set = of.manager(manager);
  if (set->enabled() && set->length != 0) return CheckLengthWithoutPdo(of, found, manager);
  if (!found.none()) return;
  // That both lengths are 0 fits, and is what the slave refuses.
  std::erase(found.right, &kLengthsFit);
  found.May(kNothingAssigned, DescribeNone(of, manager), manager);
}

void CheckMapped(const Case& of, Outcome& found, std::size_t manager) {
  constexpr std::uint16_t kNoLength = 0xFF;  // the length byte of an entry without a length
  const model::ProcessLayout* const layout = of.Assigned(manager);
  if (layout == nullptr || !of.Counts(layout->since)) return;
  for (const model::Signal& signal : layout->signals) {
    // What the slave offers by itself is its own affair.
    const model::ObjectValue* written = of.model.objects.Find(signal.pdo, 0);
    if (signal.gap() || written == nullptr || !written->written) continue;
    const std::uint16_t bits = device::BitsOf(device::DataTypeFromCode(static_cast<std::uint16_t>(signal.type)));
    const bool none = bits == 0 && signal.bits == kNoLength;
    // A BOOLEAN may fill a byte.
    const bool differs = bits != 0 && bits != signal.bits && !(bits == 1 && signal.bits == 8);
    if (!none && !differs) continue;
    Arguments arguments{{"pdo", arg::Object(signal.pdo)},
                        {"object", arg::Object(signal.index, signal.subindex)},
                        {"mapped", arg::Count(signal.bits, "bit")}};
    if (differs) arguments.Set("expected", arg::Count(bits, "bit"));
    return found.May(kMappedLength, std::move(arguments));
  }
}

void CheckAligned(const Case& of, Outcome& found, std::size_t manager) {
  const model::ProcessLayout* const layout = of.Assigned(manager);
  if (!found.none() || layout == nullptr || !of.Counts(layout->since)) return;
  for (const model::Signal& signal : layout->signals) {
    const bool whole = signal.bits >= 16 && signal.bits % 8 == 0;
    if (signal.sync_manager != manager || signal.gap() || !whole || signal.bit_offset % 8 == 0) continue;
    const std::uint32_t bytes = layout->bytes_of(static_cast<std::uint8_t>(manager));
    const auto set = of.manager(manager);
    if (!set || set->length != bytes) return;
    std::erase(found.right, &kLengthsFit);
    return found.May(kUnaligned,
                     {{"pdo", arg::Object(signal.pdo)},
                      {"object", arg::Object(signal.index, signal.subindex)},
                      {"mapped", arg::Count(signal.bits, "bit")},
                      {"bit", arg::Number(signal.bit_offset % 8)},
                      {"byte", arg::Number(signal.bit_offset / 8)},
                      {"sync_manager", NumberOf(manager)},
                      {"length", Bytes(bytes)}},
                     manager);
  }
}

}  // namespace ecaudit::refusal
