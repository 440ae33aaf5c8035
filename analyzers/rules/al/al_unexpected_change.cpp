#include <vector>

#include "analyzers/core/al_text.h"
#include "analyzers/core/rule.h"
#include "analyzers/model/bus_model.h"
#include "decoder/base/text.h"

namespace ecaudit {
namespace {

constexpr RuleInfo kInfo{
    .id = "al-unexpected-change",
    .group = "AL state machine",
    .severity = Severity::kError,
    .title = "The state falls, or the error bit appears, without a request",
    .needs = "AL Status before and after",
    .source = "ETG.1000.6, EtherCAT state machine",
    .doc = R"(
## What it checks
AL Status (0x0130) that shows a lower state than before, or the error bit, although the master asked for neither.

## Why it matters
The drive left operation by itself: watchdog, loss of synchronisation, power cycle, local control. This is usually the
moment at which the machine stopped.

## How it is decided
The state before was read, no request that was sent since then leads to the new one, not even over intermediate states,
and no request is under way or lost. The frames between the last good read and this one are the time of the event. A
broadcast read counts where its result tells the state of every slave.

## Example
samples/captures/falls-out-of-op.pcapng: 0x001B after the process data paused.

## What to do
Look at the AL status code: 0x001B process data stopped (watchdog), 0x001A, 0x002C, 0x0032, 0x0034 synchronisation. Look
at what happened between the two frames named: gaps in the process data, lost frames, link errors, other requests.
)"};

class AlUnexpectedChange final : public Rule {
 public:
  using Rule::On;
  AlUnexpectedChange() : Rule(kInfo) {
    Subscribe({Topic::kAlChangedByItself, Topic::kAlErrorRepeated, Topic::kAlErrorCode, Topic::kAlErrorCleared,
               Topic::kAlAnswered});
  }

  void On(const model::AlChangedByItself& e) override {
    if (e.slave >= open_.size()) open_.resize(static_cast<std::size_t>(e.slave) + 1);
    open_[e.slave] = {};
    const std::uint64_t key = static_cast<std::uint64_t>(e.before.raw) << 16U | e.status.raw;
    FindingIndex index = Repeat(e.slave, key, e.frame);
    if (index == kNoFinding) {
      Finding finding;
      finding.slave = e.slave;
      finding.first = e.frame;
      AddRelated(finding, e.before_since);
      index = Report(key, std::move(finding));
      if (index == kNoFinding) return;
      Describe(context().store[index], e, e.code);
    }
    open_[e.slave] = {index, e.status.bit4(), e};
  }
  void On(const model::AlErrorRepeated& e) override {
    if (Open* open = Find(e.slave)) context().store[open->finding].last = e.frame;
  }
  void On(const model::AlErrorCode& e) override {
    if (Open* open = Find(e.slave)) {
      Describe(context().store[open->finding], open->change, e.code);
      AddRelated(context().store[open->finding], e.frame.number);
    }
  }
  void On(const model::AlErrorCleared& e) override {
    if (Open* open = Find(e.slave)) open->active = false;
  }
  void On(const model::AlAnswered& e) override {
    if (Open* open = Find(e.slave)) open->active = false;
  }

 private:
  struct Open {
    FindingIndex finding = kNoFinding;
    bool active = false;
    model::AlChangedByItself change;
  };
  Open* Find(SlaveId slave) {
    return slave < open_.size() && open_[slave].active ? &open_[slave] : nullptr;
  }

  void Describe(Finding& finding, const model::AlChangedByItself& e, std::optional<std::uint16_t> code) const {
    const device::DeviceDescription& family = *context().bus.slave(e.slave).profile;
    const std::string from = esc::StatusText(e.before.raw);
    const std::string to = esc::StatusText(e.status.raw);
    finding.title = "Slave left " + from + " for " + to + " by itself";
    if (e.before.state() == e.status.state()) finding.title = "Error bit appeared in " + from;
    finding.message = "AL Status was " + from + " in frame " + std::to_string(e.before_since) + " and is " + to +
                      " in frame " + std::to_string(e.frame.number) + "; no request of the master asked for it. ";
    finding.evidence.clear();
    finding.evidence.push_back(HexNumber("al_status_before", e.before.raw));
    finding.evidence.push_back(HexNumber("al_status", e.status.raw));
    if (code) {
      finding.title += ", AL status code " + CodeText(*code, family);
      finding.message += "AL status code " + CodeText(*code, family) + ". ";
      finding.evidence.push_back(HexNumber("al_status_code", *code));
    } else if (e.status.bit4()) {
      finding.message += "The master did not read the AL status code (0x0134). ";
    } else {
      finding.message += "Without the error bit this is typical of a restart of the slave or of another master. ";
    }
    finding.message += "Look at what happened between these two frames.";
  }

  std::vector<Open> open_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<AlUnexpectedChange>};

}  // namespace
}  // namespace ecaudit
