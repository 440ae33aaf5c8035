/// The start-up of one slave, or what the master sent to all slaves at once in between: plain data for the writers,
/// for expectations and for the comparison of captures.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "decoder/base/ids.h"
#include "decoder/mailbox/header.h"

namespace ecaudit {

/// Recognised by the registers and states involved, not by the order in which a master works (esc-reference 13.6).
enum class StartupPhase : std::uint8_t {
  kScan,             ///< who is there: counting, identification of the ESC, reset of what an earlier run left
  kAddressing,       ///< station address and alias
  kEeprom,           ///< reading the EEPROM, handing it over
  kMailboxSetup,     ///< sync managers of the mailboxes
  kInitToPreop,      ///< from the request of PREOP on
  kPreopParameters,  ///< mailbox transfers in PREOP
  kDc,               ///< distributed clocks
  kPreopToSafeop,    ///< process data: sync managers, FMMUs, watchdogs, and the request of SAFEOP
  kSafeopToOp,       ///< from SAFEOP to OP
  kDriveEnable,      ///< drive state machine, up to Operation enabled
};
inline constexpr std::size_t kStartupPhases = 10;

struct StartupPhaseName {
  std::string_view name;   ///< in files
  std::string_view title;  ///< for people
};
inline constexpr std::array<StartupPhaseName, kStartupPhases> kStartupPhaseNames{{
    {"scan", "scan"},
    {"addressing", "addressing"},
    {"eeprom", "EEPROM"},
    {"mailbox-setup", "mailbox set-up"},
    {"init-to-preop", "INIT -> PREOP"},
    {"preop-parameters", "PREOP parameters"},
    {"dc", "distributed clocks"},
    {"preop-to-safeop", "PREOP -> SAFEOP"},
    {"safeop-to-op", "SAFEOP -> OP"},
    {"drive-enable", "drive enable"},
}};

[[nodiscard]] constexpr std::string_view Name(StartupPhase phase) {
  return kStartupPhaseNames[static_cast<std::size_t>(phase)].name;
}
[[nodiscard]] constexpr std::string_view Title(StartupPhase phase) {
  return kStartupPhaseNames[static_cast<std::size_t>(phase)].title;
}
/// Reads what Name() writes.
[[nodiscard]] constexpr std::optional<StartupPhase> ParseStartupPhase(std::string_view name) {
  for (std::size_t i = 0; i < kStartupPhaseNames.size(); ++i) {
    if (kStartupPhaseNames[i].name == name) return static_cast<StartupPhase>(i);
  }
  return std::nullopt;
}

/// What a step is and what it is about. Two steps with equal keys are the same step, with whatever value.
struct StartupKey {
  enum class Kind : std::uint8_t {
    kWrite,     ///< registers of the ESC from `address` on
    kEeprom,    ///< EEPROM word `address`
    kRequest,   ///< AL state `address`
    kDownload,  ///< SDO, the master writes
    kUpload,    ///< SDO, the master reads
    kDrive,     ///< control word of a drive
  };
  Kind kind = Kind::kWrite;
  bool complete_access = false;  ///< SDO
  std::uint8_t subindex = 0;     ///< SDO
  std::uint32_t address = 0;     ///< register, EEPROM word, AL state, or object index

  friend bool operator==(const StartupKey&, const StartupKey&) = default;
};

enum class StartupOutcome : std::uint8_t {
  kDone,        ///< a command to enable a drive: it shows Operation enabled
  kRefused,     ///< register: no slave took it; request: answered with the error bit; SDO: aborted; drive: in Fault
  kUnanswered,  ///< the master waited for the state or the answer and gave up: the capture shows that none came
  kUnknown,     ///< what came of it is not in the capture
};

/// One thing the master did to configure a slave. Immediate repetitions are one step.
struct StartupStep {
  StartupKey key;
  StartupPhase phase = StartupPhase::kScan;
  FrameRef frame;  ///< the request, as sent where that is captured
  FrameRef last;   ///< the answer, or the last repetition
  std::uint64_t count = 1;
  StartupOutcome outcome = StartupOutcome::kDone;
  /// The value depends on the moment or the cabling (clock times, offsets, addresses): it is not compared.
  bool volatile_value = false;
  bool broadcast = false;
  std::uint32_t code = 0;  ///< refused: SDO abort code, or AL status code (0: not read)
  /// Bytes on the wire: written, or for an upload read. Not more than the recorder keeps; `size` counts all.
  std::vector<std::uint8_t> data;
  std::uint64_t size = 0;
  /// What the master read there later, first time: registers and SDOs that were written.
  std::vector<std::uint8_t> read_back;
  FrameRef read_back_frame;
  // In words, safe to print.
  std::string name;       ///< "SM2", "1C12h:0 RxPDO assign", "SAFEOP requested", "Enable operation"
  std::string text;       ///< the value: "0x1100 6 bytes, buffered, ...", "7 (0x07)"; empty when there is none
  std::string read_text;  ///< read_back likewise; empty when not read or as written
  std::string
      note;  ///< what went wrong: "aborted 0x06010002 ...", "refused with 0x001d ...", "not answered"; else empty
};

/// What the master last wrote by a mailbox protocol other than CoE. It is no step: only an ESI is compared with it.
struct MailboxSetting {
  mailbox::Protocol protocol = mailbox::Protocol::kSoE;
  std::uint8_t drive = 0;    ///< SoE
  std::uint16_t number = 0;  ///< SoE: IDN, EoE: type of the message, AoE: command
  FrameRef frame;            ///< the request, as sent where that is captured
  StartupOutcome outcome = StartupOutcome::kUnknown;
  std::uint32_t code = 0;  ///< refused: error code of the protocol
  /// SoE: the value, empty if not all of it is kept. AoE: index group, index offset and what is written.
  std::vector<std::uint8_t> data;
};

struct StartupPhaseSummary {
  StartupPhase phase = StartupPhase::kScan;
  FrameRef first, last;
  std::optional<TimeNs> duration;  ///< between these; unset without time stamps
  std::uint64_t accesses = 0;      ///< of the master, reads included
  std::string result;              ///< "PREOP reached", "SAFEOP refused with 0x001d ...", "52 words read"; may be empty
  bool failed = false;
};

struct StartupSummary {
  /// At least one step of it is in the capture; one that starts mid-run holds none.
  bool seen = false;
  std::vector<StartupPhaseSummary> phases;  ///< by first frame
  std::vector<StartupStep> steps;           ///< by frame
  std::vector<MailboxSetting> mailbox_settings;
  std::uint64_t steps_left_out = 0;         ///< further steps that were not kept
  std::uint64_t dropped_bytes = 0;          ///< of values that were too long to keep
  std::optional<std::uint8_t> first_state;  ///< first AL state that was seen or requested
  std::uint8_t reached = 0;                 ///< highest AL state that was seen, 0: none
  std::uint64_t again = 0;                  ///< later start-ups, which are not recorded
  FrameRef again_frame;                     ///< where the first of them begins
  FrameRef end;                             ///< last frame that showed something about it
  bool ended = false;  ///< OP was reached or left; false: the capture ends, or the slave stayed below OP

  [[nodiscard]] const StartupPhaseSummary* phase(StartupPhase wanted) const {
    for (const StartupPhaseSummary& p : phases) {
      if (p.phase == wanted) return &p;
    }
    return nullptr;
  }
};

}  // namespace ecaudit
