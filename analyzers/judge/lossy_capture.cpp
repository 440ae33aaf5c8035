#include "analyzers/judge/lossy_capture.h"

#include <algorithm>

#include "analyzers/judge/shared_notes.h"

namespace ecaudit {

void WeakenWhatHistoryMayExplain(FindingStore& store, const std::vector<std::unique_ptr<Rule>>& rules,
                                 const bus::PairingStatistics& pairing) {
  if (!MissesPackets(pairing)) return;
  const bool many = MissesMany(pairing);
  for (std::size_t i = 0; i < store.findings().size(); ++i) {
    Finding& finding = store.findings()[i];
    const auto rule = std::ranges::find_if(rules, [&](const auto& r) { return r->info().id == finding.rule; });
    if (rule == rules.end() || finding.severity == Severity::kInfo) continue;
    const History history = (*rule)->info().history;
    if (history == History::kNone) continue;
    if (many || history == History::kWhole) store.Regrade(static_cast<FindingIndex>(i), Severity::kInfo);
    finding.confidence = Confidence::kInferred;
    finding.Add(kMissingPacketsMayExplain);
  }
}

}  // namespace ecaudit
