#include "analyzers/judge/refusal/refusal_case.h"

#include "analyzers/judge/lossy_capture.h"

namespace ecaudit::refusal {

bool Case::SetUpIsSeen() const {
  return requested() && state.set_up_since != 0 && !MissesPackets(context.pairing());
}

const model::ProcessLayout* Case::Assigned(std::size_t n) const {
  const model::ProcessLayout& layout = model.process.Layout(DirectionOf(n));
  return layout.known() && layout.source != model::LayoutSource::kDefault ? &layout : nullptr;
}

std::optional<std::uint32_t> Case::AssignedBytes(std::size_t n) const {
  const model::ProcessLayout* const layout = Assigned(n);
  return layout == nullptr ? std::nullopt : std::optional(layout->bytes_of(static_cast<std::uint8_t>(n)));
}

std::optional<std::uint32_t> Case::sync0_cycle_ns() const {
  if (!sync0().value_or(false) || !Applied(sync_changed())) return std::nullopt;
  return state.registers.Value<std::uint32_t>(esc::kSync0Cycle);
}

}  // namespace ecaudit::refusal
