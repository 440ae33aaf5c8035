#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/al_text.h"
#include "decoder/base/text.h"

namespace ecaudit::al_timeout {
namespace {

constexpr RuleInfo kInfo{.id = "al-timeout",
                         .group = "AL state machine",
                         .severity = Severity::kError,
                         .subject = Subject::kAlRequest,
                         .title = "Neither the requested state nor an error appears in time",
                         .needs = "AL Status reads after the request, and time stamps",
                         .source = "ETG2000, state machine time-outs",
                         .doc = R"(
## What it checks
The time from a request that the slave took to the state or the error bit in AL Status. Limits: what the ENI
(--eni) lets the master wait, else those of the device's ESI file (--esi), else PREOP and BOOT 3 s, SAFEOP and OP 10 s,
downwards 5 s.

## Why it matters
The slave neither follows nor says why. Firmware that hangs, a drive that waits for synchronisation or power, or a
request that was never read by the slave's processor.

## How it is decided
AL Status is read and still shows the old state when the limit is over. A master that stops reading before the limit
gives no finding; one that asks for a lower state instead, after 0.2 s and three looks at the least, gives a warning: it
gave up. A request that the slave has to ignore (see al-error-not-acknowledged) is not waited for. Where nobody sent
anything for long, or the clock was set, the wait counts from the next read on.
Where only broadcasts are read, their OR decides: a state that not all show although all were asked for it, or that
nobody shows, is a finding of the bus.

## Example
samples/captures/al-timeout.pcapng

## What to do
Look at the slave: display, LEDs, emergencies. Limits can be changed in the configuration file: al-timeout.preop,
al-timeout.safeop-op, al-timeout.down (milliseconds).
)"};

class AlTimeout final : public Rule {
 public:
  AlTimeout() : Rule(kInfo) {
    Subscribe<model::AlOverdue>(&AlTimeout::On);
    Subscribe<model::AlRequestJudged>(&AlTimeout::On);
    Subscribe<model::BusAlOverdue>(&AlTimeout::On);
    Subscribe<model::AlGivenUp>(&AlTimeout::On);
  }

  void On(const model::AlOverdue& e) {
    if (Repeat(e.slave, RequestKey(e.request), e.frame) != kNoFinding) return;
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.frame;
    finding.title =
        esc::StateName(e.request.control.state()) + " not reached within " + Duration(e.limit_ns) + ", and no error";
    finding.message = "The master requested " + RequestText(e.request) + " in frame " +
                      std::to_string(e.request.frame.number) + RepetitionText(e.request) + " and read AL Status " +
                      Count(e.polls, "time") + " since; after " + Duration(e.waited_ns) + " (frame " +
                      std::to_string(e.frame.number) + ") it still shows " + esc::StateName(e.status.state()) +
                      " without an error" + LimitText(e) +
                      ". Check the slave itself: is it running, does it wait for power, inputs or "
                      "synchronisation?";
    finding.evidence.push_back(Text("requested", esc::StateName(e.request.control.state())));
    finding.evidence.push_back(HexNumber("al_status", e.status.raw));
    finding.evidence.push_back(Real("waited_ms", static_cast<double>(e.waited_ns) / 1e6));
    finding.evidence.push_back(Real("limit_ms", static_cast<double>(e.limit_ns) / 1e6));
    finding.caused_by = context().ExplanationOf(e.slave, e.request.frame.number);
    AddRelated(finding, e.request.frame.number);
    if (e.request.transition != nullptr && !e.request.transition->performed) {
      finding.message += " The manual lists this transition without saying what the slave does.";
    }
    Report(RequestKey(e.request), std::move(finding));
  }
  void On(const model::AlGivenUp& e) {
    const std::uint64_t key = kGivenUp | RequestKey(e.request);
    if (Repeat(e.slave, key, e.frame) != kNoFinding) return;
    const std::string state = esc::StateName(e.request.control.state());
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.frame;
    finding.title = state + " not reached in " + Duration(e.waited_ns) + ", then the master gave up";
    finding.message = "The master requested " + RequestText(e.request) + " in frame " +
                      std::to_string(e.request.frame.number) + RepetitionText(e.request) + " and read AL Status " +
                      Count(e.polls, "time") + ", which showed " + esc::StateName(e.shown) +
                      " without an error up to frame " + std::to_string(e.frame.number) + "; in frame " +
                      std::to_string(e.next.number) +
                      " it asks for a lower state. Slaves may take longer: give it more time, or look at the slave.";
    finding.evidence.push_back(Text("requested", state));
    finding.evidence.push_back(Real("waited_ms", static_cast<double>(e.waited_ns) / 1e6));
    finding.caused_by = context().ExplanationOf(e.slave, e.request.frame.number);
    AddRelated(finding, e.request.frame.number);
    AddRelated(finding, e.next.number);
    Report(key, Severity::kWarning, std::move(finding));
  }

