/// Mailboxes and sync managers of a family, and how its manual describes the mailbox protocol.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "decoder/base/ids.h"
#include "decoder/device/register_right.h"
#include "decoder/esc/al.h"

namespace ecaudit::device {

enum class SyncManagerUse : std::uint8_t { kUnused, kMailboxOut, kMailboxIn, kProcessOut, kProcessIn };

/// How families and reports write it.
struct SyncManagerUseWord {
  std::string_view text;
  SyncManagerUse value;
};
inline constexpr SyncManagerUseWord kSyncManagerUses[] = {{"unused", SyncManagerUse::kUnused},
                                                          {"mailbox out", SyncManagerUse::kMailboxOut},
                                                          {"mailbox in", SyncManagerUse::kMailboxIn},
                                                          {"process out", SyncManagerUse::kProcessOut},
                                                          {"process in", SyncManagerUse::kProcessIn}};
[[nodiscard]] std::string_view Name(SyncManagerUse use);

/// What a sync manager of the drive must be set to.
struct SyncManagerRule {
  std::uint8_t number = 0;
  SyncManagerUse use = SyncManagerUse::kUnused;
  std::optional<EscAddress> start;  ///< unset: any
  /// Buffer lengths the source names; for mailboxes the drive's own EEPROM or ESI comes first.
  std::vector<std::uint32_t> lengths;
  std::optional<std::uint32_t> max_length;  ///< unset: not documented
  bool mailbox_mode = false;                ///< one-buffer mode; else three-buffer mode
  bool master_writes = false;               ///< direction
  std::optional<std::uint8_t> control;      ///< control byte (ESI only)
  std::string note;
  std::string source;
};

/// A mailbox size of the manual.
struct MailboxSize {
  std::string direction;  ///< "out", "in", "both"
  std::optional<EscAddress> start;
  std::uint32_t bytes = 0;
  std::string note;
  std::string source;
};

/// A mailbox protocol (type field of the mailbox header).
struct MailboxProtocol {
  std::uint8_t type = 0;
  std::string name;
  /// The manual calls it reserved; no source states that the drive would accept it.
  bool reserved = false;
  std::string note;
  std::string source;
};

/// A value of the CoE service field, or a range of them.
struct CoeService {
  std::uint8_t first = 0;
  std::uint8_t last = 0;
  std::string meaning;
  bool reserved = false;
  std::string note;
  std::string source;
};

/// An SDO command byte.
struct SdoCommandByte {
  bool request = false;  ///< master to drive
  std::uint8_t value = 0;
  std::string meaning;
  std::optional<std::uint8_t> data_bytes;
  std::string note;
  std::string source;
};

/// Bits of one byte of a mailbox telegram.
struct MailboxByte {
  bool request = false;
  std::uint8_t byte = 0;
  std::uint8_t first = 0;
  std::uint8_t last = 7;
  std::string meaning;
  std::string note;
  std::string source;
};

/// One byte of the manual's example.
struct MailboxExampleByte {
  bool request = false;
  std::uint8_t byte = 0;
  std::uint8_t value = 0;
  std::string meaning;
  std::string note;
  std::string source;
};

/// A kind of file that the drive takes by FoE.
struct MailboxFile {
  std::string name;                  ///< "parameter file"
  std::string suffix;                ///< of its file name: ".akd"
  std::vector<esc::AlState> states;  ///< in which it may be transferred
  std::string note;
  std::string source;
};

struct MailboxDescription {
  std::vector<SyncManagerRule> sync_managers;  ///< sorted by number
  std::vector<MailboxSize> sizes;
  std::vector<MailboxProtocol> protocols;  ///< sorted by type
  std::vector<CoeService> coe_services;
  std::vector<SdoCommandByte> sdo_commands;
  std::vector<MailboxByte> layout;
  std::vector<MailboxExampleByte> example;
  std::vector<MailboxFile> files;
  bool complete_access = false;  ///< SDO complete access (ESI only)
  bool sdo_information = false;  ///< (ESI only)
  std::string note;
  std::string source;

  [[nodiscard]] const SyncManagerRule* FindSyncManager(std::uint8_t number) const;
  [[nodiscard]] const MailboxProtocol* FindProtocol(std::uint8_t type) const;
};

}  // namespace ecaudit::device
