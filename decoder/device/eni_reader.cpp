#include "decoder/device/eni_reader.h"

#include <algorithm>
#include <utility>

#include "decoder/base/text.h"
#include "decoder/device/description_file.h"
#include "decoder/device/xml_cursor.h"
#include "decoder/device/xml_parts.h"
#include "decoder/esc/register_addresses.h"

namespace ecaudit::device {
namespace {

constexpr const char* kEniSource = "ENI, slave configuration";
/// Limits against files made to exhaust memory.
constexpr std::size_t kMaxSlaves = 65'536;
constexpr std::size_t kMaxEniRows = 4'000'000;  // commands, PDO entries and variables of the whole file

/// Sm0, Sm1, ... or Sm
bool IsSyncManager(const std::string& name) {
  return name.size() >= 2 && name.compare(0, 2, "Sm") == 0 &&
         std::all_of(name.begin() + 2, name.end(), [](char c) { return c >= '0' && c <= '9'; });
}

class EniParser {
 public:
  explicit EniParser(std::string_view text) : xml_(text) {}

  Result<EniConfig> Parse() {
    xml_.EnterRoot("EtherCATConfig");
    xml_.Children({{"Config", [this] { ReadConfig(); }}});
    if (xml_.failed()) return xml_.error();
    return std::move(config_);
  }

 private:
  void ReadConfig() {
    xml_.Children({
        {"Master", [this] { ReadMaster(); }},
        {"Slave", [this] { ReadSlave(); }},
        {"Cyclic", [this] { ReadCyclic(); }},
        {"ProcessImage", [this] { ReadProcessImage(); }},
    });
  }

  void ReadMaster() {
    xml_.Children({
        {"Info",
         [this] {
           xml_.Children({{"Name", config_.master_name}});
         }},
        {"InitCmds", [this] { ReadInitCommands(config_.master_init_commands); }},
    });
  }

  void ReadSlave() {
    if (config_.slaves.size() >= kMaxSlaves) return xml_.Fail("more than " + Grouped(kMaxSlaves) + " slaves");
    EniSlave& slave = config_.slaves.emplace_back();
    xml_.Children({
        {"Info", [&] { ReadInfo(slave); }},
        {"ProcessData", [&] { ReadProcessData(slave); }},
        {"Mailbox", [&] { ReadMailbox(slave); }},
        {"InitCmds", [&] { ReadInitCommands(slave.init_commands); }},
        {"DC", [&] { ReadDc(slave.dc.emplace()); }},
    });
  }

  void ReadInfo(EniSlave& slave) {
    xml_.Children({
        {"Name", slave.name},
        {"PhysAddr", slave.station_address},
        {"AutoIncAddr", [&] { slave.auto_increment = AutoIncrement(); }},
        {"VendorId", slave.vendor_id},
        {"ProductCode", slave.product_code},
        {"RevisionNo", slave.revision},
        {"SerialNo", slave.serial},
    });
  }

  /// Some tools write -1 for 0xFFFF.
  std::uint16_t AutoIncrement() {
    const auto value = xml_.Number<std::int32_t>();
    if (value < -0x8000 || value > 0xFFFF) xml_.Fail(std::to_string(value) + " is outside -32768 to 65535");
    return static_cast<std::uint16_t>(value);
  }

  void ReadProcessData(EniSlave& slave) {
    assigned_.clear();
    while (xml_.NextChild()) {
      const std::string& name = xml_.name();
      if (name == "Send") {
        slave.outputs.push_back(ReadImagePart());
      } else if (name == "Recv") {
        slave.inputs.push_back(ReadImagePart());
      } else if (name == "RxPdo") {
        ReadPdo(PdoDirection::kRx, slave);
      } else if (name == "TxPdo") {
        ReadPdo(PdoDirection::kTx, slave);
      } else if (IsSyncManager(name)) {
        ReadSyncManager(slave);
      } else {
        xml_.Skip();
      }
      CountRow();
    }
    // PDOs may stand before or after the sync manager that names them.
    for (const Assignment& assignment : assigned_) {
      for (PdoContent& pdo : slave.pdos) {
        if (pdo.index == assignment.pdo) pdo.sync_manager = assignment.sync_manager;
      }
    }
  }

