/// What can be asked of a refusal, one question each. Which AL status code asks which stands in code_table.h.
#pragma once

#include <cstddef>

#include "analyzers/judge/refusal/refusal_case.h"

namespace ecaudit::refusal {

/// What CheckLengths finds to be right; it is not if nothing is assigned.
inline constexpr Word kLengthsFit{"sync-manager-lengths", "the lengths of SM2 and SM3 against the assigned PDOs"};

/// What CheckArrival finds to be right.
inline constexpr Word kArrivalFits{"arrival", "one frame with process data in each SYNC0 interval"};
inline constexpr Word kRateFits{"rate", "the cycle of the process data against SYNC0"};

// mailbox.cpp: the mailbox against what the slave needs.

/// Are SM0 and SM1 set and enabled?
void CheckMailboxSet(const Case& of, Outcome& found);
/// Has the EEPROM a mailbox?
void CheckMailboxWords(const Case& of, Outcome& found);
/// In BOOT: is it the bootstrap mailbox of the EEPROM?
void CheckBootstrap(const Case& of, Outcome& found);
/// Is it as the EEPROM has it, and refused nevertheless?
void CheckMailboxFirmware(const Case& of, Outcome& found);

// sync_managers.cpp: writes to sync managers.

/// Was it written while enabled?
void CheckIgnored(const Case& of, Outcome& found, std::size_t manager);
/// The code rejects one buffer without synchronisation: has it one?
void CheckThreeBuffers(const Case& of, Outcome& found, std::size_t manager);
/// Was it ever written?
void CheckManagerSet(const Case& of, Outcome& found, std::size_t manager);
/// Is it enabled although it has no bytes?
void CheckEmpty(const Case& of, Outcome& found, std::size_t manager);
/// Does each sync manager exist in the slave controller, and lie in its RAM?
void CheckExists(const Case& of, Outcome& found);
void CheckRam(const Case& of, Outcome& found);
/// Does 1C00h list the types of SM2 and SM3 the right way round?
void CheckTypes(const Case& of, Outcome& found);
/// Do both fit the assigned PDOs? A wrong length is a finding of sm-process-config.
void CheckLengths(const Case& of, Outcome& found);

// pdo_assignment.cpp: assignment and mapping of the PDOs.

/// Are there as many PDOs as subindex 0 counts?
void CheckCount(const Case& of, Outcome& found, std::size_t manager);
/// Does the slave have each assigned PDO?
void CheckPdosExist(const Case& of, Outcome& found, std::size_t manager);
/// Did the master write the entries of each without a gap?
void CheckEntries(const Case& of, Outcome& found, std::size_t manager);
/// Is any PDO assigned?
void CheckAssigned(const Case& of, Outcome& found, std::size_t manager);
/// The same, where the sync manager has a length all the same.
void CheckLengthWithoutPdo(const Case& of, Outcome& found, std::size_t manager);
/// Has each object the length of its type?
void CheckMapped(const Case& of, Outcome& found, std::size_t manager);
/// Does each object of whole bytes begin at a byte?
void CheckAligned(const Case& of, Outcome& found, std::size_t manager);

// exchange.cpp: what comes and goes.

/// Does the slave support the LRW that the master uses?
void CheckLrw(const Case& of, Outcome& found);
/// Do outputs reach it?
void CheckOutputs(const Case& of, Outcome& found);
/// Does it give inputs?
void CheckInputs(const Case& of, Outcome& found);
/// Has its watchdog any time?
void CheckWatchdog(const Case& of, Outcome& found);
/// The outputs arrive: do they trigger the watchdog?
void CheckTrigger(const Case& of, Outcome& found);

// sync_settings.cpp: SYNC0 by its registers.

/// Was SYNC0 left on by the run before?
void CheckLeftOn(const Case& of, Outcome& found);
/// The code demands SYNC0: has the slave controller a clock?
void CheckClock(const Case& of, Outcome& found);
/// The code demands SYNC0: does it run?
void CheckSyncActive(const Case& of, Outcome& found);
/// Is the clock of the slave near the system time?
void CheckClockAway(const Case& of, Outcome& found);
/// The code misses a pulse, and all of SYNC0 is right: does SYNC1 run?
void CheckSync1(const Case& of, Outcome& found);
/// What is the cycle of SYNC1?
void CheckSync1Cycle(const Case& of, Outcome& found);
/// How are the latch units set?
void CheckLatch(const Case& of, Outcome& found);
/// The code rejects SYNC0: does it run?
void CheckSyncUnsupported(const Case& of, Outcome& found);
/// Nothing is known of its type: did the master set any synchronisation?
void CheckSyncSet(const Case& of, Outcome& found);
/// Is its cycle long enough?
void CheckSyncCycle(const Case& of, Outcome& found);
/// Is it as one of the operation modes of the ESI or the EEPROM?
void CheckOperationMode(const Case& of, Outcome& found);
/// Nothing is known to be wrong, but the code is about these settings: which are they?
void CheckSyncSettings(const Case& of, Outcome& found);

// sync_types.cpp: synchronisation type of outputs and inputs (1C32h:1, 1C33h:1).

/// Does it fit SYNC0? The first object that does not is the reason.
void CheckSyncTypes(const Case& of, Outcome& found);
/// Is it what the code rejects?
void CheckTypeRejected(const Case& of, Outcome& found);

// sync_rhythm.cpp: process data against SYNC0.

/// Have both the same cycle?
void CheckRate(const Case& of, Outcome& found);
/// Does one frame come in each interval? Before the request in SAFEOP, else in OP.
void CheckArrival(const Case& of, Outcome& found);

// device.cpp: what the slave is built of.

/// Is the EEPROM offered to it?
void CheckEepromOwner(const Case& of, Outcome& found);
/// Are the modules those that the master configured?
void CheckModules(const Case& of, Outcome& found);
/// Did it configure any?
void CheckModulesSet(const Case& of, Outcome& found);

}  // namespace ecaudit::refusal
