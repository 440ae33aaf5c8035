#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "analyzers/judge/refusal/code_table.h"
#include "analyzers/judge/refusal_reasons.h"
#include "decoder/esc/al.h"

namespace ecaudit {
namespace refusal {
namespace {

/// The registers and objects that show what checks look at. The likeliest reason stands first. Without a row: the
/// master does not write it (CheckTypes), or other checks of the same code name it (CheckLengths,
/// CheckExists, CheckRam, CheckOperationMode, CheckClock).
struct About {
  std::array<Check, 7> checks;           ///< null: no more
  std::array<SettingRange, 3> settings;  ///< empty ones at the end
};

constexpr SettingRange kMailboxRegisters{.first = 0x0800, .last = 0x080F};
constexpr SettingRange kOutputRegisters{.first = 0x0810, .last = 0x0817};
constexpr SettingRange kInputRegisters{.first = 0x0818, .last = 0x081F};
constexpr SettingRange kFurtherManagers{.first = 0x0820, .last = 0x087F};
constexpr SettingRange kFmmuRegisters{.first = 0x0600, .last = 0x06FF};
constexpr SettingRange kWatchdogRegisters{.first = 0x0400, .last = 0x0421};
constexpr SettingRange kClockRegisters{.first = 0x0900, .last = 0x098F};
constexpr SettingRange kSyncRegisters{.first = 0x0980, .last = 0x09AF};
constexpr SettingRange kEepromRegisters{.first = 0x0500, .last = 0x0501};
constexpr SettingRange kEepromMailbox{.kind = SettingRange::Kind::kEeprom, .first = 0x0014, .last = 0x001C};
constexpr SettingRange kRxObjects{.kind = SettingRange::Kind::kObject, .first = 0x1600, .last = 0x17FF};
constexpr SettingRange kTxObjects{.kind = SettingRange::Kind::kObject, .first = 0x1A00, .last = 0x1BFF};
constexpr SettingRange kRxAssigned{.kind = SettingRange::Kind::kObject, .first = 0x1C12, .last = 0x1C12};
constexpr SettingRange kTxAssigned{.kind = SettingRange::Kind::kObject, .first = 0x1C13, .last = 0x1C13};
constexpr SettingRange kSyncParameters{.kind = SettingRange::Kind::kObject, .first = 0x1C32, .last = 0x1C33};
constexpr SettingRange kDriveCycle{.kind = SettingRange::Kind::kObject, .first = 0x60C2, .last = 0x60C2};
constexpr SettingRange kModuleObjects{.kind = SettingRange::Kind::kObject, .first = 0xF030, .last = 0xF05F};

constexpr std::array kAbout{
    About{{CheckMailboxSet, Of<0, CheckIgnored>, Of<1, CheckIgnored>}, {kMailboxRegisters}},
    About{{CheckMailboxWords, CheckBootstrap, CheckMailboxFirmware}, {kMailboxRegisters, kEepromMailbox}},
    About{{Of<kOutputs, CheckManagerSet>}, {kOutputRegisters}},
    About{{Of<kInputs, CheckManagerSet>}, {kInputRegisters}},
    About{
        {Of<kOutputs, CheckIgnored>, Of<kOutputs, CheckCount>, Of<kOutputs, CheckPdosExist>, Of<kOutputs, CheckEntries>,
         Of<kOutputs, CheckMapped>, Of<kOutputs, CheckAssigned>, Of<kOutputs, CheckAligned>},
        {kOutputRegisters, kRxObjects, kRxAssigned}},
    About{{Of<kInputs, CheckIgnored>, Of<kInputs, CheckCount>, Of<kInputs, CheckPdosExist>, Of<kInputs, CheckEntries>,
           Of<kInputs, CheckMapped>, Of<kInputs, CheckAssigned>, Of<kInputs, CheckAligned>},
          {kInputRegisters, kTxObjects, kTxAssigned}},
    About{{Of<kOutputs, CheckLengthWithoutPdo>}, {kOutputRegisters, kRxAssigned}},
    About{{Of<kInputs, CheckLengthWithoutPdo>}, {kInputRegisters, kTxAssigned}},
    About{{CheckLrw}, {kFmmuRegisters}},
    About{{CheckOutputs}, {kFmmuRegisters, kOutputRegisters}},
    About{{CheckInputs}, {kFmmuRegisters, kInputRegisters}},
    About{{CheckWatchdog}, {kWatchdogRegisters, kOutputRegisters}},
    About{{CheckTrigger}, {kOutputRegisters, kWatchdogRegisters}},
    About{{CheckTypeRejected, CheckSyncSettings}, {kSyncRegisters, kSyncParameters}},
    About{{CheckLeftOn, CheckClockAway}, {kClockRegisters, kSyncRegisters}},
    About{{CheckSyncActive, CheckSyncUnsupported, CheckSyncTypes, CheckSyncSet}, {kSyncRegisters, kSyncParameters}},
    About{{CheckSyncCycle}, {kSyncRegisters, kSyncParameters, kDriveCycle}},
    About{{CheckRate, CheckArrival}, {kSyncRegisters, kClockRegisters, kDriveCycle}},
    About{{CheckSync1Cycle, CheckLatch}, {kSyncRegisters}},
    About{{Of<kOutputs, CheckThreeBuffers>}, {kOutputRegisters, kSyncRegisters}},
    About{{Of<kInputs, CheckThreeBuffers>}, {kInputRegisters, kSyncRegisters}},
    About{{CheckEepromOwner}, {kEepromRegisters}},
    About{{CheckModules, CheckModulesSet}, {kModuleObjects}},
};

/// What a slave checks at a request, for a code without a row.
struct AboutRequest {
  esc::AlState requested;
  std::array<SettingRange, 12> settings;
};
constexpr std::array kAboutRequests{
    AboutRequest{esc::AlState::PREOP, {kMailboxRegisters, kEepromRegisters}},
    AboutRequest{esc::AlState::SAFEOP,
                 {kMailboxRegisters, kOutputRegisters, kInputRegisters, kFurtherManagers, kFmmuRegisters, kRxObjects,
                  kTxObjects, kRxAssigned, kTxAssigned, kSyncRegisters, kSyncParameters, kModuleObjects}},
    AboutRequest{esc::AlState::OP,
                 {kOutputRegisters, kInputRegisters, kFurtherManagers, kFmmuRegisters, kWatchdogRegisters,
                  kClockRegisters, kSyncRegisters, kSyncParameters, kDriveCycle}},
};

void AddSettings(std::span<const SettingRange> settings, std::vector<SettingRange>& all) {
  for (const SettingRange& range : settings) {
    if (range.last == 0 || std::ranges::find(all, range) != all.end()) continue;
    all.push_back(range);
  }
}

}  // namespace
}  // namespace refusal

std::vector<SettingRange> SettingsOfRefusal(std::uint16_t code, std::uint8_t requested) {
  using namespace refusal;
  std::vector<SettingRange> all;
  const Row* const row = RowOf(code);
  for (const About& about : kAbout) {
    const bool asked = row != nullptr && std::ranges::any_of(about.checks, [row](Check check) {
                         return check != nullptr && row->Asks(check);
                       });
    if (asked) AddSettings(about.settings, all);
  }
  if (!all.empty()) return all;
  for (const AboutRequest& about : kAboutRequests) {
    if (static_cast<std::uint8_t>(about.requested) == requested) AddSettings(about.settings, all);
  }
  return all;
}

}  // namespace ecaudit
