#include "analyzers/judge/startup_rule.h"

#include <array>
#include <utility>

#include "analyzers/compare/comparison.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/step_text.h"
#include "decoder/base/text.h"

namespace ecaudit {
namespace {

constexpr std::size_t kListed = 6;

}  // namespace

void StartupRule::Finish() {
  if (context().startup() == nullptr) return;
  std::uint64_t key = 0;
  for (const startup::Deviation& deviation : context().startup()->deviations) {
    ++key;
    if (!Reports(deviation.kind)) continue;
    Finding finding;
    finding.slave = deviation.slave;
    finding.first = deviation.frame;
    Describe(deviation, finding);
    Report(key, std::move(finding));
  }
  for (const startup::NotCompared& entry : context().startup()->not_compared) {
    if (!entry.only || Reports(*entry.only)) NotEvaluable(entry.slave, entry.reason);
  }
}

const model::SlaveModel* StartupRule::Model(const startup::Deviation& deviation) const {
  return deviation.slave < context().slave_count() ? &context().slave(deviation.slave) : nullptr;
}

std::string StartupRule::Noun(const startup::Deviation& deviation, const startup::ExpectedStep& step) const {
  return startup::StepNoun(step.key, startup::ExpectedName(step, Model(deviation)));
}

std::string StartupRule::Noun(const StartupStep& step) {
  return startup::StepNoun(step.key, step.name);
}

void StartupRule::AddRefusal(const startup::Deviation& deviation, Finding& finding) {
  const StartupStep* step = deviation.previous;
  if (step == nullptr || step->key.kind != StartupKey::Kind::kRequest || step->outcome != StartupOutcome::kRefused) {
    return;
  }
  AddRelated(finding, step->last.number);
  finding.Add(
      kRequestFailed,
      {{"step", arg::Text(Noun(*step))}, {"outcome", arg::Text(step->note)}, {"at", arg::Frame(step->last.number)}});
}

std::string SlaveText(const startup::ExpectedSlave& slave, const SlaveNames& names) {
  return names.Of(slave.position, Printable(slave.name));
}

void SetSteps(Finding& finding, std::string_view name, std::string_view more, const std::vector<std::string>& texts) {
  const std::size_t named = texts.size() > kListed + 1 ? kListed : texts.size();
  std::vector<Value> list;
  for (std::size_t i = 0; i < named; ++i) list.push_back(arg::Text(texts[i]));
  finding.Set(name, arg::List(std::move(list)));
  if (named < texts.size()) finding.Set(more, arg::Count(texts.size() - named, "more step"));
}

Value PhaseValue(StartupPhase phase) {
  static const auto words = [] {
    std::array<Word, kStartupPhases> all;
    for (std::size_t i = 0; i < all.size(); ++i) all[i] = {kStartupPhaseNames[i].name, kStartupPhaseNames[i].title};
    return all;
  }();
  return arg::Of(words[static_cast<std::size_t>(phase)]);
}

}  // namespace ecaudit
