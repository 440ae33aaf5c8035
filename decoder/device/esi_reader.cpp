#include "decoder/device/esi_reader.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <memory>
#include <set>
#include <utility>

#include "decoder/base/sort_by_key.h"
#include "decoder/base/text.h"
#include "decoder/device/description_file.h"
#include "decoder/device/xml_cursor.h"
#include "decoder/device/xml_parts.h"
#include "decoder/mailbox/aoe.h"

namespace ecaudit::device {
namespace {

constexpr const char* kEsiSource = "ESI, device description";
/// Limits against files made to exhaust memory; the largest ESI files known stay far below.
constexpr std::size_t kMaxDevices = 20'000;
constexpr std::size_t kMaxInitCommands = 10'000;  // of a device
constexpr std::size_t kMaxTransitions = 64;       // of an init command; there are 14
constexpr std::size_t kMaxEsiRows = 4'000'000;    // PDO entries and dictionary rows of the whole file

/// English text of an element that stands once per language.
void ReadLocalName(XmlCursor& xml, std::string& out) {
  const bool english = xml.Attribute("LcId") == "1033";
  std::string text = xml.Label();
  if (out.empty() || english) out = std::move(text);
}

struct Flags {
  Access access = Access::kUnknown;
  Mappable mappable = Mappable::kUnknown;
  std::optional<PdoDirection> only;
};

/// <Flags><Access>ro</Access><PdoMapping>T</PdoMapping></Flags>
Flags ReadFlags(XmlCursor& xml) {
  Flags flags;
  flags.mappable = Mappable::kNo;  // the schema's default
  const auto read_access = [&] {
    const std::string text = xml.Text();
    flags.access = text == "rw"   ? Access::kReadWrite
                   : text == "wo" ? Access::kWrite
                   : text == "ro" ? Access::kRead
                                  : Access::kUnknown;
  };
  const auto read_mapping = [&] {
    const std::string text = xml.Text();
    const bool rx = text.find_first_of("Rr") != std::string::npos;
    const bool tx = text.find_first_of("Tt") != std::string::npos;
    if (rx || tx) flags.mappable = Mappable::kYes;
    if (rx != tx) flags.only = rx ? PdoDirection::kRx : PdoDirection::kTx;
  };
  xml.Children({{"Access", read_access}, {"PdoMapping", read_mapping}});
  return flags;
}

/// A type of the dictionary: a record's subindices, or an array.
struct EsiType {
  struct Item {
    std::optional<std::uint8_t> subindex;  ///< missing for the elements of an array
    std::string name;
    std::string type;
    std::optional<Flags> flags;
  };
  std::vector<Item> items;
  std::string base;  ///< element type of an array
  std::uint32_t first = 1;
  std::uint32_t elements = 0;
};

using EsiTypes = std::map<std::string, EsiType, std::less<>>;

class EsiParser {
 public:
  explicit EsiParser(std::string_view text) : xml_(text) {}

  Result<EsiFile> Parse() {
    xml_.EnterRoot("EtherCATInfo");
    xml_.Children({{"Vendor", [this] { ReadVendor(); }}, {"Descriptions", [this] { ReadDescriptions(); }}});
    if (xml_.failed()) return xml_.error();
    SortByKey(modules_, [](const EsiModule& module) { return module.ident; });
    const auto modules = std::make_shared<const std::vector<EsiModule>>(std::move(modules_));
    for (DeviceDescription& device : file_.devices) {
      if (device.esi->slot_rules) device.esi->slot_rules->modules = modules;
      device.match.vendor_id = file_.vendor_id;
      if (device.esi) device.esi->vendor_name = file_.vendor_name;
    }
    return std::move(file_);
  }

 private:
  void ReadVendor() {
    xml_.Children({
        {"Id", file_.vendor_id},
        {"Name", [this] { ReadLocalName(xml_, file_.vendor_name); }},
    });
  }

