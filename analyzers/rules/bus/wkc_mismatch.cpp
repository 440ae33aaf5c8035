#include <optional>
#include <utility>
#include <vector>

#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/wkc/causes.h"
#include "analyzers/judge/wkc/counter_habits.h"
#include "analyzers/judge/wkc/datagrams.h"
#include "analyzers/judge/wkc/episodes.h"
#include "analyzers/judge/wkc/evidence.h"
#include "analyzers/judge/wkc/expected_shares.h"
#include "analyzers/judge/wkc/kinds.h"
#include "analyzers/judge/wkc/missing_slaves.h"
#include "analyzers/model/bus_model.h"
#include "analyzers/words/what.h"
#include "decoder/pipeline.h"
#include "decoder/track/events.h"
#include "decoder/track/network.h"

namespace ecaudit::wkc_mismatch {
namespace {

using namespace wkc;  // NOLINT(google-build-using-namespace): the parts of this rule

constexpr const FindingKind* kKinds[] = {&kProcessData,   &kDropped,      &kBroadcast,        &kNoAnswer,
                                         &kSeveralAnswer, &kNoSlaveThere, &kNoSlaveAtPosition};
constexpr const NoteKind* kNotes[] = {&kLeftTheBus,    &kAllAway,      &kMoreCounted, &kOutputsMissing,
                                      &kInputsMissing, &kShareMissing, &kSeveralFit,  &kFitsSlaveThatLeftState,
                                      &kOneAway,       &kOneLeft,      &kFitsAlone,   &kInputsNotRefreshed,
                                      &kOneBuffer,     &kSeparateLrw};

constexpr Word kFmmuWrites{"fmmu-writes", "writes to FMMUs", true};
constexpr Word kFmmuWrite{"fmmu-write", "a frame that may have set an FMMU"};

// They are its causes.
constexpr std::string_view kAfter[] = {"al-unexpected-change", "bus-duplicate-address", "bus-link-errors",
                                       "bus-slave-count-changed"};

constexpr RuleInfo kInfo{.id = "wkc-mismatch",
                         .group = "Frame and bus",
                         .severity = Severity::kError,
                         .title = "The working counter differs from what the slaves should count",
                         .needs = "returned frames; for logical datagrams the FMMUs and AL states of all slaves",
                         .source = "ETG1000.4, working counter",
                         .kinds = kKinds,
                         .notes = kNotes,
                         .after = kAfter,
                         .doc = R"(
## What it checks
- Logical datagrams: each slave whose FMMUs overlap adds 1 if it is read and 2 if it is written (LRW). For LRD and LWR
  it adds 1.
- Configured address: a slave must answer reads of a register that every ESC has.
- Broadcast reads of such registers: every slave that the position counter shows must count.

## Why it matters
A slave that does not count did not accept its set points, or did not deliver its actual values in that cycle.

## How it is decided
Slaves that have been in OP for a while must count in full. Slaves in another state, or with a pending request, may
count. Outside that range the rule fires, and names the slaves whose share is missing if that is unambiguous.

- If the FMMUs are not all in the capture (a mid-run capture, or FMMUs between two that are set), the known ones must
  still count. Above that the constant value before is the expectation. A drop below it, with no state request or
  configuration since then, is an inferred warning. Outputs that drop after 20 frames count as well, if the lower value
  then lasts, or the counter returns to the higher one, for 200 frames.
- If the AL states are not all in the capture, the sum of all shares is the expectation after 200 frames with it.
- If only one slave has exactly the share that is missing from all datagrams since one frame, it is named, and a drop of
  20 frames is an error.
- A cause that shows later (no answer at the station address, a lower AL state) must have been possible when the counter
  changed: the slave has a part in the datagram, and was well before that.
- An FMMU that is not in the capture is known to map nothing if its activate byte was seen, if the ESC has no such FMMU
  (0x0004), or if the capture shows the set-up of the slave from its address or INIT on. It also maps nothing if for a
  while exactly the other slaves counted.
- Normal refusals are not evaluated: mailbox empty or full, registers that an ESC does not implement, a second AL
  Control write.
- Addresses that two slaves share while the master assigns new ones are not evaluated.
- A counter above the FMMUs is not evaluated if the capture misses packets or frames never returned (one of them may
  have set another FMMU), or if no slave has an FMMU.
- If the capture shows no assignment of addresses, a station address that the master accesses for at least half a second
  is an inferred warning. It never answers, and other slaves do.
- A station address that the master did not assign, though it assigned others, is an error after at least 10 accesses
  in at least 1 s. All return with working counter 0. One whose registers it writes, or to which it sends mailbox
  messages, is a warning from the first access on: a master that looks for slaves reads.
- A position after the last slave is a warning after at least 10 accesses in at least 1 s. A master that looks for new
  slaves at most 4 times a second is not reported.

## Example
samples/captures/wkc-link-break.pcapng

## What to do
If slaves are named, check their AL status and power. If the number of slaves changed, the cable after the last one that
answers is broken. If a share of 2 is missing from one slave, it did not accept its outputs: their sync manager is off.
)"};

class WkcMismatch final : public Rule {
 public:
  WkcMismatch() : Rule(kInfo) {
    Subscribe<track::LogicalAccess>(&WkcMismatch::On);
    Subscribe<track::Answered>(&WkcMismatch::On, MemoryRange{0, wkc::kLastOfEveryEsc});
    Subscribe<track::Answered>(&WkcMismatch::OnAnyRegister);
    Subscribe<track::AlRequest>(&WkcMismatch::On);
    Subscribe<track::SlaveFound>(&WkcMismatch::On, Stage::kAfterModel);
    Subscribe<track::AddressAssigned>(&WkcMismatch::On);
    Subscribe<track::SlaveCount>(&WkcMismatch::On);
  }

