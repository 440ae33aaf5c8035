#include "decoder/device/mailbox_description.h"

#include <algorithm>
#include <iterator>

namespace ecaudit::device {

std::string_view Name(SyncManagerUse use) {
  const auto* const found = std::find_if(std::begin(kSyncManagerUses), std::end(kSyncManagerUses),
                                         [use](const SyncManagerUseWord& word) { return word.value == use; });
  return found == std::end(kSyncManagerUses) ? std::string_view() : found->text;
}

const SyncManagerRule* MailboxDescription::FindSyncManager(std::uint8_t number) const {
  const auto it = std::ranges::find(sync_managers, number, &SyncManagerRule::number);
  return it == sync_managers.end() ? nullptr : &*it;
}

const MailboxProtocol* MailboxDescription::FindProtocol(std::uint8_t type) const {
  const auto it = std::ranges::find(protocols, type, &MailboxProtocol::type);
  return it == protocols.end() ? nullptr : &*it;
}

}  // namespace ecaudit::device
