/// The 15 EtherCAT datagram commands (ETG.1000.4; numbers as in every dissector).
#pragma once

#include <cstdint>
#include <string_view>

namespace ecaudit::wire {

enum class Command : std::uint8_t {
  NOP = 0,    ///< no slave acts
  APRD = 1,   ///< read, addressed by position
  APWR = 2,   ///< write, addressed by position
  APRW = 3,   ///< read and write, addressed by position
  FPRD = 4,   ///< read, addressed by configured station address or alias
  FPWR = 5,   ///< write, addressed by configured station address or alias
  FPRW = 6,   ///< read and write, addressed by configured station address or alias
  BRD = 7,    ///< every slave ORs its memory into the datagram
  BWR = 8,    ///< every slave writes
  BRW = 9,    ///< every slave reads (OR) and writes
  LRD = 10,   ///< read through FMMUs
  LWR = 11,   ///< write through FMMUs
  LRW = 12,   ///< read and write through FMMUs
  ARMW = 13,  ///< the slave at the position reads, all others write
  FRMW = 14,  ///< the slave with the address reads, all others write
};

inline constexpr std::uint8_t kCommandCount = 15;

[[nodiscard]] constexpr bool IsDefined(std::uint8_t command) {
  return command < kCommandCount;
}
[[nodiscard]] constexpr bool IsLogical(Command c) {
  return c == Command::LRD || c == Command::LWR || c == Command::LRW;
}
[[nodiscard]] constexpr bool IsPositionAddressed(Command c) {
  return c == Command::APRD || c == Command::APWR || c == Command::APRW || c == Command::ARMW;
}
[[nodiscard]] constexpr bool IsNodeAddressed(Command c) {
  return c == Command::FPRD || c == Command::FPWR || c == Command::FPRW || c == Command::FRMW;
}
[[nodiscard]] constexpr bool IsBroadcast(Command c) {
  return c == Command::BRD || c == Command::BWR || c == Command::BRW;
}
/// Slaves add one to the address of these (the position counter), whether or not they act.
[[nodiscard]] constexpr bool IncrementsAdp(Command c) {
  return IsPositionAddressed(c) || IsBroadcast(c);
}
/// The addressed slave returns data.
[[nodiscard]] constexpr bool Reads(Command c) {
  return c != Command::NOP && c != Command::APWR && c != Command::FPWR && c != Command::BWR && c != Command::LWR;
}
/// Some slave stores data (for ARMW and FRMW: all but the addressed one).
[[nodiscard]] constexpr bool Writes(Command c) {
  return c != Command::NOP && c != Command::APRD && c != Command::FPRD && c != Command::BRD && c != Command::LRD;
}

/// "FPRD"; "?" for a number that is no command.
[[nodiscard]] constexpr std::string_view Name(Command c) {
  constexpr std::string_view kNames[] = {"NOP", "APRD", "APWR", "APRW", "FPRD", "FPWR", "FPRW", "BRD",
                                         "BWR", "BRW",  "LRD",  "LWR",  "LRW",  "ARMW", "FRMW"};
  return static_cast<std::uint8_t>(c) < kCommandCount ? kNames[static_cast<std::uint8_t>(c)] : "?";
}

}  // namespace ecaudit::wire