  void On(const track::LogicalAccess& e) {
    if (e.assumed || !e.returned.seen()) return;
    if (e.wkc > 0) numbering_ = false;
    const model::LogicalExpectation& expected = context().bus().Expect(e);
    const model::CounterRange range = context().bus().RangeFor(expected, e.command);
    const std::uint64_t mappings = context().network().mapping_version();
    const bool all_known = expected.complete || habits_.WasRight(e, mappings);
    if (!all_known) AddNotAllKnown(e);
    switch (Decide(kCounters, FactsOf(e, range, all_known))) {
      case CounterVerdict::kFits:
        return;
      case CounterVerdict::kByHabit:
        return ReportDrop(e, habits_.Follow(e, range, mappings));
      case CounterVerdict::kByHabitOfAll:
        return ReportDrop(e, habits_.FollowAll(e, expected, range.most));
      case CounterVerdict::kNotEvaluable:
        return AddSetUpMissed(e);
      case CounterVerdict::kMismatch:
        return ReportMismatch(e, expected, range, all_known);
    }
  }

  void On(const track::Answered& e) {
    if (!e.returned.seen()) return;  // there is no answer to evaluate
    if (wire::IsBroadcast(e.command)) {
      EvaluateBroadcastRead(e);
    } else {
      EvaluateAddressedRead(e);
      missing_.OnOfEveryEsc(e);
    }
  }
  void OnAnyRegister(const track::Answered& e) { missing_.On(e); }
  void On(const track::AlRequest& e) {
    habits_.Forget();
    if (!e.broadcast) numbering_ = false;
  }
  void On(const track::AddressAssigned&) {
    numbering_ = true;
    missing_.OnAssigned();
  }
  void On(const track::SlaveFound&) { habits_.Forget(); }
  void On(const track::SlaveCount& e) { missing_.OnCount(e.count); }

  void Finish() override {
    if (NotEvaluableWithoutReturns()) return;
    for (MissingSlaves::Report& report : missing_.Reports()) {
      Report(report.key, report.severity, std::move(report.finding));
    }
    episodes_.NameMissing(context());
    datagrams_.NameDropped(context());
    // The missing share of a slave that left the bus or its state is a consequence of that.
    for (Finding& own : context().store.findings()) {
      if (own.rule == kInfo.id && own.caused_by == kNoFinding) LinkCause(context(), datagrams_, episodes_, own);
    }
  }

