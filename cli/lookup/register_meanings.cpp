/// Registers with their bits, and the commands of datagrams.
#include <algorithm>

#include "cli/lookup/meanings.h"
#include "decoder/base/names.h"
#include "decoder/base/text.h"
#include "decoder/esc/register_map.h"
#include "decoder/wire/command.h"

namespace ecaudit::cli::lookup {
namespace {

using device::DeviceDescription;

std::string_view Text(esc::EcatAccess access) {
  static constexpr Named<esc::EcatAccess> kNames[] = {
      {esc::EcatAccess::READ, "the master may read"},
      {esc::EcatAccess::READ_ACKNOWLEDGE, "the master may read, which acknowledges or clears"},
      {esc::EcatAccess::READ_WRITE, "the master may read and write"},
      {esc::EcatAccess::WRITE_IF, "the master may read, and write in some situations"},
      {esc::EcatAccess::WRITE_EFFECT, "the master may read and write; what is read is not what was written"},
      {esc::EcatAccess::WRITE_CLEARS, "the master may read; any write clears it"},
  };
  static_assert(NamesAll(kNames, esc::EcatAccess::WRITE_CLEARS));
  return NameIn(kNames, access);
}

/// Empty for those that need no explanation.
std::string_view Text(esc::Unit unit) {
  using esc::Unit;
  static constexpr Named<esc::Unit> kNames[] = {
      {Unit::SIGNED, "signed"},
      {Unit::KIB, "KiB"},
      {Unit::BYTES, "bytes"},
      {Unit::BIT, "number of a bit"},
      {Unit::NS, "ns"},
      {Unit::SIGNED_NS, "ns, signed"},
      {Unit::DC_TIME, "ns since 2000-01-01, or its lower 32 bits"},
      {Unit::MAGNITUDE_NS, "ns, 31 bits and a sign"},
      {Unit::TEN_NS, "10 ns each"},
      {Unit::WATCHDOG_STEP, "(value + 2) * 40 ns"},
      {Unit::WATCHDOG_TIME, "steps of 0x0400; 0: off"},
      {Unit::AL_STATE, "1 INIT, 2 PREOP, 3 BOOT, 4 SAFEOP, 8 OP; bit 4 of AL Status: error"},
      {Unit::AL_STATUS, "1 INIT, 2 PREOP, 3 BOOT, 4 SAFEOP, 8 OP; bit 4 of AL Status: error"},
      {Unit::AL_STATUS_CODE, "AL status code (ecaudit explain 0x0017)"},
      {Unit::EEPROM_COMMAND, "0 idle or clear errors, 1 read, 2 write, 4 reload"},
      {Unit::WORD_ADDRESS, "word address of the EEPROM"},
  };
  return NameIn(kNames, unit);
}

/// "; the master reads, the drive reads and writes": what the family's manual states of the two sides.
std::string Sides(device::Access master, device::Access drive) {
  const auto does = [](device::Access access) -> std::string_view {
    switch (access) {
      case device::Access::kUnknown:
        return "";
      case device::Access::kNone:
        return "has no access";
      case device::Access::kRead:
        return "reads";
      case device::Access::kWrite:
        return "writes";
      case device::Access::kReadWrite:
        return "reads and writes";
    }
    return "";
  };
  std::string text;
  if (!does(master).empty()) text += "; the master " + std::string(does(master));
  if (!does(drive).empty()) text += (text.empty() ? "; the drive " : ", the drive ") + std::string(does(drive));
  return text;
}

std::string Bits(unsigned first, unsigned last) {
  return first == last ? "bit " + std::to_string(first) : "bits " + std::to_string(last) + ":" + std::to_string(first);
}

std::string FieldText(const esc::Field& field) {
  std::string text(field.name);
  const auto add = [&text](std::string_view part, std::string_view separator) {
    if (part.empty()) return;
    if (!text.empty()) text += separator;
    text += part;
  };
  add(Text(field.unit), ": ");
  std::string values;
  for (const esc::ValueText& value : field.values) {
    if (value.text.empty()) continue;
    if (!values.empty()) values += ", ";
    values += std::to_string(value.value) + " " + std::string(value.text);
  }
  add(values, ": ");
  return text;
}

std::string Place(EscAddress address, std::size_t length) {
  return length == 1 ? Hex(address) : Hex(address) + "-" + Hex(address + length - 1);
}

/// The registers of one sync manager, FMMU or port, when its first address is asked for.
void AddUnit(const esc::RegisterHit& hit, Meaning& meaning) {
  if (hit.unit == nullptr || hit.unit->name.empty()) return;
  const EscAddress start =
      static_cast<EscAddress>(hit.unit->address + (hit.number - hit.unit->first_number) * hit.unit->size);
  if (hit.start != start || hit.offset != 0) return;
  esc::CutAccess(start, hit.unit->size, [&](const esc::RegisterPart& part) {
    if (part.hit.reg == nullptr || part.address == start) return;
    meaning.details.emplace_back("beside it", Place(part.address, part.length) + " " + esc::RegisterName(part.hit));
  });
}

/// The register map cites the two volumes of the data sheet by page ("B2:13"), and lists of other makers.
std::string Source(std::string_view short_key) {
  if (short_key.starts_with("B1:")) return "ESC-1, page " + std::string(short_key.substr(3));
  if (short_key.starts_with("B2:")) return "ESC-2, page " + std::string(short_key.substr(3));
  return short_key == "TI" ? "TI-ESC, registers" : std::string(short_key);
}

/// Who is meant.
std::string_view AddressedBy(wire::Command command) {
  if (wire::IsPositionAddressed(command)) {
    return "position (ADP, each slave adds 1; who sees 0 is meant) and register (ADO)";
  }
  if (wire::IsNodeAddressed(command)) return "station address or alias (ADP) and register (ADO)";
  if (wire::IsBroadcast(command)) return "every slave (ADP counts them) and register (ADO)";
  if (wire::IsLogical(command)) return "32-bit logical address, which the FMMUs of the slaves map to their memory";
  return "none";
}

/// What the slaves do.
std::string_view EffectOf(wire::Command command) {
  switch (command) {
    case wire::Command::NOP:
      return "nothing; no slave acts";
    case wire::Command::APRD:
    case wire::Command::FPRD:
      return "a read of the addressed slave";
    case wire::Command::APWR:
    case wire::Command::FPWR:
      return "a write to the addressed slave";
    case wire::Command::APRW:
    case wire::Command::FPRW:
      return "a read and a write of the addressed slave, in one pass";
    case wire::Command::BRD:
      return "a read of every slave; their data are ORed";
    case wire::Command::BWR:
      return "a write to every slave";
    case wire::Command::BRW:
      return "a read (ORed) and a write of every slave";
    case wire::Command::LRD:
      return "a read of the inputs that are mapped there";
    case wire::Command::LWR:
      return "a write of the outputs that are mapped there";
    case wire::Command::LRW:
      return "inputs and outputs in one pass";
    case wire::Command::ARMW:
    case wire::Command::FRMW:
      return "a read of the addressed slave, whose data all slaves after it write: spreads the time of the reference "
             "clock";
  }
  return {};
}

std::string_view CounterOf(wire::Command command) {
  switch (command) {
    case wire::Command::NOP:
      return "stays as it is";
    case wire::Command::APRW:
    case wire::Command::FPRW:
    case wire::Command::BRW:
    case wire::Command::LRW:
      return "1 for a slave that read, 2 for one that wrote, 3 for both";
    default:
      return "1 for each slave that did it";
  }
}

}  // namespace

void AddRegister(std::uint16_t address, const Families& families, std::vector<Meaning>& out) {
  const esc::RegisterHit hit = esc::RegisterAt(address);
  Meaning meaning{.kind = "register", .name = {}, .details = {}, .statements = {}};
  EscAddress start = address;
  std::size_t length = 1;
  if (hit) {
    start = hit.start;
    length = hit.reg->length;
    meaning.name = Hex(start) + " " + esc::RegisterName(hit);
    meaning.details.emplace_back("place",
                                 Place(start, length) + ", " + Count(length, "byte") +
                                     (hit.offset == 0 ? "" : "; asked for byte " + std::to_string(hit.offset)));
    meaning.details.emplace_back("access", std::string(Text(hit.reg->access)));
    for (const esc::Field& field : hit.reg->fields) {
      const std::string text = FieldText(field);
      if (!text.empty()) {
        meaning.details.emplace_back(Bits(field.lsb, static_cast<unsigned>(field.lsb) + field.width - 1U), text);
      }
    }
    AddUnit(hit, meaning);
    meaning.statements.push_back({"standard", esc::RegisterName(hit), {}, Source(hit.reg->source)});
  }
  for (const DeviceDescription* family : families) {
    if (family->id == "generic") continue;
    const device::RegisterRight* right = family->register_right(address);
    const bool own = right != nullptr && right->source.starts_with(family->document);
    if (own && (hit || right->buffer)) {
      if (!hit && meaning.name.empty()) meaning.name = Hex(address) + " " + right->name;
      meaning.statements.push_back(
          {family->id,
           Place(right->address, right->length) + " " + right->name +
               (right->printed_length.empty() ? "" : " (printed length " + right->printed_length + ")") +
               Sides(right->ecat, right->drive) +
               (right->printed_ecat.empty() ? "" : " (printed " + right->printed_ecat + ")"),
           right->note, right->source});
    }
    for (const auto* rows : {&family->register_bits, &family->event_bits}) {
      for (const device::RegisterBits& row : *rows) {
        if (row.address < start || row.address >= start + length || !row.source.starts_with(family->document)) continue;
        const unsigned shift = 8U * static_cast<unsigned>(row.address - start);
        std::string text = Bits(row.first + shift, row.last + shift) +
                           (row.value ? " = " + std::to_string(*row.value) : "") + ": " + row.name;
        if (!row.meaning.empty()) text += ", " + row.meaning;
        if (row.rising) text += *row.rising ? " (by its rising edge)" : " (by its falling edge)";
        text += Sides(row.ecat, row.drive);
        if (row.printed_address) text += " (printed address " + Hex(*row.printed_address) + ")";
        meaning.statements.push_back({family->id, text, row.note, row.source});
      }
    }
  }
  if (meaning.statements.empty()) return;
  out.push_back(std::move(meaning));
}

void AddCommand(std::string_view name, std::vector<Meaning>& out) {
  for (std::uint8_t number = 0; number < wire::kCommandCount; ++number) {
    const auto command = static_cast<wire::Command>(number);
    if (wire::Name(command) != name) continue;
    Meaning meaning{.kind = "datagram command", .name = std::string(name), .details = {}, .statements = {}};
    meaning.details.emplace_back("number", std::to_string(number));
    meaning.details.emplace_back("address", std::string(AddressedBy(command)));
    meaning.details.emplace_back("does", std::string(EffectOf(command)));
    meaning.details.emplace_back("working counter", std::string(CounterOf(command)));
    meaning.statements.push_back(
        {"standard", "datagram command " + std::to_string(number), {}, "ETG1000.4, frame and datagram header"});
    out.push_back(std::move(meaning));
  }
}

}  // namespace ecaudit::cli::lookup
