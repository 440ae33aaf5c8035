#include "analyzers/model/terminal_objects.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>

#include "analyzers/model/drive_events.h"
#include "analyzers/model/process_image.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/model/terminal_channels.h"

namespace ecaudit::model {
namespace {

struct TerminalEntry {
  bool output;
  std::uint8_t subindex;
  std::uint16_t bits;
  std::uint16_t object;   ///< of CiA 402
  std::string_view name;  ///< as modular servo drives call it, letters only, in lower case
};

/// Module profile 742.
constexpr std::array kTerminalEntries{
    TerminalEntry{true, 0x01, 16, 0x6040, "controlword"},
    TerminalEntry{true, 0x03, 8, 0x6060, "modesofoperation"},
    TerminalEntry{true, 0x05, 32, 0x607A, "targetposition"},
    TerminalEntry{true, 0x06, 32, 0x60FF, "targetvelocity"},
    TerminalEntry{true, 0x09, 16, 0x6071, "targettorque"},
    TerminalEntry{false, 0x01, 16, 0x6041, "statusword"},
    TerminalEntry{false, 0x03, 8, 0x6061, "modesofoperationdisplay"},
    TerminalEntry{false, 0x07, 32, 0x606C, "velocityactualvalue"},
    TerminalEntry{false, 0x08, 16, 0x6077, "torqueactualvalue"},
};

constexpr std::uint32_t kServoModule = 742;
constexpr std::uint8_t kMostAxes = 8;

/// The entry ends with its name: ESI files put the channel or the PDO before it.
bool Contradicts(const Signal& signal, const TerminalEntry& entry) {
  return !signal.name.empty() && !signal.name_inferred && !LettersOf(signal.name).ends_with(entry.name);
}

const TerminalEntry* EntryOf(bool output, std::uint8_t subindex, std::uint16_t bits) {
  for (const TerminalEntry& entry : kTerminalEntries) {
    if (entry.output == output && entry.subindex == subindex && entry.bits == bits) return &entry;
  }
  return nullptr;
}

std::optional<std::uint8_t> ChannelOf(std::uint16_t index, bool output) {
  return output == (index >= kTerminalOutputs) ? TerminalChannelOf(index) : std::nullopt;
}

/// By the entries of the channel in both directions: a control word, a set point and a status word, or a word of each
/// kind if the device calls itself a servo terminal.
bool IsAxis(const SlaveModel& slave, std::uint8_t channel, bool servo_terminal) {
  bool control = false, set_point = false, status = false;
  const auto look = [&](const ProcessLayout& layout, bool output) {
    for (const Signal& signal : layout.signals) {
      if (signal.gap() || ChannelOf(signal.index, output) != channel) continue;
      const TerminalEntry* const entry = EntryOf(output, signal.subindex, signal.bits);
      if (entry == nullptr) continue;
      if (Contradicts(signal, *entry)) return false;
      control = control || entry->object == kControlWord;
      status = status || entry->object == kStatusWord;
      set_point = set_point || (output && entry->bits > 8 && entry->object != kControlWord);
    }
    return true;
  };
  if (!look(slave.process.rx(), true) || !look(slave.process.tx(), false)) return false;
  return control && status && (set_point || servo_terminal);
}

std::vector<std::uint8_t> AxesOf(const SlaveModel& slave) {
  std::vector<std::uint8_t> channels;
  const auto has_word = [](const Signal& signal) {
    return signal.subindex == 1 && signal.bits == 16 && ChannelOf(signal.index, true);
  };
  const auto& outputs = slave.process.rx().signals;
  if (std::none_of(outputs.begin(), outputs.end(), has_word)) return channels;
  const std::optional<std::uint32_t> module = ModuleProfileOf(slave);
  const bool servo = module == kServoModule;
  if (module && !servo) return channels;
  for (std::uint8_t channel = 0; channel < kMostChannels && channels.size() < kMostAxes; ++channel) {
    if (IsAxis(slave, channel, servo)) channels.push_back(channel);
  }
  return channels;
}

}  // namespace

TerminalObjects::TerminalObjects(const ImagePart& part) : channels_(AxesOf(*part.model)) {}

std::uint32_t TerminalObjects::InCia402(std::uint32_t object, std::uint16_t bits) const {
  if (channels_.empty()) return object;
  const auto index = static_cast<std::uint16_t>(object >> 8U);
  const bool output = index >= kTerminalOutputs;
  const std::optional<std::uint8_t> channel = ChannelOf(index, output);
  const TerminalEntry* const entry = EntryOf(output, static_cast<std::uint8_t>(object), bits);
  // The position is a value of the encoder, whose channel is the one before.
  constexpr std::uint8_t kEncoderPosition = 0x11;
  constexpr std::uint16_t kPositionActual = 0x6064;
  if (!output && channels_.size() == 1 && bits == 32 && channel && *channel + 1 == channels_.front() &&
      static_cast<std::uint8_t>(object) == kEncoderPosition) {
    return std::uint32_t{kPositionActual} << 8U;
  }
  if (!channel || entry == nullptr) return object;
  const auto axis = std::find(channels_.begin(), channels_.end(), *channel);
  if (axis == channels_.end()) return object;
  return static_cast<std::uint32_t>(ObjectOfAxis(entry->object, static_cast<std::uint8_t>(axis - channels_.begin())))
         << 8U;
}

std::uint32_t TerminalObjects::ControlWordOf(const SlaveModel& slave, std::uint8_t axis) {
  const std::vector<std::uint8_t> channels = AxesOf(slave);
  if (axis >= channels.size()) return 0;
  return static_cast<std::uint32_t>(kTerminalOutputs + channels[axis] * kPerChannel) << 8U | 1U;
}

}  // namespace ecaudit::model