 private:
  [[nodiscard]] Facts<CounterFact> FactsOf(const track::LogicalAccess& e, const model::CounterRange& range,
                                           bool all_known) {
    Facts<CounterFact> facts{};
    facts.Set(CounterFact::kAllKnown, all_known);
    facts.Set(CounterFact::kBelow, e.wkc < range.least);
    facts.Set(CounterFact::kAbove, e.wkc > range.most);
    facts.Set(CounterFact::kOneValue, range.least == range.most);
    facts.Set(CounterFact::kHeld, !all_known && habits_.HeldAtLeast(e, range.least));
    facts.Set(CounterFact::kSetUpMissed, e.wkc > range.most && MayMissSetUp(range));
    return facts;
  }

  /// Without outbound frames the missing ones are unknown. If no slave has an FMMU at all, none can count: their set-up
  /// is not in the capture, although no gap shows.
  [[nodiscard]] bool MayMissSetUp(const model::CounterRange& range) {
    return MissesSome() || NeverReturn() || context().pairing().paired == 0 || (range.most == 0 && !AnyMapped());
  }
  [[nodiscard]] bool MissesSome() const {
    return MissesAny(context().pairing()) || context().network().last_gap() != 0;
  }
  /// A frame that is still in flight when this one returned may turn out to be lost.
  [[nodiscard]] bool NeverReturn() const { return LosesAny(context().pairing()) || context().pairing().in_flight > 0; }

  /// Any slave has an FMMU that is switched on.
  [[nodiscard]] bool AnyMapped() {
    const track::Network& network = context().network();
    if (mapped_version_ != network.mapping_version()) {
      mapped_version_ = network.mapping_version();
      any_mapped_ = false;
      for (std::size_t s = 0; s < network.slaves().size(); ++s) {
        any_mapped_ = any_mapped_ || !network.fmmus(static_cast<SlaveId>(s)).active.empty();
      }
    }
    return any_mapped_;
  }

  void AddNotAllKnown(const track::LogicalAccess& e) {
    if (std::exchange(unknown_reported_, true)) return;
    NotEvaluable(kNoSlave, ReasonCode::kNotInCapture, what::kFmmusOfAll, e.frame().number);
  }

  void AddSetUpMissed(const track::LogicalAccess& e) {
    if (std::exchange(more_reported_, true)) return;
    const bool capture = MissesSome() || !NeverReturn();
    NotEvaluable(kNoSlave, capture ? ReasonCode::kMissesPackets : ReasonCode::kNeverReturned,
                 capture ? kFmmuWrites : kFmmuWrite, e.frame().number);
  }

  void ReportMismatch(const track::LogicalAccess& e, const model::LogicalExpectation& expected,
                      const model::CounterRange& range, bool all_known) {
    const std::uint64_t key = KeyOf(KeyOf(e), e.wkc);
    episodes_.Watch(key, expected, e);
    if (Repeat(kNoSlave, key, e.frame()) != kNoFinding) return;
    Finding finding = Found(kProcessData, kNoSlave, e.frame());
    finding.Set("command", arg::Text(wire::Name(e.command)))
        .Set("length", arg::Count(e.length, "byte"))
        .Set("working_counter", arg::Number(e.wkc))
        .Set("expected_least", arg::Number(range.least));
    if (all_known) {
      finding.Set("expected_most", arg::Number(range.most)).Set("as_range", arg::Flag(range.least != range.most));
    }
    finding.Set("logical_address", arg::Hex(e.address, 8));
    Value shares = SharesOf(context(), expected, e.command);
    if (!shares.items().empty()) finding.Set("shares", std::move(shares));
    if (all_known) AddOneBuffers(context(), finding, expected);
    if (e.command == wire::Command::LRW && e.wkc < range.least) AddSeparateLrw(context(), finding, expected);
    const FindingIndex index = Report(key, std::move(finding));
    datagrams_.Add(index, expected, e, range.most);
    const int missing = range.most - e.wkc;
    if (index != kNoFinding && all_known && AreInputs(e, missing)) {
      context().store[index].Set("no_inputs", arg::Flag());
    }
    Episode* const episode = episodes_.Find(key);
    if (episode == nullptr) return;
    episode->finding = index;
    // A slave whose FMMUs are unknown may have counted instead of another one.
    if (!all_known) return;
    episode->only_candidate = OnlyCandidate(expected, e, range.most);
    episode->hint = HintOf(context(), expected, e, range.most);
    episode->missing = missing;
  }