  void ReadDescriptions() {
    xml_.Children({
        {"Devices",
         [this] {
           xml_.Children({{"Device", [this] { ReadDevice(); }}});
         }},
        {"Modules",
         [this] {
           xml_.Children({{"Module", [this] { ReadModule(); }}});
         }},
    });
  }

  void ReadModule() {
    EsiModule module;
    ObjectDictionary dictionary;
    std::set<std::uint16_t> by_slot;
    CountRow();
    const auto read_type = [&] {
      module.ident = xml_.NumberAttribute<std::uint32_t>("ModuleIdent").value_or(0);
      std::string type = xml_.Text();
      if (module.name.empty()) module.name = std::move(type);
    };
    const auto read_profile = [&] {
      xml_.Children({
          {"Dictionary", [&] { ReadDictionary(dictionary, &by_slot); }},
          {"DiagMessages", [&] { ReadDiagnosisTexts(module.diagnosis_texts); }},
      });
    };
    xml_.Children({
        {"Type", read_type},
        {"Name", [&] { ReadLocalName(xml_, module.name); }},
        {"RxPdo", [&] { module.pdos.push_back(ReadPdo(PdoDirection::kRx)); }},
        {"TxPdo", [&] { module.pdos.push_back(ReadPdo(PdoDirection::kTx)); }},
        {"Profile", read_profile},
    });
    for (DictionaryObject& row : dictionary.objects) {
      const bool depends = by_slot.count(row.index) != 0;
      module.objects.push_back({std::move(row), depends});
    }
    modules_.push_back(std::move(module));
  }

  void ReadSlots(std::optional<EsiSlots>& slot_rules) {
    slot_rules.emplace();
    slot_rules->pdo_increment = xml_.NumberAttribute<std::uint16_t>("SlotPdoIncrement").value_or(0);
    slot_rules->index_increment = xml_.NumberAttribute<std::uint16_t>("SlotIndexIncrement").value_or(0);
    slot_rules->download_idents = xml_.Flag("DownloadModuleIdentList");
    xml_.Skip();
  }

  /// <ESC><Reg0420>1000</Reg0420></ESC>: what the registers have to be set to.
  void ReadController(EsiDetails& esi) {
    constexpr std::pair<std::string_view, EscAddress> kRegisters[] = {
        {"Reg0400", 0x0400}, {"Reg0410", 0x0410}, {"Reg0420", 0x0420}};
    while (xml_.NextChild()) {
      const auto* known = std::find_if(std::begin(kRegisters), std::end(kRegisters),
                                       [&](const auto& row) { return row.first == xml_.name(); });
      if (known == std::end(kRegisters) || esi.watchdogs.size() >= std::size(kRegisters)) {
        xml_.Skip();
      } else {
        esi.watchdogs.emplace_back(known->second, xml_.Number<std::uint16_t>());
      }
    }
  }

  void ReadDevice() {
    if (file_.devices.size() >= kMaxDevices) return xml_.Fail("more than " + Grouped(kMaxDevices) + " devices");
    DeviceDescription& device = file_.devices.emplace_back();
    device.esi.emplace();
    device.document = "ESI";
    device.match.source = device.pdo.source = device.mailbox.source = kEsiSource;
    xml_.Children({
        {"Type", [&] { ReadType(device); }},
        {"Name", [&] { ReadLocalName(xml_, device.title); }},
        {"GroupType", device.esi->group},
        {"Info", [&] { ReadInfo(device.esi->timeouts); }},
        {"Profile", [&] { ReadProfileElement(device); }},
        {"Fmmu", [&] { ReadFmmu(*device.esi); }},
        {"Sm", [&] { ReadSyncManager(device.mailbox); }},
        {"RxPdo", [&] { AddPdo(ReadPdo(PdoDirection::kRx), device.pdo); }},
        {"TxPdo", [&] { AddPdo(ReadPdo(PdoDirection::kTx), device.pdo); }},
        {"Mailbox", [&] { ReadMailbox(device.mailbox, *device.esi); }},
        {"Dc", [&] { ReadDc(*device.esi); }},
        {"Slots", [&] { ReadSlots(device.esi->slot_rules); }},
        {"ESC", [&] { ReadController(*device.esi); }},
    });
    SortByKey(device.pdo.fixed, [](const PdoContent& pdo) { return pdo.index; });
    SortByKey(device.pdo.selectable, [](const SelectablePdo& pdo) { return pdo.index; });
    device.pdo.selectable_complete = true;
    if (device.dictionary) SortObjects(device.dictionary->objects);
  }

