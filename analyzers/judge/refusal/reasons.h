/// The reasons for which a slave refuses a state or leaves it, one table: a note that explains it, and a few words for
/// the title of the finding.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <iterator>
#include <string_view>

#include "analyzers/result/argument.h"
#include "analyzers/result/finding_kind.h"

namespace ecaudit::refusal {

struct Reason {
  NoteKind note;
  Word title;            ///< as short as a title needs it
  Word title_of_inputs;  ///< the same of a reason that outputs and inputs have

  constexpr Reason(std::string_view name, std::string_view title_text, std::string_view text)
      : Reason(name, Word{name, title_text}, text) {}
  constexpr Reason(std::string_view name, Word any, std::string_view text) : Reason(name, any, any, text) {}
  constexpr Reason(std::string_view name, Word outputs, Word inputs, std::string_view text)
      : note{name, text}, title(outputs), title_of_inputs(inputs) {}
};

inline constexpr Reason kMailboxNeverSet{
    "mailbox-never-set", "SM0 and SM1 were never set",
    "SM0 and SM1 (the mailbox) were never set: start, length and enable bit of both are 0[ since {since}]."};
inline constexpr Reason kMailboxOff{"mailbox-off", "the mailbox is not enabled",
                                    "SM{sync_manager} (the mailbox) is not enabled."};
inline constexpr Reason kMailboxUnseen{
    "mailbox-unseen", Word{"mailbox-never-set", "SM0 and SM1 were never set"},
    "The capture shows no write to SM0 and SM1 (the mailbox) since {since}, where the set-up began."};
inline constexpr Reason kNoMailboxInEeprom{
    "no-mailbox-in-eeprom", "the EEPROM names no mailbox",
    "The EEPROM names no mailbox: words 0x0018 to 0x001B (offset and size) are 0[, but word 0x001C names "
    "{protocols}][ and its sync manager category has SM{sync_manager} with {bytes} for a mailbox]. A master that "
    "uses these words sets no mailbox."};
inline constexpr Reason kNoBootstrapInEeprom{
    "no-bootstrap-in-eeprom", "the EEPROM names no bootstrap mailbox",
    "The EEPROM names no bootstrap mailbox: words 0x0014 to 0x0017 (offset and size) are 0. A master that uses these "
    "words sets no mailbox for BOOT[: SM{sync_manager} has length 0]. Write the EEPROM image that belongs to the "
    "firmware, or set the mailbox that the firmware has in BOOT."};
inline constexpr Reason kBootstrapMailbox{
    "bootstrap-mailbox", "not the bootstrap mailbox of the EEPROM",
    "SM{sync_manager} has start {start} and length {length}. The bootstrap mailbox of the EEPROM (words 0x0014 to "
    "0x0017) has start {expected_start} and length {expected_length}."};
inline constexpr Reason kWriteIgnored{
    "write-ignored", "sync manager written while enabled",
    "The master wrote start {start}, length {length} and control {control} to SM{sync_manager} in {write_frame} "
    "while it was enabled.[ The slave controller ignored that: in {shown_frame} SM{sync_manager} has start "
    "{kept_start}, length {kept_length} and control {kept_control}.][{!shown_frame} An ESC ignores such a write. "
    "Then start {kept_start}, length {kept_length} and control {kept_control} still apply, which may be the "
    "reason.] Switch the sync manager off before it is written."};
inline constexpr Reason kNoSuchManager{
    "no-such-sync-manager", Word{"no-sm2", "the slave has no SM2"}, Word{"no-sm3", "the slave has no SM3"},
    "The process data need SM{sync_manager}, but the slave controller has only {managers} (0x0005)."};
inline constexpr Reason kBeyondRam{
    "beyond-ram", "sync manager beyond the RAM",
    "SM{sync_manager} takes {start} to {end}[{?buffered} with its three buffers]. The RAM of the slave controller "
    "ends at {ram_end} ({ram} KiB by 0x0006). Use a start address that leaves room."};
inline constexpr Reason kLrwUnsupported{
    "lrw-not-supported", "the slave does not support LRW",
    "The master uses LRW, but the slave controller does not support LRW ({source}). {missed} with its process data "
    "came back without its working counter[ since {since}]. Use LRD and LWR."};
inline constexpr Reason kLrwApart{
    "lrw-of-separate-data", "LRW needs FMMUs that overlap",
    "The slave controller has type 0x90 (0x0000, TI PRU-ICSS), and its FMMUs map outputs and inputs to different "
    "logical addresses. Older firmware of these controllers does not support that with LRW. {missed} with its process "
    "data came back without its working counter. This may be the reason: use LRD and LWR, or map both to the same "
    "address."};
inline constexpr Reason kOutputsNotAccepted{
    "outputs-not-accepted", Word{"no-outputs", "no outputs reach the slave"},
    "The slave accepted no outputs since {since}: the working counter of {missed} does not count them (the last in "
    "{last_missed})."};
inline constexpr Reason kOutputsNotSent{"outputs-not-sent", Word{"no-outputs", "no outputs reach the slave"},
                                        "The capture shows no datagram with the outputs of this slave since {since}."};
inline constexpr Reason kInputsNotRead{
    "inputs-not-read", Word{"no-inputs", "the slave gives no inputs"},
    "The slave gave no inputs since {since}: the working counter of {missed} does not count them (the last in "
    "{last_missed})."};
inline constexpr Reason kCountExceeds{
    "count-exceeds-entries", Word{"rx-count-exceeds-entries", "1C12h:0 counts more PDOs than shown"},
    Word{"tx-count-exceeds-entries", "1C13h:0 counts more PDOs than shown"},
    "The master wrote {entries:number} to {object:number} ({count_frame}), but the capture shows [only "
    "{shown}][{!shown}no entry]. The slave may have fewer PDOs, which may be the reason."};
inline constexpr Reason kPdoMissing{
    "assigned-pdo-missing", Word{"rx-pdo-missing", "1C12h assigns a PDO that is missing"},
    Word{"tx-pdo-missing", "1C13h assigns a PDO that is missing"},
    "{object:number} assigns {pdo} ({assigned_frame}), but the slave has no such object: it aborted the upload of "
    "{pdo} in {missing_frame} with 0x06020000. A master that reads the mapping leaves its bytes out of "
    "SM{sync_manager}. This may be the reason: assign PDOs that exist, or correct {object:number} in the firmware of "
    "the slave."};
inline constexpr Reason kEntryLeftOut{
    "entry-left-out", Word{"rx-entry-left-out", "an entry of the mapping was left out"},
    Word{"tx-entry-left-out", "an entry of the mapping was left out"},
    "The master wrote {entries:number} to {object:number} ({count_frame}), but the capture shows no {entry}, only "
    "entries after it. This may be the reason: write the entries from subindex 1 on without a gap."};
inline constexpr Reason kMappedLength{
    "mapped-length-differs", "length of a mapped object",
    "{pdo} maps {object} with {mapped}, [but its type has {expected}][{!expected}which no object has]. This may be "
    "the reason."};
inline constexpr Reason kUnaligned{
    "mapping-without-padding", "the mapping lacks padding entries",
    "{pdo} maps {object} with {mapped} at bit {bit} of byte {byte}: the entries before it end within a byte. Slaves "
    "usually fill such a byte with an entry of index 0. Without these entries SM{sync_manager} is set to {length}, "
    "which is too short for them. This may be the reason: compare {pdo} with the ESI, and correct it in the firmware "
    "of the slave."};
inline constexpr Reason kWatchdogZero{
    "watchdog-zero", "watchdog time is 0",
    "The process data watchdog time {register} is 0, but SM{sync_manager} triggers the watchdog (bit 6 of its "
    "control byte)."};
inline constexpr Reason kNoTrigger{
    "no-watchdog-trigger", "SM2 triggers no watchdog",
    "Bit 6 of the control byte of SM{sync_manager} is 0 ({control}): its data do not restart the process data "
    "watchdog. Firmware that reads the watchdog (0x0440) then sees it expired, although outputs arrive. This may be "
    "the reason: set bit 6, and correct the sync manager in EEPROM and ESI."};
inline constexpr Reason kSyncLeftOn{
    "sync-left-on", "SYNC0 left on by the last run",
    "SYNC0 was active in the run before (0x0981, [{?on_written}set][{!on_written}shown] in {on_frame}). The master "
    "had not switched it off when it set the clock in {clock_frame}[, but only in {off_frame}]. The slave may have "
    "lost SYNC0 by that. Write 0 to 0x0981 before the clock is set."};
inline constexpr Reason kSyncOff{"sync-off", "SYNC0 is not active",
                                 "SYNC0 is not active: 0x0981 is {activation}[, set in {write_frame}]."};
inline constexpr Reason kSyncUnseen{
    "sync-unseen", "SYNC0 was never activated",
    "The capture shows no accepted write to 0x0981 since {since}, where the set-up began: SYNC0 may never have been "
    "activated."};
inline constexpr Reason kManagerUnseen{
    "process-manager-unseen", Word{"sm2-unseen", "SM2 was never set"}, Word{"sm3-unseen", "SM3 was never set"},
    "The capture shows no write to SM{sync_manager} ({direction}) since {since}, where the set-up began[, but the "
    "assigned PDOs have {bytes}].[{!bytes} This may be the reason.]"};
inline constexpr Reason kSyncOffAtRequest{
    "sync-set-after-request", "SYNC0 was activated too late",
    "SYNC0 was activated (0x0981) in {write_frame}, after {requested} was requested in {request_frame}. The slave "
    "checks it at this request.[{!was_off} The capture does not show whether it was active before.]"};
inline constexpr Reason kSyncOn{
    "sync-on", "SYNC0 is active",
    "SYNC0 is active (0x0981 is {activation}, [{?written}written][{!written}shown] in {write_frame}), which this "
    "code rejects."};
inline constexpr Reason kSync1Off{
    "sync1-off", "SYNC1 is not active",
    "SYNC0 is active, but SYNC1 is not (0x0981 is {activation}[, written in {write_frame}]). A slave may need SYNC1 as "
    "well, or SYNC1 alone, which may be the reason. Compare 0x0981 with the operation modes (AssignActivate) of the "
    "ESI."};
inline constexpr Reason kSyncCycleZero{"sync-cycle-zero", "the SYNC0 cycle is 0",
                                       "SYNC0 is active, but its cycle time (0x09A0) is 0: it gives a single pulse."};
inline constexpr Reason kSyncCycleTooShort{
    "sync-cycle-too-short", "the SYNC0 cycle is too short",
    "The SYNC0 cycle (0x09A0) is {cycle_us}, shorter than the minimum {minimum_us} of {object}."};
inline constexpr Reason kSyncCycleRejected{
    "sync-cycle-rejected", "the SYNC0 cycle is not accepted",
    "The SYNC0 cycle (0x09A0) is {cycle_us}, which this code rejects. Find the cycles that the slave supports in "
    "its 1C32h:5, its ESI or its manual."};
inline constexpr Reason kSync1CycleRejected{
    "sync1-cycle-rejected", "SYNC1 cycle not accepted",
    "The SYNC1 cycle (0x09A4) is {cycle_us}[ and the SYNC0 cycle (0x09A0) {sync0_us}]. This code rejects it. Take both "
    "and 0x0981 from one operation mode of the ESI."};
inline constexpr Reason kLatchSettings{"latch-settings", "latch control (0x09A8, 0x09A9)",
                                       "Latch control is {latch0} (0x09A8) and {latch1} (0x09A9), and 0x0980 (owner of "
                                       "the units) is {owner}. A slave that "
                                       "uses the latch units itself may need bits 4 and 5 of 0x0980."};
inline constexpr Reason kClockAway{
    "clock-away", "the clock deviates",
    "The time difference (0x092C) is {difference_ms} in {read_frame}: the clock of the slave and its SYNC0 are off by "
    "that much.[{?offset_unset} The capture shows no write to the offset (0x0920) since {since}, where the set-up "
    "began. A slave that was switched off counts from 0.] This may be the reason: write the offset, and wait until "
    "0x092C is small."};
inline constexpr Reason kOneBufferFreeRun{"one-buffer-free-run", Word{"one-buffer-outputs", "SM2 has one buffer"},
                                          Word{"one-buffer-inputs", "SM3 has one buffer"},
                                          "SM{sync_manager} has one buffer (control {control}). Without "
                                          "synchronisation the slave needs three: write 0 to bits "
                                          "0 and 1 of its control byte, or activate SYNC0."};
inline constexpr Reason kSyncSettings{
    "sync-settings", "SYNC0 cycle or 0x0981",
    "The SYNC0 cycle (0x09A0) is {cycle_us} and 0x0981 is {activation}[, written in {write_frame}]. Compare both "
    "with the cycles and the operation modes (AssignActivate) of the ESI."};
inline constexpr Reason kNoClock{
    "no-clock", "the slave has no distributed clocks",
    "Bit 2 of the features (0x0008) is 0: the slave controller has no distributed clocks, and generates no SYNC0. Use "
    "a synchronisation type without SYNC0 (1C32h:1, 1C33h:1) and switch distributed clocks off for this slave."};
inline constexpr Reason kNoOperationMode{"no-operation-mode", "0x0981 is in no operation mode",
                                         "0x0981 is {activation} (set in {write_frame}). The {mode_source} of the "
                                         "device offers only {offered}[ and {more}]. "
                                         "This may be the reason: take 0x0981 and the cycles from one of these modes."};
inline constexpr Reason kCycleOfNoMode{"cycle-of-no-operation-mode", "SYNC0 cycle of no operation mode",
                                       "The SYNC0 cycle (0x09A0) is {cycle_us} with 0x0981 = {activation} (set in "
                                       "{write_frame}). The {mode_source} of the device offers only {offered}[ and "
                                       "{more}]. This may be the reason: take 0x0981 and the cycles from one of these "
                                       "modes."};
inline constexpr Reason kMailboxAsEeprom{
    "mailbox-as-eeprom", "firmware and EEPROM differ",
    "SM0 and SM1 are as words 0x0018 to 0x001B of the EEPROM have them. The firmware of the slave may be built for "
    "other mailboxes: use the EEPROM image that belongs to the firmware."};
inline constexpr Reason kTypesSwapped{
    "types-swapped", "1C00h of the slave swaps SM2 and SM3",
    "1C00h of the slave lists SM2 for inputs and SM3 for outputs, but SM2 is an output sync manager (control "
    "{control}). A master that uses 1C00h exchanges both. Correct 1C00h in the firmware of the slave."};
inline constexpr Reason kNoPdoAssigned{
    "no-pdo-assigned", Word{"no-rx-pdo", "1C12h is empty, but SM2 is not"},
    Word{"no-tx-pdo", "1C13h is empty, but SM3 is not"},
    "{object:number} assigns no PDO ({count_frame}), but SM{sync_manager} has {bytes}. The slave may have no "
    "modules, or no configuration for them yet."};
inline constexpr Reason kNothingAssigned{
    "nothing-assigned", Word{"rx-unassigned", "1C12h assigns no PDO"}, Word{"tx-unassigned", "1C13h assigns no PDO"},
    "{object:number} assigns no PDO ({count_frame}), and SM{sync_manager} has no length. This may be the reason: "
    "write the PDOs of the slave to {object:number} in PREOP, and set SM{sync_manager} to their length."};
inline constexpr Reason kEnabledWithoutLength{
    "enabled-without-length", Word{"sm2-without-length", "SM2 is enabled, but has no length"},
    Word{"sm3-without-length", "SM3 is enabled, but has no length"},
    "SM{sync_manager} is enabled with length 0[ ({set_frame})]. Some slaves reject an enabled sync manager without "
    "bytes, which may be the reason. Write 0 to its activate byte if the slave has no {direction}."};
inline constexpr Reason kSyncTypeDiffers{
    "sync-type-differs", Word{"sync-type-differs", "1C32h:1 does not fit 0x0981"},
    Word{"input-sync-type-differs", "1C33h:1 does not fit 0x0981"},
    "{object} is {type}, but {pulse} is [{?active}active][{!active}not active] ([0x0981 is "
    "{activation}][{!activation}the capture shows no write to 0x0981 since {since}, where the set-up began]). This "
    "may be the reason."};
inline constexpr Reason kSyncNeverSet{
    "sync-never-set", "synchronisation was never set",
    "The capture shows no write to 1C32h:1[{!activation} and no accepted one to 0x0981] since {since}, where the "
    "set-up began. "
    "SYNC0 is off[ (0x0981 = {activation})], and the slave uses its default synchronisation type. If that needs SYNC0, "
    "both do not fit, which may be the reason. Activate SYNC0, or write another type to 1C32h:1 and 1C33h:1."};
inline constexpr Reason kSyncTypeRejected{"sync-type-rejected", "the type in 1C32h:1",
                                          "{object} is {type}, which this code rejects. This may be the reason."};
inline constexpr Reason kRateDiffers{
    "rate-differs", "cycle differs from SYNC0",
    "Process data come every {rate_us}, but the SYNC0 cycle (0x09A0) is {cycle_us}.[{?one_per_cycle} The slave "
    "needs one frame in each cycle.][{?neither} Neither is a multiple of the other.][{?several} Several frames "
    "come in each cycle of SYNC0.][ {empty} of {pulses} SYNC0 intervals have no frame.] This may be the reason."};
inline constexpr Reason kIntervalsMissed{
    "sync0-intervals-missed", "process data irregular against SYNC0",
    "Of {intervals} between two SYNC0 pulses ({cycle_us}), {empty} had no frame with process data and {doubled} "
    "had two: {share}.[ The longest run without a frame is {longest}.] This may be the reason: let the cycle of "
    "the master follow the DC time."};
inline constexpr Reason kAtPulse{
    "at-sync0-pulse", "process data arrive at the SYNC0 pulse",
    "Of {arrived} with process data, {at_pulse} arrived at the SYNC0 pulse (within {uncertainty_us}): the slave "
    "may take them before it or after it. This may be the reason: shift SYNC0 to the middle between two frames."};
inline constexpr Reason kEepromHeld{
    "eeprom-held", "the master holds the EEPROM",
    "The master holds the EEPROM[ since {since}]: bit 0 of 0x0500 is 0. The processor of the slave needs it at "
    "this transition. Write 1 to 0x0500 before the request."};
inline constexpr Reason kModuleDiffers{
    "module-differs", "other module than configured",
    "Slot {slot}: the master configured module {configured}[ {configured_name}] ({configured_object}, "
    "{configured_frame}), the slave detected {detected}[ {detected_name}] ({detected_object}, {detected_frame})."};
inline constexpr Reason kModuleCountDiffers{
    "module-count-differs", "more or fewer modules than configured",
    "The master configured {configured} (F030h:0, {configured_frame}), the slave detected {detected:number} "
    "(F050h:0, {detected_frame})."};
inline constexpr Reason kModulesUnset{
    "modules-never-configured", "F030h was never written",
    "The capture shows no write to F030h since {since}, where the set-up began. The slave compares the modules that "
    "the master configures there with the detected ones (F050h). This may be the reason: write the module list in "
    "PREOP."};
inline constexpr NoteKind kEmergency{
    "emergency-names-setting",
    "The slave gives the reason in {emergency_frame} by emergency {error_code:number}[ in {object}]: it rejects the "
    "{aspect} of "
    "SM{sync_manager}[, which the master set to {actual}].[ It accepts {smallest}[ to {largest}].]"};
inline constexpr NoteKind kChecked{"checked", "Checked and right: {checked}."};

template <class... Reasons>
constexpr std::array<const NoteKind*, sizeof...(Reasons)> NotesOf(const Reasons&... reasons) {
  return {&reasons.note...};
}
inline constexpr std::array kNotes = NotesOf(
    kMailboxNeverSet, kMailboxOff, kMailboxUnseen, kNoMailboxInEeprom, kNoBootstrapInEeprom, kBootstrapMailbox,
    kWriteIgnored, kLrwUnsupported, kLrwApart, kOutputsNotSent, kOutputsNotAccepted, kInputsNotRead, kMappedLength,
    kWatchdogZero, kNoTrigger, kSyncLeftOn, kSyncOff, kSyncUnseen, kManagerUnseen, kSyncOffAtRequest, kSyncOn,
    kSyncCycleZero, kSyncCycleTooShort, kSyncTypeDiffers, kSyncTypeRejected, kRateDiffers, kIntervalsMissed, kAtPulse,
    kEepromHeld, kModuleDiffers, kModuleCountDiffers, kModulesUnset, kSyncNeverSet, kCountExceeds, kSyncCycleRejected,
    kSyncSettings, kMailboxAsEeprom, kTypesSwapped, kNoPdoAssigned, kNothingAssigned, kEnabledWithoutLength, kSync1Off,
    kSync1CycleRejected, kLatchSettings, kOneBufferFreeRun, kNoSuchManager, kNoClock, kNoOperationMode, kCycleOfNoMode,
    kBeyondRam, kPdoMissing, kEntryLeftOut, kClockAway, kUnaligned);

/// The notes of a rule together with these.
template <std::size_t N>
constexpr std::array<const NoteKind*, N + kNotes.size() + 2> With(const NoteKind* const (&own)[N]) {
  std::array<const NoteKind*, N + kNotes.size() + 2> all{};
  auto* end = std::copy(std::begin(own), std::end(own), all.begin());
  end = std::copy(kNotes.begin(), kNotes.end(), end);
  *end++ = &kEmergency;
  *end = &kChecked;
  return all;
}

}  // namespace ecaudit::refusal
