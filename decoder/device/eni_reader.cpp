#include "decoder/device/eni_reader.h"

#include <algorithm>
#include <utility>

#include "decoder/base/text.h"
#include "decoder/device/description_file.h"
#include "decoder/device/xml_cursor.h"
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
    while (xml_.NextChild()) {
      if (xml_.name() == "Config") {
        ReadConfig();
      } else {
        xml_.Skip();
      }
    }
    if (xml_.failed()) return xml_.error();
    return std::move(config_);
  }

 private:
  void ReadConfig() {
    while (xml_.NextChild()) {
      const std::string& name = xml_.name();
      if (name == "Master") {
        ReadMaster();
      } else if (name == "Slave") {
        ReadSlave();
      } else if (name == "Cyclic") {
        ReadCyclic();
      } else if (name == "ProcessImage") {
        ReadProcessImage();
      } else {
        xml_.Skip();
      }
    }
  }

  void ReadMaster() {
    while (xml_.NextChild()) {
      if (xml_.name() == "Info") {
        while (xml_.NextChild()) {
          if (xml_.name() == "Name") {
            config_.master_name = xml_.Label();
          } else {
            xml_.Skip();
          }
        }
      } else if (xml_.name() == "InitCmds") {
        ReadInitCommands(config_.master_init_commands);
      } else {
        xml_.Skip();
      }
    }
  }

  void ReadSlave() {
    if (config_.slaves.size() >= kMaxSlaves) return xml_.Fail("more than " + Grouped(kMaxSlaves) + " slaves");
    EniSlave& slave = config_.slaves.emplace_back();
    while (xml_.NextChild()) {
      const std::string& name = xml_.name();
      if (name == "Info") {
        ReadInfo(slave);
      } else if (name == "ProcessData") {
        ReadProcessData(slave);
      } else if (name == "Mailbox") {
        ReadMailbox(slave);
      } else if (name == "InitCmds") {
        ReadInitCommands(slave.init_commands);
      } else if (name == "DC") {
        ReadDc(slave.dc.emplace());
      } else {
        xml_.Skip();
      }
    }
  }

  void ReadInfo(EniSlave& slave) {
    while (xml_.NextChild()) {
      const std::string& name = xml_.name();
      if (name == "Name") {
        slave.name = xml_.Label();
      } else if (name == "PhysAddr") {
        slave.station_address = xml_.Number<std::uint16_t>();
      } else if (name == "AutoIncAddr") {
        // Some tools write -1 for 0xFFFF.
        slave.auto_increment = static_cast<std::uint16_t>(Ranged(-0x8000, 0xFFFF));
      } else if (name == "VendorId") {
        slave.vendor_id = xml_.Number<std::uint32_t>();
      } else if (name == "ProductCode") {
        slave.product_code = xml_.Number<std::uint32_t>();
      } else if (name == "RevisionNo") {
        slave.revision = xml_.Number<std::uint32_t>();
      } else if (name == "SerialNo") {
        slave.serial = xml_.Number<std::uint32_t>();
      } else {
        xml_.Skip();
      }
    }
  }

  std::int32_t Ranged(std::int32_t min, std::int32_t max) {
    const auto value = xml_.Number<std::int32_t>();
    if (value < min || value > max) {
      xml_.Fail(std::to_string(value) + " is outside " + std::to_string(min) + " to " + std::to_string(max));
    }
    return value;
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
    while (xml_.NextChild()) {
      if (xml_.name() == "BitStart") {
        part.bit_start = xml_.Number<std::uint32_t>();
      } else if (xml_.name() == "BitLength") {
        part.bit_length = xml_.Number<std::uint32_t>();
      } else {
        xml_.Skip();
      }
    }
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
    while (xml_.NextChild()) {
      const std::string& name = xml_.name();
      if (name == "Type") {
        const std::string type = xml_.Text();
        rule.use = type == "MBoxOut"   ? SyncManagerUse::kMailboxOut
                   : type == "MBoxIn"  ? SyncManagerUse::kMailboxIn
                   : type == "Outputs" ? SyncManagerUse::kProcessOut
                   : type == "Inputs"  ? SyncManagerUse::kProcessIn
                                       : SyncManagerUse::kUnused;
      } else if (name == "StartAddress") {
        rule.start = xml_.Number<std::uint16_t>();
      } else if (name == "DefaultSize") {
        rule.lengths.push_back(xml_.Number<std::uint32_t>());
        CountRow();
      } else if (name == "MaxSize") {
        rule.max_length = xml_.Number<std::uint32_t>();
      } else if (name == "ControlByte") {
        rule.control = xml_.Number<std::uint8_t>();
      } else if (name == "Pdo") {
        assigned.push_back(xml_.Number<std::uint16_t>());
        CountRow();
      } else {
        xml_.Skip();
      }
    }
    rule.mailbox_mode = rule.use == SyncManagerUse::kMailboxOut || rule.use == SyncManagerUse::kMailboxIn;
    rule.master_writes = rule.use == SyncManagerUse::kMailboxOut || rule.use == SyncManagerUse::kProcessOut;
    for (const std::uint16_t index : assigned) assigned_.push_back({index, rule.number});
    slave.sync_managers.push_back(std::move(rule));
  }

  void ReadPdo(PdoDirection direction, EniSlave& slave) {
    PdoContent content;
    content.direction = direction;
    content.fixed = xml_.Flag("Fixed");
    content.mandatory = xml_.Flag("Mandatory");
    content.sync_manager = xml_.NumberAttribute<std::uint8_t>("Sm");
    content.source = kEniSource;
    while (xml_.NextChild()) {
      const std::string& name = xml_.name();
      if (name == "Index") {
        content.index = xml_.Number<std::uint16_t>();
      } else if (name == "Name") {
        content.name = xml_.Label();
      } else if (name == "Exclude") {
        content.excludes.push_back(xml_.Number<std::uint16_t>());
        CountRow();
      } else if (name == "Entry") {
        PdoEntry entry;
        while (xml_.NextChild()) {
          if (xml_.name() == "Index") {
            entry.index = xml_.Number<std::uint16_t>();
          } else if (xml_.name() == "SubIndex") {
            entry.subindex = xml_.Number<std::uint8_t>();
          } else if (xml_.name() == "BitLen") {
            entry.bits = xml_.Number<std::uint16_t>();
          } else if (xml_.name() == "Name") {
            entry.name = xml_.Label();
          } else if (xml_.name() == "DataType") {
            entry.type = DataTypeFromName(xml_.Text());
          } else {
            xml_.Skip();
          }
        }
        content.entries.push_back(std::move(entry));
        CountRow();
      } else {
        xml_.Skip();
      }
    }
    slave.pdos.push_back(std::move(content));
  }

  void ReadMailbox(EniSlave& slave) {
    EniMailbox& mailbox = slave.mailbox.emplace();
    while (xml_.NextChild()) {
      const std::string& name = xml_.name();
      if (name == "Send") {
        ReadMailboxWindow(mailbox, mailbox.send_start, mailbox.send_length);
      } else if (name == "Recv") {
        ReadMailboxWindow(mailbox, mailbox.receive_start, mailbox.receive_length);
      } else if (name == "Protocol") {
        mailbox.protocols.push_back(xml_.Text());
        CountRow();
      } else if (name == "CoE") {
        ReadCoe(slave);
      } else {
        xml_.Skip();
      }
    }
  }

  void ReadMailboxWindow(EniMailbox& mailbox, std::uint16_t& start, std::uint16_t& length) {
    while (xml_.NextChild()) {
      const std::string& name = xml_.name();
      if (name == "Start") {
        start = xml_.Number<std::uint16_t>();
      } else if (name == "Length") {
        length = xml_.Number<std::uint16_t>();
      } else if (name == "PollTime") {
        mailbox.poll_time = TimeNs{xml_.Number<std::int32_t>()} * 1'000'000;  // milliseconds
      } else if (name == "StatusBitAddr") {
        mailbox.status_bit = xml_.Number<std::uint32_t>();
      } else {
        xml_.Skip();
      }
    }
  }

  void ReadCoe(EniSlave& slave) {
    while (xml_.NextChild()) {
      if (xml_.name() != "InitCmds") {
        xml_.Skip();
        continue;
      }
      while (xml_.NextChild()) {
        if (xml_.name() == "InitCmd") {
          slave.sdo_commands.push_back(ReadSdoCommand());
          CountRow();
        } else {
          xml_.Skip();
        }
      }
    }
  }

  EniSdoCommand ReadSdoCommand() {
    EniSdoCommand command;
    command.line = xml_.line();
    command.fixed = xml_.Flag("Fixed");
    command.complete_access = xml_.Flag("CompleteAccess");
    while (xml_.NextChild()) {
      const std::string& name = xml_.name();
      if (name == "Transition") {
        command.transitions.push_back(xml_.Text());
        CountRow();
      } else if (name == "Comment") {
        command.comment = xml_.Label();
      } else if (name == "Timeout") {
        command.timeout = TimeNs{xml_.Number<std::int32_t>()} * 1'000'000;  // milliseconds
      } else if (name == "Ccs") {
        command.upload = xml_.Number<std::uint8_t>() == 2;
      } else if (name == "Index") {
        command.index = xml_.Number<std::uint16_t>();
      } else if (name == "SubIndex") {
        command.subindex = xml_.Number<std::uint8_t>();
      } else if (name == "Data") {
        command.data = xml_.Bytes();
      } else if (name == "Disabled") {
        const std::string text = xml_.Text();
        command.disabled = text == "1" || text == "true";
      } else {
        xml_.Skip();
      }
    }
    return command;
  }

  void ReadInitCommands(std::vector<EniInitCommand>& commands) {
    while (xml_.NextChild()) {
      if (xml_.name() == "InitCmd") {
        commands.push_back(ReadInitCommand());
        CountRow();
      } else {
        xml_.Skip();
      }
    }
  }

  wire::Command ReadCommand() {
    const auto number = xml_.Number<std::uint8_t>();
    if (number > 14) xml_.Fail(std::to_string(number) + " is no EtherCAT command");
    return static_cast<wire::Command>(number);
  }

  /// What initialisation and cyclic commands have in common. False: `name` is nothing of that, and was not read.
  template <typename C>
  bool ReadField(const std::string& name, C& command) {
    if (name == "Comment") {
      command.comment = xml_.Label();
    } else if (name == "Cmd") {
      command.command = ReadCommand();
    } else if (name == "Adp") {
      command.adp = static_cast<std::uint16_t>(Ranged(-0x8000, 0xFFFF));
    } else if (name == "Ado") {
      command.ado = xml_.Number<std::uint16_t>();
    } else if (name == "Addr") {
      command.logical = xml_.Number<std::uint32_t>();
    } else if (name == "DataLength") {
      command.data_length = xml_.Number<std::uint32_t>();
    } else if (name == "Cnt") {
      command.expected_wkc = xml_.Number<std::uint16_t>();
    } else {
      return false;
    }
    return true;
  }

  EniInitCommand ReadInitCommand() {
    EniInitCommand command;
    command.line = xml_.line();
    while (xml_.NextChild()) {
      const std::string& name = xml_.name();
      if (name == "Transition") {
        command.transitions.push_back(xml_.Text());
        CountRow();
      } else if (name == "BeforeSlave") {
        const std::string text = xml_.Text();
        command.before_slave = text == "1" || text == "true";
      } else if (name == "Data") {
        command.data = xml_.Bytes();
      } else if (name == "Retries") {
        command.retries = xml_.Number<std::uint32_t>();
      } else if (name == "Validate") {
        while (xml_.NextChild()) {
          if (xml_.name() == "Data") {
            command.validate_data = xml_.Bytes();
          } else if (xml_.name() == "DataMask") {
            command.validate_mask = xml_.Bytes();
          } else if (xml_.name() == "Timeout") {
            command.validate_timeout = TimeNs{xml_.Number<std::int32_t>()} * 1'000'000;  // milliseconds
          } else {
            xml_.Skip();
          }
        }
      } else if (!ReadField(name, command)) {
        xml_.Skip();
      }
    }
    if (command.data_length == 0) command.data_length = static_cast<std::uint32_t>(command.data.size());
    return command;
  }

  void ReadDc(EniDc& dc) {
    while (xml_.NextChild()) {
      const std::string& name = xml_.name();
      if (name == "PotentialReferenceClock" || name == "ReferenceClock") {
        bool& flag = name == "ReferenceClock" ? dc.reference : dc.potential_reference;
        const std::string text = xml_.Text();
        flag = text == "1" || text == "true";
      } else if (name == "CycleTime0") {
        dc.cycle0 = xml_.Number<std::int64_t>();
      } else if (name == "CycleTime1") {
        dc.cycle1 = xml_.Number<std::int64_t>();
      } else if (name == "ShiftTime") {
        dc.shift = xml_.Number<std::int64_t>();
      } else {
        xml_.Skip();
      }
    }
  }

  void ReadCyclic() {
    EniCyclicTask& task = config_.cyclic.emplace_back();
    CountRow();
    while (xml_.NextChild()) {
      if (xml_.name() == "CycleTime") {
        task.cycle = TimeNs{xml_.Number<std::int32_t>()} * 1'000;  // microseconds
      } else if (xml_.name() == "Frame") {
        EniCyclicFrame& frame = task.frames.emplace_back();
        CountRow();
        while (xml_.NextChild()) {
          if (xml_.name() == "Comment") {
            frame.comment = xml_.Label();
          } else if (xml_.name() == "Cmd") {
            frame.commands.push_back(ReadCyclicCommand());
            CountRow();
          } else {
            xml_.Skip();
          }
        }
      } else {
        xml_.Skip();
      }
    }
  }

  EniCyclicCommand ReadCyclicCommand() {
    EniCyclicCommand command;
    while (xml_.NextChild()) {
      const std::string& name = xml_.name();
      if (name == "State") {
        command.states.push_back(xml_.Text());
        CountRow();
      } else if (name == "Data") {
        command.data_length = static_cast<std::uint32_t>(xml_.Bytes().size());
      } else if (name == "InputOffs") {
        command.input_offset = xml_.Number<std::uint32_t>();
      } else if (name == "OutputOffs") {
        command.output_offset = xml_.Number<std::uint32_t>();
      } else if (name == "CopyInfos") {
        ReadCopies(command.copies);
      } else if (!ReadField(name, command)) {
        xml_.Skip();
      }
    }
    return command;
  }

  void ReadCopies(std::vector<EniCopy>& copies) {
    while (xml_.NextChild()) {
      if (xml_.name() != "CopyInfo") {
        xml_.Skip();
        continue;
      }
      EniCopy& copy = copies.emplace_back();
      CountRow();
      while (xml_.NextChild()) {
        if (xml_.name() == "SrcBitOffs") {
          copy.from_bit = xml_.Number<std::uint32_t>();
        } else if (xml_.name() == "DstBitOffs") {
          copy.to_bit = xml_.Number<std::uint32_t>();
        } else if (xml_.name() == "BitSize") {
          copy.bits = xml_.Number<std::uint32_t>();
        } else {
          xml_.Skip();
        }
      }
    }
  }

  void ReadProcessImage() {
    while (xml_.NextChild()) {
      if (xml_.name() == "Inputs") {
        ReadImage(config_.inputs);
      } else if (xml_.name() == "Outputs") {
        ReadImage(config_.outputs);
      } else {
        xml_.Skip();
      }
    }
  }

  void ReadImage(EniImage& image) {
    while (xml_.NextChild()) {
      if (xml_.name() == "ByteSize") {
        image.byte_size = xml_.Number<std::uint32_t>();
      } else if (xml_.name() == "Variable") {
        EniVariable& variable = image.variables.emplace_back();
        CountRow();
        while (xml_.NextChild()) {
          const std::string& name = xml_.name();
          if (name == "Name") {
            variable.name = xml_.Label();
          } else if (name == "Comment") {
            variable.comment = xml_.Label();
          } else if (name == "DataType") {
            variable.data_type = xml_.Label();
          } else if (name == "BitSize") {
            variable.bit_size = xml_.Number<std::uint32_t>();
          } else if (name == "BitOffs") {
            variable.bit_offset = xml_.Number<std::uint32_t>();
          } else {
            xml_.Skip();
          }
        }
      } else {
        xml_.Skip();
      }
    }
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
  const auto found = std::find_if(variables.begin(), variables.end(), [&](const EniVariable& variable) {
    return variable.bit_offset == bit && variable.bit_size == bits;
  });
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
  const auto it = std::find_if(slaves.begin(), slaves.end(),
                               [&](const EniSlave& slave) { return slave.station_address == address; });
  return it == slaves.end() ? nullptr : &*it;
}

const EniSlave* EniConfig::FindByPosition(SlavePos position) const {
  const auto it =
      std::find_if(slaves.begin(), slaves.end(), [&](const EniSlave& slave) { return slave.position() == position; });
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
