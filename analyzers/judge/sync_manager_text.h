/// Sync managers in findings, and the finding about wrong settings of one when a state is requested.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/sync_manager_demand.h"
#include "decoder/esc/sync_manager.h"
#include "decoder/track/slave_state.h"

namespace ecaudit {

/// Settings of a sync manager, and how they are known.
struct KnownSyncManager {
  esc::SyncManager settings;
  bool observed = false;  ///< false: inferred
  FrameNo since = 0;      ///< frame that set or showed them last
};
/// Nothing if the capture does not show them.
[[nodiscard]] std::optional<KnownSyncManager> SyncManagerOf(const track::SlaveState& state, std::size_t number);

/// "the settings of sync manager 2", for reasons.
[[nodiscard]] const Word& SyncManagerWord(std::size_t number);
/// Distinguishes settings of one sync manager, to fold repetitions.
[[nodiscard]] std::uint64_t SettingsKey(std::size_t number, const esc::SyncManager& settings);
/// The same for two settings.
[[nodiscard]] std::uint64_t KeyOfBoth(std::uint64_t one, std::uint64_t other);

/// The kinds and notes of DescribeFaults().
namespace sync_manager_fault {

inline constexpr std::string_view kMessage =
    R"(The master requests {requested} (AL Control {al_control}) in {frame}. Sync manager {sync_manager}[, last set in
{set_frame},] has start {start}, length {length} and control {control}, and is [{?off}not ]enabled.[ By {enable_source} it
must be enabled.][ By {mode_source} it must be in {expected_mode}.][ By {direction_source} the master
{expected_direction:meaning}s it.][ By {start_source} it must begin at {expected_start}[ or {other_starts}].][ By
{length_source}[ {pdos}][{?no_pdos} (none)][ ({assigned_frame})] its length must be [{?at_most}at most
]{expected_length}[ or {other_lengths}].][{?no_length} Its length must not be 0.][ This transition requires:
{requirement}.][ The slave is expected to answer with the error bit and AL status code {expected_code}.])";
inline constexpr std::string_view kNext =
    R"(Switch SM{sync_manager} off, write all its settings[ (start {expected_start})][ (length[{?at_most} at most]
{expected_length})], and switch it on before {requested} is requested.)";

inline constexpr FindingKind kNotEnabled{.name = "not-enabled",
                                         .title = "SM{sync_manager}: not enabled when {requested} is requested",
                                         .message = kMessage,
                                         .next = kNext,
                                         .identity = "sync_manager requested"};
inline constexpr FindingKind kWrongMode{.name = "wrong-mode",
                                        .title = "SM{sync_manager}: {mode} instead of {expected_mode}",
                                        .message = kMessage,
                                        .next = kNext,
                                        .identity = "sync_manager requested mode"};
inline constexpr FindingKind kWrongDirection{.name = "wrong-direction",
                                             .title =
                                                 "SM{sync_manager}: direction {direction:meaning} instead of "
                                                 "{expected_direction:meaning} when {requested} is requested",
                                             .message = kMessage,
                                             .next = kNext,
                                             .identity = "sync_manager requested direction"};
inline constexpr FindingKind kWrongStart{.name = "wrong-start",
                                         .title =
                                             "SM{sync_manager}: start {start} instead of {expected_start}[ or "
                                             "{other_starts}] when {requested} is requested",
                                         .message = kMessage,
                                         .next = kNext,
                                         .identity = "sync_manager requested start expected_start"};
inline constexpr FindingKind kWrongLength{
    .name = "wrong-length",
    .title =
        "SM{sync_manager}: length {length} instead of [{?at_most}at most ]{expected_length}[ or {other_lengths}] "
        "when {requested} is requested",
    .message = kMessage,
    .next = kNext,
    .identity = "sync_manager requested"};
inline constexpr FindingKind kNoLength{.name = "no-length",
                                       .title = "SM{sync_manager}: enabled with length 0 when {requested} is requested",
                                       .message = kMessage,
                                       .next = kNext,
                                       .identity = "sync_manager requested"};
inline constexpr FindingKind kSeveralFaults{.name = "several-settings",
                                            .title = "SM{sync_manager}: wrong {wrong} when {requested} is requested",
                                            .message = kMessage,
                                            .next = kNext,
                                            .identity = "sync_manager requested wrong"};
inline constexpr const FindingKind* kKinds[] = {&kNotEnabled,  &kWrongMode, &kWrongDirection, &kWrongStart,
                                                &kWrongLength, &kNoLength,  &kSeveralFaults};

inline constexpr NoteKind kOutboundOnly{
    .name = "outbound-only",
    .text = "The capture has only outbound frames. The finding assumes that the slave accepted them."};
inline constexpr NoteKind kSetByBroadcast{
    .name = "set-by-broadcast",
    .text = "A broadcast cleared the settings. The finding assumes that this slave accepted it."};
inline constexpr NoteKind kOffInEeprom{
    .name = "off-in-eeprom",
    .text =
        R"(The EEPROM has SM{number} with its enable bit 0, and the master set it so. Either the EEPROM image is wrong, or
the master must enable it by the ESI.)"};
inline constexpr NoteKind kPaddedStruct{.name = "padded-struct",
                                        .text =
                                            "{bytes} is also what these entries need in a C struct that is not "
                                            "packed, with {padding} of padding. If the master takes "
                                            "the length from such a struct, pack it."};
inline constexpr NoteKind kMayBeSetUnseen{
    "may-be-set-unseen",
    "The capture likely misses frames between these settings and the request: the numbers of the "
    "frames skip. The master may have changed the settings there."};
inline constexpr const NoteKind* kNotes[] = {&kOutboundOnly, &kSetByBroadcast, &kOffInEeprom, &kPaddedStruct,
                                             &kMayBeSetUnseen};

}  // namespace sync_manager_fault

/// Between these settings and the request the capture misses frames, certainly or most likely.
[[nodiscard]] bool MayBeSetUnseen(const RuleContext& context, const model::AlRequestJudged& request,
                                  const KnownSyncManager& known);

/// The finding for `faults` (at least one) of one sync manager when the master requests a state.
[[nodiscard]] Finding DescribeFaults(const RuleContext& context, const model::AlRequestJudged& request,
                                     const model::SyncManagerDemand& demand, const KnownSyncManager& known,
                                     const std::vector<model::SyncManagerFault>& faults);

}  // namespace ecaudit