  void ReadType(DeviceDescription& device) {
    if (const auto product = xml_.NumberAttribute<std::uint32_t>("ProductCode")) {
      device.match.product_codes.push_back(*product);
    }
    if (const auto revision = xml_.NumberAttribute<std::uint32_t>("RevisionNo")) {
      device.match.revision_min = device.match.revision_max = *revision;
    }
    device.esi->type = xml_.Label();
    if (device.title.empty()) device.title = device.esi->type;
  }

  /// <Info><StateMachine><Timeout><PreopTimeout>3000</PreopTimeout>...
  void ReadInfo(StateTimeouts& timeouts) {
    const auto read_timeouts = [&] {
      xml_.Children({
          {"PreopTimeout", [&] { timeouts.preop = xml_.Milliseconds(); }},
          {"SafeopOpTimeout", [&] { timeouts.safeop_op = xml_.Milliseconds(); }},
          {"BackToInitTimeout", [&] { timeouts.back_to_init = xml_.Milliseconds(); }},
          {"BackToSafeopTimeout", [&] { timeouts.back_to_safeop = xml_.Milliseconds(); }},
      });
    };
    xml_.Children({{"StateMachine", [&] { xml_.Children({{"Timeout", read_timeouts}}); }}});
  }

  void ReadFmmu(EsiDetails& esi) {
    const std::string use = xml_.Text();
    esi.fmmus.push_back(use == "Outputs"     ? FmmuUse::kOutputs
                        : use == "Inputs"    ? FmmuUse::kInputs
                        : use == "MBoxState" ? FmmuUse::kMailboxState
                                             : FmmuUse::kOther);
    if (esi.fmmus.size() > 256) xml_.Fail("more than 256 FMMUs");
  }

  void ReadSyncManager(MailboxDescription& mailbox) {
    if (mailbox.sync_managers.size() >= 256) return xml_.Fail("more than 256 sync managers");
    SyncManagerRule& rule = mailbox.sync_managers.emplace_back();
    rule.number = static_cast<std::uint8_t>(mailbox.sync_managers.size() - 1);
    rule.start = xml_.NumberAttribute<std::uint16_t>("StartAddress");
    rule.max_length = xml_.NumberAttribute<std::uint32_t>("MaxSize");
    rule.control = xml_.NumberAttribute<std::uint8_t>("ControlByte");
    if (const auto size = xml_.NumberAttribute<std::uint32_t>("DefaultSize")) rule.lengths.push_back(*size);
    SetUse(rule, xml_.Text());
    rule.source = kEsiSource;
  }

  void ReadMailbox(MailboxDescription& mailbox, EsiDetails& esi) {
    struct Protocol {
      std::string_view element;
      std::uint8_t type;
      const char* name;
    };
    static constexpr Protocol kProtocols[] = {{"AoE", 1, "ADS over EtherCAT"},
                                              {"EoE", 2, "Ethernet over EtherCAT"},
                                              {"CoE", 3, "CAN application protocol over EtherCAT"},
                                              {"FoE", 4, "File access over EtherCAT"},
                                              {"SoE", 5, "Servo drive profile over EtherCAT"},
                                              {"VoE", 15, "Vendor specific"}};
    while (xml_.NextChild()) {
      for (const Protocol& known : kProtocols) {
        if (xml_.name() != known.element || mailbox.FindProtocol(known.type) != nullptr) continue;
        MailboxProtocol& protocol = mailbox.protocols.emplace_back();
        protocol.type = known.type;
        protocol.name = known.name;
        protocol.source = kEsiSource;
      }
      if (xml_.name() == "CoE") {
        mailbox.complete_access = xml_.Flag("CompleteAccess");
        mailbox.sdo_information = xml_.Flag("SdoInfo");
        const auto feature = [this](std::string_view name) -> std::optional<bool> {
          if (xml_.Attribute(name).empty()) return std::nullopt;
          return xml_.Flag(name);
        };
        esi.pdo_assign = feature("PdoAssign");
        esi.pdo_config = feature("PdoConfig");
        ReadCoe(esi);
      } else if (xml_.name() == "SoE") {
        ReadMailboxCommands(mailbox::Protocol::kSoE, esi);
      } else if (xml_.name() == "EoE") {
        ReadMailboxCommands(mailbox::Protocol::kEoE, esi);
      } else if (xml_.name() == "AoE") {
        ReadMailboxCommands(mailbox::Protocol::kAoE, esi);
      } else {
        xml_.Skip();
      }
    }
  }