  EniImagePart ReadImagePart() {
    EniImagePart part;
    xml_.Children({{"BitStart", part.bit_start}, {"BitLength", part.bit_length}});
    return part;
  }

  void ReadSyncManager(EniSlave& slave) {
    if (slave.sync_managers.size() >= 256) return xml_.Fail("more than 256 sync managers");
    SyncManagerRule rule;
    // "Sm2" names its number, "Sm" counts.
    const std::string digits = xml_.name().substr(2);
    rule.number = static_cast<std::uint8_t>(slave.sync_managers.size());
    if (!digits.empty() && digits.size() <= 2) rule.number = static_cast<std::uint8_t>(std::stoi(digits));
    rule.source = kEniSource;
    std::vector<std::uint16_t> assigned;
    std::string use;
    xml_.Children({
        {"Type", [&] { use = xml_.Text(); }},
        {"StartAddress", rule.start},
        {"DefaultSize", [&] { Add(rule.lengths, xml_.Number<std::uint32_t>()); }},
        {"MaxSize", rule.max_length},
        {"ControlByte", rule.control},
        {"Pdo", [&] { Add(assigned, xml_.Number<std::uint16_t>()); }},
    });
    SetUse(rule, use);
    for (const std::uint16_t index : assigned) assigned_.push_back({index, rule.number});
    slave.sync_managers.push_back(std::move(rule));
  }

  void ReadPdo(PdoDirection direction, EniSlave& slave) {
    PdoContent content = PdoOfAttributes(xml_, direction, kEniSource);
    xml_.Children({
        {"Index", content.index},
        {"Name", content.name},
        {"Exclude", [&] { Add(content.excludes, xml_.Number<std::uint16_t>()); }},
        {"Entry", [&] { Add(content.entries, ReadPdoEntry()); }},
    });
    slave.pdos.push_back(std::move(content));
  }

  PdoEntry ReadPdoEntry() {
    PdoEntry entry;
    xml_.Children({
        {"Index", entry.index},
        {"SubIndex", entry.subindex},
        {"BitLen", entry.bits},
        {"Name", entry.name},
        {"DataType", [&] { entry.type = DataTypeFromName(xml_.Text()); }},
    });
    return entry;
  }

  void ReadMailbox(EniSlave& slave) {
    EniMailbox& mailbox = slave.mailbox.emplace();
    xml_.Children({
        {"Send", [&] { ReadMailboxWindow(mailbox, mailbox.send_start, mailbox.send_length); }},
        {"Recv", [&] { ReadMailboxWindow(mailbox, mailbox.receive_start, mailbox.receive_length); }},
        {"Protocol", [&] { Add(mailbox.protocols, xml_.Text()); }},
        {"CoE", [&] { ReadCoe(slave); }},
    });
  }

  void ReadMailboxWindow(EniMailbox& mailbox, std::uint16_t& start, std::uint16_t& length) {
    xml_.Children({
        {"Start", start},
        {"Length", length},
        {"PollTime", [&] { mailbox.poll_time = xml_.Milliseconds(); }},
        {"StatusBitAddr", mailbox.status_bit},
    });
  }

  void ReadCoe(EniSlave& slave) {
    const auto read_command = [&] { Add(slave.sdo_commands, ReadSdoCommand()); };
    xml_.Children({{"InitCmds", [&] { xml_.Children({{"InitCmd", read_command}}); }}});
  }

  EniSdoCommand ReadSdoCommand() {
    EniSdoCommand command;
    command.line = xml_.line();
    command.fixed = xml_.Flag("Fixed");
    command.complete_access = xml_.Flag("CompleteAccess");
    xml_.Children({
        {"Transition", [&] { Add(command.transitions, xml_.Text()); }},
        {"Comment", command.comment},
        {"Timeout", [&] { command.timeout = xml_.Milliseconds(); }},
        {"Ccs", [&] { command.upload = xml_.Number<std::uint8_t>() == 2; }},
        {"Index", command.index},
        {"SubIndex", command.subindex},
        {"Data", command.data},
        {"Disabled", command.disabled},
    });
    return command;
  }

