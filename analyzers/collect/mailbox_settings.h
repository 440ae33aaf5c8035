/// in: SoE, EoE and AoE messages.  out: what the master wrote by them, with the answer of the slave.
#pragma once

#include <optional>
#include <vector>

#include "analyzers/result/startup_summary.h"
#include "decoder/mailbox/events.h"

namespace ecaudit::startup {

/// Nothing if the message writes nothing.
[[nodiscard]] std::optional<MailboxSetting> SettingOf(const mailbox::SoeMessage& message);
[[nodiscard]] std::optional<MailboxSetting> SettingOf(const mailbox::EoeControl& message);
[[nodiscard]] std::optional<MailboxSetting> SettingOf(const mailbox::AoeMessage& message);

/// The outcome of the newest setting that the message answers.
void MarkAnswered(std::vector<MailboxSetting>& settings, const mailbox::SoeMessage& message);
void MarkAnswered(std::vector<MailboxSetting>& settings, const mailbox::EoeControl& message);
void MarkAnswered(std::vector<MailboxSetting>& settings, const mailbox::AoeMessage& message);
void MarkAnswered(std::vector<MailboxSetting>& settings, const mailbox::MailboxErrorReply& reply);

}  // namespace ecaudit::startup
