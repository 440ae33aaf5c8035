/// The six bytes in front of every mailbox message, and what can be wrong with a message.
///
///   | length 2 | address 2 | channel:6 priority:2 | type:4 counter:3 reserved:1 | service data, `length` bytes |
///
/// Source: ETG.1000.4 mailbox; esc-reference 8.1-8.2. The vendor manuals count the length differently (0x0E for the
/// answer in their printed example) and call the counter bits reserved; real drives follow the standard.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "decoder/base/bytes.h"

namespace ecaudit::mailbox {

inline constexpr std::size_t kHeaderBytes = 6;

/// Who wrote a message.
enum class Direction : std::uint8_t {
  kOut,  ///< master to slave, sync manager 0
  kIn,   ///< slave to master, sync manager 1
};

/// "out" or "in".
[[nodiscard]] constexpr std::string_view Name(Direction direction) {
  return direction == Direction::kOut ? "out" : "in";
}

/// Mailbox protocols; all other type numbers are reserved.
enum class Protocol : std::uint8_t {
  kError = 0,  ///< mailbox error reply
  kAoE = 1,    ///< ADS over EtherCAT
  kEoE = 2,    ///< Ethernet over EtherCAT
  kCoE = 3,    ///< CANopen over EtherCAT
  kFoE = 4,    ///< file access
  kSoE = 5,    ///< servo drive profile
  kVoE = 15,   ///< vendor specific
};

[[nodiscard]] constexpr bool IsDefined(Protocol protocol) {
  return static_cast<std::uint8_t>(protocol) <= 5 || protocol == Protocol::kVoE;
}
/// "CoE"; "error" for type 0; "type 9" for a reserved number.
[[nodiscard]] std::string Name(Protocol protocol);

struct Header {
  std::uint16_t length = 0;   ///< bytes of service data, without this header
  std::uint16_t address = 0;  ///< station address of the originator; usually 0
  std::uint8_t channel = 0;   ///< 0-63, reserved
  std::uint8_t priority = 0;  ///< 0-3
  Protocol protocol = Protocol::kError;
  std::uint8_t counter = 0;   ///< 1-7; 0: not used
  bool reserved_bit = false;  ///< bit 7 of byte 5, must be 0
};

/// Fields of the first six bytes; what is missing reads as 0.
[[nodiscard]] constexpr Header ParseHeader(ByteSpan bytes) {
  const auto byte4 = LittleEndian<std::uint8_t>(bytes, 4);
  const auto byte5 = LittleEndian<std::uint8_t>(bytes, 5);
  Header header;
  header.length = LittleEndian<std::uint16_t>(bytes, 0);
  header.address = LittleEndian<std::uint16_t>(bytes, 2);
  header.channel = static_cast<std::uint8_t>(byte4 & 0x3FU);
  header.priority = static_cast<std::uint8_t>(byte4 >> 6U);
  header.protocol = static_cast<Protocol>(byte5 & 0x0FU);
  header.counter = static_cast<std::uint8_t>(byte5 >> 4U & 0x07U);
  header.reserved_bit = (byte5 & 0x80U) != 0;
  return header;
}

/// The counter that follows `counter`: 1 to 7, then 1 again.
[[nodiscard]] constexpr std::uint8_t NextCounter(std::uint8_t counter) {
  return counter >= 7 ? std::uint8_t{1} : static_cast<std::uint8_t>(counter + 1);
}

/// What is wrong with a message. Everything that is there is decoded all the same.
enum class Problem : std::uint8_t {
  kNone,
  kNoHeader,             ///< fewer than six bytes
  kLengthZero,           ///< the length field is 0
  kLengthBeyondMailbox,  ///< length and header need more than the mailbox holds
  kLengthBeyondData,     ///< fewer bytes were written or read than the length announces
  kReservedBit,          ///< bit 7 of byte 5 is set
  kUnknownType,          ///< a reserved protocol number
  kServiceTooShort,      ///< the protocol's own header or its fixed fields do not fit into the length
  kServiceInvalid,       ///< a reserved service, operation or command
  kNotCompleted,         ///< the last byte of the mailbox was never accessed; the next message started before
};

/// One sentence part, for example "the length field is 0"; "" for kNone.
[[nodiscard]] std::string_view Describe(Problem problem);

/// A message cut into header and service data.
struct MessageView {
  Header header;
  ByteSpan payload;  ///< service data as far as present, at most header.length bytes
  Problem problem = Problem::kNone;
};

/// Cuts `bytes` (from the first byte of the mailbox on). Never fails: see problem.
/// @param mailbox_length  length of the sync manager, 0 when unknown
/// @param direction  which services are legal depends on it
[[nodiscard]] MessageView ParseMessage(ByteSpan bytes, std::size_t mailbox_length, Direction direction);

/// Whether `bytes` could be a mailbox message, for places where no configuration shows: a consistent header, a service
/// that `direction` allows, reserved bits clear. Process data hardly ever looks like that. VoE has nothing to check and
/// is never recognised.
[[nodiscard]] bool LooksLikeMessage(ByteSpan bytes, Direction direction);

}  // namespace ecaudit::mailbox
