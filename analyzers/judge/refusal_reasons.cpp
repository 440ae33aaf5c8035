#include "analyzers/judge/refusal_reasons.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "analyzers/judge/refusal/code_table.h"
#include "analyzers/judge/refusal/refusal_case.h"

namespace ecaudit {

RefusalReasons FindRefusalReasons(const RuleContext& context, const RefusalCase& refused) {
  const refusal::Row* const row = refusal::RowOf(refused.code);
  if (row == nullptr) return {};
  // After another request the settings are no longer those of the refusal.
  if (context.slave(refused.slave).al.last_request() > std::max(refused.request, refused.shown)) return {};
  const track::SlaveState& state = context.network().state(refused.slave);
  const refusal::Case of{context,
                         refused,
                         context.slave(refused.slave),
                         state,
                         context.sync().dc(refused.slave),
                         esc::ParseSii(state.sii.image())};
  refusal::Outcome found;
  for (const refusal::Check check : row->checks) {
    if (check != nullptr) check(of, found);
  }
  RefusalReasons reasons;
  reasons.inferred = found.reason == nullptr && found.possible != nullptr;
  reasons.reason = reasons.inferred ? found.possible : found.reason;
  reasons.slot = found.slot;
  reasons.value = found.value;
  if (!found.right.empty()) {
    std::vector<Value> words;
    for (const Word* word : found.right) words.push_back(arg::Of(*word));
    reasons.notes.push_back({&refusal::kChecked, {{"checked", arg::List(std::move(words))}}});
  }
  // What is wrong stands before the next step, which refers to it.
  std::move(found.wrong.begin(), found.wrong.end(), std::back_inserter(reasons.notes));
  return reasons;
}

void AddTo(Finding& finding, const RefusalReasons& reasons) {
  if (reasons.reason != nullptr) finding.Set("reason", arg::Of(*reasons.reason));
  if (reasons.slot != 0) finding.Set("slot", arg::Number(reasons.slot));
  if (reasons.value) finding.Set("reason_value", *reasons.value);
  if (reasons.inferred) {
    finding.Set("reason_inferred", arg::Flag());
    finding.confidence = Confidence::kInferred;
  }
  const bool checked =
      std::ranges::any_of(reasons.notes, [](const Note& note) { return note.kind == &refusal::kChecked; });
  if (checked) finding.Set("checked", arg::Flag());
  finding.notes.insert(finding.notes.end(), reasons.notes.begin(), reasons.notes.end());
}

std::vector<std::uint16_t> CodesWithReasons() {
  std::vector<std::uint16_t> codes;
  for (const refusal::Row& row : refusal::kRows) {
    std::ranges::copy_if(row.codes, std::back_inserter(codes), [](std::uint16_t code) { return code != 0; });
  }
  return codes;
}

}  // namespace ecaudit