  void ReportDrop(const track::LogicalAccess& e, const std::optional<Drop>& drop) {
    if (!drop) return;
    const std::uint64_t key = KeyOf(drop->key, drop->wkc);
    if (Repeat(kNoSlave, key, drop->first) != kNoFinding) return;
    Finding finding = Found(kDropped, kNoSlave, drop->first);
    finding.last = drop->last;
    finding.count = drop->count;
    finding.confidence = Confidence::kInferred;
    finding.Set("command", arg::Text(wire::Name(e.command)))
        .Set("length", arg::Count(e.length, "byte"))
        .Set("address", arg::Hex(e.address, 8))
        .Set("working_counter", arg::Number(drop->wkc))
        .Set("before", arg::Number(drop->before))
        .Set("times", arg::Count(drop->times, "frame"))
        .Set("since_frame", arg::Frame(drop->since));
    AddRelated(finding, drop->since);
    const FindingIndex index = Report(key, Severity::kWarning, std::move(finding));
    if (drop->wkc == e.wkc) datagrams_.Add(index, context().bus().Expect(e), e, drop->before);
  }

  void EvaluateBroadcastRead(const track::Answered& e) {
    if (e.command != wire::Command::BRD || !e.slaves_passed || !EveryEscAnswers(e.address, e.length)) return;
    if (e.wkc == *e.slaves_passed) return;
    const std::uint64_t key = 0x8000000000000000ULL | static_cast<std::uint64_t>(e.address) << 16U | e.wkc;
    if (Repeat(kNoSlave, key, e.returned) != kNoFinding) return;
    Finding finding = Found(kBroadcast, kNoSlave, e.returned);
    finding.Set("register", arg::Hex(e.address))
        .Set("working_counter", arg::Number(e.wkc))
        .Set("expected", arg::Number(*e.slaves_passed))
        .Set("passed", arg::Count(*e.slaves_passed, "slave"));
    Report(key, std::move(finding));
  }

  void EvaluateAddressedRead(const track::Answered& e) {
    if (e.command != wire::Command::FPRD || !EveryEscAnswers(e.address, e.length)) return;
    if (e.slave == kNoSlave) return;
    if (e.slave >= last_answers_.size()) last_answers_.resize(std::size_t{e.slave} + 1);
    const FrameNo answered_before = last_answers_[e.slave];
    if (e.wkc > 0) last_answers_[e.slave] = e.returned.number;
    if (e.wkc == 1 || (e.wkc > 1 && numbering_)) return;
    const std::uint64_t key = 0x4000000000000000ULL | static_cast<std::uint64_t>(e.wkc);
    if (Repeat(e.slave, key, e.returned) != kNoFinding) return;
    Finding finding = Found(e.wkc == 0 ? kNoAnswer : kSeveralAnswer, e.slave, e.returned);
    finding.Set("working_counter", arg::Number(e.wkc))
        .Set("expected", arg::Number(1))
        .Set("station_address", arg::Hex(e.adp))
        .Set("register", arg::Hex(e.address));
    if (e.wkc == 0 && answered_before != 0) {
      finding.Set("answered_frame", arg::Frame(answered_before));
      AddRelated(finding, answered_before);
    }
    Report(key, std::move(finding));
  }

  Episodes episodes_;
  Datagrams datagrams_;
  CounterHabits habits_;
  MissingSlaves missing_;
  std::vector<FrameNo> last_answers_;  ///< of each slave, at its station address
  bool unknown_reported_ = false;
  bool more_reported_ = false;
  std::uint64_t mapped_version_ = 0;
  bool any_mapped_ = false;
  bool numbering_ = false;  ///< station addresses were assigned and not used yet
};

const RuleRegistration kRegistration{kInfo, MakeRule<WkcMismatch>};

}  // namespace
}  // namespace ecaudit::wkc_mismatch
