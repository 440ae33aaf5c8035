#include "analyzers/judge/wkc/expected_shares.h"

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "analyzers/judge/lrw_support.h"
#include "analyzers/judge/wkc/kinds.h"
#include "analyzers/judge/wkc/thresholds.h"
#include "analyzers/model/bus_model.h"

namespace ecaudit::wkc {
namespace {

/// The first of them, and the number of the others.
Value Named(std::vector<Value> values) {
  if (values.size() > threshold::kNamedSlaves) {
    const std::size_t others = values.size() - threshold::kNamedSlaves;
    values.resize(threshold::kNamedSlaves);
    values.push_back(arg::Count(others, "other"));
  }
  return arg::List(std::move(values));
}

/// Unset: the share does not depend on the filling of one buffer.
std::optional<std::uint8_t> OneBufferOf(const model::LogicalShare& share, bool inputs) {
  if (!inputs) return share.outputs_one_buffer;
  if (share.inputs_one_buffer) return share.inputs_one_buffer;
  return share.mailbox_only ? share.input_manager : std::nullopt;
}

}  // namespace

Value SharesOf(const RuleContext& context, const model::LogicalExpectation& expected, wire::Command command) {
  std::vector<Value> shares;
  for (const model::LogicalShare& share : expected.shares) {
    shares.push_back(arg::Text(context.Label(share.slave) + " " + std::to_string(model::WorthOf(share, command))));
  }
  return Named(std::move(shares));
}

SlaveId OnlyCandidate(const model::LogicalExpectation& expected, const track::LogicalAccess& access,
                      std::uint16_t most) {
  if (access.wkc >= most) return kNoSlave;
  const int missing = most - access.wkc;
  SlaveId found = kNoSlave;
  for (const model::LogicalShare& share : expected.shares) {
    const int worth = model::WorthOf(share, access.command);
    const bool both = access.command == wire::Command::LRW && share.inputs && share.outputs;
    if (worth != missing && !(both && missing < worth)) continue;
    if (found != kNoSlave) return kNoSlave;
    found = share.slave;
  }
  return found;
}

Note HintOf(const RuleContext& context, const model::LogicalExpectation& expected, const track::LogicalAccess& access,
            std::uint16_t most) {
  if (access.wkc > most) return {&kMoreCounted, {}};
  const int missing = most - access.wkc;
  const SlaveId one = OnlyCandidate(expected, access, most);
  if (one == kNoSlave) {
    Note note{&kSeveralFit, {{"difference", arg::Number(missing)}}};
    if (AreInputs(access, missing)) note.arguments.Set("inputs", arg::Flag());
    return note;
  }
  for (const model::LogicalShare& share : expected.shares) {
    if (share.slave != one || model::WorthOf(share, access.command) == missing) continue;
    Note note{missing == 2 ? &kOutputsMissing : &kInputsMissing, {{"slave", SlaveValue(context, one)}}};
    const std::optional<std::uint8_t> manager = missing == 2 ? share.output_manager : share.input_manager;
    if (manager) note.arguments.Set("sync_manager", arg::Number(*manager));
    return note;
  }
  return {&kShareMissing, {{"slave", SlaveValue(context, one)}}};
}

void AddSeparateLrw(const RuleContext& context, Finding& finding, const model::LogicalExpectation& expected) {
  std::vector<Value> slaves;
  for (const model::LogicalShare& share : expected.shares) {
    if (MayRejectSeparateLrw(context, share.slave)) slaves.push_back(SlaveValue(context, share.slave));
  }
  if (slaves.empty()) return;
  finding.Set("apart", arg::Flag());
  finding.Add(kSeparateLrw, {{"slaves", Named(std::move(slaves))}});
}

void AddOneBuffers(const RuleContext& context, Finding& finding, const model::LogicalExpectation& expected) {
  for (const bool inputs : {true, false}) {
    std::vector<Value> managers;
    for (const model::LogicalShare& share : expected.shares) {
      if (!context.slave(share.slave).al.SettledIn(esc::AlState::OP)) continue;
      const std::optional<std::uint8_t> manager = OneBufferOf(share, inputs);
      if (!manager) continue;
      managers.push_back(arg::Text("SM" + std::to_string(*manager) + " of " + context.Label(share.slave)));
    }
    if (managers.empty()) continue;
    Arguments arguments{{"several", arg::Flag(managers.size() > 1)}, {"inputs", arg::Flag(inputs)}};
    arguments.Set("managers", Named(std::move(managers)));
    finding.Add(kOneBuffer, std::move(arguments));
  }
}

}  // namespace ecaudit::wkc