  void ReadCoe(EsiDetails& esi) {
    while (NextInitCommand(esi)) {
      EsiInitCommand& command = esi.init_commands.emplace_back();
      command.complete_access = xml_.Flag("CompleteAccess");
      xml_.Children({
          {"Transition", [&] { ReadTransition(command.transitions); }},
          {"Index", command.index},
          {"SubIndex", command.subindex},
          {"Data", command.data},
          {"Comment", [&] { ReadLocalName(xml_, command.comment); }},
      });
    }
  }

  /// SoE: <InitCmd Chn="0"><Transition>PS</Transition><IDN>32</IDN><Data>0200</Data></InitCmd>
  /// EoE has the type of the message in <Type>, AoE a whole message in <Data>.
  void ReadMailboxCommands(mailbox::Protocol protocol, EsiDetails& esi) {
    while (NextInitCommand(esi)) {
      EsiMailboxCommand& command = esi.mailbox_commands.emplace_back();
      command.protocol = protocol;
      if (protocol == mailbox::Protocol::kSoE) command.drive = xml_.NumberAttribute<std::uint8_t>("Chn");
      xml_.Children({
          {"Transition", [&] { ReadTransition(command.transitions); }},
          {"IDN", command.number},
          {"Type", command.number},
          {"Data", command.data},
          {"Comment", [&] { ReadLocalName(xml_, command.comment); }},
      });
      if (protocol == mailbox::Protocol::kAoE) ReadAoeMessage(command);
    }
  }
  /// What is no whole message stays without command: it is not compared.
  static void ReadAoeMessage(EsiMailboxCommand& command) {
    const mailbox::AmsHeader header = mailbox::ParseAms(command.data);
    const bool whole = !header.too_short && header.data.size() == header.length && !header.response();
    command.number = whole ? static_cast<std::uint16_t>(header.command) : 0;
    command.data = whole ? mailbox::AccessBytes(mailbox::ParseAds(header)) : std::vector<std::uint8_t>();
  }

  bool NextInitCommand(const EsiDetails& esi) {
    while (xml_.NextChild()) {
      if (xml_.name() != "InitCmd") {
        xml_.Skip();
        continue;
      }
      if (esi.init_commands.size() + esi.mailbox_commands.size() >= kMaxInitCommands) {
        xml_.Fail("more than " + Grouped(kMaxInitCommands) + " init commands");
        return false;
      }
      CountRow();
      return true;
    }
    return false;
  }
  void ReadTransition(std::vector<std::string>& transitions) {
    if (transitions.size() >= kMaxTransitions) return xml_.Fail("an init command of too many transitions");
    transitions.push_back(xml_.Label());
  }

