#include "decoder/mailbox/diagnosis_message.h"

#include <algorithm>
#include <string_view>

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

/// How many parameters fill the bytes exactly; 0: none do.
std::size_t CountOf(ByteSpan bytes) {
  std::size_t count = 0;
  for (std::size_t at = 0; at < bytes.size(); ++count) {
    const Parameter parameter = ParameterOf(LittleEndian<std::uint16_t>(bytes, at));
    if (parameter.bytes == 0 || !Fits(bytes, at + 2, parameter.bytes)) return 0;
    at += 2 + parameter.bytes;
  }
  return count;
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
    if (parameter.type == DataType::kOctetString && value.size() == EmergencyData{}.data.size() &&
        !message.five_bytes) {
      std::copy(value.begin(), value.end(), message.five_bytes.emplace().begin());
    }
    const bool text = parameter.type == DataType::kVisibleString || parameter.type == DataType::kUnicodeString;
    const bool text_id = static_cast<Layout>(flags >> 12U) == Layout::kTextId;
    const std::string shown = Printable(FormatValue(parameter.type, value));
    message.parameters.push_back(text ? "\"" + shown + "\"" : text_id ? "text ID " + shown : shown);
    message.parameter_texts.push_back(text_id ? static_cast<std::uint16_t>(UnsignedOf(Slice(value, 0, 2))) : 0);
    at += parameter.bytes;
  }
}

/// The text of an ID, safe to print; null: none.
const std::string* Find(const DiagnosisTexts* texts, std::uint16_t id) {
  if (texts == nullptr || id == 0) return nullptr;
  const auto at = texts->find(id);
  return at == texts->end() || at->second.empty() ? nullptr : &at->second;
}

/// One parameter where the text has a place for it.
/// @param conversion  the letter after the percent sign
std::string Filled(const DiagnosisMessage& message, std::size_t number, char conversion, const DiagnosisTexts* texts) {
  const std::string& shown = message.parameters[number];
  if (const std::string* text = Find(texts, message.parameter_texts[number])) return Printable(*text);
  const bool digits = !shown.empty() && std::ranges::all_of(shown, [](char c) { return c >= '0' && c <= '9'; });
  constexpr std::size_t kMostDigits = 19;  // of 64 bits
  if ((conversion == 'x' || conversion == 'X') && digits && shown.size() <= kMostDigits) {
    std::uint64_t value = 0;
    for (const char c : shown) value = 10 * value + static_cast<std::uint64_t>(c - '0');
    return Hex(value, 1).substr(2);
  }
  // The quotes of a text are those of the whole.
  const bool quoted = shown.size() >= 2 && shown.front() == '"';
  return quoted ? shown.substr(1, shown.size() - 2) : shown;
}

/// The text with its parameters. `used` gets how many of them it has a place for.
std::string Fill(const std::string& text, const DiagnosisMessage& message, const DiagnosisTexts* texts,
                 std::size_t& used) {
  constexpr std::string_view kConversions = "diuxXsc";
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '%' || i + 1 == text.size()) {
      out += text[i];
      continue;
    }
    if (text[i + 1] == '%') {
      out += '%';
      ++i;
      continue;
    }
    // Width, precision and length do not matter for reading.
    const std::size_t end = text.find_first_not_of("0123456789.+- #hl", i + 1);
    const bool place = end != std::string::npos && kConversions.find(text[end]) != std::string_view::npos;
    if (!place || used >= message.parameters.size()) {
      out += text[i];
      continue;
    }
    out += Filled(message, used++, text[end], texts);
    i = end;
  }
  return out;
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

std::optional<EmergencyData> DiagnosisMessage::emergency() const {
  const auto error_code = emergency_code();
  if (!error_code || !five_bytes) return std::nullopt;
  EmergencyData emergency;
  emergency.error_code = *error_code;
  emergency.data = *five_bytes;
  return emergency;
}

DiagnosisMessage ParseDiagnosisMessage(ByteSpan bytes) {
  DiagnosisMessage message;
  message.too_short = bytes.size() < kDiagnosisHeaderBytes;
  if (message.too_short) return message;
  message.code = LittleEndian<std::uint32_t>(bytes, 0);
  message.flags = LittleEndian<std::uint16_t>(bytes, 4);
  message.text_id = LittleEndian<std::uint16_t>(bytes, 6);
  message.time_ns = LittleEndian<std::uint64_t>(bytes, 8);
  const ByteSpan parameters = bytes.subspan(kDiagnosisHeaderBytes);
  const std::size_t counted = message.flags >> 8U;
  // Some slaves leave the count at 0.
  ParseParameters(parameters, counted != 0 ? counted : CountOf(parameters), message);
  return message;
}

std::string DiagnosisText(const DiagnosisMessage& message, const DiagnosisTexts* texts) {
  if (message.too_short) return "too short";
  if (message.empty()) return "no message";
  std::string text = TypeName(message.type());
  std::size_t used = 0;
  const std::string* const of_id = Find(texts, message.text_id);
  if (of_id != nullptr) {
    text += ": " + Printable(Fill(*of_id, message, texts, used)) + " (text ID " + Hex(message.text_id) + ")";
  }
  text += ", diag code " + Hex(message.code, 8);
  if (const auto emergency = message.emergency_code()) text += " (emergency " + Hex(*emergency) + ")";
  if (message.text_id != 0 && of_id == nullptr) text += ", text ID " + Hex(message.text_id);
  const std::size_t left = message.parameters.size() - used;
  for (std::size_t i = used; i < message.parameters.size(); ++i) {
    text += i != used ? ", " : left == 1 ? ", parameter " : ", parameters ";
    const std::string* known = Find(texts, message.parameter_texts[i]);
    text += known != nullptr ? "\"" + Printable(*known) + "\"" : message.parameters[i];
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
