#include "analyzers/result/argument.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "decoder/base/text.h"
#include "decoder/esc/al.h"

namespace ecaudit {
namespace {

Value Numeric(Value::Type type, std::int64_t number) {
  Value value;
  value.type = type;
  value.number = number;
  return value;
}

Value InTime(std::int64_t ns, std::string_view unit) {
  Value value = Numeric(Value::Type::kDuration, ns);
  value.unit = unit;
  return value;
}

Value Textual(Value::Type type, std::string_view text) {
  Value value;
  value.type = type;
  value.SetText(text);
  return value;
}

bool IsTextItself(Value::Type type) {
  return type == Value::Type::kText || type == Value::Type::kBytes;
}

}  // namespace

struct Value::More {
  std::string text;
  std::vector<Value> items;
};

const std::string& Value::text() const {
  static const std::string none;
  return more_ == nullptr ? none : more_->text;
}

const std::vector<Value>& Value::items() const {
  static const std::vector<Value> none;
  return more_ == nullptr ? none : more_->items;
}

void Value::SetText(std::string_view text) {
  more_ = text.empty() ? nullptr : std::make_shared<const More>(More{std::string(text), {}});
}

void Value::SetItems(std::vector<Value> items) {
  more_ = std::make_shared<const More>(More{{}, std::move(items)});
}

bool Value::operator==(const Value& other) const {
  if (type != other.type || number != other.number) return false;
  if (IsTextItself(type) && text() != other.text()) return false;
  const std::string_view mine = word == nullptr ? std::string_view() : word->code;
  const std::string_view theirs = other.word == nullptr ? std::string_view() : other.word->code;
  return mine == theirs && items() == other.items();
}

std::string KeyOf(const Value& value) {
  switch (value.type) {
    case Value::Type::kText:
    case Value::Type::kBytes:
      return value.text();
    case Value::Type::kWord:
      return std::string(value.word->code);
    case Value::Type::kReal:
      return Fixed(value.real(), value.digits);
    case Value::Type::kList: {
      std::string key;
      for (const Value& item : value.items()) key += (key.empty() ? "" : "+") + KeyOf(item);
      return key;
    }
    case Value::Type::kHex:
    case Value::Type::kCode:
    case Value::Type::kRegister:
      return Hex(static_cast<std::uint64_t>(value.number), value.digits);
    case Value::Type::kObject:
      return ObjectName(static_cast<std::uint16_t>(value.number >> 9U), static_cast<int>(value.number & 0x1FF) - 1);
    case Value::Type::kAlState:
      return esc::StateName(static_cast<std::uint8_t>(value.number));
    default:
      return std::to_string(value.number);
  }
}

namespace arg {

Value Number(std::int64_t value, std::string_view meaning) {
  Value out = Numeric(Value::Type::kNumber, value);
  out.SetText(meaning);
  return out;
}

Value Hex(std::uint64_t value, int digits) {
  Value out = Numeric(Value::Type::kHex, static_cast<std::int64_t>(value));
  out.digits = static_cast<std::uint8_t>(digits);
  return out;
}

Value Real(double value, std::string_view unit, int decimals) {
  Value out;
  out.type = Value::Type::kReal;
  out.number = std::bit_cast<std::int64_t>(value);
  out.unit = unit;
  out.digits = static_cast<std::uint8_t>(decimals);
  return out;
}

Value Text(std::string_view text) {
  return Textual(Value::Type::kText, text);
}

Value Flag(bool value) {
  return Numeric(Value::Type::kFlag, value ? 1 : 0);
}

Value Boolean(bool value) {
  return Numeric(Value::Type::kBoolean, value ? 1 : 0);
}

Value Of(const Word& word) {
  Value out;
  out.type = Value::Type::kWord;
  out.word = &word;
  return out;
}

Value Frame(FrameNo number) {
  return Numeric(Value::Type::kFrame, static_cast<std::int64_t>(number));
}

Value Ms(std::int64_t ns) {
  return InTime(ns, "ms");
}

Value Us(std::int64_t ns) {
  return InTime(ns, "us");
}

Value Ns(std::int64_t ns) {
  return InTime(ns, "ns");
}

Value Count(std::uint64_t value, std::string_view noun) {
  Value out = Numeric(Value::Type::kCount, static_cast<std::int64_t>(value));
  out.unit = noun;
  return out;
}

Value Code(std::uint64_t value, std::string_view meaning, int digits) {
  Value out = Numeric(Value::Type::kCode, static_cast<std::int64_t>(value));
  out.SetText(meaning);
  out.digits = static_cast<std::uint8_t>(digits);
  return out;
}

Value Object(std::uint16_t index, int subindex, std::string_view name) {
  Value out = Numeric(Value::Type::kObject, std::int64_t{index} << 9U | (subindex + 1));
  out.SetText(name);
  return out;
}

Value Register(std::uint16_t address, std::string_view name) {
  Value out = Numeric(Value::Type::kRegister, address);
  out.SetText(name);
  return out;
}

Value State(std::uint8_t state) {
  return Numeric(Value::Type::kAlState, state);
}

Value Status(std::uint16_t al_status) {
  return Numeric(Value::Type::kAlStatus, al_status);
}

Value StatusOfAll(std::uint16_t al_status) {
  return Numeric(Value::Type::kAlStatusOfAll, al_status);
}

Value Bytes(ByteSpan bytes) {
  return Textual(Value::Type::kBytes, HexBytes(bytes));
}

Value Slave(SlaveId id, std::string_view label) {
  Value out = Numeric(Value::Type::kSlave, id);
  out.SetText(label);
  return out;
}

Value List(std::vector<Value> items) {
  Value out;
  out.type = Value::Type::kList;
  out.SetItems(std::move(items));
  return out;
}

Value Bits(std::uint64_t mask) {
  std::vector<Value> bits;
  for (; mask != 0; mask &= mask - 1) bits.push_back(Number(std::countr_zero(mask)));
  return List(std::move(bits));
}

}  // namespace arg

Arguments& Arguments::Set(std::string_view name, Value value) {
  for (Argument& argument : list_) {
    if (argument.name != name) continue;
    argument.value = std::move(value);
    return *this;
  }
  list_.push_back({name, std::move(value)});
  return *this;
}

void Arguments::Remove(std::string_view name) {
  std::erase_if(list_, [name](const Argument& argument) { return argument.name == name; });
}

const Value* Arguments::Find(std::string_view name) const {
  for (const Argument& argument : list_) {
    if (argument.name == name) return &argument.value;
  }
  return nullptr;
}

}  // namespace ecaudit
