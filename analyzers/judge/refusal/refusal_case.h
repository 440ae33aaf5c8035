/// A refusal with all that is known of its slave, and what the checks find in it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "analyzers/judge/refusal/reasons.h"
#include "analyzers/judge/refusal_reasons.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/sync/sync_model.h"
#include "decoder/esc/sii.h"
#include "decoder/track/network.h"

namespace ecaudit::refusal {

inline constexpr std::size_t kOutputs = 2, kInputs = 3;  ///< sync managers of process data

[[nodiscard]] constexpr device::PdoDirection DirectionOf(std::size_t manager) {
  return manager == kOutputs ? device::PdoDirection::kRx : device::PdoDirection::kTx;
}
[[nodiscard]] constexpr std::uint16_t AssignmentOf(std::size_t manager) {
  return manager == kOutputs ? process::kRxAssignment : process::kTxAssignment;
}
[[nodiscard]] inline Value NumberOf(std::size_t manager) {
  return arg::Number(static_cast<std::int64_t>(manager));
}
[[nodiscard]] inline Value Bytes(std::uint64_t count) {
  return arg::Count(count, "byte");
}

struct Case {
  const RuleContext& context;
  const RefusalCase& refusal;
  const model::SlaveModel& model;
  const track::SlaveState& state;
  const sync::DcUnit& dc;
  esc::SiiContents sii;

  /// A state was requested; else the slave left its state by itself.
  [[nodiscard]] bool requested() const { return refusal.requested != 0; }
  /// A setting that changed last in `changed` (0: never in the capture) was what it is when the slave refused.
  [[nodiscard]] bool Applied(FrameNo changed) const { return changed <= refusal.shown; }
  /// ... and can be the reason. A slave that held its state with a setting did not leave it because of that.
  [[nodiscard]] bool Counts(FrameNo changed) const {
    return Applied(changed) && (requested() || changed > refusal.held_since);
  }
  /// Process data are exchanged in SAFEOP and OP only: that a slave that refuses SAFEOP takes none is a consequence.
  [[nodiscard]] bool ExchangeCounts() const {
    return !requested() || refusal.requested == static_cast<std::uint8_t>(esc::AlState::OP);
  }
  /// Nothing that the master wrote since the set-up began is missing from the capture.
  [[nodiscard]] bool SetUpIsSeen() const;

  [[nodiscard]] std::optional<esc::SyncManager> manager(std::size_t n) const {
    return state.sync_manager(n, Certainty::kInferred);
  }
  [[nodiscard]] FrameNo manager_changed(std::size_t n) const { return model.set_up.manager_changed(n); }
  /// The PDOs of sync manager `n` as the master or the slave assigned them; null: they are not known.
  [[nodiscard]] const model::ProcessLayout* Assigned(std::size_t n) const;
  [[nodiscard]] std::optional<std::uint32_t> AssignedBytes(std::size_t n) const;

  [[nodiscard]] FrameNo sync_changed() const { return std::max(dc.activation_changed(), dc.cycle_changed()); }
  /// SYNC0 is generated; unset: 0x0981 is not known.
  [[nodiscard]] std::optional<bool> sync0() const {
    if (!dc.activation()) return std::nullopt;
    return dc.activation()->active() && dc.activation()->sync0();
  }
  [[nodiscard]] bool sync1() const { return dc.activation() && dc.activation()->sync1(); }
  [[nodiscard]] bool generates_sync1() const { return sync1() && dc.activation()->active(); }
  /// The capture shows all of the set-up, and no write to 0x0981.
  [[nodiscard]] bool SyncNeverSet() const { return !sync0() && dc.activation_changed() == 0 && SetUpIsSeen(); }
  [[nodiscard]] Value Activation() const { return arg::Hex(dc.activation()->raw, 2); }
  /// Of SYNC0 that is generated, as it was when the slave refused. Unset: it is not, or not known.
  [[nodiscard]] std::optional<std::uint32_t> sync0_cycle_ns() const;
};

/// What the checks found: notes about what is wrong, and words for what is right.
struct Outcome {
  const Word* reason = nullptr;
  std::uint8_t slot = 0;           ///< of `reason`
  const Word* possible = nullptr;  ///< a reason that nothing but the coincidence speaks for
  std::optional<Value> value;      ///< of the setting that the reason is about
  std::vector<Note> wrong;
  std::vector<const Word*> right;

  [[nodiscard]] bool none() const { return reason == nullptr && possible == nullptr; }
  /// The slave gives this reason, or may have it.
  [[nodiscard]] bool Names(const Reason& why) const { return reason == &why.title || possible == &why.title; }
  [[nodiscard]] bool Has(const Word& word) const { return std::ranges::find(right, &word) != right.end(); }

  /// @param must  the slave has to refuse this; else this may be why it refused
  void Add(bool must, const Reason& why, Arguments arguments = {}, std::size_t manager = kOutputs) {
    const Word*& first = must ? reason : possible;
    if (first == nullptr) first = manager == kInputs ? &why.title_of_inputs : &why.title;
    wrong.push_back({&why.note, std::move(arguments)});
  }
  void Wrong(const Reason& why, Arguments arguments = {}, std::size_t manager = kOutputs) {
    Add(true, why, std::move(arguments), manager);
  }
  void May(const Reason& why, Arguments arguments = {}, std::size_t manager = kOutputs) {
    Add(false, why, std::move(arguments), manager);
  }
  void Right(const Word& word) { right.push_back(&word); }
};

/// One question about the case.
using Check = void (*)(const Case&, Outcome&);

/// A question that is asked about sync manager `manager`.
template <std::size_t manager, void (*check)(const Case&, Outcome&, std::size_t)>
void Of(const Case& of, Outcome& found) {
  check(of, found, manager);
}

}  // namespace ecaudit::refusal
