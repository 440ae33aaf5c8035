/// Typed values of findings and reasons. The type decides how a person writes the value: hexadecimal or decimal, unit,
/// plural. Analyzers only make and compare values; cli/report/notation.h turns them into text.
#pragma once

#include <bit>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "decoder/base/bytes.h"
#include "decoder/base/ids.h"

namespace ecaudit {

/// A value of a closed list. Declare it `static constexpr` or at file scope: values keep its address.
struct Word {
  std::string_view code;  ///< public interface: "sm-length"
  std::string_view text;  ///< for sentences: "the length of the sync manager"
  bool plural = false;    ///< the text takes "are" instead of "is"
};

struct Value {
  enum class Type : std::uint8_t {
    kNumber,         ///< decimal
    kHex,            ///< 0x0012
    kReal,           ///< with unit and decimals
    kText,           ///< from the capture, a profile or a file; untrusted
    kFlag,           ///< only chooses text
    kBoolean,        ///< a fact: shown as evidence
    kWord,           ///< of a closed list
    kFrame,          ///< frame number
    kDuration,       ///< number in ns; JSON has it in `unit`
    kCount,          ///< number of `unit`s: "3 frames"
    kCode,           ///< number in hexadecimal with its meaning in `text`
    kObject,         ///< index in the upper bits, subindex + 1 in the lower 9 (0: the whole object); its name in `text`
    kRegister,       ///< ESC address; its name in `text`
    kAlState,        ///< state value as in AL Control
    kAlStatus,       ///< AL Status
    kAlStatusOfAll,  ///< AL Status of all slaves, joined by OR
    kBytes,          ///< hexadecimal bytes in `text`
    kSlave,          ///< slave id in `number`, its label in `text`
    kList            ///< `items`
  };
  Type type = Type::kNumber;
  std::uint8_t digits = 4;  ///< kHex, kCode: at least this many; kReal: decimals
  std::int64_t number = 0;
  std::string_view unit;  ///< static storage
  const Word* word = nullptr;

  [[nodiscard]] double real() const { return std::bit_cast<double>(number); }
  [[nodiscard]] const std::string& text() const;
  [[nodiscard]] const std::vector<Value>& items() const;
  void SetText(std::string_view text);
  void SetItems(std::vector<Value> items);

  /// Equal in what a program compares: not in texts that only explain a number.
  [[nodiscard]] bool operator==(const Value& other) const;

 private:
  // Most values are numbers, and a report about thousands of slaves holds many.
  struct More;
  std::shared_ptr<const More> more_;
};

/// Stable form for identities, fingerprints and baselines: numbers as people write them ("0x001d", "6040h:0",
/// "SAFEOP"), codes of words, no explaining text.
[[nodiscard]] std::string KeyOf(const Value& value);

/// Short names for making values: `finding.Set("requested", arg::State(raw))`.
namespace arg {
/// "7", or "7 (Interpolated position)"
[[nodiscard]] Value Number(std::int64_t value, std::string_view meaning = {});
[[nodiscard]] Value Hex(std::uint64_t value, int digits = 4);
/// @param unit  "ppm", "%", "us"; static storage
[[nodiscard]] Value Real(double value, std::string_view unit = {}, int decimals = 1);
[[nodiscard]] Value Text(std::string_view text);
[[nodiscard]] Value Flag(bool value = true);
[[nodiscard]] Value Boolean(bool value);
[[nodiscard]] Value Of(const Word& word);
[[nodiscard]] Value Frame(FrameNo number);
/// Written like Duration(): "141 ms". In JSON milliseconds, so name it NAME_ms.
[[nodiscard]] Value Ms(std::int64_t ns);
/// Likewise in JSON microseconds: NAME_us.
[[nodiscard]] Value Us(std::int64_t ns);
/// Likewise in JSON nanoseconds: NAME_ns.
[[nodiscard]] Value Ns(std::int64_t ns);
/// @param noun  singular: "frame"; static storage
[[nodiscard]] Value Count(std::uint64_t value, std::string_view noun);
/// "0x001d (Invalid output configuration)"
[[nodiscard]] Value Code(std::uint64_t value, std::string_view meaning = {}, int digits = 4);
/// "6040h:0 Control word"
/// @param subindex  -1: the whole object
[[nodiscard]] Value Object(std::uint16_t index, int subindex = -1, std::string_view name = {});
/// "AL Status (0x0130)"
[[nodiscard]] Value Register(std::uint16_t address, std::string_view name = {});
[[nodiscard]] Value State(std::uint8_t state);
[[nodiscard]] Value Status(std::uint16_t al_status);
/// As a broadcast read shows it: the bits of all slaves.
[[nodiscard]] Value StatusOfAll(std::uint16_t al_status);
[[nodiscard]] Value Bytes(ByteSpan bytes);
[[nodiscard]] Value Slave(SlaveId id, std::string_view label);
[[nodiscard]] Value List(std::vector<Value> items);
/// The numbers of the bits that are 1: "17, 18".
[[nodiscard]] Value Bits(std::uint64_t mask);
}  // namespace arg

struct Argument {
  std::string_view name;  ///< public interface; static storage
  Value value;
};

/// A few named values, in the order in which they were set.
class Arguments {
 public:
  Arguments() = default;
  Arguments(std::initializer_list<Argument> list) : list_(list) {}

  /// Sets the value of `name`, or replaces it.
  Arguments& Set(std::string_view name, Value value);
  void Remove(std::string_view name);
  [[nodiscard]] const Value* Find(std::string_view name) const;
  [[nodiscard]] bool Has(std::string_view name) const { return Find(name) != nullptr; }
  [[nodiscard]] bool empty() const { return list_.empty(); }
  /// Gives back what the list holds in reserve, once all values are set.
  void ShrinkToFit() { list_.shrink_to_fit(); }
  [[nodiscard]] auto begin() const { return list_.begin(); }
  [[nodiscard]] auto end() const { return list_.end(); }

 private:
  std::vector<Argument> list_;
};

}  // namespace ecaudit
