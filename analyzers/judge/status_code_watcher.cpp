#include "analyzers/judge/status_code_watcher.h"

#include <algorithm>

#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/words/what.h"

namespace ecaudit {

StatusCodeWatcher::StatusCodeWatcher(const RuleInfo& info) : Rule(info) {
  Subscribe<model::AlAnswered>(&StatusCodeWatcher::On);
  Subscribe<model::AlChangedByItself>(&StatusCodeWatcher::On);
  Subscribe<model::AlErrorCode>(&StatusCodeWatcher::On);
}

bool StatusCodeWatcher::Tolerates(const device::DeviceDescription& family, const Context& c) {
  if (!esc::IsAlState(c.from) || !esc::IsAlState(c.to)) return false;
  const device::AlTransition* row =
      family.al_transition(static_cast<esc::AlState>(c.from), static_cast<esc::AlState>(c.to));
  return row != nullptr && std::ranges::find(row->tolerated_codes, c.code) != row->tolerated_codes.end();
}

void StatusCodeWatcher::AddUnread(const Context& c) {
  if (!c.frame.seen()) return;
  NotEvaluable(c.slave, ReasonCode::kNotRead, what::kAlStatusCode, c.frame.number);
}

StatusCodeWatcher::Context& StatusCodeWatcher::Remember(SlaveId slave, const FrameRef& frame, std::uint8_t from,
                                                        std::uint8_t to) {
  if (slave >= last_.size()) last_.resize(static_cast<std::size_t>(slave) + 1);
  AddUnread(last_[slave]);
  last_[slave] = Context{slave, frame, 0, from, to};
  return last_[slave];
}

void StatusCodeWatcher::Evaluate(Context& c, const FrameRef& frame, std::uint16_t code) {
  Context read = c;
  read.frame = frame;
  read.code = code;
  c.frame = {};
  OnCode(read);
}

void StatusCodeWatcher::Finish() {
  if (NotEvaluableWithoutReturns()) return;
  for (const Context& c : last_) AddUnread(c);
  std::vector<Finding>& findings = context().store.findings();
  for (Finding& own : findings) {
    if (own.rule != info().id) continue;
    for (std::size_t i = 0; i < findings.size(); ++i) {
      const Finding& f = findings[i];
      if (f.slave == own.slave && f.first.number <= own.first.number &&
          (f.rule == "al-refused" || f.rule == "al-unexpected-change") &&
          (own.caused_by == kNoFinding || findings[own.caused_by].first.number <= f.first.number)) {
        own.caused_by = static_cast<FindingIndex>(i);
      }
    }
  }
}

void StatusCodeWatcher::On(const model::AlAnswered& e) {
  if (e.outcome != model::AlAnswered::Outcome::kRefused) return;
  Context& c = Remember(e.slave, e.frame, e.request.from, e.request.control.state());
  if (e.code) Evaluate(c, e.frame, *e.code);
}

void StatusCodeWatcher::On(const model::AlChangedByItself& e) {
  // Without the error bit there is no code to wait for, but a read may still show one.
  Context& c = Remember(e.slave, e.status.bit4() ? e.frame : FrameRef{}, e.before.state(), 0);
  if (e.code && e.status.bit4()) Evaluate(c, e.frame, *e.code);
}

void StatusCodeWatcher::On(const model::AlErrorCode& e) {
  if (e.slave >= last_.size() || last_[e.slave].slave == kNoSlave) return;
  Evaluate(last_[e.slave], e.frame, e.code);
}

}  // namespace ecaudit
