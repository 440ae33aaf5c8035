/// Which register writes configure something, in which phase of a start-up, and which of them have no meaning by their
/// value. The only place that knows register numbers of start-ups; source: esc-reference 4, 13.
#pragma once

#include <cstdint>
#include <vector>

#include "analyzers/result/expectation.h"
#include "analyzers/result/startup_summary.h"
#include "decoder/base/bytes.h"
#include "decoder/base/ids.h"
#include "decoder/esc/al.h"

namespace ecaudit::startup {

// AL states as StartupStep and the registers hold them.
inline constexpr std::uint8_t kInit = static_cast<std::uint8_t>(esc::AlState::INIT);
inline constexpr std::uint8_t kPreop = static_cast<std::uint8_t>(esc::AlState::PREOP);
inline constexpr std::uint8_t kSafeop = static_cast<std::uint8_t>(esc::AlState::SAFEOP);

/// False for writes that are no configuration: error counters, commands of the EEPROM interface, process RAM,
/// AL Control (shown by AlRequest), repeat requests of a mailbox.
[[nodiscard]] bool Configures(EscAddress address, ByteSpan data, std::uint8_t state);

/// Where a write belongs.
/// @param state  AL state of the slave, 0: not known yet
[[nodiscard]] StartupPhase PhaseOfWrite(EscAddress address, ByteSpan data, std::uint8_t state);

/// The phase that a read extends; nothing when reading there is part of none in this state.
[[nodiscard]] std::optional<StartupPhase> PhaseOfRead(EscAddress address, std::uint8_t state);

/// True when the value depends on the moment or the cabling: station addresses, clock times, offsets and delays.
[[nodiscard]] bool IsVolatile(EscAddress address, std::size_t length);

/// True when a step has its place by the clock, not by the sequence of the configuration: latching of receive times,
/// distribution of the system time.
[[nodiscard]] bool IsWithoutOrder(const StartupKey& key);

/// Cuts a write into the sync managers or FMMUs it covers; visit(EscAddress, ByteSpan) for each part, once with the
/// whole where it covers neither or only clears them.
template <typename Visit>
void CutIntoUnits(EscAddress address, ByteSpan data, Visit&& visit) {
  const auto cut = [&](EscAddress base, EscAddress end, std::size_t unit) {
    if (address < base || address + data.size() > end || (address - base) % unit != 0 || data.size() % unit != 0) {
      return false;
    }
    for (std::size_t at = 0; at < data.size(); at += unit) {
      visit(static_cast<EscAddress>(address + at), data.subspan(at, unit));
    }
    return true;
  };
  bool zero = true;
  for (const std::uint8_t byte : data) zero = zero && byte == 0;
  if (zero || (!cut(0x0800, 0x0880, 8) && !cut(0x0600, 0x0700, 16))) visit(address, data);
}

/// A command that enables a drive: bits 0 to 3, and not bit 7, which resets faults. Source: CIA402, control word.
[[nodiscard]] constexpr bool Enables(const StartupKey& key) {
  return key.kind == StartupKey::Kind::kDrive && (key.address & 0x008FU) == 0x000FU;
}

/// Steps that set what is exchanged, and where it is: sync managers, FMMUs, PDOs.
[[nodiscard]] bool IsMapping(const StartupKey& key);

/// An FMMU that maps the same bytes of the slave to another logical address: the bus has another layout.
[[nodiscard]] bool LogicalStartOnly(const StartupKey& key, ByteSpan a, ByteSpan b);

/// What a step of an expectation wants written to registers.
struct WantedBytes {
  EscAddress address = 0;
  std::vector<std::uint8_t> data;
  bool any_value = false;  ///< whatever `data` is
};
/// Of a register write; a number is as wide as its register.
[[nodiscard]] WantedBytes BytesOf(const ExpectedStep& expected);
/// Which of these bytes a write sets as they are wanted, together with other registers or not; none where it sets one
/// of them to another value.
[[nodiscard]] std::vector<bool> WrittenBy(const StartupStep& actual, const WantedBytes& wanted);

/// Same value by what the master configures: what only the ESC sets (status bytes of a sync manager) does not count.
[[nodiscard]] bool SameValue(const StartupKey& key, ByteSpan a, ByteSpan b);

}  // namespace ecaudit::startup
