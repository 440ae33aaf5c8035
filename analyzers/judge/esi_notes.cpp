#include "analyzers/judge/esi_notes.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "analyzers/compare/esi_demands.h"
#include "analyzers/judge/lossy_capture.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/result/analysis_result.h"

namespace ecaudit {
namespace {

constexpr std::size_t kMostNamed = 4;

bool HoldsRequest(const StartupSummary& startup, const UnfollowedRequest& request) {
  return std::ranges::any_of(startup.steps, [&](const StartupStep& step) {
    return step.key.kind == StartupKey::Kind::kRequest && step.key.address == request.requested &&
           step.frame.number <= request.last && step.last.number >= request.first;
  });
}

bool MayExplain(const EsiDemand& demand) {
  return demand.kind == EsiDemand::Kind::kInitCommand || demand.kind == EsiDemand::Kind::kModules ||
         demand.kind == EsiDemand::Kind::kActivation || demand.kind == EsiDemand::Kind::kSyncManager;
}

}  // namespace

bool AddEsiDemands(const RuleContext& context, const UnfollowedRequest& request, Finding& finding) {
  if (context.summary() == nullptr || !context.slave(request.slave).profile->esi) return false;
  const SlaveSummary* slave = context.summary()->slave(request.slave);
  if (slave == nullptr || !HoldsRequest(slave->startup, request)) return false;
  const std::vector<EsiDemand> demands = startup::EsiDemandsOf(
      context.slave(request.slave),
      {slave->startup, context.summary()->bus.startup, MissesPackets(context.pairing()), request.first});
  std::size_t named = 0;
  std::size_t more = 0;
  bool explains = false;
  for (const EsiDemand& demand : demands) {
    if (!demand.unmet() || demand.before > request.requested || demand.kind == EsiDemand::Kind::kTimeout) continue;
    explains = explains || MayExplain(demand);
    const bool command = demand.kind == EsiDemand::Kind::kInitCommand && demand.by_sdo;
    if (command && demand.status == EsiDemand::Status::kMissing && request.commands_named) continue;
    if (named == kMostNamed) {
      ++more;
      continue;
    }
    ++named;
    Arguments arguments{{"what", arg::Text(demand.what)}};
    if (!demand.wanted.empty()) arguments.Set("wanted", arg::Text(demand.wanted));
    if (!demand.seen.empty()) arguments.Set("seen", arg::Text(demand.seen));
    if (demand.frame != 0) arguments.Set("frame", arg::Frame(demand.frame));
    finding.Add(kEsiDemandUnmet, std::move(arguments));
  }
  if (more > 0) finding.Add(kFurtherEsiDemands, {{"more", arg::Count(more, "further demand")}});
  return explains;
}

}  // namespace ecaudit
