#include <algorithm>
#include <cctype>
#include <charconv>
#include <optional>

#include "cli/lookup/meanings.h"
#include "cli/lookup/progress_meanings.h"

namespace ecaudit::cli {
namespace {

template <typename T>
std::optional<T> WholeNumber(std::string_view digits, int base) {
  T value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value, base);
  if (digits.empty() || error != std::errc{} || end != digits.data() + digits.size()) return std::nullopt;
  return value;
}

struct Object {
  std::uint16_t index = 0;
  std::optional<std::uint8_t> subindex;
};

/// What `what` can be by its form alone.
struct Form {
  std::optional<std::uint32_t> hex;     ///< 0x...
  bool short_hex = false;               ///< of at most four digits
  std::optional<Object> object;         ///< 6040h, 6040h:1, 0x6040:1
  std::optional<std::uint64_t> value;   ///< of the object: 6041h=0x1237
  std::optional<std::uint32_t> number;  ///< F125, n125, 125
  std::optional<std::uint16_t> bare;    ///< 6041, 001B, 27: hexadecimal without any mark
  char letter = 0;
};

bool StartsWithHex(std::string_view text) {
  return text.starts_with("0x") || text.starts_with("0X");
}

/// Subindices are written in decimal; 0x also in hexadecimal.
std::optional<std::uint8_t> Subindex(std::string_view text) {
  return StartsWithHex(text) ? WholeNumber<std::uint8_t>(text.substr(2), 16) : WholeNumber<std::uint8_t>(text, 10);
}

bool IsHexDigit(char c) {
  return std::isxdigit(static_cast<unsigned char>(c)) != 0;
}

/// "6041", "1C12": an index, a code or an address as manuals print it.
bool IsBareWord(std::string_view text) {
  return text.size() == 4 && std::ranges::all_of(text, IsHexDigit);
}

Form FormOf(std::string_view what) {
  Form form;
  if (const std::size_t equals = what.find('='); equals != std::string_view::npos) {
    const std::string_view value = what.substr(equals + 1);
    form.value =
        StartsWithHex(value) ? WholeNumber<std::uint64_t>(value.substr(2), 16) : WholeNumber<std::uint64_t>(value, 10);
    std::string index(what.substr(0, equals));
    if (IsBareWord(index)) index += 'h';
    if (StartsWithHex(index)) index = index.substr(2) + "h";
    form.object = FormOf(index).object;
    if (!form.value || !form.object) return {};
    return form;
  }
  const std::size_t colon = what.find(':');
  std::string_view head = what.substr(0, colon);
  const bool suffixed = head.size() > 1 && head.size() <= 5 && (head.back() == 'h' || head.back() == 'H');
  if (suffixed || (colon != std::string_view::npos && (StartsWithHex(head) || IsBareWord(head)))) {
    if (!suffixed && !StartsWithHex(head)) {
      form.object = FormOf(std::string(head) + "h" + std::string(what.substr(colon))).object;
      return form;
    }
    head = suffixed ? head.substr(0, head.size() - 1) : head.substr(2);
    const auto index = WholeNumber<std::uint16_t>(head, 16);
    if (!index) return form;
    form.object = Object{*index, std::nullopt};
    if (colon != std::string_view::npos) {
      form.object->subindex = Subindex(what.substr(colon + 1));
      if (!form.object->subindex) form.object.reset();
    }
    return form;
  }
  if (StartsWithHex(what)) {
    form.hex = WholeNumber<std::uint32_t>(what.substr(2), 16);
    form.short_hex = form.hex && *form.hex <= 0xFFFF && what.size() <= 6;
    return form;
  }
  if (IsBareWord(what)) form.bare = WholeNumber<std::uint16_t>(what, 16);
  std::string_view digits = what;
  if (!what.empty() && std::isalpha(static_cast<unsigned char>(what.front())) != 0) {
    form.letter = what.front();
    digits.remove_prefix(1);
  }
  if (digits.size() <= 5) form.number = WholeNumber<std::uint32_t>(digits, 10);
  return form;
}

std::string Upper(std::string_view text) {
  std::string upper(text);
  std::ranges::transform(upper, upper.begin(), [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return upper;
}

}  // namespace

bool IsNumberLike(std::string_view what) {
  const Form form = FormOf(what);
  return form.hex || form.object || form.number || form.bare;
}

std::vector<Meaning> LookUp(std::string_view what, const Families& families) {
  std::vector<Meaning> out;
  const Form form = FormOf(what);
  if (form.object) {
    if (form.value) lookup::AddValue(form.object->index, *form.value, families, out);
    lookup::AddObject(form.object->index, form.object->subindex, families, out);
    return out;
  }
  const auto add_word = [&](std::uint16_t word) {
    lookup::AddAlStatusCode(word, families, out);
    if (word >= 0x1000) lookup::AddObject(word, std::nullopt, families, out);
    if (word >= 0x1000) lookup::AddEmergency(word, families, out);
    lookup::AddRegister(word, families, out);
    lookup::AddMailboxError(word, out);
  };
  if (form.number) lookup::AddDriveNumber(form.letter, *form.number, families, out);
  if (form.letter != 0 && form.number) lookup::AddNamed(what, families, out);
  if (form.number && form.letter == 0 && *form.number <= 0xFF) {
    // Masters print status codes in both forms, and a number does not show which one it is.
    const auto decimal = static_cast<std::uint16_t>(*form.number);
    lookup::AddAlStatusCode(decimal, families, out);
    const auto hex = WholeNumber<std::uint16_t>(what, 16);
    if (hex && *hex != decimal) lookup::AddAlStatusCode(*hex, families, out);
  }
  if (form.bare) add_word(*form.bare);
  if (form.number || (form.bare && !out.empty())) return out;
  if (form.hex) {
    if (form.short_hex) {
      add_word(static_cast<std::uint16_t>(*form.hex));
    }
    if (!form.short_hex || out.empty()) lookup::AddSdoAbort(*form.hex, out);
    return out;
  }
  const std::string upper = Upper(what);
  lookup::AddCommand(upper, out);
  lookup::AddAlState(upper, families, out);
  lookup::AddProgress(what, out);
  if (out.empty()) lookup::AddNamed(what, families, out);
  return out;
}

}  // namespace ecaudit::cli
