#include "decoder/track/mailbox_window.h"

namespace ecaudit::track {
namespace {

struct Setting {
  EscAddress start = 0;
  std::uint16_t length = 0;
  MailboxUse use = MailboxUse::kUnknown;
};

Setting SettingOf(const std::optional<esc::SyncManager>& sm, esc::SmDirection direction) {
  if (!sm) return {};
  if (!sm->enabled() || sm->length == 0) return {0, 0, MailboxUse::kOff};
  if (!sm->mailbox() || sm->direction() != direction) return {0, 0, MailboxUse::kNone};
  return {sm->start, sm->length, MailboxUse::kOn};
}

}  // namespace

MailboxWindow MailboxWindowOf(const SlaveState& state) {
  const Setting out = SettingOf(state.sync_manager(0, Certainty::kInferred), esc::SmDirection::ECAT_WRITES);
  const Setting in = SettingOf(state.sync_manager(1, Certainty::kInferred), esc::SmDirection::ECAT_READS);
  return {out.start, out.length, in.start, in.length, out.use, in.use};
}

}  // namespace ecaudit::track
