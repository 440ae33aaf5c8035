#include <vector>

#include "analyzers/core/al_text.h"
#include "analyzers/core/rule.h"
#include "analyzers/model/bus_model.h"
#include "decoder/base/text.h"

namespace ecaudit {
namespace {

constexpr RuleInfo kInfo{
    .id = "al-refused",
    .group = "AL state machine",
    .severity = Severity::kError,
    .title = "The slave answers a state request with the error bit",
    .needs = "AL Status after the request; the state before it, to tell the error from an older one",
    .source = "ETG.1000.6, AL Status register 0x0130 and AL Status Code register 0x0134",
    .doc = R"(
## What it checks
Whether a request for a state is answered by the error bit (bit 4 of AL Status 0x0130), and what the AL status code
(0x0134) says. Further reads of the same error count as repetitions.

## Why it matters
This is the moment at which a start-up stops: the drive did not follow its master, and the code is its reason.

## How it is decided
The error bit appears after a request that the slave took, and was not set before. Slaves without a processor echo the
acknowledge bit of the request; that is no error. Where the state before the request was never read, the error may be
older and the finding is marked inferred. Where the model knows why the slave had to refuse (an illegal transition, a
wrong sync manager), caused_by names that finding.

## Example
samples/captures/init-to-op-refused.pcapng: OP refused with 0x0011.

## What to do
Look at the cause where one is named. Otherwise the AL status code says what the slave checked: 0x0017, 0x001D and
0x001E sync manager settings against the assigned PDOs, 0x001B missing outputs, 0x0030-0x0037 distributed clocks.
)"};

class AlRefused final : public Rule {
 public:
  using Rule::On;
  AlRefused() : Rule(kInfo) {
    Subscribe({Topic::kAlAnswered, Topic::kAlErrorRepeated, Topic::kAlErrorCode, Topic::kAlErrorCleared,
               Topic::kAlChangedByItself});
  }

  void On(const model::AlAnswered& e) override {
    if (e.slave >= open_.size()) open_.resize(static_cast<std::size_t>(e.slave) + 1);
    open_[e.slave] = {};
    if (e.outcome != model::AlAnswered::Outcome::kRefused) return;
    const std::uint64_t key = RequestKey(e.request) | static_cast<std::uint64_t>(e.status.raw) << 16U;
    FindingIndex index = Repeat(e.slave, key, e.frame);
    if (index == kNoFinding) {
      Finding finding;
      finding.slave = e.slave;
      finding.first = e.frame;
      finding.confidence = e.state_before_known ? Confidence::kObserved : Confidence::kInferred;
      finding.caused_by = context().ExplanationOf(e.slave, e.request.frame.number);
      AddRelated(finding, e.request.frame.number);
      index = Report(key, std::move(finding));
    } else {
      AddRelated(context().store[index], e.request.frame.number);
    }
    if (index == kNoFinding) return;
    open_[e.slave] = {index, true, e};
    Describe(context().store[index], e, e.code);
  }

  void On(const model::AlErrorRepeated& e) override {
    if (Open* open = Find(e.slave)) {
      Finding& finding = context().store[open->finding];
      ++finding.count;
      finding.last = e.frame;
    }
  }

  void On(const model::AlErrorCode& e) override {
    if (Open* open = Find(e.slave)) {
      Finding& finding = context().store[open->finding];
      Describe(finding, open->answer, e.code);
      AddRelated(finding, e.frame.number);
    }
  }

  void On(const model::AlErrorCleared& e) override {
    if (Open* open = Find(e.slave)) open->active = false;
  }
  void On(const model::AlChangedByItself& e) override {
    if (Open* open = Find(e.slave)) open->active = false;
  }

 private:
  struct Open {
    FindingIndex finding = kNoFinding;
    bool active = false;
    model::AlAnswered answer;
  };

  Open* Find(SlaveId slave) {
    return slave < open_.size() && open_[slave].active ? &open_[slave] : nullptr;
  }

  void Describe(Finding& finding, const model::AlAnswered& e, std::optional<std::uint16_t> code) const {
    const device::DeviceDescription& family = *context().bus.slave(e.slave).profile;
    const std::string to = esc::StateName(e.request.control.state());
    finding.title = to + " refused" + (e.request.from != 0 ? " in " + esc::StateName(e.request.from) : "");
    finding.message = "The master requested " + RequestText(e.request) + " in frame " +
                      std::to_string(e.request.frame.number) + RepetitionText(e.request) +
                      "; from frame " + std::to_string(e.frame.number) + " on the slave shows " +
                      esc::StatusText(e.status.raw) + " (AL Status " + Hex(e.status.raw) + "). ";
    finding.evidence.clear();
    finding.evidence.push_back(Text("requested", to));
    if (e.request.from != 0) finding.evidence.push_back(Text("state_before", esc::StateName(e.request.from)));
    finding.evidence.push_back(HexNumber("al_status", e.status.raw));
    if (code) {
      finding.title += " with AL status code " + CodeText(*code, family);
      finding.message += "AL status code " + CodeText(*code, family) + ". ";
      finding.evidence.push_back(HexNumber("al_status_code", *code));
    } else {
      finding.message += "The master did not read the AL status code (0x0134), so the slave's reason is not in the capture. ";
    }
    if (e.request.frame.has_time && e.frame.has_time) {
      finding.evidence.push_back(Real("answered_after_ms",
                                      static_cast<double>(e.frame.time - e.request.frame.time) / 1e6));
    }
    const device::AlTransition* row = e.request.transition;
    if (row != nullptr && e.request.verdict == model::AlVerdict::kLegal && !row->requirement.empty()) {
      finding.message += "For this transition the slave needs: " + row->requirement + ". ";
      finding.reference = {family.document, row->source};
    }
    if (const device::AlStatusCode* entry = code ? family.al_status_code(*code) : nullptr;
        entry != nullptr && !entry->source.empty() && finding.reference.document.empty()) {
      finding.reference = {family.document, entry->source};
    }
    if (finding.caused_by == kNoFinding) {
      finding.message += "Check what the code names, then acknowledge (bit 4 of AL Control) and request " + to + " again.";
    }
    if (!e.state_before_known) {
      finding.message += " AL Status was not read between the start of the capture and the request: the error may be older.";
    }
  }

  std::vector<Open> open_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<AlRefused>};

}  // namespace
}  // namespace ecaudit
