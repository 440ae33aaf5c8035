#include "analyzers/collect/startup_outcomes.h"

#include <algorithm>
#include <string>

#include "analyzers/compare/startup_registers.h"
#include "analyzers/model/drive_unit.h"
#include "analyzers/model/model_events.h"
#include "decoder/base/time.h"

namespace ecaudit::startup {
namespace {

/// Looks that come so much later than the others before them come no more.
constexpr std::int64_t kLooksMissed = 10;
/// An answer that the capture goes on for so long without is none, whatever the master does.
constexpr std::int64_t kNoAnswerNs = 1'000'000'000;

bool IsMailbox(const StartupKey& key) {
  return key.kind == StartupKey::Kind::kDownload || key.kind == StartupKey::Kind::kUpload;
}

bool GaveUp(const std::vector<StartupStep>& steps, const mailbox::MailboxUnanswered& event) {
  using End = mailbox::MailboxUnanswered::End;
  if (event.end == End::kGap || event.read_lost || event.certainty != Certainty::kObserved) return false;
  if (event.polls < model::kGivenUpPolls || !event.request.frame.has_time || !event.last_poll.has_time) return false;
  const std::int64_t waited = Elapsed(event.request.frame.time, event.last_poll.time);
  if (waited < model::kGivenUpNs) return false;
  if (event.end != End::kCaptureEnd || waited >= kNoAnswerNs) return true;
  return std::ranges::any_of(steps, [&](const StartupStep& step) {
    return step.key.kind == StartupKey::Kind::kRequest && step.frame.number > event.request.frame.number;
  });
}

}  // namespace

void MarkNotFollowed(std::vector<StartupStep>& steps, std::uint32_t state, const FrameRef& last_look) {
  for (auto step = steps.rbegin(); step != steps.rend(); ++step) {
    if (step->key.kind != StartupKey::Kind::kRequest || step->key.address != state ||
        step->frame.number > last_look.number) {
      continue;
    }
    if (step->outcome != StartupOutcome::kUnknown) return;
    step->outcome = StartupOutcome::kUnanswered;
    step->last = last_look;
    return;
  }
}

bool StoppedLooking(const model::AlMachine::Wait& wait, const FrameRef& capture_end) {
  if (wait.polls < model::kGivenUpPolls || !wait.since.has_time || !wait.last_poll.has_time || !capture_end.has_time) {
    return false;
  }
  const std::int64_t waited = Elapsed(wait.since.time, wait.last_poll.time);
  const std::int64_t behind = Elapsed(wait.last_poll.time, capture_end.time);
  const std::int64_t look = waited / static_cast<std::int64_t>(wait.polls);
  return waited >= model::kGivenUpNs && behind >= model::kGivenUpNs && behind / kLooksMissed >= look;
}

void MarkUnanswered(std::vector<StartupStep>& steps, const mailbox::MailboxUnanswered& event) {
  if (!event.request.index) return;
  for (auto step = steps.rbegin(); step != steps.rend(); ++step) {
    if (!IsMailbox(step->key) || step->frame.number > event.request.frame.number) continue;
    const bool same = step->key.address == *event.request.index && step->last.number == event.request.frame.number;
    if (same && step->outcome == StartupOutcome::kUnknown && GaveUp(steps, event)) {
      step->outcome = StartupOutcome::kUnanswered;
      step->last = event.last_poll;
    }
    return;
  }
}

void MarkDriveOutcome(std::vector<StartupStep>& steps, device::DriveState shows, const FrameRef& capture_end) {
  const auto step = std::find_if(steps.rbegin(), steps.rend(), [](const StartupStep& any) { return Enables(any.key); });
  if (step == steps.rend() || step->outcome != StartupOutcome::kUnknown) return;
  if (shows == device::DriveState::kFault || shows == device::DriveState::kFaultReactionActive) {
    step->outcome = StartupOutcome::kRefused;
  } else if (step->frame.has_time && capture_end.has_time &&
             Elapsed(step->frame.time, capture_end.time) >= model::DriveLimits{}.reaction_ns) {
    step->outcome = StartupOutcome::kUnanswered;
  } else {
    return;
  }
  step->note = "answered with " + std::string(device::DriveStateName(shows));
}

}  // namespace ecaudit::startup
