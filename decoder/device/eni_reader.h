/// Reads EtherCAT network information files (ENI, ETG.2100): what a master was configured to send.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "decoder/base/ids.h"
#include "decoder/base/result.h"
#include "decoder/device/esi_description.h"
#include "decoder/device/mailbox_description.h"
#include "decoder/device/pdo_description.h"
#include "decoder/wire/command.h"

namespace ecaudit::device {

/// When an init command is sent: one of "IP", "PS", "SO", "OS", "SP", "PI", "IB", ... as in the file.
using EniTransition = std::string;

/// A datagram the master sends at a state change.
struct EniInitCommand {
  std::vector<EniTransition> transitions;
  bool before_slave = false;  ///< sent before the AL state is requested
  std::string comment;
  wire::Command command = wire::Command::NOP;
  std::uint16_t adp = 0;      ///< address of the slave; meaning depends on the command
  std::uint16_t ado = 0;      ///< register
  std::uint32_t logical = 0;  ///< logical address, for LRD, LWR and LRW
  std::vector<std::uint8_t> data;
  std::uint32_t data_length = 0;  ///< bytes; equals data.size() unless the file gives a length only
  std::optional<std::uint16_t> expected_wkc;
  std::uint32_t retries = 0;
  std::vector<std::uint8_t> validate_data;  ///< expected answer; empty: not checked
  std::vector<std::uint8_t> validate_mask;  ///< bits of it that count; empty: all
  std::optional<TimeNs> validate_timeout;
  std::uint32_t line = 0;  ///< of the file
};

/// An SDO transfer the master makes at a state change.
struct EniSdoCommand {
  std::vector<EniTransition> transitions;
  std::string comment;
  bool fixed = false;
  bool complete_access = false;
  bool upload = false;  ///< the master reads (Ccs 2); else it writes
  std::uint16_t index = 0;
  std::uint8_t subindex = 0;
  std::vector<std::uint8_t> data;
  std::optional<TimeNs> timeout;
  bool disabled = false;
  std::uint32_t line = 0;
};

/// Place of a slave's process data in the image, in bits.
struct EniImagePart {
  std::uint32_t bit_start = 0;
  std::uint32_t bit_length = 0;
};

struct EniMailbox {
  std::uint16_t send_start = 0;  ///< master to slave
  std::uint16_t send_length = 0;
  std::uint16_t receive_start = 0;
  std::uint16_t receive_length = 0;
  std::optional<TimeNs> poll_time;          ///< the master polls in this interval
  std::optional<std::uint32_t> status_bit;  ///< or polls this bit of the image of mailbox states
  std::vector<std::string> protocols;       ///< "CoE", "EoE", ...
};

struct EniDc {
  bool potential_reference = false;
  bool reference = false;
  std::optional<TimeNs> cycle0;
  std::optional<TimeNs> cycle1;
  std::optional<TimeNs> shift;
};

struct EniSlave {
  std::string name;
  std::optional<StationAddress> station_address;
  std::optional<std::uint16_t> auto_increment;  ///< as sent: 0, 0xFFFF, 0xFFFE, ...
  std::optional<std::uint32_t> vendor_id;
  std::optional<std::uint32_t> product_code;
  std::optional<std::uint32_t> revision;
  std::optional<std::uint32_t> serial;
  std::vector<EniImagePart> outputs;  ///< Send
  std::vector<EniImagePart> inputs;   ///< Recv
  std::vector<SyncManagerRule> sync_managers;
  std::vector<PdoContent> pdos;  ///< of both directions, with the sync manager they are assigned to
  std::optional<EniMailbox> mailbox;
  std::vector<EniInitCommand> init_commands;
  std::vector<EniSdoCommand> sdo_commands;
  std::optional<EniDc> dc;

  /// Place on the bus by the auto-increment address; nothing when the file gives none.
  [[nodiscard]] std::optional<SlavePos> position() const;
  /// How long the master waits for a state: what its checks of AL Status after a request allow, the longest of
  /// several.
  [[nodiscard]] StateTimeouts Waits() const;
};

/// Bits that the master copies from the image of inputs to that of outputs: from slave to slave.
struct EniCopy {
  std::uint32_t from_bit = 0;
  std::uint32_t to_bit = 0;
  std::uint32_t bits = 0;
};

/// One datagram of a cyclic frame.
struct EniCyclicCommand {
  std::vector<std::string> states;  ///< AL states of the master in which it is sent: "SAFEOP", "OP"
  std::string comment;
  wire::Command command = wire::Command::NOP;
  std::uint16_t adp = 0;
  std::uint16_t ado = 0;
  std::uint32_t logical = 0;
  std::uint32_t data_length = 0;
  std::optional<std::uint16_t> expected_wkc;
  std::optional<std::uint32_t> input_offset;   ///< byte in the image of inputs
  std::optional<std::uint32_t> output_offset;  ///< byte in the image of outputs
  std::vector<EniCopy> copies;                 ///< done when it came back
};

struct EniCyclicFrame {
  std::string comment;
  std::vector<EniCyclicCommand> commands;
};

struct EniCyclicTask {
  std::optional<TimeNs> cycle;
  std::vector<EniCyclicFrame> frames;
};

/// A signal of the process image.
struct EniVariable {
  std::string name;
  std::string comment;
  std::string data_type;
  std::uint32_t bit_size = 0;
  std::uint32_t bit_offset = 0;
};

struct EniImage {
  std::uint32_t byte_size = 0;
  std::vector<EniVariable> variables;

  /// Null: no variable lies at just these bits.
  [[nodiscard]] const EniVariable* Find(std::uint32_t bit, std::uint32_t bits) const;
};

struct EniConfig {
  std::string master_name;
  std::vector<EniInitCommand> master_init_commands;
  std::vector<EniSlave> slaves;
  std::vector<EniCyclicTask> cyclic;
  EniImage inputs;   ///< from the slaves
  EniImage outputs;  ///< to the slaves

  /// The variable that lies at these bits of the image of outputs, or the one of the inputs that is copied there (then
  /// "copy of NAME"); empty where there is none.
  [[nodiscard]] std::string OutputAt(std::uint32_t bit, std::uint32_t bits) const;
  [[nodiscard]] const EniSlave* FindByAddress(StationAddress address) const;
  [[nodiscard]] const EniSlave* FindByPosition(SlavePos position) const;
};

/// Fails with "line 12, column 5: reason". Document type declarations, and with them entities, are refused.
[[nodiscard]] Result<EniConfig> ReadEni(std::string_view xml);
/// Same for a file; errors begin with its path.
[[nodiscard]] Result<EniConfig> LoadEniFile(const std::string& path);

}  // namespace ecaudit::device
