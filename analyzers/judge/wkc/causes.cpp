#include "analyzers/judge/wkc/causes.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "analyzers/judge/wkc/kinds.h"
#include "analyzers/judge/wkc/thresholds.h"
#include "decoder/track/network.h"

namespace ecaudit::wkc {
namespace {

/// They are about a slave that is gone, or a link to it.
constexpr std::array<std::string_view, 3> kOfTheBus{"bus-slave-count-changed", "bus-link-errors",
                                                    "bus-duplicate-address"};

bool IsCause(const RuleContext& context, const Datagrams& datagrams, const Finding& f, const Finding& own) {
  const bool left_state = f.rule == "al-unexpected-change";
  const bool of_the_bus = std::ranges::find(kOfTheBus, f.rule) != kOfTheBus.end();
  if (!left_state && !of_the_bus && !(IsAway(f) && !IsAway(own))) return false;
  if (f.first.number > own.last.number + threshold::kLaterFrames) return false;
  if (f.last.number + threshold::kAtOnceFrames < own.first.number) return false;
  // It was away, and answers again when its lower state is read: then its absence is the cause.
  if (left_state && IsAway(own) && f.first.number > own.last.number) return false;
  if (own.slave != kNoSlave && f.slave != kNoSlave && f.slave != own.slave) return false;
  return datagrams.MayHaveBegunBefore(context, f, own);
}

/// It answered last before this change.
bool AnsweredLastBefore(const Finding& changed, const Finding& own) {
  const Value* const answered = own.arguments.Find("answered_frame");
  return IsAway(own) && answered != nullptr && static_cast<FrameNo>(answered->number) < changed.first.number;
}

/// The last change of the number of slaves before, if the bus ended before this slave since then, or a branch left
/// that may include it. One that is back since then, but lost its address, is still away.
FindingIndex EndOfTheBusBefore(const RuleContext& context, const Finding& own) {
  if (own.slave == kNoSlave) return kNoFinding;
  const SlavePos* position = context.network().slaves()[own.slave].position.if_known();
  if (position == nullptr) return kNoFinding;
  const std::vector<Finding>& findings = context.store.findings();
  FindingIndex found = kNoFinding;
  FrameNo latest = 0;
  for (std::size_t i = 0; i < findings.size(); ++i) {
    const Finding& f = findings[i];
    if (f.rule != "bus-slave-count-changed" || f.first.number > own.first.number || f.first.number < latest) continue;
    latest = f.first.number;
    const std::optional<std::int64_t> end = SlavesNow(f);
    const bool left = end && (*position >= *end || IsOfABranch(f));
    if (left) {
      found = static_cast<FindingIndex>(i);
    } else if (found != kNoFinding && !AnsweredLastBefore(findings[found], own)) {
      found = kNoFinding;
    }
  }
  return found;
}

}  // namespace

FrameNo Distance(const Finding& a, const Finding& b) {
  return std::max(a.first.number, b.first.number) - std::min(a.first.number, b.first.number);
}

bool IsAway(const Finding& finding) {
  return finding.kind == &kNoAnswer;
}

std::optional<std::int64_t> SlavesNow(const Finding& changed) {
  const Value* now = changed.arguments.Find("slaves_now");
  return now == nullptr ? std::nullopt : std::optional(now->number);
}

bool IsOfABranch(const Finding& changed) {
  return changed.arguments.Has("still_answers");
}

void LinkCause(RuleContext& context, const Datagrams& datagrams, const Episodes& episodes, Finding& own) {
  std::vector<Finding>& findings = context.store.findings();
  FindingIndex best = kNoFinding;
  for (std::size_t i = 0; i < findings.size(); ++i) {
    if (!IsCause(context, datagrams, findings[i], own)) continue;
    const bool nearer = best == kNoFinding || Distance(findings[i], own) < Distance(findings[best], own);
    if (nearer) best = static_cast<FindingIndex>(i);
  }
  own.caused_by = best != kNoFinding ? best : EndOfTheBusBefore(context, own);
  if (best != kNoFinding) episodes.AddWhoLeftItsState(context, own, findings[best]);
  if (own.caused_by == kNoFinding) own.caused_by = datagrams.SameDropBefore(context, own);
}

}  // namespace ecaudit::wkc
