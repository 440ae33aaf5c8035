#include "analyzers/core/status_code_watcher.h"

namespace ecaudit {

StatusCodeWatcher::StatusCodeWatcher(const RuleInfo& info) : Rule(info) {
  Subscribe({Topic::kAlAnswered, Topic::kAlChangedByItself, Topic::kAlErrorCode});
}

StatusCodeWatcher::Context& StatusCodeWatcher::Remember(SlaveId slave, std::uint8_t from, std::uint8_t to) {
  if (slave >= last_.size()) last_.resize(static_cast<std::size_t>(slave) + 1);
  last_[slave] = Context{slave, {}, 0, from, to};
  return last_[slave];
}

void StatusCodeWatcher::Hand(Context& c, const FrameRef& frame, std::uint16_t code) {
  c.frame = frame;
  c.code = code;
  OnCode(c);
}

void StatusCodeWatcher::Finish() {
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
  Context& c = Remember(e.slave, e.request.from, e.request.control.state());
  if (!e.code) return;
  Hand(c, e.frame, *e.code);
}

void StatusCodeWatcher::On(const model::AlChangedByItself& e) {
  Context& c = Remember(e.slave, e.before.state(), 0);
  if (!e.code) return;
  Hand(c, e.frame, *e.code);
}

void StatusCodeWatcher::On(const model::AlErrorCode& e) {
  if (e.slave >= last_.size() || last_[e.slave].slave == kNoSlave) return;
  Hand(last_[e.slave], e.frame, e.code);
}

}  // namespace ecaudit
