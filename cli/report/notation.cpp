#include "cli/report/notation.h"

#include "decoder/base/names.h"
#include "decoder/base/text.h"
#include "decoder/esc/al.h"

namespace ecaudit::report {
namespace {

/// "0x001d (meaning)"
std::string Explained(const std::string& number, const std::string& meaning, Form form) {
  if (form == Form::kMeaning) return meaning;
  if (form == Form::kNumber || meaning.empty()) return number;
  return number + " (" + meaning + ")";
}

std::string ObjectTextOf(const Value& value, Form form) {
  const auto index = static_cast<std::uint16_t>(value.number >> 9U);
  const int subindex = static_cast<int>(value.number & 0x1FF) - 1;
  const std::string name = Printable(value.text());
  if (form == Form::kMeaning) return name;
  const std::string number = ObjectName(index, subindex);
  return form == Form::kNumber || name.empty() ? number : number + " " + name;
}

/// "a, b and c"
std::string ListText(const std::vector<Value>& items, Form form) {
  std::string text;
  for (std::size_t i = 0; i < items.size(); ++i) {
    if (i > 0) text += i + 1 == items.size() ? " and " : ", ";
    text += TextOf(items[i], i > 0 && items[i].type == Value::Type::kFrame ? Form::kNumber : form);
  }
  return text;
}

}  // namespace

std::string TextOf(const Value& value, Form form) {
  const auto natural = static_cast<std::uint64_t>(value.number);
  switch (value.type) {
    case Value::Type::kNumber:
      return Explained(std::to_string(value.number), Printable(value.text()), form);
    case Value::Type::kHex:
      return Hex(natural, value.digits);
    case Value::Type::kReal:
      return Fixed(value.real(), value.digits) + (value.unit.empty() ? "" : " " + std::string(value.unit));
    case Value::Type::kText:
      return Printable(value.text());
    case Value::Type::kFlag:
    case Value::Type::kBoolean:
      return value.number != 0 ? "yes" : "no";
    case Value::Type::kWord:
      return std::string(value.word->text);
    case Value::Type::kFrame:
      return (form == Form::kNumber ? "" : "frame ") + std::to_string(value.number);
    case Value::Type::kDuration:
      return Duration(value.number);
    case Value::Type::kCount:
      return form == Form::kNumber ? Grouped(natural) : Count(natural, value.unit);
    case Value::Type::kCode:
      return Explained(Hex(natural, value.digits), Printable(value.text()), form);
    case Value::Type::kObject:
      return ObjectTextOf(value, form);
    case Value::Type::kRegister: {
      const std::string name = Printable(value.text());
      if (form == Form::kMeaning) return name;
      return name.empty() || form == Form::kNumber ? Hex(natural) : name + " (" + Hex(natural) + ")";
    }
    case Value::Type::kAlState:
      return esc::StateName(static_cast<std::uint8_t>(value.number));
    case Value::Type::kAlStatus:
      return form == Form::kNumber ? Hex(natural) : esc::StatusText(static_cast<std::uint16_t>(value.number));
    case Value::Type::kAlStatusOfAll:
      return form == Form::kNumber ? Hex(natural) : esc::StatesOfAllText(static_cast<std::uint16_t>(value.number));
    case Value::Type::kBytes:
      return value.text();
    case Value::Type::kSlave:
      return Printable(value.text());
    case Value::Type::kList:
      return ListText(value.items(), form);
  }
  return {};
}

std::string_view Name(Value::Type type) {
  static constexpr Named<Value::Type> kNames[] = {
      {Value::Type::kNumber, "number"},      {Value::Type::kHex, "hex"},
      {Value::Type::kReal, "real"},          {Value::Type::kText, "text"},
      {Value::Type::kFlag, "flag"},          {Value::Type::kBoolean, "boolean"},
      {Value::Type::kWord, "word"},          {Value::Type::kFrame, "frame"},
      {Value::Type::kDuration, "duration"},  {Value::Type::kCount, "count"},
      {Value::Type::kCode, "code"},          {Value::Type::kObject, "object"},
      {Value::Type::kRegister, "register"},  {Value::Type::kAlState, "al-state"},
      {Value::Type::kAlStatus, "al-status"}, {Value::Type::kAlStatusOfAll, "al-status-of-all"},
      {Value::Type::kBytes, "bytes"},        {Value::Type::kSlave, "slave"},
      {Value::Type::kList, "list"},
  };
  static_assert(NamesAll(kNames, Value::Type::kList));
  return NameIn(kNames, type);
}

bool IsPlural(const Value& value) {
  if (value.type == Value::Type::kList) return value.items().size() != 1;
  if (value.type == Value::Type::kWord) return value.word->plural;
  return value.number != 1;
}

}  // namespace ecaudit::report
