/// What the manuals call by a name: parameters, numbers that a drive shows, commands of the service tool.
#include <algorithm>
#include <cctype>
#include <set>
#include <utility>

#include "cli/lookup/manual_rows.h"
#include "cli/lookup/meanings.h"
#include "decoder/base/text.h"

namespace ecaudit::cli::lookup {
namespace {

using device::DeviceDescription;

/// More rows would hide the ones that matter.
constexpr std::size_t kMostNamedRows = 60;

/// Case does not distinguish names, and manuals put blanks into them.
bool SameLetter(char a, char b) {
  return std::toupper(static_cast<unsigned char>(a)) == std::toupper(static_cast<unsigned char>(b));
}

bool IsWordLetter(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_';
}

/// True where `text` has `name` as a whole word.
bool Mentions(std::string_view text, std::string_view name) {
  for (auto at = text.begin();;) {
    at = std::search(at, text.end(), name.begin(), name.end(), SameLetter);
    if (at == text.end()) return false;
    const auto after = at + static_cast<std::ptrdiff_t>(name.size());
    const bool begins = at == text.begin() || !IsWordLetter(*(at - 1));
    const bool ends = after == text.end() || !IsWordLetter(*after);
    if (begins && ends) return true;
    ++at;
  }
}

/// Joins the parts of a row that are there: "SERCSET bits 17 and 18: switch off synchronisation monitoring".
class JoinedRow {
 public:
  JoinedRow& Add(std::string_view part, std::string_view separator = ", ") {
    if (part.empty()) return *this;
    if (!text_.empty()) text_ += separator;
    text_ += part;
    return *this;
  }
  [[nodiscard]] std::string Take() { return std::move(text_); }

