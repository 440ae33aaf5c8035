#include "cli/commands/profile_details.h"

#include <string>
#include <string_view>

#include "cli/commands/profile_rows.h"
#include "decoder/base/names.h"
#include "decoder/base/text.h"

namespace ecaudit::cli {
namespace {

using profile_page::Heading;
using profile_page::Row;
using report::OneLine;
using report::TextBuilder;

std::string Pattern(const device::StatusPattern& pattern) {
  return "status word & " + Hex(pattern.mask) + " = " + Hex(pattern.value);
}

void AppendStates(const device::DriveProfile& drive, TextBuilder& text) {
  if (drive.states.empty() && drive.commands.empty()) return;
  Heading("Drive states and commands", "", text);
  for (const device::DriveStateRow& state : drive.states) {
    std::string about = Pattern(state.printed);
    for (const device::StatusPattern& also : state.also) about += " or " + Hex(also.mask) + " = " + Hex(also.value);
    if (!state.meaning.empty()) about += "; " + OneLine(state.meaning);
    Row(device::DriveStateName(state.state), about, state.note, state.source, text);
  }
  for (const device::DriveCommand& command : drive.commands) {
    std::string about = "control word & " + Hex(command.mask) + " = " + Hex(command.value);
    if (command.rising != 0) about += ", rising " + Hex(command.rising);
    if (command.falling != 0) about += ", falling " + Hex(command.falling);
    std::string transitions;
    for (const std::uint8_t number : command.transitions) {
      transitions += (transitions.empty() ? "" : ", ") + std::to_string(number);
    }
    if (!transitions.empty()) about += "; transition " + transitions;
    Row(OneLine(command.name) + (command.variant.empty() ? "" : " " + command.variant), about, command.note,
        command.source, text);
  }
}

void AppendEeprom(const device::DeviceDescription& profile, TextBuilder& text) {
  if (profile.eeprom.empty()) return;
  Heading("EEPROM", "", text);
  for (const device::EepromFact& fact : profile.eeprom) {
    const std::string name = fact.category ? "category " + Hex(*fact.category) : OneLine(fact.kind);
    Row(name, (fact.key.empty() ? "" : OneLine(fact.key) + ": ") + OneLine(fact.fact), fact.note, fact.source, text);
  }
}

void AppendFieldbus(const device::DeviceDescription& profile, TextBuilder& text) {
  if (profile.fieldbus_parameters.empty()) return;
  Heading("Fieldbus parameters", "", text);
  for (const device::FieldbusParameter& parameter : profile.fieldbus_parameters) {
    std::string name = OneLine(parameter.parameter);
    if (parameter.bit) name += " bit " + std::to_string(*parameter.bit);
    if (parameter.value) name += " = " + std::to_string(*parameter.value);
    Row(name, OneLine(parameter.meaning), parameter.note, parameter.source, text);
  }
}

void AppendMailboxSizes(const device::MailboxDescription& mailbox, TextBuilder& text) {
  if (mailbox.sizes.empty()) return;
  Heading("Mailbox sizes", "", text);
  for (const device::MailboxSize& size : mailbox.sizes) {
    Row("mailbox " + OneLine(size.direction),
        (size.start ? "start " + Hex(*size.start) + ", " : "") + Count(size.bytes, "byte"), size.note, size.source,
        text);
  }
}

void AppendWordBits(std::string_view heading, const std::vector<device::WordBit>& bits, TextBuilder& text) {
  if (bits.empty()) return;
  Heading(heading, "", text);
  for (const device::WordBit& bit : bits) {
    std::string about = OneLine(bit.name);
    if (!bit.meaning.empty()) about += ": " + OneLine(bit.meaning);
    Row("bit " + std::to_string(bit.bit), about, bit.note, bit.source, text);
  }
}

void AppendCyclic(const device::PdoDescription& pdo, TextBuilder& text) {
  if (pdo.cyclic.empty()) return;
  Heading("Objects for cyclic exchange", pdo.cyclic_complete ? "the manual lists all" : "", text);
  for (const device::CyclicObject& object : pdo.cyclic) {
    std::string about = OneLine(object.name) + ", ";
    about += object.type != device::DataType::kUnknown ? std::string(device::DataTypeName(object.type))
                                                       : Count(object.bits, "bit");
    Row(ObjectName(object.index, object.subindex) + (object.direction == device::PdoDirection::kRx ? " Rx" : " Tx"),
        about, object.note, object.source, text);
  }
}

std::string_view MappableText(device::Mappable mappable) {
  static constexpr Named<device::Mappable> kNames[] = {
      {device::Mappable::kNo, ", not mappable"},
      {device::Mappable::kYes, ", mappable"},
      {device::Mappable::kConditional, ", mappable (yes*)"},
  };
  return NameIn(kNames, mappable);
}

std::string_view AccessText(device::Access access) {
  static constexpr Named<device::Access> kNames[] = {
      {device::Access::kRead, ", read"},
      {device::Access::kWrite, ", write"},
      {device::Access::kReadWrite, ", read-write"},
  };
  return NameIn(kNames, access);
}

void AppendDictionary(const device::ObjectDictionary& dictionary, TextBuilder& text) {
  Heading("Object dictionary", dictionary.complete ? "the manual lists all objects" : "others are possible", text);
  for (const device::DictionaryObject& object : dictionary.objects) {
    std::string name = object.head ? ObjectName(object.index) : ObjectName(object.index, object.subindex);
    if (!object.head && object.last_subindex > object.subindex) name += "-" + std::to_string(object.last_subindex);
    std::string about = OneLine(object.name);
    for (std::size_t i = 0; i < object.types.size(); ++i) {
      about += (i == 0 ? ", " : " or ") + std::string(device::DataTypeName(object.types[i]));
    }
    about += AccessText(object.access);
    about += MappableText(object.mappable);
    if (!object.scale.empty()) about += ", scale " + OneLine(object.scale);
    if (!object.pdo_scale.empty()) about += ", in the process data " + OneLine(object.pdo_scale);
    if (!object.unit.empty()) about += ", unit " + OneLine(object.unit);
    if (!object.keyword.empty()) about += ", " + OneLine(object.keyword);
    Row(name, about, object.note, object.source, text);
  }
}

void AppendEmergencies(const device::EmergencyTable& table, TextBuilder& text) {
  Heading("Emergency codes", "", text);
  for (const device::EmergencyCode& code : table.codes) {
    std::string name = Hex(code.code);
    if (code.last_code != code.code) name += " to " + Hex(code.last_code);
    if (!code.id.empty()) name += " " + OneLine(code.id);
    Row(name, OneLine(code.text), code.note, code.source, text);
  }
}

void AppendFacts(const device::DeviceDescription& profile, TextBuilder& text) {
  if (profile.facts.empty()) return;
  Heading("Other facts", "", text);
  for (const device::Fact& fact : profile.facts) {
    Row(OneLine(fact.category), OneLine(fact.name) + (fact.value.empty() ? "" : ": " + OneLine(fact.value)), fact.note,
        fact.source, text);
  }
}

}  // namespace

void AppendDetailSections(const device::DeviceDescription& profile, bool full, TextBuilder& text) {
  if (profile.drive) AppendStates(*profile.drive, text);
  AppendMailboxSizes(profile.mailbox, text);
  AppendEeprom(profile, text);
  AppendFieldbus(profile, text);
  if (!full) return;
  if (profile.drive) {
    AppendWordBits("Control word bits", profile.drive->control_bits, text);
    AppendWordBits("Status word bits", profile.drive->status_bits, text);
  }
  AppendCyclic(profile.pdo, text);
  if (profile.dictionary) AppendDictionary(*profile.dictionary, text);
  if (profile.emergency) AppendEmergencies(*profile.emergency, text);
  AppendFacts(profile, text);
}

}  // namespace ecaudit::cli
