/// One SDO message (after the CoE header), requests and responses.
///
///   initiate, abort: | command 1 | index 2 | subindex 1 | size, expedited data or abort code 4 | data ... |
///   segment:         | command 1 | data, at least 7 bytes (some slaves answer with the command alone) |
///
/// The top three bits of the command show what it is; the rest of the bits of an abort or a download response mean
/// nothing and are not always 0 (KickCAT sends aborts 0x80-0x91).
/// Source: ETG.1000.6 5.6.2; AKD manual 4.12, MKD 4.13, Pilz 4.10; esc-reference 8.4.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "decoder/base/bytes.h"
#include "decoder/mailbox/header.h"

namespace ecaudit::mailbox {

enum class SdoKind : std::uint8_t {
  kDownloadInitiate,
  kDownloadSegment,
  kUploadInitiate,
  kUploadSegment,
  kAbort,
  kReserved,  ///< command specifiers 5-7 (block transfer of CANopen), not used with EtherCAT
};

/// What the command byte makes the message.
[[nodiscard]] SdoKind KindOf(std::uint8_t command, Direction direction);

struct SdoMessage {
  SdoKind kind = SdoKind::kReserved;
  Direction direction = Direction::kOut;  ///< kOut: request; kIn: response
  std::uint8_t command = 0;               ///< the command byte as it is
  bool has_object = false;                ///< index and subindex are part of it (all but segments)
  std::uint16_t index = 0;
  std::uint8_t subindex = 0;
  bool complete_access = false;       ///< initiates only
  bool expedited = false;             ///< initiate with data inside the size field
  bool toggle = false;                ///< segments only
  bool last = false;                  ///< segments with data: no more follow
  std::optional<std::uint32_t> size;  ///< bytes announced by an initiate with data; absent when not indicated
  ByteSpan data;                      ///< bytes of the object carried here
  std::uint32_t excess = 0;           ///< bytes after the announced size in a normal transfer
  std::uint32_t abort_code = 0;       ///< aborts only
  /// Aborts of normal downloads: a defined abort code found four bytes later although the code at its place is none
  /// (KickCAT leaves the size of the request where the code belongs).
  std::optional<std::uint32_t> displaced_abort_code;
  bool too_short = false;  ///< fixed fields are missing; they read as 0
};

/// Reads one SDO message. Never fails: too_short and kind kReserved show what is wrong.
/// @param sdo  bytes after the CoE header, as long as the mailbox length announces
[[nodiscard]] SdoMessage ParseSdo(ByteSpan sdo, Direction direction);

/// Meaning of an abort code (ETG.1000.6 table 41), "" when it has none.
[[nodiscard]] std::string_view AbortCodeText(std::uint32_t code);

}  // namespace ecaudit::mailbox
