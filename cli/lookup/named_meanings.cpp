/// What the manuals call by a name: parameters, numbers that a drive shows, commands of the service tool.
#include <algorithm>
#include <cctype>
#include <set>
#include <utility>

#include "cli/lookup/meanings.h"
#include "cli/lookup/rows_without_number.h"
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

bool IsNameLetter(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_' || c == '.';
}

bool SameText(std::string_view a, std::string_view b) {
  return std::ranges::equal(a, b, SameLetter);
}

/// "SERCSET", "DRV.OPMODE", "n17", "FBUS.PARAM02": what a manual prints so is a name, and no word of a sentence.
bool IsPrintedAsName(std::string_view word) {
  const auto any = [word](auto of) {
    return std::ranges::any_of(word, [of](char c) { return of(static_cast<unsigned char>(c)) != 0; });
  };
  const auto upper = [](unsigned char c) { return std::isupper(c); };
  const auto lower = [](unsigned char c) { return std::islower(c); };
  const auto digit = [](unsigned char c) { return std::isdigit(c); };
  return (any(upper) && !any(lower)) || (any(digit) && (any(upper) || any(lower)));
}

/// "SAMPLEPERIOD" of "FBUS.SAMPLEPERIOD": most write it alone.
std::string_view WithoutGroup(std::string_view word) {
  const std::size_t point = word.rfind('.');
  return point == std::string_view::npos ? word : word.substr(point + 1);
}

/// True where `text` has `name` as a whole word that is printed as a name. Without its group, as "WINDOW", it could be
/// a word of a sentence as well, unless it is typed as a name.
bool MentionsName(std::string_view text, std::string_view name) {
  for (auto begin = text.begin(); begin != text.end();) {
    begin = std::find_if(begin, text.end(), IsNameLetter);
    const auto end = std::find_if_not(begin, text.end(), IsNameLetter);
    std::string_view word(begin, end);
    while (word.ends_with('.')) word.remove_suffix(1);  // of the sentence
    if ((SameText(word, name) || (IsPrintedAsName(name) && SameText(WithoutGroup(word), name))) &&
        IsPrintedAsName(word))
      return true;
    begin = end;
  }
  return false;
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

/// Calls `visit(name, words, note, source)` for each row of the family that has a name or words of its manual.
template <typename Visit>
void ForEachRow(const DeviceDescription& family, Visit visit) {
  const auto parameter = [&](const std::optional<device::DriveParameter>& row, std::string_view what) {
    if (!row) return;
    std::string words(what);
    if (row->object) words += ", object " + ObjectName(row->object->index, row->object->subindex);
    if (row->object && row->object_inferred) words += " (of a sister family)";
    visit(row->keyword, words, row->note, row->source);
  };
  const device::SyncDescription& sync = family.sync;
  // What the drive warns of, it also warns of at other moments: the rows of the manual have them.
  for (const std::string& number : sync.lost_faults) {
    const bool missing = sync.lost_after_missing.value.has_value();
    const auto& limit = missing ? sync.lost_after_missing : sync.lost_after_jitter;
    if (!limit.value) continue;
    const std::string after = missing ? "more than " + Count(*limit, "missing frame") + " while the drive is enabled"
                                      : Count(*limit, "consecutive cycle") + " outside the permitted jitter";
    visit(number + " (fault)", "synchronisation lost, after " + after, limit.note, limit.source);
  }
  for (const device::FieldbusParameter& row : family.fieldbus_parameters) {
    std::string name = row.parameter;
    if (row.bit) name += " bit " + std::to_string(*row.bit);
    if (row.value) name += " = " + std::to_string(*row.value);
    visit(name, row.meaning, row.note, row.source);
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
    JoinedRow words;
    words.Add(row.meaning);
    if (!row.unit.empty()) words.Add("unit " + row.unit);
    if (!row.default_value.empty()) words.Add("default " + row.default_value);
    if (!row.limit.empty()) words.Add("limit " + row.limit);
    visit(JoinedRow().Add(row.parameter).Add(row.object).Take(), words.Take(), row.note, row.source);
  }
  for (const device::AlTransition& row : family.al.transitions) {
    JoinedRow words;
    words.Add(row.action).Add(row.requirement.empty() ? "" : "requires: " + row.requirement, "; ");
    visit(JoinedRow().Add(esc::StateName(row.from)).Add(esc::StateName(row.to), " -> ").Take(), words.Take(), row.note,
          row.source);
  }
  if (family.drive) {
    for (const device::EdgeAction& row : family.drive->edge_actions) {
      JoinedRow words;
      words.Add(row.action).Add(row.condition.empty() ? "" : "condition: " + row.condition, "; ");
      visit((row.rising ? "rising" : "falling") + std::string(" edge of control word bit ") + std::to_string(row.bit),
            words.Take(), row.note, row.source);
    }
    for (const device::OperationMode& row : family.drive->modes) {
      visit("mode " + std::to_string(row.value) + " (6060h)", ModeWithParameters(*family.drive, row), row.note,
            row.source);
    }
    for (const auto* bits : {&family.drive->control_bits, &family.drive->status_bits}) {
      const bool control = bits == &family.drive->control_bits;
      for (const device::WordBit& row : *bits) {
        visit((control ? "control" : "status") + std::string(" word bit ") + std::to_string(row.bit),
              JoinedRow().Add(row.name).Add(row.meaning).Take(), row.note, row.source);
      }
    }
  }
  for (const device::EepromFact& row : family.eeprom) {
    visit(JoinedRow().Add("EEPROM, " + row.kind).Add(row.key).Take(), row.fact, row.note, row.source);
  }
  for (const device::Limit& row : family.limits) {
    visit(row.name, JoinedRow().Add(row.value).Add(row.unit, " ").Add(row.meaning).Take(), row.note, row.source);
  }
  for (const device::Fact& row : family.facts) {
    visit(JoinedRow().Add(row.category).Add(row.name).Take(), row.value, row.note, row.source);
  }
  for (const RowWithoutNumber& row : RowsWithoutNumber(family)) visit(row.title, row.words, row.note, row.source);
  if (family.dictionary) {
    for (const device::DictionaryObject& row : family.dictionary->objects) {
      if (row.keyword.empty()) continue;
      const std::string object = "object " + ObjectName(row.index, row.head ? -1 : row.subindex);
      visit(row.keyword, JoinedRow().Add(object).Add(row.name).Take(), row.note, row.source);
    }
  }
  if (family.emergency) {
    for (const device::EmergencyCode& row : family.emergency->codes) {
      const std::string id = row.id.empty() ? Hex(row.code) : row.id;
      visit(JoinedRow().Add(id).Add(KindWord(row.kind), " ").Take(), row.text, row.note, row.source);
    }
  }
}

}  // namespace

