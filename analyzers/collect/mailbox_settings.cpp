#include "analyzers/collect/mailbox_settings.h"

#include "decoder/mailbox/aoe.h"
#include "decoder/mailbox/soe.h"

namespace ecaudit::startup {
namespace {

using mailbox::Direction;
using mailbox::Protocol;

constexpr std::uint8_t kSoeValue = 0x40;  // of the elements

template <typename Matches>
void MarkNewest(std::vector<MailboxSetting>& settings, std::uint32_t code, bool refused, Matches&& matches) {
  for (auto setting = settings.rbegin(); setting != settings.rend(); ++setting) {
    if (setting->outcome != StartupOutcome::kUnknown || !matches(*setting)) continue;
    setting->outcome = refused ? StartupOutcome::kRefused : StartupOutcome::kDone;
    setting->code = code;
    return;
  }
}

}  // namespace

std::optional<MailboxSetting> SettingOf(const mailbox::SoeMessage& message) {
  const bool writes = message.operation == mailbox::SoeOperation::kWriteRequest;
  if (message.direction != Direction::kOut || !writes || !message.idn_known) return std::nullopt;
  if ((message.elements & kSoeValue) == 0) return std::nullopt;
  MailboxSetting setting{.protocol = Protocol::kSoE, .drive = message.drive, .number = message.idn};
  setting.frame = message.frame;
  if (!message.fragment_error && message.data.size() == message.size) {
    setting.data.assign(message.data.begin(), message.data.end());
  }
  return setting;
}

std::optional<MailboxSetting> SettingOf(const mailbox::EoeControl& message) {
  const bool writes =
      message.type == mailbox::EoeType::kSetIpRequest || message.type == mailbox::EoeType::kSetFilterRequest;
  if (message.direction != Direction::kOut || !writes) return std::nullopt;
  MailboxSetting setting{.protocol = Protocol::kEoE, .number = static_cast<std::uint16_t>(message.type)};
  setting.frame = message.frame;
  return setting;
}

std::optional<MailboxSetting> SettingOf(const mailbox::AoeMessage& message) {
  if (message.direction != Direction::kOut || message.header.response()) return std::nullopt;
  MailboxSetting setting{.protocol = Protocol::kAoE, .number = static_cast<std::uint16_t>(message.header.command)};
  setting.frame = message.frame;
  setting.data = mailbox::AccessBytes(message.parameters);
  return setting;
}

void MarkAnswered(std::vector<MailboxSetting>& settings, const mailbox::SoeMessage& message) {
  if (message.direction != Direction::kIn || message.operation != mailbox::SoeOperation::kWriteResponse) return;
  if (!message.idn_known) return;
  MarkNewest(settings, message.error_code.value_or(0), message.error_code.has_value(), [&](const auto& setting) {
    return setting.protocol == Protocol::kSoE && setting.drive == message.drive && setting.number == message.idn;
  });
}

void MarkAnswered(std::vector<MailboxSetting>& settings, const mailbox::EoeControl& message) {
  if (message.direction != Direction::kIn || !message.result) return;
  MarkNewest(settings, *message.result, *message.result != 0, [&](const auto& setting) {
    return setting.protocol == Protocol::kEoE && setting.number + 1 == static_cast<int>(message.type);
  });
}

void MarkAnswered(std::vector<MailboxSetting>& settings, const mailbox::AoeMessage& message) {
  if (message.direction != Direction::kIn || !message.header.response()) return;
  const std::uint32_t error = message.header.error != 0 ? message.header.error : message.parameters.result.value_or(0);
  MarkNewest(settings, error, error != 0, [&](const auto& setting) {
    return setting.protocol == Protocol::kAoE && setting.number == static_cast<std::uint16_t>(message.header.command);
  });
}

void MarkAnswered(std::vector<MailboxSetting>& settings, const mailbox::MailboxErrorReply& reply) {
  MarkNewest(settings, reply.detail, true, [&](const auto& setting) {
    return reply.request.frame.seen() && setting.protocol == reply.request.protocol &&
           setting.frame.number == reply.request.frame.number;
  });
}

}  // namespace ecaudit::startup
