/// The registers of an EtherCAT slave controller (ESC), 0x0000-0x0FFF, as one table: what lies where, how the master
/// may access it and what its bits mean.
///
/// Sources: esc-reference 4 (ESC data sheet section II and the register lists of other makers); each register names its
/// own with the keys of esc-reference 0. Not every ESC has every register. Names follow the data sheet, without its
/// "ESC " before DL Control and DL Status. Registers that repeat are named by their unit: "SM2 Start", "FMMU0 Type",
/// "RX Error Counter Port 1".
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "decoder/base/ids.h"

namespace ecaudit::esc {

/// Process data RAM begins here; its size is in 0x0006.
inline constexpr EscAddress kProcessRam = 0x1000;
inline constexpr std::uint32_t kAddressSpace = 0x10000;

/// What the master may do; `r`, `w` as the manuals write it.
enum class EcatAccess : std::uint8_t {
  READ,              ///< r
  READ_ACKNOWLEDGE,  ///< r*: reading clears or acknowledges something
  READ_WRITE,        ///< r/w
  WRITE_IF,          ///< r/(w): writable in some situations only, refused in others
  WRITE_EFFECT,      ///< r/w*: the value written is not what is read later, the write itself matters
  WRITE_CLEARS,      ///< r/w: any write clears the counter
};

[[nodiscard]] constexpr bool IsReadOnly(EcatAccess access) {
  return access == EcatAccess::READ || access == EcatAccess::READ_ACKNOWLEDGE;
}

/// How the value of a field is to be read.
enum class Unit : std::uint8_t {
  FLAG,    ///< one bit with a name
  NUMBER,  ///< unsigned
  SIGNED,  ///< two's complement
  HEX,     ///< address, identifier
  VALUE,   ///< one of Field::values
  KIB,     ///< 1024 bytes
  BYTES,
  BIT,            ///< number of a bit
  NS,             ///< nanoseconds
  SIGNED_NS,      ///< nanoseconds, two's complement
  DC_TIME,        ///< nanoseconds since 2000, or its lower 32 bits
  MAGNITUDE_NS,   ///< 31 bits of nanoseconds and a bit whose meaning differs (esc-reference 10.4)
  TEN_NS,         ///< 10 ns each; 0: acknowledge mode
  WATCHDOG_STEP,  ///< 0x0400: (value + 2) * 40 ns
  WATCHDOG_TIME,  ///< steps of 0x0400; 0: off
  AL_STATE,       ///< AL Control bits 3:0
  AL_STATUS,      ///< AL Status bits 4:0, the state and the error bit
  AL_STATUS_CODE,
  EEPROM_COMMAND,
  WORD_ADDRESS,  ///< of the EEPROM
  DATA,          ///< bytes without a meaning known here
};

struct ValueText {
  std::uint32_t value = 0;
  std::string_view text;
};

/// One group of bits of a register.
struct Field {
  std::string_view name;  ///< "" when the register has only this field
  std::uint8_t lsb = 0;
  std::uint8_t width = 1;
  Unit unit = Unit::FLAG;
  std::span<const ValueText> values;  ///< for Unit::VALUE; a value with an empty text is not worth reporting
};

struct Register {
  EscAddress address = 0;    ///< of the first instance
  std::uint16_t length = 0;  ///< bytes
  std::string_view name;     ///< '#' means the number of the instance
  EcatAccess access = EcatAccess::READ;
  std::span<const Field> fields;
  std::string_view zero;             ///< what no set bit means, for registers of flags
  std::uint8_t mandatory_bytes = 0;  ///< leading bytes that every ESC implements; 0: not every ESC has the register
  std::string_view source;
};

/// Registers that come several times, `size` bytes apart.
struct RegisterUnit {
  EscAddress address = 0;
  std::uint16_t size = 0;
  std::uint8_t count = 0;
  std::uint8_t first_number = 0;
  std::string_view name;  ///< "SM", "FMMU"; "" when the unit is a single register
};

/// All registers, sorted by address, repeated ones once; no two overlap.
[[nodiscard]] std::span<const Register> AllRegisters();
/// All units, sorted by address.
[[nodiscard]] std::span<const RegisterUnit> AllRegisterUnits();

/// The register that contains `address` (of a repeated one: its table entry); null for reserved addresses and from
/// kProcessRam on.
[[nodiscard]] const Register* FindRegister(EscAddress address);
/// The unit that contains `address`; null when there is none.
[[nodiscard]] const RegisterUnit* FindRegisterUnit(EscAddress address);

/// A place in the register area.
struct RegisterHit {
  const Register* reg = nullptr;       ///< null: reserved, or process RAM
  const RegisterUnit* unit = nullptr;  ///< null: not repeated
  std::uint8_t number = 0;             ///< of the instance, as in its name
  EscAddress start = 0;                ///< first byte of this instance of the register
  std::uint16_t offset = 0;            ///< of the address asked for inside the register

  explicit operator bool() const { return reg != nullptr; }
};
[[nodiscard]] RegisterHit RegisterAt(EscAddress address);

/// "AL Status", "SM2 Start"; "Process RAM" from 0x1000 on; "" for reserved addresses.
[[nodiscard]] std::string RegisterName(EscAddress address);
[[nodiscard]] std::string RegisterName(const RegisterHit& hit);
/// Name for an access: that of its only register ("AL Status"), the units it covers ("SM0", "SM0-SM3"), else first and
/// last register ("AL Status - AL Status Code"); "Process RAM"; "" when it covers reserved addresses only.
[[nodiscard]] std::string AccessName(EscAddress address, std::size_t length);

/// A part of an access: one register, or a run of reserved bytes, or process RAM.
struct RegisterPart {
  RegisterHit hit;         ///< reg null: reserved, or process RAM
  EscAddress address = 0;  ///< first byte of the part
  std::size_t at = 0;      ///< its offset in the access
  std::size_t length = 0;  ///< bytes of the access in it
  bool complete = false;   ///< covers the whole register

  [[nodiscard]] bool is_process_ram() const { return address >= kProcessRam; }
};
/// The part that begins at `address` + `at` of the access [address, address + length); `at` < `length`.
[[nodiscard]] RegisterPart PartAt(EscAddress address, std::size_t length, std::size_t at);

/// Cuts an access into the registers it covers; visit(const RegisterPart&) in ascending order. What reaches past the
/// address space is left out.
template <typename Visit>
void CutAccess(EscAddress address, std::size_t length, Visit&& visit) {
  length = std::min<std::size_t>(length, kAddressSpace - address);
  for (std::size_t at = 0; at < length;) {
    const RegisterPart part = PartAt(address, length, at);
    visit(part);
    at += part.length;
  }
}

/// True when every ESC counts a read of [address, address + length): the access covers a byte that all ESCs implement
/// (one byte is enough for the working counter, esc-reference 2.2).
[[nodiscard]] bool EveryEscReads(EscAddress address, std::size_t length);
/// True when every ESC counts a write there in every situation. Registers that refuse writes at times (AL Control, sync
/// managers, EEPROM) do not make it true.
[[nodiscard]] bool EveryEscWrites(EscAddress address, std::size_t length);
/// True when no byte of the access is one that a master can write: all of it is read-only by the data sheet, or
/// reserved (section II table 1: reserved addresses are not writable).
[[nodiscard]] bool NothingToWrite(EscAddress address, std::size_t length);

}  // namespace ecaudit::esc