  void ReadDc(EsiDetails& esi) {
    const auto read_mode = [&] {
      if (esi.dc_modes.size() >= 1000) return xml_.Fail("more than 1,000 DC modes");
      DcMode& mode = esi.dc_modes.emplace_back();
      const auto read_cycle = [this](std::int32_t& factor, std::optional<TimeNs>& cycle) {
        factor = xml_.NumberAttribute<std::int32_t>("Factor").value_or(0);
        cycle = xml_.Number<std::int64_t>();
      };
      xml_.Children({
          {"Name", mode.name},
          {"Desc", mode.description},
          {"AssignActivate", mode.assign_activate},
          {"CycleTimeSync0", [&] { read_cycle(mode.factor_sync0, mode.cycle_sync0); }},
          {"ShiftTimeSync0", mode.shift_sync0},
          {"CycleTimeSync1", [&] { read_cycle(mode.factor_sync1, mode.cycle_sync1); }},
          {"ShiftTimeSync1", mode.shift_sync1},
      });
    };
    xml_.Children({{"OpMode", read_mode}});
  }

  EsiModule::Pdo ReadPdo(PdoDirection direction) {
    EsiModule::Pdo pdo;
    PdoContent& content = pdo.content;
    content = PdoOfAttributes(xml_, direction, kEsiSource);
    const auto read_index = [&] {
      pdo.by_slot = xml_.Flag("DependOnSlot");
      content.index = xml_.Number<std::uint16_t>();
    };
    const auto read_exclude = [&] {
      content.excludes.push_back(xml_.Number<std::uint16_t>());
      CountRow();
    };
    xml_.Children({
        {"Index", read_index},
        {"Name", [&] { ReadLocalName(xml_, content.name); }},
        {"Exclude", read_exclude},
        {"Entry", [&] { ReadPdoEntry(pdo); }},
    });
    return pdo;
  }

  void AddPdo(EsiModule::Pdo read, PdoDescription& pdo) {
    PdoContent& content = read.content;
    // A PDO that may be remapped freely can have no entries by default.
    SelectablePdo selectable;
    selectable.direction = content.direction;
    selectable.index = content.index;
    selectable.source = kEsiSource;
    pdo.selectable.push_back(std::move(selectable));
    pdo.fixed.push_back(std::move(content));
    CountRow();
  }

  void ReadPdoEntry(EsiModule::Pdo& pdo) {
    PdoEntry entry;
    bool by_slot = false;
    const auto read_index = [&] {
      by_slot = xml_.Flag("DependOnSlot");
      entry.index = xml_.Number<std::uint16_t>();
    };
    xml_.Children({
        {"Index", read_index},
        {"SubIndex", entry.subindex},
        {"BitLen", entry.bits},
        {"Name", [&] { ReadLocalName(xml_, entry.name); }},
        {"DataType", [&] { entry.type = DataTypeFromName(xml_.Text()); }},
    });
    pdo.content.entries.push_back(std::move(entry));
    pdo.entry_by_slot.push_back(by_slot);
    CountRow();
  }

  /// <DiagMessages><DiagMessage><TextId>#x3702</TextId><MessageText LcId="1033">...</MessageText></DiagMessage> ...
  void ReadDiagnosisTexts(mailbox::DiagnosisTexts& texts) {
    const auto read_message = [&] {
      CountRow();
      std::uint16_t id = 0;
      std::string text;
      xml_.Children({{"TextId", id}, {"MessageText", [&] { ReadLocalName(xml_, text); }}});
      if (id != 0 && !text.empty()) texts.emplace(id, std::move(text));
    };
    xml_.Children({{"DiagMessage", read_message}});
  }

  void ReadProfileElement(DeviceDescription& device) {
    const auto read_dictionary = [&] {
      if (!device.dictionary) device.dictionary.emplace();
      device.dictionary->source = kEsiSource;
      ReadDictionary(*device.dictionary, nullptr);
    };
    xml_.Children({
        {"ProfileNo", device.esi->profile_number},
        {"Dictionary", read_dictionary},
        {"DiagMessages", [&] { ReadDiagnosisTexts(device.esi->diagnosis_texts); }},
    });
  }

