#include "analyzers/objects/object_value.h"

#include <bit>

#include "decoder/base/text.h"
#include "decoder/mailbox/diagnosis_message.h"
#include "decoder/process/pdo_mapping.h"

namespace ecaudit::events {
namespace {

using mailbox::DataType;

/// Numbers that people know in hexadecimal get that form as well.
std::string WithHex(std::string decimal, std::uint64_t value) {
  return value < 10 ? decimal : decimal + " (" + Hex(value, 1) + ")";
}

ObjectValue ReadTyped(DataType type, ByteSpan bytes) {
  ObjectValue out;
  out.text = mailbox::FormatValue(type, bytes);
  const bool fits = !bytes.empty() && bytes.size() <= 8 && bytes.size() == (mailbox::BitLength(type) + 7U) / 8U;
  if (fits && type == DataType::kBoolean) {
    out.value = bytes[0] != 0;
  } else if (fits && (mailbox::IsUnsigned(type) || mailbox::IsBitString(type))) {
    out.value = UnsignedOf(bytes);
    if (!out.text.starts_with("0x")) out.text = WithHex(std::move(out.text), UnsignedOf(bytes));
  } else if (fits && mailbox::IsSigned(type)) {
    out.value = SignExtend(UnsignedOf(bytes), 8 * static_cast<unsigned>(bytes.size()));
  } else if (fits && type == DataType::kReal32) {
    out.value = static_cast<double>(std::bit_cast<float>(LittleEndian<std::uint32_t>(bytes, 0)));
  } else if (fits && type == DataType::kReal64) {
    out.value = std::bit_cast<double>(LittleEndian<std::uint64_t>(bytes, 0));
  } else if (!bytes.empty()) {
    out.value = out.text;
    if (!out.text.starts_with("0x") && out.text != HexBytes(bytes)) out.text = "\"" + out.text + "\"";
  }
  return out;
}

void AddUnit(const ObjectInfo& info, ObjectValue& value) {
  const bool scaled = !info.scale.empty() && info.scale != "1:1";
  const bool factor = !info.unit.empty() && info.unit[0] >= '0' && info.unit[0] <= '9';  // "0.1 %"
  if (scaled) value.text += ", scale " + info.scale;
  if (!info.unit.empty()) value.text += (scaled ? ", unit " : factor ? " x " : " ") + info.unit;
}

/// @param whole  the bytes are exactly this subindex
ObjectValue ReadItem(const ObjectNames& names, const device::DeviceDescription* profile, std::uint16_t index,
                     std::uint8_t subindex, DataType type, ByteSpan bytes) {
  ObjectValue value = ReadTyped(type, bytes);
  value.subindex = subindex;
  if (subindex == 0) return value;
  if ((process::IsRxMapping(index) || process::IsTxMapping(index)) && bytes.size() == 4) {
    value.text = MappingText(names, profile, LittleEndian<std::uint32_t>(bytes, 0));
    value.value = value.text;
  } else if (process::IsAssignment(index) && bytes.size() == 2) {
    value.text = ObjectName(LittleEndian<std::uint16_t>(bytes, 0));
  } else if (mailbox::IsDiagnosisMessage(index, subindex) && bytes.size() >= mailbox::kDiagnosisHeaderBytes) {
    value.text = mailbox::DiagnosisText(mailbox::ParseDiagnosisMessage(bytes),
                                        profile != nullptr ? profile->diagnosis_texts() : nullptr);
  }
  return value;
}

}  // namespace

std::string MappingText(const ObjectNames& names, const device::DeviceDescription* profile, std::uint32_t entry) {
  const process::MappingEntry mapped = process::MappingEntry::FromValue(entry);
  if (entry == 0) return "nothing";
  if (mapped.index == 0) return "gap of " + Count(mapped.bits, "bit");
  const std::string name = Printable(names.Find(profile, mapped.index, mapped.subindex).name);
  return ObjectName(mapped.index, mapped.subindex) + " " + std::to_string(mapped.bits) + " bit" +
         (name.empty() ? "" : " " + name);
}

ObjectValue ReadValue(const ObjectNames& names, const device::DeviceDescription* profile, std::uint16_t index,
                      std::uint8_t subindex, ByteSpan bytes) {
  const ObjectInfo info = names.Find(profile, index, subindex);
  ObjectValue value = ReadItem(names, profile, index, subindex, info.type, bytes);
  if (!bytes.empty()) AddUnit(info, value);
  return value;
}

ObjectValue ReadCompleteAccess(const ObjectNames& names, const device::DeviceDescription* profile, std::uint16_t index,
                               std::uint8_t first_subindex, ByteSpan bytes) {
  ObjectValue out;
  std::size_t at = 0;
  unsigned subindex = first_subindex;
  const auto add = [&](ObjectValue item) {
    out.text += (out.items.empty() ? "" : out.items.back().subindex == 0 ? " entries: " : "; ") + item.text;
    out.items.push_back(std::move(item));
  };
  if (subindex == 0 && !bytes.empty()) {
    add(ReadItem(names, profile, index, 0, DataType::kUnsigned8, bytes.first(1)));
    at = 2;
    subindex = 1;
  }
  for (; at < bytes.size() && subindex <= 0xFF; ++subindex) {
    const auto sub = static_cast<std::uint8_t>(subindex);
    const DataType type = names.Find(profile, index, sub).type;
    const std::size_t size = (mailbox::BitLength(type) + 7U) / 8U;
    // Bits share bytes with their neighbours, strings have no length of their own: the rest stays as it is.
    const bool splits = size != 0 && mailbox::BitLength(type) % 8 == 0 && Fits(bytes, at, size);
    const ByteSpan part = splits ? bytes.subspan(at, size) : bytes.subspan(at);
    add(ReadItem(names, profile, index, sub, splits ? type : DataType::kUnknown, part));
    at += part.size();
  }
  return out;
}

}  // namespace ecaudit::events
