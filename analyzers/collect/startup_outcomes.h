/// What came of steps of a start-up that nothing answered: whether the master waited without result, or the capture
/// merely ends before the answer.
///
/// A master has given up when it looked for a while, and then did something else, or looked no more although the
/// capture goes on. Only then is a step unanswered; else what came of it stays unknown.
#pragma once

#include <cstdint>
#include <vector>

#include "analyzers/model/al_machine.h"
#include "analyzers/result/startup_summary.h"
#include "decoder/device/drive_profile.h"
#include "decoder/mailbox/events.h"

namespace ecaudit::startup {

/// True while a state or an answer may still come: another write of the same request belongs to the step.
[[nodiscard]] constexpr bool IsOpen(StartupOutcome outcome) {
  return outcome == StartupOutcome::kUnknown || outcome == StartupOutcome::kUnanswered;
}

/// The last open request of this state never came: the master stopped waiting.
/// @param last_look  of the master
void MarkNotFollowed(std::vector<StartupStep>& steps, std::uint32_t state, const FrameRef& last_look);

/// The master looked for a state, and then no more up to the end of the capture, much longer than from look to look.
[[nodiscard]] bool StoppedLooking(const model::AlMachine::Wait& wait, const FrameRef& capture_end);

/// Of `steps`, the transfer that this request belongs to is unanswered if the master gave it up.
void MarkUnanswered(std::vector<StartupStep>& steps, const mailbox::MailboxUnanswered& event);

/// What came of the last command to enable a drive that does not show Operation enabled.
/// @param shows  its state as last shown
void MarkDriveOutcome(std::vector<StartupStep>& steps, device::DriveState shows, const FrameRef& capture_end);

}  // namespace ecaudit::startup