  void ReadInitCommands(std::vector<EniInitCommand>& commands) {
    xml_.Children({{"InitCmd", [&] { Add(commands, ReadInitCommand()); }}});
  }

  wire::Command ReadCommand() {
    const auto number = xml_.Number<std::uint8_t>();
    if (number > 14) xml_.Fail(std::to_string(number) + " is no EtherCAT command");
    return static_cast<wire::Command>(number);
  }

  EniInitCommand ReadInitCommand() {
    EniInitCommand command;
    command.line = xml_.line();
    xml_.Children({
        {"Transition", [&] { Add(command.transitions, xml_.Text()); }},
        {"BeforeSlave", command.before_slave},
        {"Comment", command.comment},
        {"Cmd", [&] { command.command = ReadCommand(); }},
        {"Adp", [&] { command.adp = AutoIncrement(); }},
        {"Ado", command.ado},
        {"Addr", command.logical},
        {"Data", command.data},
        {"DataLength", command.data_length},
        {"Cnt", command.expected_wkc},
        {"Retries", command.retries},
        {"Validate", [&] { ReadValidation(command); }},
    });
    if (command.data_length == 0) command.data_length = static_cast<std::uint32_t>(command.data.size());
    return command;
  }

  void ReadValidation(EniInitCommand& command) {
    xml_.Children({
        {"Data", command.validate_data},
        {"DataMask", command.validate_mask},
        {"Timeout", [&] { command.validate_timeout = xml_.Milliseconds(); }},
    });
  }

  void ReadDc(EniDc& dc) {
    xml_.Children({
        {"PotentialReferenceClock", dc.potential_reference},
        {"ReferenceClock", dc.reference},
        {"CycleTime0", dc.cycle0},
        {"CycleTime1", dc.cycle1},
        {"ShiftTime", dc.shift},
    });
  }