  /// @param by_slot  gets the indices that depend on the slot; null: nothing can
  void ReadDictionary(ObjectDictionary& dictionary, std::set<std::uint16_t>* by_slot) {
    EsiTypes types;
    const auto read_object = [&] { ReadObject(types, dictionary, by_slot); };
    xml_.Children({
        {"DataTypes",
         [&] {
           xml_.Children({{"DataType", [&] { ReadDataType(types); }}});
         }},
        {"Objects",
         [&] {
           xml_.Children({{"Object", read_object}});
         }},
    });
  }

  void ReadDataType(EsiTypes& types) {
    EsiType type;
    std::string name;
    const auto read_item = [&] {
      type.items.push_back(ReadSubItem());
      CountRow();
    };
    xml_.Children({
        {"Name", [&] { name = xml_.Text(); }},
        {"BaseType", [&] { type.base = xml_.Text(); }},
        {"ArrayInfo",
         [&] {
           xml_.Children({{"LBound", type.first}, {"Elements", type.elements}});
         }},
        {"SubItem", read_item},
    });
    CountRow();
    types.insert_or_assign(std::move(name), std::move(type));
  }

  EsiType::Item ReadSubItem() {
    EsiType::Item item;
    const auto read_name = [&] { ReadLocalName(xml_, item.name); };
    xml_.Children({
        {"SubIdx", item.subindex},
        {"Name", read_name},
        {"DisplayName", read_name},
        {"Type", [&] { item.type = xml_.Text(); }},
        {"Flags", [&] { item.flags = ReadFlags(xml_); }},
    });
    return item;
  }

  void ReadObject(const EsiTypes& types, ObjectDictionary& dictionary, std::set<std::uint16_t>* by_slot) {
    DictionaryObject object;
    object.source = kEsiSource;
    std::string type_name;
    Flags flags;
    const auto read_index = [&] {
      const bool depends = xml_.Flag("DependOnSlot");
      object.index = xml_.Number<std::uint16_t>();
      if (depends && by_slot != nullptr) by_slot->insert(object.index);
    };
    xml_.Children({
        {"Index", read_index},
        {"Name", [&] { ReadLocalName(xml_, object.name); }},
        {"Type", [&] { type_name = xml_.Text(); }},
        {"Flags", [&] { flags = ReadFlags(xml_); }},
    });
    if (xml_.failed()) return;
    const auto type = types.find(type_name);
    if (type == types.end() || type->second.items.empty()) {
      // A simple object; a declared type without subindices means its base type, or is a string of a fixed size.
      AddRow(dictionary, object, type_name, type == types.end() ? nullptr : &type->second, flags);
      return;
    }
    DictionaryObject head = object;
    head.head = true;
    const std::vector<EsiType::Item>& items = type->second.items;
    const bool array = std::ranges::any_of(items, [](const EsiType::Item& i) { return !i.subindex; });
    head.types = {array ? DataType::kArray : DataType::kRecord};
    dictionary.objects.push_back(std::move(head));
    CountRow();
    for (const EsiType::Item& item : items) {
      DictionaryObject row = object;
      row.name = item.name;
      const auto inner = types.find(item.type);
      if (item.subindex) {
        row.subindex = row.last_subindex = *item.subindex;
      } else if (inner != types.end() && inner->second.elements > 0) {
        row.subindex = static_cast<std::uint8_t>(std::min<std::uint32_t>(inner->second.first, 255));
        row.last_subindex = static_cast<std::uint8_t>(
            std::min<std::uint64_t>(std::uint64_t{inner->second.first} + inner->second.elements - 1, 255));
        row.name = object.name;
      } else {
        continue;  // no subindex, no array: nothing to find by SDO
      }
      AddRow(dictionary, std::move(row), item.type, inner == types.end() ? nullptr : &inner->second,
             item.flags.value_or(flags));
    }
  }

  void AddRow(ObjectDictionary& dictionary, DictionaryObject row, const std::string& type_name, const EsiType* declared,
              const Flags& flags) {
    DataType type = DataTypeFromName(type_name);
    if (type == DataType::kUnknown && declared != nullptr) type = DataTypeFromName(declared->base);
    if (type != DataType::kUnknown) row.types = {type};
    row.access = flags.access;
    row.mappable = flags.mappable;
    row.only = flags.only;
    dictionary.objects.push_back(std::move(row));
    CountRow();
  }

