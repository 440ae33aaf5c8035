#include "analyzers/model/terminal_channels.h"

#include <cctype>

#include "analyzers/model/slave_model.h"

namespace ecaudit::model {
namespace {

constexpr std::uint16_t kDeviceType = 0x1000;
constexpr std::uint32_t kModular = 5001;

}  // namespace

std::optional<std::uint8_t> TerminalChannelOf(std::uint16_t index) {
  const std::uint16_t first = index >= kTerminalOutputs ? kTerminalOutputs : kTerminalInputs;
  if (index < first || index >= first + kMostChannels * kPerChannel || index % kPerChannel != 0) return std::nullopt;
  return static_cast<std::uint8_t>((index - first) / kPerChannel);
}

std::optional<std::uint32_t> ModuleProfileOf(const SlaveModel& slave) {
  const ObjectValue* const type = slave.objects.Find(kDeviceType, 0);
  if (type == nullptr || (type->raw & 0xFFFFU) != kModular || type->raw >> 16U == 0) return std::nullopt;
  return static_cast<std::uint32_t>(type->raw >> 16U);
}

std::string LettersOf(std::string_view name) {
  std::string letters;
  for (const char c : name) {
    if (std::isalpha(static_cast<unsigned char>(c)) != 0) {
      letters += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    }
  }
  return letters;
}

}  // namespace ecaudit::model