std::string ModeWithParameters(const device::DriveProfile& drive, const device::OperationMode& mode) {
  std::string text = mode.name;
  if (mode.opmode) text += ", " + drive.opmode_parameter + " " + std::to_string(*mode.opmode);
  if (mode.printed_opmode) text += " (printed " + std::to_string(*mode.printed_opmode) + ")";
  if (mode.cmdsource) text += ", " + drive.cmdsource_parameter + " " + std::to_string(*mode.cmdsource);
  return text;
}

void AddNamed(std::string_view name, const Families& families, std::vector<Meaning>& out) {
  if (name.size() < 2) return;
  Meaning meaning{.kind = "name in a manual", .name = std::string(name), .details = {}, .statements = {}};
  std::vector<Statement> known;  // what an earlier meaning states
  for (const Meaning& before : out) known.insert(known.end(), before.statements.begin(), before.statements.end());
  std::set<std::pair<std::string, std::string>> seen;  // each row once
  for (const DeviceDescription* family : families) {
    std::size_t rows = 0;
    ForEachRow(*family, [&](const std::string& title, const std::string& words, const std::string& note,
                            const std::string& source) {
      const bool names =
          SameText(title, name) || MentionsName(title, name) || MentionsName(words, name) || MentionsName(note, name);
      if (!names || !source.starts_with(family->document)) return;
      const bool listed = std::ranges::any_of(known, [&](const Statement& row) {
        return row.family == family->id && row.source == source && row.text.ends_with(words);
      });
      const std::string text = JoinedRow().Add(title).Add(words, ": ").Take();
      if (listed || !seen.emplace(family->id, source + text).second) return;
      if (++rows <= kMostNamedRows) meaning.statements.push_back({family->id, text, note, source});
    });
    if (rows <= kMostNamedRows) continue;
    meaning.statements.push_back(
        {family->id, Count(rows - kMostNamedRows, "more row"), "ecaudit profiles " + family->id + " --full", {}});
  }
  if (!meaning.statements.empty()) out.push_back(std::move(meaning));
}

}  // namespace ecaudit::cli::lookup