  void CountRow() {
    if (++rows_ > kMaxEsiRows) xml_.Fail("more than " + Grouped(kMaxEsiRows) + " objects and PDO entries");
  }

  XmlCursor xml_;
  EsiFile file_;
  std::vector<EsiModule> modules_;
  std::size_t rows_ = 0;
};

}  // namespace

const DeviceDescription* EsiFile::Find(std::uint32_t product_code, std::uint32_t revision) const {
  const DeviceDescription* best = nullptr;
  for (const DeviceDescription& device : devices) {
    const auto& products = device.match.product_codes;
    if (std::ranges::find(products, product_code) == products.end()) continue;
    if (device.match.revision_min == revision) return &device;
    if (best == nullptr || device.match.revision_min.value_or(0) > best->match.revision_min.value_or(0)) best = &device;
  }
  return best;
}

Result<EsiFile> ReadEsi(std::string_view xml) {
  return EsiParser(xml).Parse();
}

Result<EsiFile> LoadEsiFile(const std::string& path) {
  Result<std::string> text = ReadDescriptionFile(path, kMaxXmlBytes);
  if (!text) return text.error();
  Result<EsiFile> file = ReadEsi(*text);
  if (!file) return Error{Printable(path) + ": " + file.error().message};
  return file;
}

DeviceDescription WithEsi(DeviceDescription family, const DeviceDescription& esi) {
  family.match = esi.match;
  family.esi = esi.esi;
  if (!esi.title.empty()) family.title = esi.title;

  // PDO by PDO: the ESI of the device beats the manual of the family.
  for (const PdoContent& content : esi.pdo.fixed) {
    const auto at = std::ranges::lower_bound(family.pdo.fixed, content.index, {}, &PdoContent::index);
    if (at != family.pdo.fixed.end() && at->index == content.index) {
      // An empty list in an ESI means "configurable", not "empty": keep what the manual knows.
      if (!content.entries.empty()) *at = content;
    } else {
      family.pdo.fixed.insert(at, content);
    }
  }
  for (const SelectablePdo& pdo : esi.pdo.selectable) {
    if (!family.pdo.IsAssignable(pdo.direction, pdo.index)) family.pdo.selectable.push_back(pdo);
  }
  SortByKey(family.pdo.selectable, [](const SelectablePdo& pdo) { return pdo.index; });

  if (esi.dictionary) {
    ObjectDictionary merged = *esi.dictionary;
    if (family.dictionary) {
      for (DictionaryObject& object : merged.objects) {
        const DictionaryObject* known = object.head ? family.dictionary->FindIndex(object.index)
                                                    : family.dictionary->Find(object.index, object.subindex);
        if (known == nullptr) continue;
        if (object.name.empty()) object.name = known->name;
        object.keyword = known->keyword;
        object.scale = known->scale;
        object.unit = known->unit;
      }
      // What only the family knows stays known.
      std::vector<DictionaryObject> others;
      for (const DictionaryObject& object : family.dictionary->objects) {
        const bool replaced = object.head ? merged.FindIndex(object.index) != nullptr
                                          : merged.Find(object.index, object.subindex) != nullptr;
        if (!replaced) others.push_back(object);
      }
      merged.objects.insert(merged.objects.end(), others.begin(), others.end());
      SortObjects(merged.objects);
      merged.complete = false;
    }
    family.dictionary = std::move(merged);
  }
  if (!esi.mailbox.sync_managers.empty()) family.mailbox.sync_managers = esi.mailbox.sync_managers;
  if (!esi.mailbox.protocols.empty()) family.mailbox.protocols = esi.mailbox.protocols;
  family.mailbox.complete_access = esi.mailbox.complete_access;
  family.mailbox.sdo_information = esi.mailbox.sdo_information;
  return family;
}

}  // namespace ecaudit::device
