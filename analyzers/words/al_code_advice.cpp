#include "analyzers/words/al_code_advice.h"

#include <algorithm>

#include "decoder/esc/al.h"

namespace ecaudit {
namespace {

/// Besides those of esc::al_code, which decide something.
enum Code : std::uint16_t {
  kNoMemory = 0x0002,
  kDeviceSetup = 0x0003,
  kRevision = 0x0004,
  kEepromOfOtherFirmware = 0x0006,
  kUpdateFailed = 0x0007,
  kLicense = 0x000E,
  kNoFirmware = 0x0014,
  kColdStart = 0x0020,
  kNeedsPreop = 0x0022,
  kNeedsSafeop = 0x0023,
  kBackgroundWatchdog = 0x002A,
  kAoe = 0x0041,
  kEoe = 0x0042,
  kCoe = 0x0043,
  kFoe = 0x0044,
  kSoe = 0x0045,
  kVoe = 0x004F,
  kEepromError = 0x0051,
  kExternalHardware = 0x0052,
  kLocalRestart = 0x0060,
  kIdentification = 0x0061,
  kSupplyLow = 0x0080,
  kSupplyHigh = 0x0081,
  kTemperatureLow = 0x0082,
  kTemperatureHigh = 0x0083,
  kApplicationController = 0x00F0,
};

struct Advice {
  std::uint16_t code;
  Word word;
};

constexpr Advice kAdvices[] = {
    {kNoMemory,
     {"no-memory",
      "The slave lacks memory for this configuration: configure fewer PDOs or modules, and check its "
      "firmware"}},
    {kDeviceSetup,
     {"device-setup",
      "The slave rejects its own combination of hardware, modules and options: compare these with its "
      "manual"}},
    {kRevision,
     {"revision",
      "Compare the revision of the slave (1018h:3) with the one that the configuration of the master is "
      "made for"}},
    {kEepromOfOtherFirmware,
     {"eeprom-of-other-firmware", "Write the EEPROM image that belongs to the firmware of the slave"}},
    {kUpdateFailed,
     {"update-failed", "The slave runs its old firmware: repeat the update in BOOT, with a file for this hardware"}},
    {kLicense, {"license", "The slave lacks a license: install it, or do not use the function that needs it"}},
    {kNoFirmware, {"no-firmware", "Load the firmware of the slave in BOOT (FoE), with a file for this hardware"}},
    {kColdStart, {"cold-start", "The slave needs a cold start: switch its power off and on, then start the bus again"}},
    {esc::al_code::kNeedsInit,
     {"needs-init", "The slave demands INIT: settings that it takes only there may have changed since"}},
    {kNeedsPreop, {"needs-preop", "The slave demands PREOP: settings that it takes only there may have changed since"}},
    {kNeedsSafeop, {"needs-safeop", "The slave demands SAFEOP before it goes on"}},
    {kBackgroundWatchdog,
     {"background-watchdog",
      "The background task of the slave took too long: lower its load (cycle time, acyclic "
      "traffic), and check its firmware"}},
    {kAoe, {"aoe", "Check the last AoE messages in the mailbox of the slave"}},
    {kEoe, {"eoe", "Check the last EoE messages in the mailbox of the slave"}},
    {kCoe, {"coe", "Check the last CoE messages in the mailbox of the slave"}},
    {kFoe, {"foe", "Check the last FoE messages in the mailbox of the slave"}},
    {kSoe, {"soe", "Check the last SoE messages in the mailbox of the slave"}},
    {kVoe, {"voe", "Check the last VoE messages in the mailbox of the slave"}},
    {kEepromError,
     {"eeprom-error",
      "The slave could not use its EEPROM: check its contents, and write the image that belongs to "
      "the firmware"}},
    {kExternalHardware,
     {"external-hardware",
      "The slave waits for hardware at its terminals: check supplies, connectors and signals that "
      "its manual requires"}},
    {kLocalRestart,
     {"local-restart",
      "The slave was restarted at the device itself: by its keys, a service tool or its firmware. "
      "Find out which, then start it up from INIT"}},
    {kIdentification,
     {"identification",
      "The slave has another identification value: check its address switches, then request the "
      "identification again (bit 5 of AL Control)"}},
    {kSupplyLow, {"supply-low", "Measure the supply voltage of the slave: it reports too low a value"}},
    {kSupplyHigh, {"supply-high", "Measure the supply voltage of the slave: it reports too high a value"}},
    {kTemperatureLow, {"temperature-low", "Check the temperature of the slave: it reports too low a value"}},
    {kTemperatureHigh,
     {"temperature-high", "Check the cooling and the load of the slave: it reports too high a temperature"}},
    {kApplicationController,
     {"application-controller",
      "The slave reports that its application controller is available: request the states "
      "from INIT on"}},
};

constexpr Word kNoSetting{"no-setting",
                          "This AL status code names no setting: find its meaning in the manual of the slave, or ask "
                          "its vendor"};

}  // namespace

void SetCodeAdvice(Finding& finding, std::uint16_t code) {
  const auto* advice = std::ranges::find(kAdvices, code, &Advice::code);
  const bool no_setting = code == esc::al_code::kUnspecified || code >= esc::al_code::kFirstOfVendors;
  if (no_setting) finding.Set("code_advice", arg::Of(kNoSetting));
  if (advice != std::end(kAdvices)) finding.Set("code_advice", arg::Of(advice->word));
}

bool DemandsRestart(std::uint16_t code) {
  return code == kColdStart;
}

std::uint8_t DemandedState(std::uint16_t code) {
  switch (code) {
    case esc::al_code::kNeedsInit:
      return static_cast<std::uint8_t>(esc::AlState::INIT);
    case kNeedsPreop:
      return static_cast<std::uint8_t>(esc::AlState::PREOP);
    case kNeedsSafeop:
      return static_cast<std::uint8_t>(esc::AlState::SAFEOP);
    default:
      return 0;
  }
}

}  // namespace ecaudit
