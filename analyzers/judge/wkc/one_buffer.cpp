#include "analyzers/judge/wkc/one_buffer.h"

#include "analyzers/model/bus_model.h"
#include "analyzers/model/logical_expectation.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/sync/sync_model.h"

namespace ecaudit::wkc {
namespace {

bool IsOpen(const model::LogicalShare& share) {
  return share.inputs_one_buffer.has_value() || share.outputs_one_buffer.has_value();
}

}  // namespace

std::optional<OneBufferUse> UseOfOneBuffer(const RuleContext& context, const track::LogicalAccess& access) {
  const model::LogicalExpectation& expected = context.bus().Expect(access);
  const model::CounterRange range = context.bus().RangeFor(expected, access.command);
  if (range.least == range.most || !expected.complete) return std::nullopt;
  if (access.wkc < range.least || access.wkc > range.most) return std::nullopt;
  const model::LogicalShare* open = nullptr;
  for (const model::LogicalShare& share : expected.shares) {
    if (!context.slave(share.slave).al.SettledIn(esc::AlState::OP)) return std::nullopt;
    if (!IsOpen(share)) continue;
    if (open != nullptr) return std::nullopt;
    open = &share;
  }
  if (open == nullptr) return std::nullopt;
  const int counted = access.wkc - range.least;
  const bool both = access.command == wire::Command::LRW;  // outputs count 2 then
  OneBufferUse use{.slave = open->slave, .ways = {}};
  use.ways[0] = {open->outputs_one_buffer, both ? (counted & 2) != 0 : counted == 1};
  use.ways[1] = {open->inputs_one_buffer, (counted & 1) != 0};
  // A sum that this slave cannot make.
  for (const OneBufferUse::Way& way : use.ways) {
    if (way.counted && !way.manager && both) return std::nullopt;
  }
  return use;
}

bool IsSync0Off(const RuleContext& context, SlaveId slave) {
  const auto& activation = context.sync().dc(slave).activation();
  return activation && !activation->sync0();
}

}  // namespace ecaudit::wkc
