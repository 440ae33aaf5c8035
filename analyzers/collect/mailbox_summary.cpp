#include "analyzers/collect/mailbox_summary.h"

namespace ecaudit {

MailboxStatistics::MailboxStatistics(EventBus& bus) {
  bus.ListenTo<mailbox::MailboxMessage, mailbox::SdoTransfer, mailbox::MailboxErrorReply, mailbox::MailboxUnanswered,
               mailbox::Emergency>(Stage::kBeforeModel, *this);
}

MailboxStatistics::Entry& MailboxStatistics::Get(SlaveId slave) {
  while (slave >= entries_.size()) entries_.emplace_back();
  return entries_[slave];
}

void MailboxStatistics::On(const mailbox::MailboxMessage& message) {
  if (message.repeated || message.late) return;
  Entry& entry = Get(message.slave);
  Messages& messages = entry.by_type[static_cast<std::size_t>(message.header.protocol) % entry.by_type.size()];
  const bool request = message.direction == mailbox::Direction::kOut;
  ++(request ? entry.totals.requests : entry.totals.responses);
  ++(request ? messages.requests : messages.responses);
}

void MailboxStatistics::On(const mailbox::SdoTransfer& transfer) {
  MailboxSummary& totals = Get(transfer.slave).totals;
  if (transfer.service == mailbox::SdoService::kUpload) ++totals.sdo_uploads;
  if (transfer.service == mailbox::SdoService::kDownload) ++totals.sdo_downloads;
  if (transfer.outcome == mailbox::SdoOutcome::kAborted) ++totals.aborts;
}

void MailboxStatistics::On(const mailbox::MailboxErrorReply& reply) {
  ++Get(reply.slave).totals.error_replies;
}

void MailboxStatistics::On(const mailbox::MailboxUnanswered& unanswered) {
  if (unanswered.end != mailbox::MailboxUnanswered::End::kGap) ++Get(unanswered.slave).totals.unanswered;
}

void MailboxStatistics::On(const mailbox::Emergency& emergency) {
  ++Get(emergency.slave).totals.emergencies;
}

void MailboxStatistics::Summarise(AnalysisResult& result) {
  for (SlaveSummary& slave : result.slaves) slave.mailbox = Of(slave.id);
}

MailboxSummary MailboxStatistics::Of(SlaveId slave) const {
  if (slave >= entries_.size()) return {};
  const Entry& entry = entries_[slave];
  MailboxSummary summary = entry.totals;
  for (std::size_t type = 0; type < entry.by_type.size(); ++type) {
    const Messages& messages = entry.by_type[type];
    if (messages.requests == 0 && messages.responses == 0) continue;
    summary.by_protocol.push_back({Name(static_cast<mailbox::Protocol>(type)), messages.requests, messages.responses});
  }
  return summary;
}

}  // namespace ecaudit
