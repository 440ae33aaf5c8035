#include "analyzers/judge/lrw_support.h"

#include <algorithm>
#include <cstdint>

#include "analyzers/model/slave_model.h"
#include "decoder/base/known.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/track/network.h"

namespace ecaudit {

bool MayRejectSeparateLrw(const RuleContext& context, SlaveId slave) {
  const model::SlaveModel& model = context.slave(slave);
  if (model.outputs.exchanged > 0 && model.inputs.exchanged > 0) return false;
  const track::Network& network = context.network();
  constexpr std::uint8_t kPruIcss = 0x90;
  const auto type = network.state(slave).registers.Value<std::uint8_t>(esc::kEscType, Certainty::kObserved);
  if (type != kPruIcss) return false;
  const track::KnownFmmus& fmmus = network.fmmus(slave);
  const auto apart = [](const track::KnownFmmus::Unit& a, const track::KnownFmmus::Unit& b) {
    const bool both = a.fmmu.writes() && !a.fmmu.reads() && b.fmmu.reads() && !b.fmmu.writes();
    return both && a.fmmu.logical_start != b.fmmu.logical_start;
  };
  return std::ranges::any_of(fmmus.active, [&](const track::KnownFmmus::Unit& a) {
    return std::ranges::any_of(fmmus.active, [&](const track::KnownFmmus::Unit& b) { return apart(a, b); });
  });
}

}  // namespace ecaudit
