/// Notes that any rule's finding may get.
#pragma once

#include "analyzers/result/finding_kind.h"

namespace ecaudit {

inline constexpr NoteKind kMissingPacketsMayExplain{"missing-packets-may-explain",
                                                    "The capture misses packets, which may explain this finding."};

/// wkc-mismatch adds it to the fall of a slave whose share was missing before.
inline constexpr NoteKind kWorkingCounterMissing{"working-counter-missing",
                                                 "The share of this slave in the working counter is missing from "
                                                 "{missing_frame} on."};

/// All of them, for documentation and tests.
inline constexpr const NoteKind* kSharedNotes[] = {&kMissingPacketsMayExplain, &kWorkingCounterMissing};

}  // namespace ecaudit
