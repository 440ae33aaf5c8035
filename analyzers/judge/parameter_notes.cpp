#include "analyzers/judge/parameter_notes.h"

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "analyzers/judge/shared_notes.h"
#include "analyzers/model/slave_model.h"

namespace ecaudit {
namespace {

struct Setting {
  std::uint64_t value = 0;
  const device::DictionaryObject* object = nullptr;
  FrameNo since = 0;  ///< 0: given by the user
};

std::optional<Setting> SettingOf(const model::SlaveModel& slave, const std::string& keyword) {
  const device::DictionaryObject* object = slave.profile->object_of_keyword(keyword);
  if (object != nullptr) {
    if (const model::ObjectValue* seen = slave.objects.Find(object->index, object->subindex)) {
      return Setting{seen->raw, object, seen->since};
    }
  }
  const auto given = slave.given.find(keyword);
  if (given == slave.given.end()) return std::nullopt;
  return Setting{static_cast<std::uint64_t>(given->second), object, 0};
}

/// The bit of the row has the level that the row describes.
bool Holds(const device::FieldbusParameter& row, std::uint64_t value) {
  const std::uint64_t found = row.bit ? value >> *row.bit & 1U : value;
  return row.value && found == static_cast<std::uint64_t>(*row.value);
}

bool Names(const std::vector<std::string>& rules, const Finding& finding) {
  return std::ranges::find(rules, finding.rule) != rules.end();
}

/// The finding, or one of its notes, is about this word of the EEPROM.
bool IsAbout(const Finding& finding, std::uint16_t word) {
  const auto has = [word](const Arguments& arguments, std::string_view name) {
    const Value* value = arguments.Find(name);
    return value != nullptr && value->number == word;
  };
  return has(finding.arguments, "word") ||
         std::ranges::any_of(finding.notes, [&](const Note& note) { return has(note.arguments, "address"); });
}

void AddEepromFacts(const device::DeviceDescription& family, Finding& finding) {
  for (const device::EepromFact& row : family.eeprom) {
    if (!row.word || !Names(row.rules, finding) || !IsAbout(finding, *row.word)) continue;
    Arguments arguments{{"source", arg::Text(row.source)}, {"fact", arg::Text(row.fact)}};
    if (!row.note.empty()) arguments.Set("note", arg::Text(row.note));
    finding.Add(kManualStates, std::move(arguments));
  }
}

}  // namespace

void AddParameterNotes(const RuleContext& context, FindingStore& store) {
  for (Finding& finding : store.findings()) {
    if (finding.slave == kNoSlave) continue;
    const model::SlaveModel& slave = context.slave(finding.slave);
    if (slave.profile == nullptr) continue;
    AddEepromFacts(*slave.profile, finding);
    for (const device::FieldbusParameter& row : slave.profile->fieldbus_parameters) {
      if (!Names(row.rules, finding)) continue;
      const std::optional<Setting> setting = SettingOf(slave, row.parameter);
      if (!setting || !Holds(row, setting->value)) continue;
      Arguments arguments{
          {"parameter", arg::Text(row.parameter)},
          {"value", arg::Hex(setting->value, 8)},
          {"bit", arg::Text(row.bit ? "bit " + std::to_string(*row.bit) + " = " + std::to_string(*row.value)
                                    : "value " + std::to_string(*row.value))},
          {"meaning", arg::Text(row.meaning)}};
      if (setting->object != nullptr) {
        arguments.Set("object", arg::Object(setting->object->index, setting->object->subindex));
      }
      if (setting->since != 0) arguments.Set("since", arg::Frame(setting->since));
      finding.Add(kParameterSays, std::move(arguments));
    }
  }
}

}  // namespace ecaudit
