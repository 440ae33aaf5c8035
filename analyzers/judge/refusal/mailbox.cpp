#include <algorithm>
#include <array>

#include "analyzers/judge/refusal/checks.h"
#include "analyzers/model/sync_manager_demand.h"

namespace ecaudit::refusal {
namespace {

constexpr Word kMailboxManagers{"mailbox-sync-managers", "the settings of SM0 and SM1"};
constexpr Word kMailboxEnabled{"mailbox-enabled", "SM0 and SM1 are enabled"};
constexpr Word kMailboxWords{"mailbox-words", "the mailbox words of the EEPROM"};

/// For SM0 and SM1.
using MailboxWords = std::array<std::optional<esc::SiiMailbox>, 2>;

MailboxWords StandardOf(const Case& of) {
  return {of.sii.header.standard_receive, of.sii.header.standard_send};
}

bool IsBlank(const esc::SyncManager& manager) {
  return manager.start == 0 && manager.length == 0 && !manager.enabled();
}

bool IsAs(const esc::SyncManager& manager, const esc::SiiMailbox& words) {
  return manager.start == words.offset && manager.length == words.size;
}

/// Both are known to be as the slave needs them.
bool MailboxFits(const Case& of) {
  const auto demands = model::MailboxDemands(*of.model.profile, of.sii);
  return demands.known && !demands.list.empty() &&
         std::ranges::all_of(demands.list, [&](const model::SyncManagerDemand& demand) {
           const auto manager = of.manager(demand.number);
           return manager && model::FaultsOf(*manager, demand).empty();
         });
}

/// The master may have set a mailbox all the same.
void AddNoBootstrap(const Case& of, Outcome& found) {
  Arguments arguments;
  for (std::size_t n = 0; n < 2 && arguments.empty(); ++n) {
    const auto manager = of.manager(n);
    if (manager && manager->length == 0) arguments.Set("sync_manager", NumberOf(n));
  }
  const bool must = found.reason != nullptr || !arguments.empty();
  found.Add(must, kNoBootstrapInEeprom, std::move(arguments));
}

}  // namespace

void CheckMailboxSet(const Case& of, Outcome& found) {
  const std::array managers{of.manager(0), of.manager(1)};
  const std::array since{of.state.sync_manager_since[0], of.state.sync_manager_since[1]};
  const FrameNo changed = std::max(of.manager_changed(0), of.manager_changed(1));
  if (!managers[0] && !managers[1]) {
    const bool seen = of.SetUpIsSeen() && since[0] <= of.state.set_up_since;
    if (seen) found.Wrong(kMailboxUnseen, {{"since", arg::Frame(of.state.set_up_since)}});
    return;
  }
  if (!managers[0] || !managers[1] || !of.Applied(changed)) return;
  if (IsBlank(*managers[0]) && IsBlank(*managers[1])) {
    if (!of.Counts(changed)) return;
    Arguments arguments;
    if (const FrameNo last = std::max(since[0], since[1]); last != 0) arguments.Set("since", arg::Frame(last));
    return found.Wrong(kMailboxNeverSet, std::move(arguments));
  }
  for (std::size_t n = 0; n < managers.size(); ++n) {
    if (managers[n]->enabled() || !of.Counts(of.manager_changed(n))) continue;
    found.Wrong(kMailboxOff, {{"sync_manager", NumberOf(n)}});
  }
  if (!managers[0]->enabled() || !managers[1]->enabled()) return;
  // Which settings apply is not known after a write that an ESC ignores.
  if (of.model.set_up.ignored(0) != nullptr || of.model.set_up.ignored(1) != nullptr) return;
  found.Right(MailboxFits(of) ? kMailboxManagers : kMailboxEnabled);
}

void CheckMailboxWords(const Case& of, Outcome& found) {
  constexpr std::uint8_t kMailboxOut = 1;  // type in the sync manager category
  const auto [out, in] = StandardOf(of);
  if (!out || !in) return;
  if (out->size != 0 || in->size != 0) return found.Right(kMailboxWords);
  if (!of.requested()) return;
  Arguments arguments;
  const std::uint16_t protocols = of.sii.header.protocols.value_or(0);
  if (protocols != 0) arguments.Set("protocols", arg::Text(esc::SiiProtocolNames(protocols)));
  const auto& managers = of.sii.sync_managers;
  const auto mailbox = std::ranges::find_if(
      managers, [](const esc::SiiSyncManager& entry) { return entry.type == kMailboxOut && entry.length != 0; });
  if (mailbox != managers.end()) {
    arguments.Set("sync_manager", arg::Number(mailbox - managers.begin())).Set("bytes", Bytes(mailbox->length));
  }
  // The master may have set a mailbox all the same.
  found.Add(found.reason != nullptr, kNoMailboxInEeprom, std::move(arguments));
}

void CheckMailboxFirmware(const Case& of, Outcome& found) {
  if (!found.none() || !of.requested()) return;
  const MailboxWords words = StandardOf(of);
  for (std::size_t n = 0; n < words.size(); ++n) {
    const auto manager = of.manager(n);
    if (!manager || !manager->enabled() || !words[n] || words[n]->size == 0) return;
    if (!IsAs(*manager, *words[n]) || !manager->mailbox() || !of.Counts(of.manager_changed(n))) return;
  }
  found.May(kMailboxAsEeprom);
}

void CheckBootstrap(const Case& of, Outcome& found) {
  const MailboxWords words{of.sii.header.bootstrap_receive, of.sii.header.bootstrap_send};
  if (words[0] && words[1] && words[0]->size == 0 && words[1]->size == 0) return AddNoBootstrap(of, found);
  for (std::size_t n = 0; n < words.size(); ++n) {
    const auto manager = of.manager(n);
    if (!manager || !manager->enabled() || !words[n] || words[n]->size == 0) continue;
    if (IsAs(*manager, *words[n]) || !of.Counts(of.manager_changed(n))) continue;
    found.Wrong(kBootstrapMailbox, {{"sync_manager", NumberOf(n)},
                                    {"start", arg::Hex(manager->start)},
                                    {"length", arg::Number(manager->length)},
                                    {"expected_start", arg::Hex(words[n]->offset)},
                                    {"expected_length", arg::Number(words[n]->size)}});
  }
}

}  // namespace ecaudit::refusal
