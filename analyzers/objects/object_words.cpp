#include "analyzers/objects/object_words.h"

#include <algorithm>

#include "analyzers/objects/relatives.h"
#include "decoder/base/text.h"

namespace ecaudit::events {
namespace {

using device::DeviceDescription;
using device::FaultValue;

constexpr std::uint16_t kStatusWord = 0x6041;
constexpr std::uint16_t kMode = 0x6060;
constexpr std::uint16_t kModeShown = 0x6061;

void Join(std::string& text, std::string_view part) {
  if (part.empty()) return;
  if (!text.empty()) text += ", ";
  text += part;
}

std::string CodeText(const device::EmergencyCode& code) {
  return code.id.empty() ? code.text : code.id + " " + code.text;
}

/// Of a field that has several rows, the row of its value; a single bit without a value counts if it is 1.
std::string BitWords(const DeviceDescription& family, std::uint16_t index, std::uint8_t subindex, std::uint64_t raw) {
  std::string text;
  for (const device::ObjectBits& row : family.object_bits) {
    if (row.index != index || row.subindex != subindex) continue;
    const std::uint32_t field = row.Of(raw);
    if (row.value ? *row.value != field : field == 0) continue;
    std::string words = BitsName(row.first, row.last) + " " + row.name;
    if (!row.value && row.last > row.first) words += " = " + std::to_string(field);
    if (row.value && !row.meaning.empty()) words += ": " + row.meaning;
    Join(text, words);
  }
  return text;
}

std::string LatchWords(const std::vector<device::LatchField>& fields, std::uint64_t raw) {
  std::string text;
  for (const device::LatchField& field : fields) {
    const auto word = static_cast<std::uint16_t>(raw & field.mask);
    if (field.value != 0 ? word != field.value : word == 0) continue;
    Join(text, field.reserved ? "reserved bits " + Hex(word) : field.meaning);
  }
  return text;
}

std::string DriveWords(const device::DriveProfile& drive, std::uint16_t index, std::uint64_t raw) {
  if (index == kStatusWord) {
    const auto state = drive.StateOf(static_cast<std::uint16_t>(raw));
    return state ? std::string(device::DriveStateName(*state)) : std::string();
  }
  if (index != kMode && index != kModeShown) return {};
  const device::OperationMode* mode = drive.FindMode(static_cast<std::int8_t>(raw));
  return mode == nullptr ? std::string() : mode->name;
}

}  // namespace

std::string BitsName(unsigned first, unsigned last) {
  return first == last ? "bit " + std::to_string(first) : "bits " + std::to_string(first) + "-" + std::to_string(last);
}

std::vector<const device::FieldbusParameter*> ParameterRows(const DeviceDescription& family, std::string_view keyword,
                                                            std::uint64_t raw) {
  std::vector<const device::FieldbusParameter*> rows;
  for (const device::FieldbusParameter& row : family.fieldbus_parameters) {
    if (row.parameter != keyword || (!row.bit && !row.value)) continue;
    const std::uint64_t found = row.bit ? raw >> *row.bit & 1U : raw;
    const bool holds = row.value ? found == static_cast<std::uint64_t>(*row.value) : found != 0;
    if (holds) rows.push_back(&row);
  }
  return rows;
}

std::string NumberWords(const DeviceDescription& family, const device::FaultObject& object, std::uint64_t raw) {
  const bool number = object.kind == FaultValue::kFaultNumber || object.kind == FaultValue::kWarningNumber;
  if (!number) {
    const EmergencyInfo info = FindEmergency(&family, static_cast<std::uint16_t>(raw));
    if (info.code == nullptr) return {};
    return CodeText(*info.code) + (info.inferred ? " (by a related family)" : "");
  }
  const std::string id = object.prefix + std::to_string(raw);
  if (const device::EmergencyCode* code = family.emergency_by_id(id)) return CodeText(*code);
  for (const DeviceDescription* relative : AllRelatives(family)) {
    if (const device::EmergencyCode* code = relative->emergency_by_id(id)) {
      return CodeText(*code) + " (by a related family)";
    }
  }
  return id;
}

bool HasWords(const DeviceDescription& family, std::uint16_t index, std::uint8_t subindex) {
  if (family.number_object(index, subindex) != nullptr) return true;
  if (std::ranges::any_of(family.object_bits, [&](const device::ObjectBits& row) {
        return row.index == index && row.subindex == subindex;
      })) {
    return true;
  }
  const auto& latch = family.latch;
  if (latch && subindex == 0 && (index == latch->control_object || index == latch->status_object)) return true;
  if (family.drive && subindex == 0 && (index == kMode || index == kModeShown)) return true;
  const device::DictionaryObject* row = family.dictionary ? family.dictionary->Find(index, subindex) : nullptr;
  return row != nullptr && !row->keyword.empty() &&
         std::ranges::any_of(family.fieldbus_parameters, [row](const device::FieldbusParameter& parameter) {
           return parameter.parameter == row->keyword;
         });
}

std::string WordsOf(const DeviceDescription& family, std::uint16_t index, std::uint8_t subindex, std::uint64_t raw) {
  if (const device::FaultObject* object = family.number_object(index, subindex)) {
    return raw == 0 ? std::string() : NumberWords(family, *object, raw);
  }
  if (std::string words = BitWords(family, index, subindex, raw); !words.empty()) return words;
  if (family.latch && subindex == 0) {
    if (index == family.latch->control_object) return LatchWords(family.latch->control, raw);
    if (index == family.latch->status_object) return LatchWords(family.latch->status, raw);
  }
  if (family.drive && subindex == 0) {
    if (std::string words = DriveWords(*family.drive, index, raw); !words.empty()) return words;
  }
  const device::DictionaryObject* row = family.dictionary ? family.dictionary->Find(index, subindex) : nullptr;
  if (row == nullptr || row->keyword.empty()) return {};
  std::string text;
  for (const device::FieldbusParameter* parameter : ParameterRows(family, row->keyword, raw)) {
    Join(text, parameter->bit ? "bit " + std::to_string(*parameter->bit) + " = " +
                                    std::to_string(raw >> *parameter->bit & 1U) + ": " + parameter->meaning
                              : parameter->meaning);
  }
  return text.empty() ? text : row->keyword + ": " + text;
}

}  // namespace ecaudit::events
