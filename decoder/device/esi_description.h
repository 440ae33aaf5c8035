/// What only an ESI file states about a device.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "decoder/base/ids.h"
#include "decoder/device/esi_modules.h"
#include "decoder/mailbox/diagnosis_message.h"
#include "decoder/mailbox/header.h"

namespace ecaudit::device {

/// One synchronisation mode (Dc/OpMode).
struct DcMode {
  std::string name;
  std::string description;
  /// Low byte: register 0x0980, high byte: 0x0981.
  std::uint32_t assign_activate = 0;
  std::optional<TimeNs> cycle_sync0;  ///< 0 with a factor: the master's cycle times the factor
  std::int32_t factor_sync0 = 0;
  std::optional<TimeNs> shift_sync0;
  std::optional<TimeNs> cycle_sync1;
  std::int32_t factor_sync1 = 0;
  std::optional<TimeNs> shift_sync1;
};

enum class FmmuUse : std::uint8_t { kOutputs, kInputs, kMailboxState, kOther };

/// Longest times the device needs for a state change (Info/StateMachine/Timeout), nanoseconds.
struct StateTimeouts {
  std::optional<TimeNs> preop;
  std::optional<TimeNs> safeop_op;
  std::optional<TimeNs> back_to_init;
  std::optional<TimeNs> back_to_safeop;
};

/// An SDO that the device wants to be written at a state change (Mailbox/CoE/InitCmd).
struct EsiInitCommand {
  std::vector<std::string> transitions;  ///< "IP", "PS", "SO", ... as in the file
  std::uint16_t index = 0;
  std::uint8_t subindex = 0;
  bool complete_access = false;
  std::vector<std::uint8_t> data;
  std::string comment;
};

/// A message of another mailbox protocol that the device wants at a state change (Mailbox/SoE, EoE, AoE: InitCmd).
struct EsiMailboxCommand {
  mailbox::Protocol protocol = mailbox::Protocol::kSoE;
  std::vector<std::string> transitions;  ///< as above
  std::optional<std::uint8_t> drive;     ///< SoE: the channel (Chn); unset: any
  std::uint16_t number = 0;              ///< SoE: IDN, EoE: type of the message, AoE: command (0: not known)
  std::vector<std::uint8_t> data;        ///< SoE: value, AoE: index group, index offset and what is written
  std::string comment;
};

struct EsiDetails {
  std::string vendor_name;
  std::string type;                             ///< order code, the text of the element Type
  std::string group;                            ///< GroupType
  std::optional<std::uint32_t> profile_number;  ///< 402 for a drive
  std::vector<FmmuUse> fmmus;                   ///< by FMMU number
  std::vector<DcMode> dc_modes;
  std::vector<EsiInitCommand> init_commands;
  std::vector<EsiMailboxCommand> mailbox_commands;
  /// CoE features; unset where the file does not state them.
  std::optional<bool> pdo_assign, pdo_config;
  StateTimeouts timeouts;
  std::vector<std::pair<EscAddress, std::uint16_t>> watchdogs;  ///< registers 0x0400, 0x0410, 0x0420 (ESC/Reg0420)
  mailbox::DiagnosisTexts diagnosis_texts;                      ///< of object 10F3h (Profile/DiagMessages)
  std::optional<EsiSlots> slot_rules;                           ///< a modular device
  bool modules_known = false;  ///< PDOs and objects of the modules in its slots are part of the description

  /// PDOs of modules are missing, so that what the file assigns by itself is not all of it.
  [[nodiscard]] bool misses_modules() const { return slot_rules && !modules_known; }
};

}  // namespace ecaudit::device
