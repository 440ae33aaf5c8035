/// What is asked about an AL status code: one row for the codes with the same reasons.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "analyzers/judge/refusal/checks.h"
#include "decoder/esc/al.h"

namespace ecaudit::refusal {

namespace al = esc::al_code;

/// Only these checks are about this code.
inline constexpr std::uint16_t kSyncManagerTypes = 0x001C;

struct Row {
  std::array<std::uint16_t, 6> codes;  ///< with the same reasons; 0: no more
  std::array<Check, 16> checks;        ///< the likeliest reason first; null: no more

  [[nodiscard]] constexpr bool Has(std::uint16_t code) const {
    return code != 0 && std::ranges::find(codes, code) != codes.end();
  }
  [[nodiscard]] constexpr bool Asks(Check check) const { return std::ranges::find(checks, check) != checks.end(); }
};

inline constexpr std::array kRows{
    Row{{al::kBootMailbox},
        {CheckExists, CheckMailboxSet, CheckRam, CheckBootstrap, Of<0, CheckIgnored>, Of<1, CheckIgnored>}},
    Row{{al::kMailbox},
        {CheckExists, CheckMailboxSet, CheckRam, CheckMailboxWords, Of<0, CheckIgnored>, Of<1, CheckIgnored>,
         CheckMailboxFirmware}},
    Row{{al::kSyncManagers},
        {CheckExists, CheckMailboxSet, CheckRam, Of<0, CheckIgnored>, Of<1, CheckIgnored>,
         Of<kOutputs, CheckManagerSet>, Of<kInputs, CheckManagerSet>, Of<kOutputs, CheckIgnored>,
         Of<kInputs, CheckIgnored>, Of<kOutputs, CheckMapped>, Of<kInputs, CheckMapped>, CheckLengths,
         Of<kOutputs, CheckEmpty>, Of<kInputs, CheckEmpty>, Of<kOutputs, CheckLengthWithoutPdo>,
         Of<kInputs, CheckLengthWithoutPdo>}},
    Row{{al::kNoInputs}, {CheckInputs, CheckLrw}},
    Row{{al::kNoOutputs, al::kWatchdog}, {CheckLrw, CheckOutputs, CheckTrigger}},
    Row{{al::kNoInputsAndOutputs}, {CheckLrw, CheckOutputs, CheckInputs}},
    Row{{al::kOutputs, al::kOutputMapping},
        {CheckTypes, CheckExists, CheckRam, Of<kOutputs, CheckManagerSet>, Of<kOutputs, CheckIgnored>,
         Of<kOutputs, CheckCount>, Of<kOutputs, CheckPdosExist>, Of<kOutputs, CheckEntries>, Of<kOutputs, CheckMapped>,
         CheckLengths, Of<kOutputs, CheckEmpty>, Of<kOutputs, CheckAssigned>, Of<kOutputs, CheckAligned>}},
    Row{{al::kInputs, al::kInputMapping},
        {CheckTypes, CheckExists, CheckRam, Of<kInputs, CheckManagerSet>, Of<kInputs, CheckIgnored>,
         Of<kInputs, CheckCount>, Of<kInputs, CheckPdosExist>, Of<kInputs, CheckEntries>, Of<kInputs, CheckMapped>,
         CheckLengths, Of<kInputs, CheckEmpty>, Of<kInputs, CheckAssigned>, Of<kInputs, CheckAligned>}},
    Row{{kSyncManagerTypes}, {CheckTypes, CheckExists, Of<kOutputs, CheckManagerSet>, Of<kInputs, CheckManagerSet>}},
    Row{{al::kWatchdogSettings}, {CheckWatchdog}},
    Row{{al::kInconsistent}, {CheckSyncTypes, CheckSyncCycle, CheckLengths, CheckSyncSet}},
    Row{{al::kFreeRun}, {CheckTypeRejected, CheckSyncActive, CheckSyncTypes}},
    Row{{al::kSyncMode}, {CheckSyncUnsupported, CheckTypeRejected, CheckSyncTypes, CheckSyncSet}},
    Row{{al::kSynchronization, al::kFatalSync, al::kPll, al::kSyncIo, al::kSyncTimeout},
        {CheckClock, CheckLeftOn, CheckSyncActive, CheckSyncCycle, CheckClockAway, CheckRate, CheckArrival}},
    Row{{al::kNoSync},
        {CheckClock, CheckLeftOn, CheckSyncActive, CheckSyncCycle, CheckClockAway, CheckRate, CheckArrival,
         CheckSyncTypes, CheckOperationMode, CheckSync1}},
    Row{{al::kCycleTooSmall}, {CheckSyncCycle, CheckSyncSettings}},
    Row{{al::kFreeRunBuffers}, {Of<kOutputs, CheckThreeBuffers>, Of<kInputs, CheckThreeBuffers>}},
    Row{{al::kLatchSettings}, {CheckLatch}},
    Row{{al::kSyncSettings},
        {CheckClock, CheckSyncActive, CheckSyncCycle, CheckSyncTypes, CheckLeftOn, CheckOperationMode,
         CheckSyncSettings}},
    Row{{al::kSyncCycle},
        {CheckClock, CheckSyncActive, CheckSyncCycle, CheckRate, CheckSyncTypes, CheckOperationMode,
         CheckSyncSettings}},
    Row{{al::kSync0Cycle},
        {CheckClock, CheckSyncActive, CheckSyncCycle, CheckSyncTypes, CheckOperationMode, CheckSyncSettings}},
    Row{{al::kSync1Cycle}, {CheckOperationMode, CheckSync1Cycle}},
    Row{{al::kEepromAccess}, {CheckEepromOwner}},
    Row{{al::kModules}, {CheckModules, CheckModulesSet}},
};

/// Null: nothing is known that could be asked about the code.
[[nodiscard]] inline const Row* RowOf(std::uint16_t code) {
  const auto* row = std::ranges::find_if(kRows, [code](const Row& r) { return r.Has(code); });
  return row == kRows.end() ? nullptr : row;
}

}  // namespace ecaudit::refusal
