#include "analyzers/words/drive_text.h"

#include <algorithm>
#include <map>

#include "analyzers/objects/relatives.h"
#include "analyzers/words/drive_error_codes.h"
#include "decoder/base/text.h"

namespace ecaudit {
namespace {

using device::DriveCommand;
using device::DriveProfile;

constexpr unsigned kHaltBit = 8;
constexpr const char* kByRelative = " (by another family of the same maker)";

bool Has(const DriveCommand& command, std::uint8_t number) {
  return std::ranges::find(command.transitions, number) != command.transitions.end();
}

/// The row that commands `number` with this word; null when none does.
const DriveCommand* RowOf(const DriveProfile& drive, std::uint8_t number, std::uint16_t before, std::uint16_t word) {
  for (const DriveCommand& command : drive.commands) {
    if (!command.automatic && Has(command, number) && command.Matches(before, word)) return &command;
  }
  return nullptr;
}

std::string CodeWords(const device::EmergencyCode& code) {
  return code.id.empty() ? code.text : code.id + (code.text.empty() ? "" : " " + code.text);
}

/// The first row that this object has in the family's list; null when it holds no reason of a fault.
const device::FaultObject* FaultObjectOf(const device::DeviceDescription& family, std::uint16_t index) {
  if (!family.drive) return nullptr;
  const auto& objects = family.drive->fault_objects;
  const auto found = std::ranges::find_if(objects, [&](const auto& row) { return row.index == index; });
  return found == objects.end() ? nullptr : &*found;
}

/// The row with the drive's own number, "F401".
const device::EmergencyCode* FindById(const device::DeviceDescription& family, const std::string& id) {
  if (!family.emergency) return nullptr;
  const auto& codes = family.emergency->codes;
  const auto found = std::ranges::find_if(codes, [&](const auto& code) { return code.id == id; });
  return found == codes.end() ? nullptr : &*found;
}

}  // namespace

std::string PathText(const model::DrivePath& path) {
  if (path.empty()) return "";
  std::string text = path.count == 1 ? "transition " : "transitions ";
  for (std::uint8_t i = 0; i < path.count; ++i) {
    if (i > 0) text += i + 1 == path.count ? " and " : ", ";
    text += std::to_string(path.numbers[i]);
  }
  return text;
}

std::string CommandName(const DriveProfile& drive, const model::DrivePath& path, std::optional<std::uint16_t> before,
                        std::uint16_t word) {
  std::string names;
  const auto add = [&names](const std::string& name) {
    if (!names.ends_with(name)) names += (names.empty() ? "" : ", ") + name;
  };
  for (std::uint8_t i = 0; i < path.count; ++i) {
    // The edge of the first step is used up for those after it.
    const DriveCommand* row = RowOf(drive, path.numbers[i], i == 0 ? before.value_or(word) : word, word);
    if (row != nullptr) add(row->name);
  }
  if (!names.empty()) return names;
  const std::uint16_t from = before.value_or(0);
  // Fault reset, Enable operation, Disable operation or Switch on, Shutdown, Quick stop, Disable voltage.
  const bool was_enabled = before && RowOf(drive, 4, 0, *before) != nullptr;
  const std::uint8_t second = was_enabled ? 5 : 3;
  for (const std::uint8_t number : {std::uint8_t{15}, std::uint8_t{4}, second, std::uint8_t{2}, std::uint8_t{11},
                                    std::uint8_t{7}, std::uint8_t{9}}) {
    if (number == 15 && !before) continue;
    if (const DriveCommand* row = RowOf(drive, number, from, word)) return row->name;
  }
  return "no command";
}

std::string CommandText(const DriveProfile& drive, const model::DriveCommanded& event) {
  std::string text = CommandName(drive, event.path, event.before, event.word) + " (control word " + Hex(event.word);
  if (!event.path.empty()) text += ", " + PathText(event.path);
  return text + ")";
}

std::string EdgesText(const DriveProfile& drive, const model::DriveBits& event) {
  const device::ModeBits* const mode = BitsOfMode(drive, event.mode);
  std::string text;
  for (unsigned bit = 0; bit < 16; ++bit) {
    if ((event.changed >> bit & 1U) == 0) continue;
    const bool rises = (event.word >> bit & 1U) != 0;
    text += (text.empty() ? "bit " : ", bit ") + std::to_string(bit) + (rises ? " rises" : " falls");
    const auto row = std::ranges::find_if(drive.edge_actions,
                                          [&](const auto& each) { return each.bit == bit && each.rising == rises; });
    std::string name = row != drive.edge_actions.end() ? row->action : std::string();
    if (name.empty() && mode != nullptr)
      name = bit == 4 ? mode->bit4 : bit == 5 ? mode->bit5 : bit == 6 ? mode->bit6 : "";
    if (name.empty() && bit == kHaltBit) name = "halt";
    if (!name.empty()) text += ": " + name;
  }
  return text + " (control word " + Hex(event.word) + ")";
}

std::string StateText(std::optional<device::DriveState> state) {
  return state ? std::string(device::DriveStateName(*state)) : "unknown";
}

Value StateValue(std::optional<device::DriveState> state) {
  static const auto words = [] {
    std::map<device::DriveState, Word> all;
    for (int i = 0; i <= static_cast<int>(device::DriveState::kFault); ++i) {
      const auto each = static_cast<device::DriveState>(i);
      all[each] = Word{device::DriveStateName(each), device::DriveStateName(each)};
    }
    return all;
  }();
  static constexpr Word kUnknown{"unknown", "an unknown state"};
  const auto found = state ? words.find(*state) : words.end();
  return arg::Of(found == words.end() ? kUnknown : found->second);
}

Value ModeValue(const device::DeviceDescription& family, std::int8_t value) {
  const device::OperationMode* mode = family.drive ? family.drive->FindMode(value) : nullptr;
  return arg::Number(value, mode == nullptr ? std::string_view() : std::string_view(mode->name));
}

Value WayValue(bool by_sdo) {
  static constexpr Word kSdo{"sdo", "SDO"}, kProcessData{"process-data", "process data"};
  return arg::Of(by_sdo ? kSdo : kProcessData);
}

std::string StateChangeText(const model::DriveStateChanged& event) {
  std::string text = event.from ? StateText(event.from) + " -> " : "";
  text += event.to ? StateText(event.to) : "no known state";
  text += " (status word " + Hex(event.word);
  if (!event.path.empty()) text += ", " + PathText(event.path);
  return text + ")";
}

std::string ModeText(const DriveProfile& drive, std::int8_t value) {
  const device::OperationMode* mode = drive.FindMode(value);
  return std::to_string(value) + (mode == nullptr ? "" : " (" + mode->name + ")");
}

std::string FaultText(const device::DeviceDescription& family, const model::DriveFaultExplained& event) {
  using Source = model::DriveFaultExplained::Source;
  std::string text = event.source == Source::kEmergency
                         ? "emergency "
                         : "object " + ObjectName(model::ObjectForAxis(event.object, event.axis)) + ": ";
  if (event.source == Source::kFaultNumber) {
    const device::FaultObject* object = FaultObjectOf(family, event.object);
    const std::string id = (object == nullptr ? "" : object->prefix) + std::to_string(event.code);
    if (const device::EmergencyCode* code = FindById(family, id)) return text + CodeWords(*code);
    for (const device::DeviceDescription* relative : events::Relatives(family)) {
      const device::EmergencyCode* code = FindById(*relative, id);
      if (code != nullptr) return text + CodeWords(*code) + kByRelative;
    }
    const bool inferred = object != nullptr && object->basis == device::Basis::kInferred;
    return text + id + (inferred ? kByRelative : "");
  }
  text += Hex(event.code);
  const events::EmergencyInfo info = events::FindEmergency(&family, static_cast<std::uint16_t>(event.code));
  const bool of_class = info.code != nullptr && info.code->code != info.code->last_code;
  const std::string_view standard = DriveErrorText(static_cast<std::uint16_t>(event.code));
  if ((info.code == nullptr || of_class) && !standard.empty()) return text + " " + std::string(standard);
  if (info.code != nullptr) {
    const std::string words = CodeWords(*info.code);
    if (!words.empty()) text += of_class ? " (class " + words + ")" : " " + words;
    if (info.inferred) text += kByRelative;
  }
  return text;
}

std::vector<std::string> SetBits(const std::vector<device::WordBit>& bits, std::uint16_t word,
                                 const device::ModeBits* mode) {
  std::vector<std::string> names;
  for (const device::WordBit& bit : bits) {
    if ((word >> bit.bit & 1U) == 0) continue;
    std::string name = bit.name;
    if (mode != nullptr) {
      const std::string& in_mode = bit.bit == 4   ? mode->bit4
                                   : bit.bit == 5 ? mode->bit5
                                   : bit.bit == 6 ? mode->bit6
                                                  : name;
      if (!in_mode.empty()) name = in_mode;
    }
    names.push_back("bit " + std::to_string(bit.bit) + " " + name);
  }
  return names;
}

const device::ModeBits* BitsOfMode(const DriveProfile& drive, std::optional<std::int8_t> mode) {
  if (!mode) return nullptr;
  const auto found = std::ranges::find(drive.mode_bits, *mode, &device::ModeBits::mode);
  return found == drive.mode_bits.end() ? nullptr : &*found;
}

std::string MillisecondsText(std::optional<TimeNs> duration) {
  return duration ? Fixed(static_cast<double>(*duration) / 1e6, 1) + " ms" : "";
}

}  // namespace ecaudit
