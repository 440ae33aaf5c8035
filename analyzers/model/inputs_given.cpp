#include "analyzers/model/inputs_given.h"

#include "analyzers/model/slave_model.h"

namespace ecaudit::model {
namespace {

constexpr auto kOperational = static_cast<std::uint8_t>(esc::AlState::OP);

/// It was asked for a state in which it gives nothing, and may be there already.
bool MayBeBelow(const AlMachine& al) {
  const StateSet possible = al.possible();
  for (const esc::AlState state : {esc::AlState::INIT, esc::AlState::PREOP, esc::AlState::BOOT}) {
    if (possible.contains(static_cast<std::uint8_t>(state))) return true;
  }
  // A request whose fate is not known, of a broadcast that some took.
  return possible.single() == kOperational && !al.SettledIn(esc::AlState::OP);
}

}  // namespace

bool OnlyWithAllInputs(const Counting& counting, unsigned wkc) {
  if (wkc < counting.inputs || (wkc - counting.inputs) % counting.step != 0) return false;
  const unsigned taken = (wkc - counting.inputs) / counting.step;
  if (taken < counting.surely_take || taken > counting.take) return false;
  // Whose inputs are missing has not taken outputs. As many as outputs count for are missing for one more slave that
  // takes them; if so few do not come out, more do not.
  if (counting.miss < counting.step) return true;
  const unsigned no_takers = counting.miss_nothing < counting.step ? counting.step - counting.miss_nothing : 0;
  return taken + 1 + no_takers > counting.take;
}

bool AllInputsGiven(const LogicalExpectation& expectation, const std::deque<SlaveModel>& slaves, Counting others,
                    unsigned wkc) {
  Counting by_state = others;
  Counting any = others;
  for (const LogicalShare& share : expectation.shares) {
    const AlMachine& al = slaves[share.slave].al;
    const bool takes = share.outputs && al.possible().contains(kOperational);
    if (takes) ++by_state.take;
    if (share.outputs) ++any.take;
    if (share.outputs && al.SettledIn(esc::AlState::OP)) ++by_state.surely_take;
    if (!share.inputs) continue;
    if (al.possible().empty()) return false;
    ++by_state.inputs;
    ++any.inputs;
    ++any.miss;
    if (!share.outputs) ++any.miss_nothing;
    if (!share.mailbox_only && !share.inputs_one_buffer && !MayBeBelow(al)) continue;
    ++by_state.miss;
    if (!takes) ++by_state.miss_nothing;
  }
  const bool explained = wkc >= by_state.inputs && (wkc - by_state.inputs) / by_state.step >= by_state.surely_take &&
                         (wkc - by_state.inputs) / by_state.step <= by_state.take;
  return OnlyWithAllInputs(explained ? by_state : any, wkc);
}

}  // namespace ecaudit::model
