#include "analyzers/judge/wkc/datagrams.h"

#include <algorithm>
#include <utility>

#include "analyzers/judge/wkc/counter_habits.h"
#include "analyzers/judge/wkc/expected_shares.h"
#include "analyzers/judge/wkc/kinds.h"
#include "analyzers/judge/wkc/thresholds.h"

namespace ecaudit::wkc {
namespace {

constexpr std::size_t kMaxDatagrams = 64;

}  // namespace

void Datagrams::Add(FindingIndex finding, const model::LogicalExpectation& expected, const track::LogicalAccess& access,
                    int before) {
  if (finding == kNoFinding || datagrams_.size() >= kMaxDatagrams) return;
  Datagram datagram{finding, KeyOf(access), before - int{access.wkc}, {}, false};
  int all = 0;
  for (const model::LogicalShare& share : expected.shares) {
    const int worth = model::WorthOf(share, access.command);
    if (worth == 0) continue;
    datagram.parts.push_back({share.slave, worth});
    all += worth;
  }
  datagram.all_parts = all > 0 && all == before;
  datagrams_.push_back(std::move(datagram));
}

const Datagrams::Datagram* Datagrams::Find(const RuleContext& context, const Finding& own) const {
  const auto found = std::ranges::find_if(
      datagrams_, [&](const Datagram& datagram) { return &context.store[datagram.finding] == &own; });
  return found != datagrams_.end() ? &*found : nullptr;
}

bool Datagrams::MayHaveBegunBefore(const RuleContext& context, const Finding& cause, const Finding& own) const {
  if (cause.first.number <= own.first.number) return true;
  const FrameNo well_before = BegunBy(cause);
  if (well_before < cause.first.number && well_before > own.first.number) return false;
  const Datagram* const datagram = Find(context, own);
  if (datagram == nullptr || cause.slave == kNoSlave) return true;
  const auto& parts = datagram->parts;
  const bool has_part = std::ranges::any_of(parts, [&](const Datagram::Part& p) { return p.slave == cause.slave; });
  if (datagram->all_parts && !has_part) return false;
  // The counter changed once more before the cause showed: that change is the effect.
  return std::ranges::none_of(datagrams_, [&](const Datagram& other) {
    if (other.key != datagram->key || other.finding == datagram->finding) return false;
    const FrameNo first = context.store[other.finding].first.number;
    return own.last.number < first && first <= cause.first.number;
  });
}

FindingIndex Datagrams::SameDropBefore(const RuleContext& context, const Finding& own) const {
  if (own.kind != &kDropped || own.slave == kNoSlave) return kNoFinding;
  for (const Datagram& other : datagrams_) {
    const Finding& finding = context.store[other.finding];
    if (&finding == &own) break;
    if (finding.kind == &kDropped && finding.slave == own.slave && finding.first.number == own.first.number) {
      return other.finding;
    }
  }
  return kNoFinding;
}

void Datagrams::NameDropped(RuleContext& context) const {
  for (const Datagram& datagram : datagrams_) {
    const Finding& finding = context.store[datagram.finding];
    if (finding.kind != &kDropped || finding.slave != kNoSlave || !datagram.all_parts) continue;
    const FrameNo since = finding.first.number;
    const auto fits = [&](const Datagram::Part& part) { return FitsAllSince(context, part.slave, since); };
    const auto only = std::ranges::find_if(datagram.parts, fits);
    if (only == datagram.parts.end() || std::any_of(only + 1, datagram.parts.end(), fits)) continue;
    const Value slave = SlaveValue(context, only->slave);
    for (const Datagram& other : datagrams_) {
      Finding& same = context.store[other.finding];
      if (same.kind != &kDropped || same.first.number != since) continue;
      same.slave = only->slave;
      same.Set("missing", slave);
      same.Add(kFitsAlone, {{"slave", slave}, {"since", arg::Frame(since)}});
      if (same.count >= threshold::kRightFrames) context.store.Regrade(other.finding, Severity::kError);
    }
  }
}

bool Datagrams::FitsAllSince(const RuleContext& context, SlaveId slave, FrameNo first) const {
  return std::ranges::all_of(datagrams_, [&](const Datagram& datagram) {
    const Finding& finding = context.store[datagram.finding];
    if (finding.kind != &kDropped || finding.first.number != first) return true;
    return datagram.all_parts && std::ranges::any_of(datagram.parts, [&](const auto& part) {
             return part.slave == slave && part.worth == datagram.missing;
           });
  });
}

}  // namespace ecaudit::wkc
