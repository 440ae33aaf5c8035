/// Why a slave refused a state or left it: what the capture shows of the settings that its AL status code is about.
///
/// One table (refusal_reasons.cpp) has a row for each code: the registers, objects and counters that can show its
/// reason. What is wrong becomes a note of the finding. What is right is one note for all of it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <optional>
#include <string_view>
#include <vector>

#include "analyzers/judge/rule_context.h"
#include "analyzers/result/finding.h"
#include "analyzers/result/setting_range.h"

namespace ecaudit {

/// The code of a refusal, or of a state that a slave left by itself.
struct RefusalCase {
  SlaveId slave = kNoSlave;
  std::uint16_t code = 0;      ///< AL status code (0x0134)
  std::uint8_t requested = 0;  ///< 0: the slave left its state by itself
  FrameNo request = 0;         ///< the last frame with the request; 0: none
  FrameNo shown = 0;           ///< the frame that shows the error
  FrameNo held_since = 0;      ///< without request: the first frame that showed the state before
};

namespace refusal {

inline constexpr NoteKind kMailboxNeverSet{
    "mailbox-never-set",
    "SM0 and SM1 (the mailbox) were never set: start, length and enable bit of both are 0[ since {since}]."};
inline constexpr NoteKind kMailboxOff{"mailbox-off", "SM{sync_manager} (the mailbox) is not enabled."};
inline constexpr NoteKind kMailboxUnseen{
    "mailbox-unseen", "The capture shows no write to SM0 and SM1 (the mailbox) since {since}, where the set-up began."};
inline constexpr NoteKind kNoMailboxInEeprom{
    "no-mailbox-in-eeprom",
    "The EEPROM names no mailbox: words 0x0018 to 0x001B (offset and size) are 0[, but word 0x001C names "
    "{protocols}][ and its sync manager category has SM{sync_manager} with {bytes} for a mailbox]. A master that uses "
    "these words sets no mailbox."};
inline constexpr NoteKind kBootstrapMailbox{
    "bootstrap-mailbox",
    "SM{sync_manager} has start {start} and length {length}. The bootstrap mailbox of the EEPROM (words 0x0014 to "
    "0x0017) has start {expected_start} and length {expected_length}."};
inline constexpr NoteKind kWriteIgnored{
    "write-ignored",
    "The master wrote start {start}, length {length} and control {control} to SM{sync_manager} in {write_frame} while "
    "it was enabled.[ The slave controller ignored that: in {shown_frame} SM{sync_manager} has start {kept_start}, "
    "length {kept_length} and control {kept_control}.][{!shown_frame} An ESC ignores such a write. Then start "
    "{kept_start}, length {kept_length} and control {kept_control} still apply, which may be the reason.] Switch the "
    "sync manager off before it is written."};
inline constexpr NoteKind kLrwUnsupported{
    "lrw-not-supported",
    "The master uses LRW, but the slave controller does not support LRW ({source}). {missed} with its process data "
    "came back without its working counter[ since {since}]. Use LRD and LWR."};
inline constexpr NoteKind kOutputsNotAccepted{
    "outputs-not-accepted",
    "The slave accepted no outputs since {since}: the working counter of {missed} does not count them (the last in "
    "{last_missed})."};
inline constexpr NoteKind kOutputsNotSent{
    "outputs-not-sent", "The capture shows no datagram with the outputs of this slave since {since}."};
inline constexpr NoteKind kInputsNotRead{
    "inputs-not-read",
    "The slave gave no inputs since {since}: the working counter of {missed} does not count them (the last in "
    "{last_missed})."};
inline constexpr NoteKind kCountExceeds{
    "count-exceeds-entries",
    "The master wrote {entries:number} to {object:number} ({count_frame}), but the capture shows [only "
    "{shown}][{!shown}no entry]. The slave may have fewer PDOs, which may be the reason."};
inline constexpr NoteKind kMappedLength{
    "mapped-length-differs",
    "{pdo} maps {object} with {mapped}, [but its type has {expected}][{!expected}which no object has]. This may be the "
    "reason."};
inline constexpr NoteKind kWatchdogZero{
    "watchdog-zero",
    "The process data watchdog time {register} is 0, but SM{sync_manager} triggers the watchdog (bit 6 of its control "
    "byte)."};
inline constexpr NoteKind kSyncLeftOn{
    "sync-left-on",
    "SYNC0 was active in the run before (0x0981, [{?on_written}set][{!on_written}shown] in {on_frame}). The master had "
    "not switched it off when it set the clock in {clock_frame}[, but only in {off_frame}]. The slave may have lost "
    "SYNC0 by that. Write 0 to 0x0981 before the clock is set."};
inline constexpr NoteKind kSyncOff{"sync-off", "SYNC0 is not active: 0x0981 is {activation}[, set in {write_frame}]."};
inline constexpr NoteKind kSyncUnseen{
    "sync-unseen",
    "The capture shows no write to 0x0981 since {since}, where the set-up began: SYNC0 may never have been activated."};
inline constexpr NoteKind kManagerUnseen{
    "process-manager-unseen",
    "The capture shows no write to SM{sync_manager} ({direction}) since {since}, where the set-up began[, but the "
    "assigned PDOs have {bytes}].[{!bytes} This may be the reason.]"};
inline constexpr NoteKind kSyncOffAtRequest{
    "sync-set-after-request",
    "SYNC0 was activated (0x0981) in {write_frame}, after {requested} was requested in {request_frame}. The slave "
    "checks it at this request.[{!was_off} The capture does not show whether it was active before.]"};
inline constexpr NoteKind kSyncOn{
    "sync-on",
    "SYNC0 is active (0x0981 is {activation}, [{?written}written][{!written}shown] in {write_frame}), which this code "
    "rejects."};
inline constexpr NoteKind kSyncCycleZero{"sync-cycle-zero",
                                         "SYNC0 is active, but its cycle time (0x09A0) is 0: it gives a single pulse."};
inline constexpr NoteKind kSyncCycleTooShort{
    "sync-cycle-too-short",
    "The SYNC0 cycle (0x09A0) is {cycle_us}, shorter than the minimum {minimum_us} of {object}."};
inline constexpr NoteKind kSyncCycleRejected{
    "sync-cycle-rejected",
    "The SYNC0 cycle (0x09A0) is {cycle_us}, which this code rejects. Find the cycles that the slave supports in its "
    "1C32h:5, its ESI or its manual."};
inline constexpr NoteKind kSyncSettings{
    "sync-settings",
    "The SYNC0 cycle (0x09A0) is {cycle_us} and 0x0981 is {activation}[, written in {write_frame}]. Compare both with "
    "the cycles and the operation modes (AssignActivate) of the ESI."};
inline constexpr NoteKind kMailboxAsEeprom{
    "mailbox-as-eeprom",
    "SM0 and SM1 are as words 0x0018 to 0x001B of the EEPROM have them. The firmware of the slave may be built for "
    "other mailboxes: use the EEPROM image that belongs to the firmware."};
inline constexpr NoteKind kTypesSwapped{
    "types-swapped",
    "1C00h of the slave lists SM2 for inputs and SM3 for outputs, but SM2 is an output sync manager (control "
    "{control}). A master that uses 1C00h exchanges both. Correct 1C00h in the firmware of the slave."};
inline constexpr NoteKind kNoPdoAssigned{
    "no-pdo-assigned",
    "{object:number} assigns no PDO ({count_frame}), but SM{sync_manager} has {bytes}. The slave may have no modules, "
    "or no configuration for them yet."};
inline constexpr NoteKind kNothingAssigned{
    "nothing-assigned",
    "{object:number} assigns no PDO ({count_frame}), and SM{sync_manager} has no length. This may be the reason: write "
    "the PDOs of the slave to {object:number} in PREOP, and set SM{sync_manager} to their length."};
inline constexpr NoteKind kSyncTypeDiffers{
    "sync-type-differs",
    "{object} is {type}, but SYNC0 is [{?active}active][{!active}not active] ([0x0981 is "
    "{activation}][{!activation}the "
    "capture shows no write to 0x0981 since {since}, where the set-up began]). This may be the reason."};
inline constexpr NoteKind kSyncTypeRejected{"sync-type-rejected",
                                            "{object} is {type}, which this code rejects. This may be the reason."};
inline constexpr NoteKind kRateDiffers{
    "rate-differs",
    "Process data come every {rate_us}, but the SYNC0 cycle (0x09A0) is {cycle_us}.[{?one_per_cycle} The slave needs "
    "one frame in each cycle.][{?neither} Neither is a multiple of the other.][{?several} Several frames come in each "
    "cycle of SYNC0.][ {empty} of {pulses} SYNC0 intervals have no frame.] This may be the reason."};
inline constexpr NoteKind kIntervalsMissed{"sync0-intervals-missed",
                                           "Of {intervals} between two SYNC0 pulses ({cycle_us}), {empty} had no frame "
                                           "with process data and {doubled} had two: "
                                           "{share}.[ The longest run without a frame is {longest}.] This may be the "
                                           "reason: let the cycle of the master follow "
                                           "the DC time."};
inline constexpr NoteKind kAtPulse{
    "at-sync0-pulse",
    "Of {arrived} with process data, {at_pulse} arrived at the SYNC0 pulse (within {uncertainty_us}): the slave may "
    "take "
    "them before it or after it. This may be the reason: shift SYNC0 to the middle between two frames."};
inline constexpr NoteKind kEepromHeld{
    "eeprom-held",
    "The master holds the EEPROM[ since {since}]: bit 0 of 0x0500 is 0. The processor of the slave needs it at this "
    "transition. Write 1 to 0x0500 before the request."};
inline constexpr NoteKind kModuleDiffers{
    "module-differs",
    "Slot {slot}: the master configured module {configured}[ {configured_name}] ({configured_object}, "
    "{configured_frame}), the slave detected {detected}[ {detected_name}] ({detected_object}, {detected_frame})."};
inline constexpr NoteKind kModuleCountDiffers{
    "module-count-differs",
    "The master configured {configured} (F030h:0, {configured_frame}), the slave detected {detected:number} (F050h:0, "
    "{detected_frame})."};
inline constexpr NoteKind kEmergency{
    "emergency-names-setting",
    "The slave gives the reason in {emergency_frame} by emergency {error_code:number}: it rejects the {aspect} of "
    "SM{sync_manager}[, which the master set to {actual}].[ It accepts {smallest}[ to {largest}].]"};
inline constexpr NoteKind kChecked{"checked", "Checked and right: {checked}."};

inline constexpr const NoteKind* kNotes[] = {&kMailboxNeverSet,
                                             &kMailboxOff,
                                             &kMailboxUnseen,
                                             &kNoMailboxInEeprom,
                                             &kBootstrapMailbox,
                                             &kWriteIgnored,
                                             &kLrwUnsupported,
                                             &kOutputsNotSent,
                                             &kOutputsNotAccepted,
                                             &kInputsNotRead,
                                             &kMappedLength,
                                             &kWatchdogZero,
                                             &kSyncLeftOn,
                                             &kSyncOff,
                                             &kSyncUnseen,
                                             &kManagerUnseen,
                                             &kSyncOffAtRequest,
                                             &kSyncOn,
                                             &kSyncCycleZero,
                                             &kSyncCycleTooShort,
                                             &kSyncTypeDiffers,
                                             &kSyncTypeRejected,
                                             &kRateDiffers,
                                             &kIntervalsMissed,
                                             &kAtPulse,
                                             &kEepromHeld,
                                             &kModuleDiffers,
                                             &kModuleCountDiffers,
                                             &kCountExceeds,
                                             &kSyncCycleRejected,
                                             &kSyncSettings,
                                             &kMailboxAsEeprom,
                                             &kTypesSwapped,
                                             &kNoPdoAssigned,
                                             &kNothingAssigned,
                                             &kEmergency,
                                             &kChecked};

/// The notes of a rule together with these.
template <std::size_t N>
constexpr std::array<const NoteKind*, N + std::size(kNotes)> With(const NoteKind* const (&own)[N]) {
  std::array<const NoteKind*, N + std::size(kNotes)> all{};
  for (std::size_t i = 0; i < N; ++i) all[i] = own[i];
  for (std::size_t i = 0; i < std::size(kNotes); ++i) all[N + i] = kNotes[i];
  return all;
}

}  // namespace refusal

struct RefusalReasons {
  const Word* reason = nullptr;  ///< the likeliest of them, for the title; null: nothing is wrong
  std::uint8_t slot = 0;         ///< of a modular device that it is about; 0: none
  std::optional<Value> value;    ///< of the setting that is the reason
  bool inferred = false;         ///< `reason` is only a possible one: the slave may have refused for another
  std::vector<Note> notes;       ///< what is wrong, and what is right
};

/// What the capture shows of the settings that the code is about, for the finding about it.
[[nodiscard]] RefusalReasons FindRefusalReasons(const RuleContext& context, const RefusalCase& refusal);
/// Adds them, with {reason} and its {reason_value} for the title and the flags {reason_inferred} and {checked}
/// (settings of the code are right). A finding whose reason is inferred is inferred itself.
void AddTo(Finding& finding, const RefusalReasons& reasons);

/// The registers and objects that a refusal of the state with this code (0: not read) is about: those that the checks
/// of its row look at. A code without a row is about what a slave checks at the request.
[[nodiscard]] std::vector<SettingRange> SettingsOfRefusal(std::uint16_t code, std::uint8_t requested);

/// The codes that have a row, for documentation and tests.
[[nodiscard]] std::vector<std::uint16_t> CodesWithReasons();

}  // namespace ecaudit
