#include "analyzers/analysis.h"

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <algorithm>
#include <memory>
#include <utility>
#include <vector>

#include "analyzers/collect/collectors.h"
#include "analyzers/collect/mapping_history.h"
#include "analyzers/collect/summary.h"
#include "analyzers/collect/topology.h"
#include "analyzers/compare/comparison.h"
#include "analyzers/compare/esi_demands.h"
#include "analyzers/judge/capture_advice.h"
#include "analyzers/judge/common_causes.h"
#include "analyzers/judge/coverage.h"
#include "analyzers/judge/crowded_lists.h"
#include "analyzers/judge/diagnosis_notes.h"
#include "analyzers/judge/finding_order.h"
#include "analyzers/judge/finding_store.h"
#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/mapping_tables.h"
#include "analyzers/judge/one_for_many.h"
#include "analyzers/judge/parameter_notes.h"
#include "analyzers/judge/reached_limits.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/observation.h"
#include "analyzers/progress/ladder.h"
#include "decoder/track/network.h"

namespace ecaudit {
namespace {

PipelineOptions WhatToRead(const AnalysisOptions& options) {
  PipelineOptions reads;
  reads.from_s = options.from_s;
  reads.to_s = options.to_s;
  reads.from_frame = options.from_frame;
  reads.to_frame = options.to_frame;
  reads.stop = options.stop;
  reads.reached = options.reached;
  reads.progress = options.progress;
  return reads;
}

/// The rules that the user did not switch off, each with its subscriptions.
std::vector<std::unique_ptr<Rule>> Attached(RuleContext& context, EventBus& bus, std::uint32_t shuffle) {
  std::vector<std::unique_ptr<Rule>> rules = MakeAllRules(shuffle);
  std::erase_if(rules, [&](const std::unique_ptr<Rule>& rule) { return context.store.IsOff(rule->info()); });
  for (const std::unique_ptr<Rule>& rule : rules) rule->Attach(context, bus);
  return rules;
}

/// Slaves that turned out to be others give what was found of them to those.
/// @return slaves that are left
std::size_t ForgetReplaced(const RuleContext& context, FindingStore& store) {
  const bus::SlaveSet& slaves = context.network().slaves();
  std::size_t left = 0;
  // Of several in a row the last one is kept.
  for (std::size_t s = 0; s < slaves.size(); ++s) {
    SlaveId kept = static_cast<SlaveId>(s);
    for (std::size_t steps = 0; slaves[kept].replaced && steps < slaves.size(); ++steps) kept = slaves[kept].successor;
    if (kept == static_cast<SlaveId>(s)) {
      ++left;
    } else {
      store.Replace(static_cast<SlaveId>(s), kept);
    }
  }
  return left;
}

AnalysisResult AnalyseAll(capture::FrameSource& source, const AnalysisOptions& options, Timeline* timeline) {
  // The first subscriber of an event is made first.
  Observation observation(options, Depth::kClocks);
  Explanations explanations;
  const auto collectors = MakeCollectors(observation, explanations, timeline);
  MappingHistory mappings(observation.model(), observation.bus());
  FindingStore store(options.rules);
  for (const auto& collector : collectors) collector->Follow(store.findings());
  RuleContext context(store, observation, source, options, explanations);
  const auto rules = Attached(context, observation.bus(), options.shuffle_rules);

  observation.Run(source, WhatToRead(options));

  AnalysisResult result = Summarise(source, observation);
  result.slave_names = options.slave_names;
  for (const auto& collector : collectors) collector->Summarise(result);
  for (SlaveSummary& slave : result.slaves) {
    slave.esi_demands = startup::EsiDemandsOf(context.slave(slave.id),
                                              {slave.startup, result.bus.startup, MissesPackets(context.pairing())});
  }
  context.SetSummary(result);
  startup::Comparison comparison;
  if (options.expectation != nullptr) {
    comparison = startup::Compare(*options.expectation, result);
    context.SetStartup(comparison);
  }
  for (const auto& rule : rules) rule->Finish();
  for (const auto& collector : collectors) collector->Conclude();
  JoinConsequences(context);
  AddParameterNotes(context, store);
  AddDiagnosisNotes(context, store);
  AddMappingTables(context, mappings, store);
  WeakenWhatHistoryMayExplain(store, rules, context.pairing());
  const std::size_t slaves = ForgetReplaced(context, store);
  result.coverage = CoverageOf(context, result);
  for (SlaveSummary& slave : result.slaves) {
    slave.not_evaluated = WhyNotEvaluated(slave, context, result);
  }
  store.FoldNotEvaluable(slaves);
  result.findings = std::move(store.findings());
  TakeEntryPorts(result);
  JoinSlaves(
      result.findings, [&](SlaveId slave) { return context.Label(slave); },
      [&](SlaveId slave) {
        const SlaveSummary* summary = result.slave(slave);
        return summary != nullptr ? summary->position : static_cast<SlavePos>(slave);
      });
  (void)SortFindings(result.findings);
  NumberFindings(result.findings);
  progress::Climb(*observation.progress(), result);
  result.not_evaluable = store.not_evaluable();
  std::ranges::stable_sort(result.not_evaluable, {}, &NotEvaluable::rule);
  result.capture.earlier_left_out = (options.from_s || options.from_frame) && result.capture.first.number > 1;
  result.capture_next = WhatToCaptureNext(result);
  const CrowdedLists lists = LeaveOutCrowdedLists(observation.pipeline(), result);
  AddLimits(store, observation.pipeline(), lists, result);
  return result;
}

}  // namespace

AnalysisResult Analyse(capture::FrameSource& source, const AnalysisOptions& options, Timeline* timeline) {
  AnalysisResult result = AnalyseAll(source, options, timeline);
#ifdef __GLIBC__
  // Of thousands of slaves tens of megabytes were kept, between which the little that is left lies: what comes next,
  // a page or another analysis, would take as much again.
  malloc_trim(0);
#endif
  return result;
}

}  // namespace ecaudit