  /// Which of them it is, broadcasts do not tell.
  void On(const model::BusAlOverdue& e) {
    if (MissesPackets(context().pairing())) {
      NotEvaluable(kNoSlave, ReasonCode::kMissesPackets, e.frame.number);
      return;
    }
    const std::uint64_t key = kOfAll | (e.given_up ? kGivenUp : 0) | e.control.raw;
    if (Repeat(kNoSlave, key, e.frame) != kNoFinding) return;
    const std::string state = esc::StateName(e.control.state());
    const std::string who = e.slaves == 1 ? "the slave"
                            : e.all_asked ? "all of " + std::to_string(e.slaves) + " slaves"
                                          : "any slave";
    Finding finding;
    finding.first = e.frame;
    AddRelated(finding, e.request.number);
    finding.title = state + " not reached by " + who + " within " + Duration(e.given_up ? e.waited_ns : e.limit_ns) +
                    (e.given_up ? ", then the master gave up, as broadcasts show" : ", as broadcasts show");
    finding.message = "The master requested " + state +
                      (e.all_asked ? " of all slaves (the last in frame " : " (frame ") +
                      std::to_string(e.request.number) + ") and read AL Status of all by broadcast; after " +
                      Duration(e.waited_ns) + " (frame " + std::to_string(e.frame.number) + ") and up to frame " +
                      std::to_string(e.last.number) + " it shows " + esc::StatesOfAllText(e.status.raw) +
                      ". Which slave it is, such a read does not tell: read six bytes from 0x0130 of each slave.";
    finding.evidence.push_back(Text("requested", state));
    finding.evidence.push_back(HexNumber("al_status_of_all", e.status.raw));
    finding.evidence.push_back(Real("waited_ms", static_cast<double>(e.waited_ns) / 1e6));
    finding.evidence.push_back(Real("limit_ms", static_cast<double>(e.limit_ns) / 1e6));
    Report(key, e.given_up ? Severity::kWarning : Severity::kError, std::move(finding));
  }
  void On(const model::AlRequestJudged& e) {
    if (!e.request.frame.has_time) {
      NotEvaluable(e.slave, "the request has no time stamp", e.request.frame.number);
    }
  }
  void Finish() override {
    NotEvaluableWhereRequestsAreNotFollowed();
    for (std::size_t s = 0; s < context().slave_count(); ++s) {
      const auto id = static_cast<SlaveId>(s);
      const model::AlMachine& al = context().slave(id).al;
      const model::AlRequestRecord* open = al.waits_for();
      if (open == nullptr || !open->frame.has_time) continue;
      NotEvaluable(id,
                   "the state requested last was not seen, and no look at AL Status behind the limit is in the capture",
                   open->frame.number);
    }
    if (const FrameRef& since = context().bus().al_wait().unfinished(); since.seen()) {
      NotEvaluable(kNoSlave, "broadcasts do not show the state requested last, and the limit is not over at the end",
                   since.number);
    }
  }

 private:
  static constexpr std::uint64_t kOfAll = std::uint64_t{1} << 63U;
  static constexpr std::uint64_t kGivenUp = std::uint64_t{1} << 62U;

  [[nodiscard]] std::string LimitText(const model::AlOverdue& e) const {
    const model::SlaveModel& slave = context().slave(e.slave);
    const auto state = [&e](const device::StateTimeouts& stated) {
      return stated.preop == e.limit_ns || stated.safeop_op == e.limit_ns || stated.back_to_init == e.limit_ns;
    };
    if (slave.eni != nullptr && state(slave.eni->Waits())) {
      return ", and longer the master does not wait by the ENI (" + Duration(e.limit_ns) + ")";
    }
    if (!slave.profile->esi || !state(slave.profile->esi->timeouts)) return {};
    return ", although its ESI gives it " + Duration(e.limit_ns);
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<AlTimeout>};

}  // namespace
}  // namespace ecaudit::al_timeout