  void ReadCyclic() {
    EniCyclicTask& task = config_.cyclic.emplace_back();
    CountRow();
    xml_.Children({
        {"CycleTime", [&] { task.cycle = TimeNs{xml_.Number<std::int32_t>()} * 1'000; }},  // microseconds
        {"Frame", [&] { ReadCyclicFrame(task.frames.emplace_back()); }},
    });
  }

  void ReadCyclicFrame(EniCyclicFrame& frame) {
    CountRow();
    xml_.Children({
        {"Comment", frame.comment},
        {"Cmd", [&] { Add(frame.commands, ReadCyclicCommand()); }},
    });
  }

  EniCyclicCommand ReadCyclicCommand() {
    EniCyclicCommand command;
    xml_.Children({
        {"State", [&] { Add(command.states, xml_.Text()); }},
        {"Comment", command.comment},
        {"Cmd", [&] { command.command = ReadCommand(); }},
        {"Adp", [&] { command.adp = AutoIncrement(); }},
        {"Ado", command.ado},
        {"Addr", command.logical},
        {"Data", [&] { command.data_length = static_cast<std::uint32_t>(xml_.Bytes().size()); }},
        {"DataLength", command.data_length},
        {"Cnt", command.expected_wkc},
        {"InputOffs", command.input_offset},
        {"OutputOffs", command.output_offset},
        {"CopyInfos", [&] { ReadCopies(command.copies); }},
    });
    return command;
  }

  void ReadCopies(std::vector<EniCopy>& copies) {
    const auto read_copy = [&] {
      EniCopy& copy = copies.emplace_back();
      CountRow();
      xml_.Children({{"SrcBitOffs", copy.from_bit}, {"DstBitOffs", copy.to_bit}, {"BitSize", copy.bits}});
    };
    xml_.Children({{"CopyInfo", read_copy}});
  }

  void ReadProcessImage() {
    xml_.Children({
        {"Inputs", [this] { ReadImage(config_.inputs); }},
        {"Outputs", [this] { ReadImage(config_.outputs); }},
    });
  }

  void ReadImage(EniImage& image) {
    xml_.Children({
        {"ByteSize", image.byte_size},
        {"Variable", [&] { ReadVariable(image.variables.emplace_back()); }},
    });
  }

  void ReadVariable(EniVariable& variable) {
    CountRow();
    xml_.Children({
        {"Name", variable.name},
        {"Comment", variable.comment},
        {"DataType", variable.data_type},
        {"BitSize", variable.bit_size},
        {"BitOffs", variable.bit_offset},
    });
  }

  template <typename T>
  void Add(std::vector<T>& list, T item) {
    list.push_back(std::move(item));
    CountRow();
  }

  void CountRow() {
    if (++rows_ > kMaxEniRows) xml_.Fail("more than " + Grouped(kMaxEniRows) + " commands, PDO entries and variables");
  }

  struct Assignment {
    std::uint16_t pdo = 0;
    std::uint8_t sync_manager = 0;
  };

  XmlCursor xml_;
  EniConfig config_;
  std::vector<Assignment> assigned_;  ///< of the slave being read
  std::size_t rows_ = 0;
};

}  // namespace

std::optional<SlavePos> EniSlave::position() const {
  if (!auto_increment) return std::nullopt;
  return static_cast<SlavePos>(0x10000 - *auto_increment);  // 0 stays 0 in 16 bits
}

const EniVariable* EniImage::Find(std::uint32_t bit, std::uint32_t bits) const {
  const auto found = std::ranges::find_if(
      variables, [&](const EniVariable& variable) { return variable.bit_offset == bit && variable.bit_size == bits; });
  return found == variables.end() ? nullptr : &*found;
}

std::string EniConfig::OutputAt(std::uint32_t bit, std::uint32_t bits) const {
  if (const EniVariable* variable = outputs.Find(bit, bits)) return variable->name;
  for (const EniCyclicTask& task : cyclic) {
    for (const EniCyclicFrame& frame : task.frames) {
      for (const EniCyclicCommand& command : frame.commands) {
        for (const EniCopy& copy : command.copies) {
          if (bit < copy.to_bit || std::uint64_t{bit} + bits > std::uint64_t{copy.to_bit} + copy.bits) continue;
          const std::uint64_t source = std::uint64_t{copy.from_bit} + (bit - copy.to_bit);
          if (source > UINT32_MAX) continue;
          if (const EniVariable* variable = inputs.Find(static_cast<std::uint32_t>(source), bits)) {
            return "copy of " + variable->name;
          }
        }
      }
    }
  }
  return {};
}

StateTimeouts EniSlave::Waits() const {
  StateTimeouts waits;
  for (const EniInitCommand& command : init_commands) {
    const TimeNs wait = command.validate_timeout.value_or(0);
    if (command.ado != esc::kAlStatus || !wire::Reads(command.command) || wait <= 0) continue;
    for (const EniTransition& transition : command.transitions) {
      std::optional<TimeNs>& limit = transition == "IP" || transition == "IB"   ? waits.preop
                                     : transition == "PS" || transition == "SO" ? waits.safeop_op
                                                                                : waits.back_to_init;
      limit = std::max(limit.value_or(0), wait);
    }
  }
  return waits;
}

const EniSlave* EniConfig::FindByAddress(StationAddress address) const {
  const auto it = std::ranges::find(slaves, address, &EniSlave::station_address);
  return it == slaves.end() ? nullptr : &*it;
}

const EniSlave* EniConfig::FindByPosition(SlavePos position) const {
  const auto it = std::ranges::find_if(slaves, [&](const EniSlave& slave) { return slave.position() == position; });
  return it == slaves.end() ? nullptr : &*it;
}

Result<EniConfig> ReadEni(std::string_view xml) {
  return EniParser(xml).Parse();
}

Result<EniConfig> LoadEniFile(const std::string& path) {
  Result<std::string> text = ReadDescriptionFile(path, kMaxXmlBytes);
  if (!text) return text.error();
  Result<EniConfig> config = ReadEni(*text);
  if (!config) return Error{Printable(path) + ": " + config.error().message};
  return config;
}

}  // namespace ecaudit::device
