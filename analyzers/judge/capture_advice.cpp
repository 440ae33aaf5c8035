#include "analyzers/judge/capture_advice.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "analyzers/result/every_slave.h"

namespace ecaudit {
namespace {

/// Ways to know more; of two that open as many rules, the first.
enum class Way : std::uint8_t {
  kBothDirections,
  kFromPowerOn,
  kReadStatus,
  kReadStatusCode,
  kTellMapping,
  kStampBetter,
  kReadDifference,
  kReadLinkCounters,
};
constexpr std::size_t kWays = 8;

struct Opened {
  std::uint64_t judgements = 0;
  std::set<unsigned> slaves;  ///< empty: the bus
};

using Lines = std::map<std::string_view, std::vector<const NotEvaluable*>>;  // by rule

const Reason* ReasonOf(const Lines& lines, std::string_view rule, SlaveId slave) {
  const auto of_rule = lines.find(rule);
  if (of_rule == lines.end()) return nullptr;
  for (const NotEvaluable* entry : of_rule->second) {
    if (entry->slave == slave || entry->slave == kNoSlave || entry->slave == kEverySlave) return &entry->reason;
  }
  return nullptr;
}

bool IsAboutStamps(const Reason* reason) {
  return reason != nullptr && (reason->code == ReasonCode::kStampsTooCoarse || reason->code == ReasonCode::kNoStamps ||
                               reason->code == ReasonCode::kWithinUncertainty);
}

/// Whether the capture shows how the slave was brought up.
bool IsStarted(const SlaveSummary& slave) {
  return slave.startup.seen ||
         std::ranges::any_of(slave.al_history, [](const AlStep& step) { return step.kind == AlStep::Kind::kRequest; });
}

bool IsMappingOpen(const SlaveSummary& slave) {
  const auto open = [](const PdoSummary& pdo) { return !pdo.bytes; };
  return open(slave.rx_pdo) || open(slave.tx_pdo);
}

/// About what is set while a slave is brought up.
bool RestsOnConfiguration(std::string_view chapter) {
  return chapter == "Sync managers and FMMUs" || chapter == "PDO mapping" || chapter == "Drive profile (DS402)" ||
         chapter == "Synchronisation" || chapter == "Latch";
}

std::optional<Way> WayTo(const AnalysisResult& result, const RuleCoverage& rule, const SlaveSummary* slave,
                         const Reason* reason) {
  if (result.capture.direction != DirectionSeen::kBoth) return Way::kBothDirections;
  if (IsAboutStamps(reason)) return Way::kStampBetter;
  // What no source states about the device, no capture shows.
  if (reason != nullptr && reason->code == ReasonCode::kNotInProfile) return std::nullopt;
  if (slave == nullptr) return result.slaves.empty() ? std::optional(Way::kFromPowerOn) : std::nullopt;
  if (rule.rule == "bus-link-errors") return Way::kReadLinkCounters;
  if (rule.rule == "sync-difference-large") return Way::kReadDifference;
  if (rule.chapter == "AL state machine") {
    if (!slave->al_status) return Way::kReadStatus;
    return reason != nullptr && reason->code == ReasonCode::kNotRead ? std::optional(Way::kReadStatusCode)
                                                                     : std::nullopt;
  }
  if (!RestsOnConfiguration(rule.chapter)) return std::nullopt;
  if (!IsStarted(*slave)) return Way::kFromPowerOn;
  return IsMappingOpen(*slave) ? std::optional(Way::kTellMapping) : std::nullopt;
}

std::string TextOf(Way way, const std::set<unsigned>& slaves, const AnalysisResult& result) {
  constexpr std::size_t kNamed = 4;
  const std::string named = result.slave_names.List(slaves, kNamed);
  switch (way) {
    case Way::kBothDirections:
      return result.capture.direction == DirectionSeen::kNone
                 ? "EtherCAT frames, at a tap between master and first slave or at the master's own port"
                 : "both directions, at a tap between master and first slave or at the master's own port";
    case Way::kFromPowerOn:
      if (result.capture.earlier_left_out) {
        return "nothing new: the range leaves out earlier packets of this capture, so let it begin with them, or "
               "evaluate all of them (without --isolate)";
      }
      return "from before the master starts: how slaves are addressed and set up is seen only then";
    case Way::kReadStatus:
      return "let the master read AL Status (0x0130) of " + named;
    case Way::kReadStatusCode:
      return "let the master read AL Status (0x0130) with its code (0x0134), 6 bytes, of " + named;
    case Way::kTellMapping:
      return "read 1C12h, 1C13h and the PDOs in them of " + named + " by SDO, or give --esi or --eni";
    case Way::kStampBetter:
      return "with stamps of a probe or of the network card instead of the computer's";
    case Way::kReadDifference:
      return "let the master read the time difference (0x092C) of " + named + " in OP";
    case Way::kReadLinkCounters:
      return "read the error counters (0x0300 to 0x0313) of " + named + " twice, at the beginning and the end";
  }
  return {};
}

}  // namespace

std::vector<CaptureAdvice> WhatToCaptureNext(const AnalysisResult& result) {
  std::array<Opened, kWays> ways;
  Lines lines;
  for (const NotEvaluable& entry : result.not_evaluable) lines[entry.rule].push_back(&entry);
  for (const RuleCoverage& rule : result.coverage) {
    // Slaves without an entry are those that were left out of the report.
    auto at = result.slaves.begin();
    for (const SlaveCoverage& entry : rule.slaves) {
      while (entry.slave != kNoSlave && at != result.slaves.end() && at->id != entry.slave) ++at;
      if (entry.slave != kNoSlave && at == result.slaves.end()) break;
      if (entry.coverage != Coverage::kNotJudged && entry.coverage != Coverage::kPartly) continue;
      const SlaveSummary* slave = entry.slave == kNoSlave ? nullptr : &*at;
      const std::optional<Way> way = WayTo(result, rule, slave, ReasonOf(lines, rule.rule, entry.slave));
      if (!way) continue;
      Opened& opened = ways[static_cast<std::size_t>(*way)];
      ++opened.judgements;
      if (slave != nullptr) opened.slaves.insert(slave->position);
    }
  }
  std::vector<CaptureAdvice> out;
  for (std::size_t i = 0; i < ways.size(); ++i) {
    if (ways[i].judgements == 0) continue;
    out.push_back({TextOf(static_cast<Way>(i), ways[i].slaves, result), ways[i].judgements});
  }
  std::ranges::stable_sort(out,
                           [](const CaptureAdvice& a, const CaptureAdvice& b) { return a.judgements > b.judgements; });
  return out;
}

}  // namespace ecaudit
