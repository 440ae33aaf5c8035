/// Notes that any rule's finding may get.
#pragma once

#include "analyzers/result/finding_kind.h"

namespace ecaudit {

inline constexpr NoteKind kMissingPacketsMayExplain{"missing-packets-may-explain",
                                                    "The capture misses packets, which may explain this finding."};
/// wkc-mismatch adds it to the drop of a slave whose working counter was missing before.
inline constexpr NoteKind kWorkingCounterMissing{"working-counter-missing",
                                                 "The working counter of this slave is missing from {since} on."};

inline constexpr NoteKind kStateReached{"state-reached",
                                        "The slave reached {state} in {reached_frame} in spite of this."};
// Of a refusal of SAFEOP:
inline constexpr NoteKind kOddMappingMayExplain{
    "odd-mapping-may-explain",
    "Possible reason (inferred): the {direction} mapping has an odd length of {bytes}. {manual} forbids this for free "
    "mapping."};
inline constexpr NoteKind kObjectTwiceMayExplain{
    "object-mapped-twice-may-explain",
    "Possible reason (inferred): {object} is mapped {times} in the {direction} PDOs."};
inline constexpr NoteKind kUnusedMayExplain{"unused-pdo-may-explain",
                                            "Possible reason (inferred): the master assigns {assigned} and does not "
                                            "clear {pdos}. By {manual} unused PDOs must be "
                                            "cleared with writing 0 to the subindex 0."};
/// What a setting of the drive means for the finding.
inline constexpr NoteKind kParameterSays{"parameter-says",
                                         "{parameter}[ ({object})] is {value}[ since {since}], {bit}: {meaning}."};
/// What the manual of the family states about what the finding is about.
inline constexpr NoteKind kManualStates{"manual-states", "The manual ({source}) states: {fact}[ ({note})]."};

/// A message of the diagnosis history of the slave about what the finding is about.
inline constexpr NoteKind kSlaveStates{"slave-states",
                                       "The slave states ({object}, {read_frame}): {diagnosis}.[ It stored this after "
                                       "{absent_frame}.][{?may_be_older} The "
                                       "message may be older than this event.]"};

/// Of a mapping of which the slave did not accept all, while the master goes on as if it did.
inline constexpr NoteKind kMappingShifted{"mapping-shifted",
                                          "[{?outputs}The outputs][{!outputs}The inputs] after [{entry}][{!entry}that] "
                                          "are shifted: the slave has {shifted} at "
                                          "{slave_place}, the master at {wanted_place}."};

/// ... and the slave may keep an older entry where it aborted one.
inline constexpr NoteKind kMappingMayBeShifted{
    "mapping-may-be-shifted",
    "[{?outputs}The outputs][{!outputs}The inputs] after [{entry}][{!entry}that] may be shifted: if the slave has no "
    "entry there, it has {shifted} at {slave_place}, and the master at {wanted_place}."};

/// All of them, for documentation and tests.
inline constexpr const NoteKind* kSharedNotes[] = {&kMissingPacketsMayExplain,
                                                   &kWorkingCounterMissing,
                                                   &kStateReached,
                                                   &kOddMappingMayExplain,
                                                   &kObjectTwiceMayExplain,
                                                   &kUnusedMayExplain,
                                                   &kParameterSays,
                                                   &kManualStates,
                                                   &kSlaveStates,
                                                   &kMappingShifted,
                                                   &kMappingMayBeShifted};

}  // namespace ecaudit
