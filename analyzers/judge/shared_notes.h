/// Notes that any rule's finding may get.
#pragma once

#include "analyzers/result/finding_kind.h"

namespace ecaudit {

inline constexpr NoteKind kMissingPacketsMayExplain{"missing-packets-may-explain",
                                                    "The capture misses packets, which may explain this finding."};
inline constexpr NoteKind kWorkingCounterMissing{"working-counter-missing",
                                                 "The working counter of this slave is missing from {since} on."};

/// All of them, for documentation and tests.
inline constexpr const NoteKind* kSharedNotes[] = {&kMissingPacketsMayExplain, &kWorkingCounterMissing};

}  // namespace ecaudit