 private:
  std::string text_;
};

std::string_view KindWord(device::EmergencyKind kind) {
  return kind == device::EmergencyKind::kWarning ? "warning" : kind == device::EmergencyKind::kFault ? "fault" : "";
}

/// Calls `visit(text, note, source)` for each row of the family that has a name or words of its manual.
template <typename Visit>
void ForEachRow(const DeviceDescription& family, Visit visit) {
  const auto parameter = [&](const std::optional<device::DriveParameter>& row, std::string_view what) {
    if (!row) return;
    std::string text = row->keyword + ": " + std::string(what);
    if (row->object) text += ", object " + ObjectName(row->object->index, row->object->subindex);
    if (row->object && row->object_inferred) text += " (of a sister family)";
    visit(text, row->note, row->source);
  };
  const device::SyncDescription& sync = family.sync;
  const auto lost = [&](const std::vector<std::string>& numbers, std::string_view kind) {
    for (const std::string& number : numbers) {
      const bool missing = sync.lost_after_missing.value.has_value();
      const auto& limit = missing ? sync.lost_after_missing : sync.lost_after_jitter;
      if (!limit.value) continue;
      std::string text = number + " (" + std::string(kind) + "): synchronisation lost, after ";
      text += missing ? "more than " + Count(*limit, "missing frame") + " while the drive is enabled"
                      : Count(*limit, "consecutive cycle") + " outside the permitted jitter";
      visit(text, limit.note, limit.source);
    }
  };
  lost(sync.lost_faults, "fault");
  lost(sync.lost_warnings, "warning");
  for (const device::FieldbusParameter& row : family.fieldbus_parameters) {
    std::string text = row.parameter;
    if (row.bit) text += " bit " + std::to_string(*row.bit);
    if (row.value) text += " = " + std::to_string(*row.value);
    visit(text + ": " + row.meaning, row.note, row.source);
  }
  parameter(sync.cycle_count, "cycle of the drive, a multiple of " +
                                  (sync.cycle_base.value ? std::to_string(*sync.cycle_base) + " ns" : "its base"));
  parameter(sync.sync_distance, "wanted distance of SYNC0 and frame");
  parameter(sync.sync_actual, "measured distance of SYNC0 and frame");
  parameter(sync.sync_window, "permitted deviation of the distance");
  parameter(sync.pll_threshold, "cycles until the PLL counts as locked");
  parameter(sync.supervision, "supervision of the synchronisation");
  parameter(sync.pll_switch, "switches the PLL; with distributed clocks it must be on");
  for (const device::SyncParameter& row : sync.parameters) {
    JoinedRow text;
    text.Add(row.parameter).Add(row.object).Add(row.meaning, ": ");
    if (!row.unit.empty()) text.Add("unit " + row.unit);
    if (!row.default_value.empty()) text.Add("default " + row.default_value);
    if (!row.limit.empty()) text.Add("limit " + row.limit);
    visit(text.Take(), row.note, row.source);
  }
  for (const device::AlTransition& row : family.al.transitions) {
    JoinedRow text;
    text.Add(esc::StateName(row.from)).Add(esc::StateName(row.to), " -> ").Add(row.action, ": ");
    text.Add(row.requirement.empty() ? "" : "requires: " + row.requirement, "; ");
    visit(text.Take(), row.note, row.source);
  }
  if (family.drive) {
    for (const device::EdgeAction& row : family.drive->edge_actions) {
      JoinedRow text;
      text.Add((row.rising ? "rising" : "falling") + std::string(" edge of control word bit ") +
               std::to_string(row.bit));
      text.Add(row.action, ": ").Add(row.condition.empty() ? "" : "condition: " + row.condition, "; ");
      visit(text.Take(), row.note, row.source);
    }
    for (const device::OperationMode& row : family.drive->modes) {
      visit("mode " + std::to_string(row.value) + " (6060h): " + ModeText(*family.drive, row), row.note, row.source);
    }
    for (const auto* bits : {&family.drive->control_bits, &family.drive->status_bits}) {
      const bool control = bits == &family.drive->control_bits;
      for (const device::WordBit& row : *bits) {
        JoinedRow text;
        text.Add((control ? "control" : "status") + std::string(" word bit ") + std::to_string(row.bit));
        visit(text.Add(row.name, ": ").Add(row.meaning).Take(), row.note, row.source);
      }
    }
  }
  for (const device::EepromFact& row : family.eeprom) {
    visit(JoinedRow().Add("EEPROM, " + row.kind).Add(row.key).Add(row.fact, ": ").Take(), row.note, row.source);
  }
  for (const device::Limit& row : family.limits) {
    visit(JoinedRow().Add(row.name).Add(row.value, ": ").Add(row.unit, " ").Add(row.meaning).Take(), row.note,
          row.source);
  }
  for (const device::Fact& row : family.facts) {
    visit(JoinedRow().Add(row.category).Add(row.name).Add(row.value, ": ").Take(), row.note, row.source);
  }
  for (const ManualRow& row : ManualRows(family)) visit(row.text, row.note, row.source);
  if (family.dictionary) {
    for (const device::DictionaryObject& row : family.dictionary->objects) {
      if (row.keyword.empty()) continue;
      JoinedRow text;
      text.Add(row.keyword).Add(ObjectName(row.index, row.head ? -1 : row.subindex), ": object ").Add(row.name);
      visit(text.Take(), row.note, row.source);
    }
  }
  if (family.emergency) {
    for (const device::EmergencyCode& row : family.emergency->codes) {
      JoinedRow text;
      text.Add(row.id).Add(KindWord(row.kind), " ").Add(row.text, ": ");
      visit(text.Take(), row.note, row.source);
    }
  }
}

}  // namespace

std::string ModeText(const device::DriveProfile& drive, const device::OperationMode& mode) {
  std::string text = mode.name;
  if (mode.opmode) text += ", " + drive.opmode_parameter + " " + std::to_string(*mode.opmode);
  if (mode.printed_opmode) text += " (printed " + std::to_string(*mode.printed_opmode) + ")";
  if (mode.cmdsource) text += ", " + drive.cmdsource_parameter + " " + std::to_string(*mode.cmdsource);
  return text;
}

void AddNamed(std::string_view name, const Families& families, std::vector<Meaning>& out) {
  if (name.size() < 2) return;
  Meaning meaning{.kind = "name in a manual", .name = std::string(name), .details = {}, .statements = {}};
  std::set<std::pair<std::string, std::string>> earlier;  // what an earlier meaning states
  for (const Meaning& before : out) {
    for (const Statement& row : before.statements) earlier.emplace(row.family, row.source + row.text);
  }
  std::set<std::pair<std::string, std::string>> known;  // each row once
  for (const DeviceDescription* family : families) {
    std::size_t rows = 0;
    ForEachRow(*family, [&](const std::string& text, const std::string& note, const std::string& source) {
      if (!Mentions(text, name) && !Mentions(note, name)) return;
      if (rows == kMostNamedRows || !source.starts_with(family->document)) return;
      const bool listed = std::any_of(earlier.begin(), earlier.end(), [&](const auto& row) {
        return row.first == family->id && row.second.ends_with(text.substr(text.find(':') + 1));
      });
      if (listed || !known.emplace(family->id, source + text).second) return;
      meaning.statements.push_back({family->id, text, note, source});
      ++rows;
    });
  }
  if (!meaning.statements.empty()) out.push_back(std::move(meaning));
}

}  // namespace ecaudit::cli::lookup
