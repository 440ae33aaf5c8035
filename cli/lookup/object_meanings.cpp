/// Objects by family: names, types, access, and for the words of a drive their bits.
#include <algorithm>
#include <cctype>

#include "analyzers/objects/object_names.h"
#include "analyzers/objects/object_words.h"
#include "cli/lookup/meanings.h"
#include "decoder/base/names.h"
#include "decoder/base/text.h"

namespace ecaudit::cli::lookup {
namespace {

using device::Access;
using device::DeviceDescription;
using device::DictionaryObject;

/// A long array is the same row again and again; a page shows the first ones.
constexpr std::size_t kMostRows = 40;
/// The families that have no bits of their own inherit those of the standard.
constexpr std::uint16_t kErrorRegister = 0x1001;

void Join(std::string& text, std::string_view part) {
  if (part.empty()) return;
  if (!text.empty()) text += ", ";
  text += part;
}

std::string_view Name(Access access) {
  static constexpr Named<Access> kNames[] = {
      {Access::kUnknown, ""},
      {Access::kNone, ""},
      {Access::kRead, "read only"},
      {Access::kWrite, "write only"},
      {Access::kReadWrite, "read and write"},
  };
  static_assert(NamesAll(kNames, Access::kReadWrite));
  return NameIn(kNames, access);
}

std::string_view Name(device::Mappable mappable) {
  static constexpr Named<device::Mappable> kNames[] = {
      {device::Mappable::kUnknown, ""},
      {device::Mappable::kNo, "not mappable"},
      {device::Mappable::kYes, "mappable"},
      {device::Mappable::kConditional, "mappable under a condition"},
  };
  static_assert(NamesAll(kNames, device::Mappable::kConditional));
  return NameIn(kNames, mappable);
}

/// ":1 Vendor ID, UINT32, read only, mappable"
std::string RowText(const DictionaryObject& row) {
  std::string text = row.name;
  if (!row.head) {
    std::string types;
    for (const device::DataType type : row.types) {
      const std::string_view name = device::DataTypeName(type);
      if (name.empty() || type == device::DataType::kUnknown) continue;
      types += (types.empty() ? "" : " or ") + std::string(name);
    }
    Join(text, types);
    if (!row.printed_type.empty()) text += " (printed " + row.printed_type + ")";
    Join(text, row.constant ? "constant" : Name(row.access));
    if (!row.printed_access.empty()) text += " (printed " + row.printed_access + ")";
    Join(text, Name(row.mappable));
    if (row.only) Join(text, *row.only == device::PdoDirection::kRx ? "in RxPDOs only" : "in TxPDOs only");
    Join(text, row.unit.empty() ? "" : "unit " + row.unit);
    Join(text, row.scale.empty() ? "" : "scale " + row.scale);
    if (!row.pdo_scale.empty()) Join(text, "in the process data scale " + row.pdo_scale);
    if (!row.pdo_unit.empty()) Join(text, "in the process data unit " + row.pdo_unit);
    if (row.max_bytes != 0) Join(text, "at most " + Count(row.max_bytes, "byte"));
    Join(text, row.keyword.empty() ? "" : "parameter " + row.keyword);
  }
  std::string place;
  if (!row.head && row.last_subindex != row.subindex) {
    place = ":" + std::to_string(row.subindex) + "-" + std::to_string(row.last_subindex) + " ";
  } else if (!row.head && row.subindex != 0) {
    place = ":" + std::to_string(row.subindex) + " ";
  }
  return place + text;
}

/// The rows of an index in the list, one statement each.
void AddRows(const std::string& family, const std::vector<DictionaryObject>& rows, std::uint16_t index,
             std::optional<std::uint8_t> subindex, std::vector<Statement>& out) {
  std::size_t shown = 0;
  std::size_t more = 0;
  for (const DictionaryObject& row : rows) {
    if (row.index != index) continue;
    if (subindex && !row.head && !row.Covers(*subindex)) continue;
    if (++shown > kMostRows) {
      ++more;
      continue;
    }
    out.push_back({family, RowText(row), row.note, row.source});
  }
  if (more > 0) out.push_back({family, Count(more, "more row"), "ecaudit profiles " + family + " --full", {}});
}

void AddWordBits(const std::string& name, const std::vector<device::WordBit>& bits, std::vector<Statement>& out) {
  for (const device::WordBit& bit : bits) {
    std::string text = "bit " + std::to_string(bit.bit) + ": " + bit.name;
    Join(text, bit.meaning);
    out.push_back({name, text, bit.note, bit.source});
  }
}

/// Bits and values of objects that are no word of the state machine: of the object itself, and of the fieldbus
/// parameter that it holds.
void AddObjectBits(const DeviceDescription& family, const std::string& name, std::uint16_t index,
                   std::optional<std::uint8_t> subindex, std::vector<Statement>& out) {
  for (const device::ObjectBits& row : family.object_bits) {
    if (row.index != index || (subindex && row.subindex != *subindex)) continue;
    std::string text = events::BitsName(row.first, row.last);
    if (row.value) text += " = " + std::to_string(*row.value);
    text += ": " + row.name;
    Join(text, row.meaning);
    out.push_back({name, text, row.note, row.source});
  }
  const DictionaryObject* object = family.dictionary ? family.dictionary->Find(index, subindex.value_or(0)) : nullptr;
  if (object != nullptr && !object->keyword.empty()) {
    for (const device::FieldbusParameter& row : family.fieldbus_parameters) {
      if (row.parameter != object->keyword) continue;
      std::string text = row.parameter;
      if (row.bit) text += " bit " + std::to_string(*row.bit);
      if (row.value) text += " = " + std::to_string(*row.value);
      out.push_back({name, text + ": " + row.meaning, row.note, row.source});
    }
  }
}

void AddModes(const std::string& name, const device::DriveProfile& drive, std::vector<Statement>& out) {
  for (const device::OperationMode& mode : drive.modes) {
    out.push_back(
        {name, "value " + std::to_string(mode.value) + ": " + ModeWithParameters(drive, mode), mode.note, mode.source});
  }
}

/// "mode 6 (Homing): bit 4 homing_operation_start, bit 5 reserved, bit 6 reserved"
void AddModeBits(const std::string& name, const device::DriveProfile& drive, std::vector<Statement>& out) {
  for (const device::ModeBits& row : drive.mode_bits) {
    std::string bits;
    if (!row.bit4.empty()) Join(bits, "bit 4 " + row.bit4);
    if (!row.bit5.empty()) Join(bits, "bit 5 " + row.bit5);
    if (!row.bit6.empty()) Join(bits, "bit 6 " + row.bit6);
    out.push_back({name, "mode " + std::to_string(row.mode) + " (" + row.name + "): " + bits, row.note, row.source});
  }
}

/// "Quick stop: bit 2 = 0, bit 1 = 1; transitions 7, 10, 11", and what each edge does.
void AddCommands(const std::string& name, const device::DriveProfile& drive, std::vector<Statement>& out) {
  for (const device::DriveCommand& row : drive.commands) {
    std::string bits;
    for (int bit = 15; bit >= 0; --bit) {
      if ((row.mask >> bit & 1U) == 0) continue;
      const bool rises = (row.rising >> bit & 1U) != 0;
      const bool falls = (row.falling >> bit & 1U) != 0;
      Join(bits, "bit " + std::to_string(bit) +
                     (rises   ? " rises"
                      : falls ? " falls"
                              : " = " + std::to_string(row.value >> bit & 1U)));
    }
    std::string transitions;
    for (const std::uint8_t number : row.transitions) Join(transitions, std::to_string(number));
    out.push_back({name,
                   "command " + row.name + (row.variant.empty() ? "" : " " + row.variant) + ": " +
                       (bits.empty() ? "any word" : bits) + "; " +
                       (row.transitions.size() == 1 ? "transition " : "transitions ") + transitions,
                   row.note, row.source});
  }
  for (const device::EdgeAction& row : drive.edge_actions) {
    std::string text =
        std::string(row.rising ? "rising" : "falling") + " edge of bit " + std::to_string(row.bit) + ": " + row.action;
    if (!row.condition.empty()) text += "; condition: " + row.condition;
    out.push_back({name, text, row.note, row.source});
  }
}

/// The bits of a latch word.
void AddLatchBits(const std::string& name, const device::LatchDescription& latch, std::uint16_t index,
                  std::vector<Statement>& out) {
  const bool control = index == latch.control_object;
  if (!control && index != latch.status_object) return;
  out.push_back({name, control ? "latch control word" : "latch status word", latch.note, latch.source});
  for (const device::LatchField& row : control ? latch.control : latch.status) {
    std::string text = events::BitsName(row.first, row.last);
    if (!row.reserved) text += " (word & " + Hex(row.mask) + ") = " + Hex(row.value);
    out.push_back({name, text + ": " + row.meaning, row.note, row.source});
  }
}

/// Where the positions of a latch are, and which capture unit it shares with a touch probe.
void AddLatchEdges(const std::string& name, const device::LatchDescription& latch, std::uint16_t index,
                   std::vector<Statement>& out) {
  if (index != latch.control_object && index != latch.status_object) return;
  for (const device::LatchEdge& row : latch.edges) {
    std::string text = row.name + ": armed by " + Hex(row.enable) + ", valid " + Hex(row.valid);
    if (row.selector != 0) Join(text, "selector " + std::to_string(row.selector));
    for (const device::ObjectAddress& at : row.positions) Join(text, "position " + ObjectName(at.index, at.subindex));
    if (row.touch_probe != 0) Join(text, "same unit as touch probe " + std::to_string(row.touch_probe));
    Join(text, row.capture_unit.empty() ? "" : "unit " + row.capture_unit);
    out.push_back({name, text, row.note, row.source});
  }
}

/// "fault number, 1 is F1": what the object holds of faults and warnings.
/// @param standard  whose rows a family repeats; null: none, or this is the standard
void AddNumbers(const DeviceDescription& family, const std::string& name, const device::DriveProfile* standard,
                std::uint16_t index, std::optional<std::uint8_t> subindex, std::vector<Statement>& out) {
  const auto add = [&](const std::vector<device::FaultObject>& rows) {
    for (const device::FaultObject& row : rows) {
      if (row.index != index || (subindex && !row.Holds(index, *subindex))) continue;
      const device::FaultObject* common =
          standard == nullptr ? nullptr : standard->FindFaultObject(index, row.subindex);
      if (common != nullptr && common->source == row.source) continue;
      std::string text(device::FaultValueName(row.kind));
      if (!row.prefix.empty()) text += ", 1 is " + row.prefix + "1";
      out.push_back({name, text, row.note, row.source});
    }
  };
  if (family.drive) add(family.drive->fault_objects);
  add(family.reported_objects);
}

/// What only drives have: the bits of control and status word, the modes of operation.
void AddDriveWords(const DeviceDescription& family, const std::string& name, const device::DriveProfile* standard,
                   std::uint16_t index, std::vector<Statement>& out) {
  if (!family.drive) return;
  std::vector<Statement> rows;
  if (index == 0x6040) {
    AddWordBits(name, family.drive->control_bits, rows);
    AddModeBits(name, *family.drive, rows);
    AddCommands(name, *family.drive, rows);
  }
  if (index == 0x6041) {
    for (const device::DriveStateRow& row : family.drive->states) {
      rows.push_back({name,
                      "state " + std::string(device::DriveStateName(row.state)) + ": (word & " + Hex(row.printed.mask) +
                          ") = " + Hex(row.printed.value) + (row.meaning.empty() ? "" : ", " + row.meaning),
                      row.note, row.source});
    }
    AddWordBits(name, family.drive->status_bits, rows);
  }
  if (index == 0x6060 || index == 0x6061) AddModes(name, *family.drive, rows);
  // A family without a statement of its own repeats the standard.
  if (standard != nullptr && standard != &*family.drive) {
    std::vector<Statement> common;
    if (index == 0x6040) {
      AddWordBits(name, standard->control_bits, common);
      AddModeBits(name, *standard, common);
      AddCommands(name, *standard, common);
    }
    if (index == 0x6041) AddWordBits(name, standard->status_bits, common);
    if (index == 0x6060 || index == 0x6061) AddModes(name, *standard, common);
    rows.erase(std::remove_if(rows.begin(), rows.end(),
                              [&](const Statement& row) {
                                return std::ranges::any_of(common, [&](const Statement& known) {
                                  return known.text == row.text && known.source == row.source;
                                });
                              }),
               rows.end());
  }
  out.insert(out.end(), std::make_move_iterator(rows.begin()), std::make_move_iterator(rows.end()));
}

void AddPdos(const DeviceDescription& family, const std::string& name, std::uint16_t index,
             std::optional<std::uint8_t> subindex, std::vector<Statement>& out) {
  if (const device::PdoContent* pdo = family.pdo.FindFixed(index)) {
    std::string text = std::string(pdo->direction == device::PdoDirection::kRx ? "RxPDO" : "TxPDO");
    if (!pdo->name.empty()) text += " " + pdo->name;
    if (pdo->known) text += ", " + std::to_string(pdo->bits()) + " bits:";
    for (const device::PdoEntry& entry : pdo->entries) {
      text += " " + (entry.index == 0 ? std::string("padding") : ObjectName(entry.index, entry.subindex)) + " " +
              (entry.name.empty() ? "" : entry.name + " ") + "(" + std::to_string(entry.bits) + ")" +
              (&entry == &pdo->entries.back() ? "" : ",");
    }
    if (!pdo->known) text += ", content not in the manual";
    out.push_back({name, text, pdo->note, pdo->source});
  }
  for (const device::SelectablePdo& row : family.pdo.selectable) {
    if (row.index != index || !row.example_only) continue;
    out.push_back({name, "appears in an example only", row.note, row.source});
  }
  for (const device::CyclicObject& row : family.pdo.cyclic) {
    if (row.index != index || (subindex && row.subindex != *subindex)) continue;
    std::string text = (row.subindex == 0 ? "" : ":" + std::to_string(row.subindex) + " ") + row.name;
    Join(text, row.type == device::DataType::kUnknown ? std::string_view() : device::DataTypeName(row.type));
    Join(text, row.direction == device::PdoDirection::kRx ? "cyclic from the master" : "cyclic from the drive");
    out.push_back({name, text, row.note, row.source});
  }
}

/// Parameters of the synchronisation that SDO reaches in the object.
void AddParameters(const DeviceDescription& family, const std::string& name, std::uint16_t index,
                   std::optional<std::uint8_t> subindex, std::vector<Statement>& out) {
  if (!family.sync.source.starts_with(family.document)) return;
  for (const device::DriveParameter* row : family.sync.DriveParameters()) {
    if (!row->object || row->object->index != index || (subindex && row->object->subindex != *subindex)) continue;
    std::string text = row->object->subindex == 0 ? "" : ":" + std::to_string(row->object->subindex) + " ";
    text += "parameter " + row->keyword;
    if (row->object_inferred) text += " (object of a sister family)";
    out.push_back({name, text, row->note, row->source});
  }
  std::string place = Hex(index, 4);
  for (char& c : place) c = c == 'x' ? c : static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  for (const device::SyncParameter& row : family.sync.parameters) {
    if (!row.object.starts_with(place)) continue;
    if (subindex && !row.object.ends_with(":" + std::to_string(*subindex))) continue;
    std::string text = row.object.size() > place.size() ? row.object.substr(place.size()) + " " : "";
    text += row.parameter;
    Join(text, row.meaning);
    Join(text, row.limit.empty() ? "" : "limit " + row.limit);
    out.push_back({name, text, row.note, row.source});
  }
}

/// As the first family calls it that lists it.
std::string NameInFamilies(const events::ObjectNames& names, std::uint16_t index, std::optional<std::uint8_t> subindex,
                           const Families& families) {
  for (const DeviceDescription* family : families) {
    const events::ObjectInfo info = subindex ? names.Find(family, index, *subindex) : names.FindWhole(family, index);
    if (!info.name.empty()) return info.name;
  }
  return {};
}

}  // namespace

void AddObject(std::uint16_t index, std::optional<std::uint8_t> subindex, const Families& families,
               std::vector<Meaning>& out) {
  Meaning meaning{
      .kind = "object", .name = ObjectName(index, subindex ? *subindex : -1), .details = {}, .statements = {}};
  const DeviceDescription* generic = nullptr;
  for (const DeviceDescription* family : families) {
    if (family->id == "generic") generic = family;
  }
  const auto add = [&](const DeviceDescription& family, const std::string& name) {
    const bool is_standard = &family == generic;
    const auto inherited = [&](const DictionaryObject* row) {
      const DictionaryObject* standard =
          generic == nullptr || row == nullptr ? nullptr : generic->object(index, row->subindex);
      return !is_standard && standard != nullptr && row != nullptr && standard->source == row->source;
    };
    const std::size_t before = meaning.statements.size();
    if (family.dictionary && !inherited(family.dictionary->FindIndex(index))) {
      AddRows(name, family.dictionary->objects, index, subindex, meaning.statements);
    }
    if (family.drive && meaning.statements.size() == before &&
        !inherited(device::FindObjectHead(family.drive->objects, index))) {
      AddRows(name, family.drive->objects, index, subindex, meaning.statements);
    }
    AddPdos(family, name, index, subindex, meaning.statements);
    const bool own_bits =
        is_standard || generic == nullptr || family.object_bits.size() != generic->object_bits.size() ||
        (!family.object_bits.empty() && family.object_bits.front().source != generic->object_bits.front().source);
    if (own_bits || index != kErrorRegister) AddObjectBits(family, name, index, subindex, meaning.statements);
    AddParameters(family, name, index, subindex, meaning.statements);
    AddNumbers(family, name, is_standard || generic == nullptr || !generic->drive ? nullptr : &*generic->drive, index,
               subindex, meaning.statements);
    for (const auto* latch : {&family.latch, &family.touch_probe}) {
      if (!*latch || !(*latch)->source.starts_with(family.document)) continue;
      AddLatchBits(name, **latch, index, meaning.statements);
      AddLatchEdges(name, **latch, index, meaning.statements);
    }
    AddDriveWords(family, name, generic != nullptr && generic->drive ? &*generic->drive : nullptr, index,
                  meaning.statements);
  };
  if (generic != nullptr) add(*generic, "standard");
  for (const DeviceDescription* family : families) {
    if (family != generic) add(*family, family->id);
  }
  // Ranges of the standard (PDO mappings, PDO assignments), which no list has one by one.
  const events::ObjectNames names;
  events::ObjectInfo info = subindex ? names.Find(nullptr, index, *subindex) : names.FindWhole(nullptr, index);
  if (!subindex && generic != nullptr && generic->drive) {
    const DictionaryObject* head = device::FindObjectHead(generic->drive->objects, index);
    if (head != nullptr && head->head && !head->name.empty()) info.name = head->name;
  }
  if (!info.name.empty()) meaning.name += " " + info.name;
  if (meaning.statements.empty()) {
    if (info.name.empty()) return;
    meaning.statements.push_back({"standard", info.name, {}, "ETG1000.6, object dictionary"});
  }
  if (info.name.empty()) {
    const std::string name = NameInFamilies(names, index, subindex, families);
    if (!name.empty()) meaning.name += " " + name;
  }
  out.push_back(std::move(meaning));
}

}  // namespace ecaudit::cli::lookup
