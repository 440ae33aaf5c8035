/// in: events of the mailboxes.  out: the numbers of each slave for the report.
#pragma once

#include <array>
#include <deque>

#include "analyzers/collect/collector.h"
#include "analyzers/wiring/event_bus.h"
#include "decoder/mailbox/events.h"

namespace ecaudit {

class MailboxStatistics final : public Collector {
 public:
  explicit MailboxStatistics(EventBus& bus);

  void On(const mailbox::MailboxMessage& message);
  void On(const mailbox::SdoTransfer& transfer);
  void On(const mailbox::MailboxErrorReply& reply);
  void On(const mailbox::MailboxUnanswered& unanswered);
  void On(const mailbox::Emergency& emergency);
  void Summarise(AnalysisResult& result) override;
  /// All zero for a slave whose mailboxes were never used.
  [[nodiscard]] MailboxSummary Of(SlaveId slave) const;

 private:
  struct Messages {
    std::uint64_t requests = 0;
    std::uint64_t responses = 0;
  };
  struct Entry {
    MailboxSummary totals;
    std::array<Messages, 16> by_type{};  // type number of the mailbox header
  };
  Entry& Get(SlaveId slave);

  std::deque<Entry> entries_;
};

}  // namespace ecaudit
