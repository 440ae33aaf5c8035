#include "decoder/mailbox/diagnosis_message.h"

#include <algorithm>

#include "decoder/base/text.h"
#include "decoder/mailbox/coe_types.h"

namespace ecaudit::mailbox {
namespace {

constexpr std::size_t kMostParameters = 16;
constexpr std::uint16_t kEmergencyClass = 0xE800;

/// What bits 12 to 15 of the flags of a parameter state about its other bits.
enum class Layout : std::uint8_t { kDataType = 0, kBytes = 1, kAscii = 2, kUnicode = 3, kTextId = 4 };

struct Parameter {
  std::size_t bytes = 0;  ///< 0: not known
  DataType type = DataType::kUnknown;
};

Parameter ParameterOf(std::uint16_t flags) {
  const auto low = static_cast<std::uint16_t>(flags & 0x0FFFU);
  switch (static_cast<Layout>(flags >> 12U)) {
    case Layout::kDataType:
      return {(BitLength(static_cast<DataType>(low)) + 7U) / 8U, static_cast<DataType>(low)};
    case Layout::kBytes:
      return {low, DataType::kOctetString};
    case Layout::kAscii:
      return {low, DataType::kVisibleString};
    case Layout::kUnicode:
      return {low, DataType::kUnicodeString};
    case Layout::kTextId:
      return {low, DataType::kUnknown};
  }
  return {};
}

void ParseParameters(ByteSpan bytes, std::size_t count, DiagnosisMessage& message) {
  std::size_t at = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (i == kMostParameters || !Fits(bytes, at, 2)) {
      message.cut = true;
      return;
    }
    const auto flags = LittleEndian<std::uint16_t>(bytes, at);
    const Parameter parameter = ParameterOf(flags);
    at += 2;
    if (parameter.bytes == 0 || !Fits(bytes, at, parameter.bytes)) {
      message.cut = true;
      return;
    }
    const ByteSpan value = bytes.subspan(at, parameter.bytes);
    const bool text = parameter.type == DataType::kVisibleString || parameter.type == DataType::kUnicodeString;
    const bool text_id = static_cast<Layout>(flags >> 12U) == Layout::kTextId;
    const std::string shown = Printable(FormatValue(parameter.type, value));
    message.parameters.push_back(text ? "\"" + shown + "\"" : text_id ? "text ID " + shown : shown);
    at += parameter.bytes;
  }
}

std::string TypeName(std::uint8_t type) {
  switch (static_cast<DiagnosisType>(type)) {
    case DiagnosisType::kInfo:
      return "information";
    case DiagnosisType::kWarning:
      return "warning";
    case DiagnosisType::kError:
      return "error";
  }
  return "type " + std::to_string(type);
}

}  // namespace

std::optional<std::uint16_t> DiagnosisMessage::emergency_code() const {
  if ((code & 0xFFFFU) != kEmergencyClass) return std::nullopt;
  return static_cast<std::uint16_t>(code >> 16U);
}

DiagnosisMessage ParseDiagnosisMessage(ByteSpan bytes) {
  DiagnosisMessage message;
  message.too_short = bytes.size() < kDiagnosisHeaderBytes;
  if (message.too_short) return message;
  message.code = LittleEndian<std::uint32_t>(bytes, 0);
  message.flags = LittleEndian<std::uint16_t>(bytes, 4);
  message.text_id = LittleEndian<std::uint16_t>(bytes, 6);
  message.time_ns = LittleEndian<std::uint64_t>(bytes, 8);
  ParseParameters(bytes.subspan(kDiagnosisHeaderBytes), message.flags >> 8U, message);
  return message;
}

std::string DiagnosisText(const DiagnosisMessage& message) {
  if (message.too_short) return "too short";
  if (message.empty()) return "no message";
  std::string text = TypeName(message.type()) + ", diag code " + Hex(message.code, 8);
  if (const auto emergency = message.emergency_code()) text += " (emergency " + Hex(*emergency) + ")";
  if (message.text_id != 0) text += ", text ID " + Hex(message.text_id);
  for (std::size_t i = 0; i < message.parameters.size(); ++i) {
    text += (i != 0 ? ", " : message.parameters.size() == 1 ? ", parameter " : ", parameters ") + message.parameters[i];
  }
  if (message.cut) text += ", parameters not complete";
  if (message.time_ns != 0) {
    constexpr std::uint64_t kMostShown = std::uint64_t{1} << 62U;
    const bool shown = message.local_time() && message.time_ns < kMostShown;
    text += message.local_time() ? ", local time " : ", time ";
    text += shown ? Duration(static_cast<std::int64_t>(message.time_ns)) : std::to_string(message.time_ns) + " ns";
  }
  return text;
}

}  // namespace ecaudit::mailbox
