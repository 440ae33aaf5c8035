/// Objects of modular devices (ETG.5001): channel n has its outputs at 7000h + 10h x n and its inputs at 6000h + 10h x
/// n.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace ecaudit::model {

struct SlaveModel;

inline constexpr std::uint16_t kTerminalOutputs = 0x7000;
inline constexpr std::uint16_t kTerminalInputs = 0x6000;
inline constexpr std::uint16_t kPerChannel = 0x10;
inline constexpr std::uint8_t kMostChannels = 16;

/// The channel, from 0 on, of an object of this index; nothing for other objects, and from kMostChannels on.
[[nodiscard]] std::optional<std::uint8_t> TerminalChannelOf(std::uint16_t index);
/// The module profile of a modular device (703: stepper, 742: servo), by 1000h as the capture shows it; nothing where
/// it does not, and for all other devices.
[[nodiscard]] std::optional<std::uint32_t> ModuleProfileOf(const SlaveModel& slave);
/// Letters only, in lower case: "DRV Outputs__Control word" and "Controlword" end alike.
[[nodiscard]] std::string LettersOf(std::string_view name);

}  // namespace ecaudit::model
