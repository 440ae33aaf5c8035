/// A pause of all process data as possible reason of AL status code 0x001B, for a slave whose FMMUs or watchdog are not
/// in the capture. Where both are known, sync-watchdog-margin measures the outputs of the slave itself.
#pragma once

#include <optional>

#include "analyzers/judge/rule_context.h"
#include "analyzers/result/finding.h"
#include "analyzers/sync/process_data_pauses.h"

namespace ecaudit {

inline constexpr NoteKind kAllPaused{
    .name = "process-data-paused",
    .text =
        R"(From {paused_from} to {paused_to}, for {pause_ms}, no slave got outputs (LRW, LWR). [{!mapped}The FMMUs of
this slave are not in the capture: which of them are its own is not known.][{?mapped}The watchdog of this slave is not in
the capture (0x0400, 0x0420): it may be shorter than {watchdog_ms}.])"};
/// For the title.
inline constexpr Word kWhyPaused{"process-data-paused", "no outputs"};

/// @param before  the last frame that shows the slave without the code; 0: none does
/// @param now     the frame that shows it with the code
/// @return unset: nothing paused, FMMUs and watchdog are known, or neither stamps nor frames show it for sure
[[nodiscard]] std::optional<sync::ProcessDataPauses::Pause> PauseReason(const RuleContext& context, SlaveId slave,
                                                                        FrameNo before, const FrameRef& now);
/// kAllPaused with its arguments.
[[nodiscard]] Note NoteOf(const RuleContext& context, SlaveId slave, const sync::ProcessDataPauses::Pause& pause);

}  // namespace ecaudit
