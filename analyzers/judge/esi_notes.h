/// What the ESI of a slave (--esi) requires before a request that the slave did not follow, and the start-up in the
/// capture does not show, or shows with another value.
#pragma once

#include <cstdint>

#include "analyzers/judge/rule_context.h"
#include "analyzers/result/esi_demand.h"
#include "analyzers/result/finding.h"

namespace ecaudit {

inline constexpr NoteKind kEsiDemandUnmet{
    .name = "esi-demand-unmet",
    .text =
        "The ESI requires {what}[ = {wanted}].[{?seen} The capture shows {seen}[ in {frame}].][{!seen} The capture "
        "does not show it.]"};
inline constexpr NoteKind kFurtherEsiDemands{
    .name = "further-esi-demands",
    .text = "The ESI has {more} that the start-up does not meet: startup --expect lists them."};

/// A request that a finding is about.
struct UnfollowedRequest {
  SlaveId slave = kNoSlave;
  FrameNo first = 0, last = 0;  ///< frames with it
  std::uint8_t requested = 0;   ///< AL state
  bool commands_named = false;  ///< the finding names missing init commands itself
};

/// Adds these notes, a few by name. Nothing for a request that is not one of the start-up that is kept.
/// @return whether a write is missing or has another value that may be why the slave does not follow
bool AddEsiDemands(const RuleContext& context, const UnfollowedRequest& request, Finding& finding);

}  // namespace ecaudit
