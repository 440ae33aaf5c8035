/// Words for sync managers, and the finding that says what is wrong with one when a state is requested.
#pragma once

#include <string>
#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/sync_manager_demand.h"
#include "decoder/esc/sync_manager.h"
#include "decoder/track/slave_state.h"

namespace ecaudit {

/// Settings of a sync manager with what is known of them.
struct KnownSyncManager {
  esc::SyncManager settings;
  bool observed = false;  ///< false: inferred
  FrameNo since = 0;      ///< frame that set or showed them last
};
/// Nothing when the capture does not show them.
[[nodiscard]] std::optional<KnownSyncManager> SyncManagerOf(const track::SlaveState& state, std::size_t number);

/// "start 0x1100, length 12, control 0x24, enabled".
[[nodiscard]] std::string SettingsText(const esc::SyncManager& settings);
/// Distinguishes settings of one sync manager, to fold repetitions.
[[nodiscard]] std::uint64_t SettingsKey(std::size_t number, const esc::SyncManager& settings);
/// The same for two settings.
[[nodiscard]] std::uint64_t KeyOfBoth(std::uint64_t one, std::uint64_t other);

/// The finding for `faults` (at least one) of one sync manager when the master requests a state.
[[nodiscard]] Finding DescribeFaults(const RuleContext& context, const model::AlRequestJudged& request,
                                     const model::SyncManagerDemand& demand, const KnownSyncManager& known,
                                     const std::vector<model::SyncManagerFault>& faults);

}  // namespace ecaudit
