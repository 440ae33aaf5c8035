/// For AL status code 0x001B without any pause of the outputs: what the capture shows of them and of the watchdog.
#pragma once

#include <optional>

#include "analyzers/judge/rule_context.h"
#include "analyzers/result/finding.h"

namespace ecaudit {

inline constexpr NoteKind kNoPause{
    .name = "outputs-arrive",
    .text =
        R"(The outputs arrived up to {last_outputs_frame}: {outputs_in_op} counted the slave in OP. No gap between
them reached half of its watchdog of {watchdog_ms} ([{?assumed}assumed: the value after power-on][{!assumed}0x0400 = {divider}, 0x0420 =
{intervals}]).[ Bit 6 of the control byte of SM{sync_manager} is [{?trigger}1][{!trigger}0] ({control})[{?trigger}: its data
restart the watchdog][{!trigger}: its data do not restart the watchdog].])"};

/// What the capture shows about a slave that left OP with this code.
struct NoPause {
  Note note;
  const Word* advice = nullptr;  ///< one or two sentences without the last full stop
};

/// @param held_since  the first frame that showed it in OP  @param shown  the frame that shows the drop
/// @return unset: outputs paused or stopped, or the capture does not show that they did not
[[nodiscard]] std::optional<NoPause> FindNoPause(const RuleContext& context, SlaveId slave, FrameNo held_since,
                                                 const FrameRef& shown);

}  // namespace ecaudit
