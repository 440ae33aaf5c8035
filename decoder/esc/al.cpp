#include "decoder/esc/al.h"

#include <bit>

#include "decoder/base/names.h"

namespace ecaudit::esc {
namespace {

constexpr Named<std::uint16_t> kCodes[] = {
    {0x0000, "no error"},
    {0x0001, "unspecified error"},
    {0x0002, "no memory"},
    {0x0003, "invalid device setup"},
    {0x0004, "invalid revision"},
    {0x0006, "EEPROM does not match the firmware"},
    {0x0007, "firmware update not successful, old firmware still running"},
    {0x000E, "license error"},
    {0x0011, "invalid requested state change"},
    {0x0012, "unknown requested state"},
    {0x0013, "bootstrap not supported"},
    {0x0014, "no valid firmware"},
    {0x0015, "invalid mailbox configuration (BOOT)"},
    {0x0016, "invalid mailbox configuration (PREOP)"},
    {0x0017, "invalid sync manager configuration"},
    {0x0018, "no valid inputs available"},
    {0x0019, "no valid outputs"},
    {0x001A, "synchronization error"},
    {0x001B, "sync manager watchdog"},
    {0x001C, "invalid sync manager types"},
    {0x001D, "invalid output configuration"},
    {0x001E, "invalid input configuration"},
    {0x001F, "invalid watchdog configuration"},
    {0x0020, "slave needs cold start"},
    {0x0021, "slave needs INIT"},
    {0x0022, "slave needs PREOP"},
    {0x0023, "slave needs SAFEOP"},
    {0x0024, "invalid input mapping"},
    {0x0025, "invalid output mapping"},
    {0x0026, "inconsistent settings"},
    {0x0027, "free run not supported"},
    {0x0028, "synchronization mode not supported"},
    {0x0029, "free run needs three-buffer mode"},
    {0x002A, "background watchdog"},
    {0x002B, "no valid inputs and outputs"},
    {0x002C, "fatal sync error"},
    {0x002D, "no sync error: SYNC0 never seen"},
    {0x002E, "cycle time too small"},
    {0x0030, "invalid DC SYNC configuration"},
    {0x0031, "invalid DC latch configuration"},
    {0x0032, "PLL error"},
    {0x0033, "DC sync IO error"},
    {0x0034, "DC sync timeout"},
    {0x0035, "DC invalid sync cycle time"},
    {0x0036, "DC SYNC0 cycle time"},
    {0x0037, "DC SYNC1 cycle time"},
    {0x0041, "mailbox AoE error"},
    {0x0042, "mailbox EoE error"},
    {0x0043, "mailbox CoE error"},
    {0x0044, "mailbox FoE error"},
    {0x0045, "mailbox SoE error"},
    {0x004F, "mailbox VoE error"},
    {0x0050, "EEPROM no access"},
    {0x0051, "EEPROM error"},
    {0x0052, "external hardware not ready"},
    {0x0060, "slave restarted locally"},
    {0x0061, "device identification value updated"},
    {0x0070, "detected module identification list does not match"},
    {0x0080, "supply voltage too low"},
    {0x0081, "supply voltage too high"},
    {0x0082, "temperature too low"},
    {0x0083, "temperature too high"},
    {0x00F0, "application controller available"},
};

}  // namespace

std::string_view StateName(AlState state) {
  static constexpr Named<AlState> kNames[] = {
      {AlState::INIT, "INIT"},     {AlState::PREOP, "PREOP"}, {AlState::BOOT, "BOOT"},
      {AlState::SAFEOP, "SAFEOP"}, {AlState::OP, "OP"},
  };
  const std::string_view name = NameIn(kNames, state);
  return !name.empty() ? name : "?";
}

std::string StateName(std::uint8_t value) {
  if (IsAlState(value)) return std::string(StateName(static_cast<AlState>(value)));
  return "state " + std::to_string(value);
}

std::uint8_t StateFromName(std::string_view name) {
  for (const AlState state : {AlState::INIT, AlState::PREOP, AlState::BOOT, AlState::SAFEOP, AlState::OP}) {
    if (StateName(state) == name) return static_cast<std::uint8_t>(state);
  }
  return 0;
}

std::string_view AlStatusCodeName(std::uint16_t code) {
  return NameIn(kCodes, code);
}

std::string StatesOfAllText(std::uint16_t status) {
  const AlWord word{status};
  const std::string states = OredStatesText(word.state());
  if (!word.bit4()) return states;
  const bool several = std::popcount(static_cast<unsigned>(word.state())) > 1;
  return states + (several ? ", and the error bit" : " and the error bit");
}

std::string StatusText(std::uint16_t al_status) {
  const AlWord word{al_status};
  return StateName(word.state()) + (word.bit4() ? "+ERR" : "");
}

std::string OredStatesText(std::uint8_t states) {
  if (states == static_cast<std::uint8_t>(AlState::BOOT)) return "BOOT, or INIT and PREOP";
  if (IsAlState(states)) return std::string(StateName(static_cast<AlState>(states)));
  std::string text;
  std::string_view last;
  for (const AlState state : {AlState::INIT, AlState::PREOP, AlState::SAFEOP, AlState::OP}) {
    if ((states & static_cast<std::uint8_t>(state)) == 0) continue;
    if (!last.empty()) text += (text.empty() ? "" : ", ") + std::string(last);
    last = StateName(state);
  }
  return last.empty() ? StateName(states) : text + " and " + std::string(last);
}

}  // namespace ecaudit::esc
