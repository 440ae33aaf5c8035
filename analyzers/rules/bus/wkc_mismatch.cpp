#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/shared_notes.h"
#include "analyzers/model/bus_model.h"
#include "analyzers/words/what.h"
#include "decoder/base/time.h"
#include "decoder/pipeline.h"
#include "decoder/track/events.h"

namespace ecaudit::wkc_mismatch {
namespace {

constexpr FindingKind kProcessData{
    .name = "process-data",
    .title = R"({command} working counter {working_counter} instead of [{!expected_most}at least
{expected_least}][[{?as_range}{expected_least} to ]{expected_most}][{!missing}[{?no_inputs}: one slave delivers no
inputs]])",
    .message = R"({command} of {length} at logical address {logical_address} returned in {frame} with
working counter {working_counter}. Expected [{!expected_most}at least {expected_least}][[{?as_range}{expected_least} to
]{expected_most}][, by the FMMUs of the slaves: {shares}].[{!shares} No slave has an FMMU for this address.])",
    .next = R"([{?outputs_of}Check the AL status of {outputs_of} and the sync manager of its
outputs[ (SM{sync_manager})].][{?inputs_of}Check the AL status of {inputs_of} and the sync manager of its
inputs[ (SM{sync_manager})].][{!outputs_of}[{!inputs_of}[{?missing}Check AL status, power and cable of
{missing}.][{!missing}[{?more_counted}Check which slaves have FMMUs for this address.][{!more_counted}[{?no_inputs}Find
the slave whose inputs never change, and check that its application (processor) runs.][{!no_inputs}Check AL status and
power of the slaves.]]]]])",
    .identity = "command"};
constexpr FindingKind kDropped{
    .name = "process-data-dropped",
    .title = "{command} working counter {working_counter} instead of {before} as before",
    .message = R"({command} of {length} at logical address {address} returned in {frame} with working counter
{working_counter}. Before, it was {before} in {times} from {since_frame} on, and there was no state request since
then.[{!missing} The capture does not show which slave is missing.])",
    .next = "Check AL status, power and cable of [{missing}][{!missing}the slaves].",
    .identity = "command"};
constexpr FindingKind kBroadcast{
    .name = "broadcast",
    .title = "BRD of {register}: {working_counter} of {passed} answer",
    .message =
        R"(The broadcast read of register {register} in {frame} passed {passed}, and every ESC has this register.
But the working counter is {working_counter}. A broadcast does not show which slave did not answer.)",
    .next = "Check which slave does not answer the reads of its own address.",
    .identity = "register"};
constexpr FindingKind kNoAnswer{
    .name = "no-answer",
    .title = "The slave does not answer at its station address {station_address}",
    .message = R"(FPRD of register {register} at station address {station_address} returned in {frame} with
working counter 0, although a slave answered there [in {answered_frame}][{!answered_frame}before]. The slave lost power, its
link, or its address. A restart clears the address.)",
    .next = "Check the power of the slave and the cable to it."};
constexpr FindingKind kSeveralAnswer{
    .name = "several-answer",
    .title = "{working_counter} slaves answer at station address {station_address}",
    .message =
        R"(FPRD of register {register} returned in {frame} with working counter {working_counter} instead of 1. So
{working_counter} slaves have station address {station_address}, and their data are mixed.)",
    .next = "Give each slave an address of its own."};
constexpr FindingKind kNoSlaveThere{
    .name = "no-slave",
    .title = "No slave answers at station address {station_address}",
    .message =
        R"([{?assigned}The master accesses station address {station_address} {accesses} from {frame} to {last_frame},
first register {register}, and the working counter is always 0. It assigned other addresses in the capture, but not this
one.][{!assigned}FPRD of register {register} at station address {station_address} returned with working counter 0
from {frame} to {last_frame}. Other slaves answered at their addresses. The capture begins after the start-up, so the master
found this slave before. It has lost power, its link or its address since then.])",
    .next =
        "[{?assigned}Compare the station addresses in the configuration of the master with those that it assigns "
        "(0x0010).][{!assigned}Check the power of this slave and the cable to it.]",
    .identity = "station_address"};
constexpr const FindingKind* kKinds[] = {&kProcessData, &kDropped,       &kBroadcast,
                                         &kNoAnswer,    &kSeveralAnswer, &kNoSlaveThere};

constexpr NoteKind kLeftTheBus{.name = "left-the-bus",
                               .text = "The shares of {slaves} are missing. These slaves left the bus."};
constexpr NoteKind kAllAway{
    .name = "do-not-answer",
    .text = "The shares of {slaves} are missing. These slaves do not answer at their station addresses either."};
constexpr NoteKind kMoreCounted{.name = "more-than-have-fmmus",
                                .text = "More slaves took part than have FMMUs for this address."};
constexpr NoteKind kOutputsMissing{.name = "outputs-missing",
                                   .text = "The outputs of {slave} are missing: it does not accept them."};
constexpr NoteKind kInputsMissing{.name = "inputs-missing",
                                  .text = "The inputs of {slave} are missing: it does not deliver them."};
constexpr NoteKind kShareMissing{.name = "share-missing", .text = "The share of {slave} is missing."};
constexpr NoteKind kSeveralFit{.name = "several-fit",
                               .text = R"(The difference of {difference} fits the shares of several
slaves.[{?inputs} One is what a slave counts for its inputs. It does not count while its application has written none.])"};
constexpr NoteKind kFitsSlaveThatLeftState{
    .name = "fits-slave-that-left-state",
    .text = "The difference of {difference} fits the share of {slave}, which left its AL state."};
constexpr NoteKind kOneAway{.name = "one-does-not-answer",
                            .text = "One of them is {slave}, which does not answer at its station address."};
constexpr NoteKind kOneLeft{.name = "one-left-the-bus", .text = "One of them is {slave}, which left the bus."};
constexpr NoteKind kFitsAlone{.name = "fits-alone",
                              .text = "Only {slave} has the share that is missing from all datagrams since {since}."};
constexpr NoteKind kInputsNotRefreshed{
    .name = "inputs-not-refreshed",
    .text = R"(The inputs of {slave} returned unchanged in all of these frames, and those of the other slaves were
refreshed. So {slave} does not take part.)"};
constexpr NoteKind kOneBuffer{
    .name = "one-buffer",
    .text =
        R"([{?several}These sync managers have one buffer: {managers}. Each slave][{!several}{managers} has one buffer. The
slave] counts only if it has [{?inputs}filled][{!inputs}emptied] the buffer.)"};
constexpr const NoteKind* kNotes[] = {&kLeftTheBus,    &kAllAway,      &kMoreCounted, &kOutputsMissing,
                                      &kInputsMissing, &kShareMissing, &kSeveralFit,  &kFitsSlaveThatLeftState,
                                      &kOneAway,       &kOneLeft,      &kFitsAlone,   &kInputsNotRefreshed,
                                      &kOneBuffer};

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
- In a mid-run capture, an address that the master reads for at least half a second and that never answers, while others
  do, is an inferred warning.

- A station address that the master did not assign, though it assigned others, is an error after at least 10 accesses
  in at least 1 s. All return with working counter 0.

## Example
samples/captures/wkc-link-break.pcapng

## What to do
If slaves are named, check their AL status and power. If the number of slaves changed, the cable after the last one that
answers is broken. If a share of 2 is missing from one slave, it did not accept its outputs: their sync manager is off.
)"};

constexpr EscAddress kLastAlwaysThere = 0x0130;  // AL Status

class WkcMismatch final : public Rule {
 public:
  WkcMismatch() : Rule(kInfo) {
    Subscribe<track::LogicalAccess>(&WkcMismatch::On);
    Subscribe<track::Answered>(&WkcMismatch::On, MemoryRange{0, kLastAlwaysThere});
    Subscribe<track::AlRequest>(&WkcMismatch::On);
    Subscribe<track::SlaveFound>(&WkcMismatch::On, Stage::kAfterModel);
    Subscribe<track::AddressAssigned>(&WkcMismatch::On);
  }

  void On(const track::LogicalAccess& e) {
    if (e.assumed || !e.returned.seen()) return;
    if (e.wkc > 0) numbering_ = false;
    const model::LogicalExpectation& expected = context().bus().Expect(e);
    const model::CounterRange range = context().bus().RangeFor(expected, e.command);
    const bool all_known = expected.complete || WasRight(e);
    // A slave that has an FMMU counts, whatever others have. Only the maximum is unknown.
    if (!all_known) AddNotAllKnown(e);
    if (!all_known && (e.wkc >= range.least || !HeldAtLeast(e, range.least))) return EvaluateByHabit(e, range);
    if (e.wkc >= range.least && e.wkc <= range.most) {
      if (range.least < range.most) EvaluateUnconfirmed(e, expected, range);
      return;
    }
    // Without outbound frames the missing ones are unknown. If no slave has an FMMU at all, none can count: their
    // set-up is not in the capture, although no gap shows.
    const bus::PairingStatistics& pairing = context().pairing();
    const bool of_no_slave = range.most == 0 && !AnyMapped();
    // A frame that is still in flight when this one returned may turn out to be lost.
    const bool open = pairing.in_flight > 0;
    const bool missed = MissesAny(pairing) || context().network().last_gap() != 0;
    if (e.wkc > range.most && (missed || LosesAny(pairing) || open || pairing.paired == 0 || of_no_slave)) {
      if (!more_reported_) {
        more_reported_ = true;
        const bool capture = missed || (!LosesAny(pairing) && !open);
        NotEvaluable(kNoSlave, capture ? ReasonCode::kMissesPackets : ReasonCode::kNeverReturned,
                     capture ? kFmmuWrites : kFmmuWrite, e.frame().number);
      }
      return;
    }
    const std::uint64_t key = Key(e) ^ static_cast<std::uint64_t>(e.wkc) << 48U;
    WatchInputs(key, expected, e);
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
    if (Value shares = SharesOf(expected, e.command); !shares.items().empty()) finding.Set("shares", std::move(shares));
    if (all_known) {
      AddOneBuffers(finding, expected, true);
      AddOneBuffers(finding, expected, false);
    }
    const FindingIndex index = Report(key, std::move(finding));
    AddSubject(index, expected, e, range.most);
    if (index != kNoFinding && all_known && AreInputs(e, range.most - e.wkc)) {
      context().store[index].Set("no_inputs", arg::Flag());
    }
    for (Episode& episode : episodes_) {
      if (episode.key != key) continue;
      episode.finding = index;
      // A slave whose FMMUs are unknown may have counted instead of another one.
      if (!all_known) continue;
      episode.only_candidate = OnlyCandidate(expected, e, range);
      episode.hint = HintOf(expected, e, range);
      episode.missing = range.most - e.wkc;
    }
  }

  void On(const track::Answered& e) {
    if (!e.returned.seen()) return;  // there is no answer to evaluate
    if (wire::IsBroadcast(e.command)) {
      EvaluateBroadcastRead(e);
    } else {
      EvaluateAddressedRead(e);
      AddUnassigned(e);
    }
  }

  // A change of states or of the mapping ends the habit.
  void On(const track::AlRequest& e) {
    ForgetHabits();
    if (!e.broadcast) numbering_ = false;
  }
  void On(const track::AddressAssigned&) {
    numbering_ = assigned_ = true;
    unassigned_.clear();
  }
  void On(const track::SlaveFound&) { ForgetHabits(); }

  void Finish() override {
    if (NotEvaluableWithoutReturns()) return;
    for (const auto& [station, reads] : unanswered_) ReportNoSlave(station, reads);
    for (const auto& [station, accesses] : unassigned_) ReportUnassigned(station, accesses);
    for (const Episode& episode : episodes_) NameMissing(episode);
    NameDropped();
    // The missing share of a slave that left the bus or its state is a consequence of that.
    std::vector<Finding>& findings = context().store.findings();
    for (Finding& own : findings) {
      if (own.rule != kInfo.id || own.caused_by != kNoFinding) continue;
      FindingIndex best = kNoFinding;
      for (std::size_t i = 0; i < findings.size(); ++i) {
        const Finding& f = findings[i];
        const bool left_state = f.rule == "al-unexpected-change";
        if (!left_state && f.rule != "bus-slave-count-changed" && f.rule != "bus-link-errors" &&
            f.rule != "bus-duplicate-address" && !(IsAway(f) && !IsAway(own))) {
          continue;
        }
        if (f.first.number > own.last.number + kAbout || f.last.number + 20 < own.first.number) continue;
        // It was away, and answers again when its lower state is read: then its absence is the cause.
        if (left_state && IsAway(own) && f.first.number > own.last.number) continue;
        if (own.slave != kNoSlave && f.slave != kNoSlave && f.slave != own.slave) continue;
        if (!MayHaveBegunBefore(f, own)) continue;
        if (best == kNoFinding || Distance(f, own) < Distance(findings[best], own)) best = static_cast<FindingIndex>(i);
      }
      own.caused_by = best != kNoFinding ? best : EndOfTheBusBefore(own);
      if (best != kNoFinding) AddWhoLeftItsState(own, findings[best]);
      if (own.caused_by == kNoFinding) own.caused_by = SameDropBefore(own);
    }
  }

 private:
  /// A datagram that a finding is about, and the slaves that have a part in it.
  struct Subject {
    FindingIndex finding = kNoFinding;
    std::uint64_t key = 0;
    int missing = 0;  ///< of the working counter; 0: not known
    struct Part {
      SlaveId slave = kNoSlave;
      int worth = 0;
    };
    std::vector<Part> parts;
    bool all_parts = false;  ///< they explain the working counter before exactly
  };
  static constexpr std::size_t kMaxSubjects = 64;

  /// One kind of mismatch: which slaves' inputs were refreshed while it lasted.
  struct Episode {
    std::uint64_t key = 0;
    FindingIndex finding = kNoFinding;
    SlaveId only_candidate = kNoSlave;
    std::optional<Note> hint;
    std::uint64_t frames = 0;
    struct Watched {
      SlaveId slave = kNoSlave;
      std::uint64_t refreshed = 0;  ///< frames in which the inputs differ from what the master sent there
      int worth = 0;                ///< what it adds to the working counter
    };
    int missing = 0;
    std::vector<Watched> slaves;
  };
  static constexpr std::size_t kMaxEpisodes = 32;
  static constexpr FrameNo kAbout = 2000;  ///< a finding this number of frames later may have the same cause

  /// What shows after the effect is its cause only if it may have begun before it, lasted until it showed, and is about
  /// a slave with a part in the datagram.
  [[nodiscard]] bool MayHaveBegunBefore(const Finding& cause, const Finding& own) const {
    if (cause.first.number <= own.first.number) return true;
    const FrameNo well_before = BegunBy(cause);
    if (well_before < cause.first.number && well_before > own.first.number) return false;
    const Subject* subject = SubjectOf(own);
    if (subject == nullptr || cause.slave == kNoSlave) return true;
    const auto& parts = subject->parts;
    const bool has_part =
        std::any_of(parts.begin(), parts.end(), [&](const auto& p) { return p.slave == cause.slave; });
    if (subject->all_parts && !has_part) return false;
    // The counter changed once more before the cause showed: that change is the effect.
    return std::none_of(subjects_.begin(), subjects_.end(), [&](const Subject& other) {
      if (other.key != subject->key || other.finding == subject->finding) return false;
      const FrameNo first = context().store[other.finding].first.number;
      return own.last.number < first && first <= cause.first.number;
    });
  }

  [[nodiscard]] const Subject* SubjectOf(const Finding& own) const {
    const auto found = std::find_if(subjects_.begin(), subjects_.end(),
                                    [&](const Subject& subject) { return &context().store[subject.finding] == &own; });
    return found != subjects_.end() ? &*found : nullptr;
  }

  /// The same slave is missing from another datagram since the same frame.
  [[nodiscard]] FindingIndex SameDropBefore(const Finding& own) const {
    if (own.kind != &kDropped || own.slave == kNoSlave) return kNoFinding;
    for (const Subject& other : subjects_) {
      const Finding& finding = context().store[other.finding];
      if (&finding == &own) break;
      if (finding.kind == &kDropped && finding.slave == own.slave && finding.first.number == own.first.number) {
        return other.finding;
      }
    }
    return kNoFinding;
  }

  /// Drops of several datagrams in one frame are those of one slave if only one has all shares that are missing.
  void NameDropped() {
    for (const Subject& subject : subjects_) {
      Finding& finding = context().store[subject.finding];
      if (finding.kind != &kDropped || finding.slave != kNoSlave || !subject.all_parts) continue;
      SlaveId only = kNoSlave;
      std::size_t fitting = 0;
      for (const auto& part : subject.parts) {
        if (!FitsAllSince(part.slave, finding.first.number)) continue;
        only = part.slave;
        ++fitting;
      }
      if (fitting != 1) continue;
      for (const Subject& other : subjects_) {
        Finding& same = context().store[other.finding];
        if (same.kind != &kDropped || same.first.number != finding.first.number) continue;
        same.slave = only;
        same.Set("missing", SlaveValue(only));
        same.Add(kFitsAlone, {{"slave", SlaveValue(only)}, {"since", arg::Frame(finding.first.number)}});
        if (same.count >= kTimesUntilRight) context().store.Regrade(other.finding, Severity::kError);
      }
    }
  }

  [[nodiscard]] bool FitsAllSince(SlaveId slave, FrameNo first) const {
    return std::all_of(subjects_.begin(), subjects_.end(), [&](const Subject& subject) {
      const Finding& finding = context().store[subject.finding];
      if (finding.kind != &kDropped || finding.first.number != first) return true;
      return subject.all_parts && std::any_of(subject.parts.begin(), subject.parts.end(), [&](const auto& part) {
               return part.slave == slave && part.worth == subject.missing;
             });
    });
  }

  void AddSubject(FindingIndex finding, const model::LogicalExpectation& expected, const track::LogicalAccess& e,
                  int before) {
    if (finding == kNoFinding || subjects_.size() >= kMaxSubjects) return;
    Subject subject{finding, Key(e), before - int{e.wkc}, {}, false};
    int all = 0;
    for (const model::LogicalShare& share : expected.shares) {
      const int worth = model::WorthOf(share, e.command);
      if (worth == 0) continue;
      subject.parts.push_back({share.slave, worth});
      all += worth;
    }
    subject.all_parts = all > 0 && all == before;
    subjects_.push_back(std::move(subject));
  }

  /// If several shares fit, that of the slave which left its state is missing.
  void AddWhoLeftItsState(Finding& own, Finding& cause) const {
    const auto several =
        std::find_if(own.notes.begin(), own.notes.end(), [](const Note& note) { return note.kind == &kSeveralFit; });
    if (cause.rule != "al-unexpected-change" || cause.slave == kNoSlave || several == own.notes.end()) return;
    for (const Episode& episode : episodes_) {
      if (episode.finding == kNoFinding || &context().store[episode.finding] != &own) continue;
      const bool fits = std::any_of(episode.slaves.begin(), episode.slaves.end(), [&](const Episode::Watched& w) {
        return w.slave == cause.slave && w.worth >= episode.missing;
      });
      if (!fits) continue;
      several->kind = &kFitsSlaveThatLeftState;
      several->arguments.Set("slave", SlaveValue(cause.slave));
      if (own.first.number < cause.first.number) {
        cause.Add(kWorkingCounterMissing, {{"since", arg::Frame(own.first.number)}});
        AddRelated(cause, own.first.number);
      }
      return;
    }
  }

  /// A slave that does not answer any more at its own address.
  static bool IsAway(const Finding& f) { return f.kind == &kNoAnswer; }

  /// The last change of the number of slaves before, if the bus ended before this slave since then, or a branch left
  /// that may include it.
  [[nodiscard]] FindingIndex EndOfTheBusBefore(const Finding& own) const {
    if (own.slave == kNoSlave) return kNoFinding;
    const SlavePos* position = context().network().slaves()[own.slave].position.if_known();
    const std::vector<Finding>& findings = context().store.findings();
    FindingIndex found = kNoFinding;
    FrameNo latest = 0;
    for (std::size_t i = 0; position != nullptr && i < findings.size(); ++i) {
      const Finding& f = findings[i];
      if (f.rule != "bus-slave-count-changed" || f.first.number > own.first.number || f.first.number < latest) continue;
      latest = f.first.number;
      const std::optional<std::int64_t> end = SlavesNow(f);
      found = end && (*position >= *end || IsOfABranch(f)) ? static_cast<FindingIndex>(i) : kNoFinding;
    }
    return found;
  }

  static std::optional<std::int64_t> SlavesNow(const Finding& changed) {
    const Value* now = changed.arguments.Find("slaves_now");
    return now == nullptr ? std::nullopt : std::optional(now->number);
  }

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

  /// Working counters of one kind of datagram while its expectation is unknown.
  struct Habit {
    std::uint64_t key = 0;
    std::uint16_t wkc = 0;
    std::uint32_t times = 0;
    FrameNo since = 0;
    std::optional<std::uint64_t> right_for;  ///< version of the mappings with which the known ones explained it
  };
  /// A value below the one before.
  struct Drop {
    std::uint64_t key = 0;
    std::uint16_t before = 0, wkc = 0;
    std::uint32_t times = 0;  ///< frames that showed `before`
    std::uint64_t count = 0;  ///< frames that show `wkc`
    FrameNo since = 0;        ///< the first that showed `before`
    FrameRef first, last;     ///< that show `wkc`
  };
  static constexpr std::uint32_t kTimesUntilHabit = 200;
  static constexpr std::uint32_t kTimesUntilRight = 20;

  static FrameNo Distance(const Finding& a, const Finding& b) {
    return a.first.number > b.first.number ? a.first.number - b.first.number : b.first.number - a.first.number;
  }
  static std::uint64_t Key(const track::LogicalAccess& e) {
    return static_cast<std::uint64_t>(e.address) << 16U ^ static_cast<std::uint64_t>(e.length) << 4U ^
           static_cast<std::uint64_t>(e.command);
  }

  void WatchInputs(std::uint64_t key, const model::LogicalExpectation& expected, const track::LogicalAccess& e) {
    auto episode = std::find_if(episodes_.begin(), episodes_.end(), [&](const Episode& x) { return x.key == key; });
    if (episode == episodes_.end()) {
      if (episodes_.size() >= kMaxEpisodes) return;
      Episode fresh;
      fresh.key = key;
      for (const model::LogicalShare& share : expected.shares) {
        fresh.slaves.push_back({share.slave, 0, model::WorthOf(share, e.command)});
      }
      episodes_.push_back(std::move(fresh));
      episode = episodes_.end() - 1;
    }
    if (e.sent_data.empty() || episode->slaves.size() != expected.shares.size()) return;
    // In a capture downstream of slaves, the sent frame has their inputs already.
    if (e.sent_wkc != 0) return;
    ++episode->frames;
    for (std::size_t i = 0; i < expected.shares.size(); ++i) {
      const model::LogicalShare& share = expected.shares[i];
      const ByteSpan sent = Slice(e.sent_data, share.input_offset, share.input_bytes);
      const ByteSpan returned = Slice(e.returned_data, share.input_offset, share.input_bytes);
      if (!std::equal(sent.begin(), sent.end(), returned.begin(), returned.end())) ++episode->slaves[i].refreshed;
    }
  }

  /// Adds which slave is missing: by its share, or because its inputs returned unchanged while those of all others were
  /// refreshed.
  void NameMissing(const Episode& episode) const {
    if (episode.finding == kNoFinding) return;
    Finding& finding = context().store[episode.finding];
    const std::vector<SlaveId> left = SlavesThatLeft(episode);
    if (left.size() > 1) return AddSeveralMissing(finding, kLeftTheBus, left);
    const std::vector<SlaveId> away = SlavesAway(episode);
    if (away.size() > 1) return AddSeveralMissing(finding, kAllAway, away);
    AddHint(finding, episode);
    SlaveId missing = episode.only_candidate;
    if (missing == kNoSlave) missing = OnlySilent(episode, finding);
    if (missing == kNoSlave && away.size() == 1) {
      missing = away.front();
      finding.Add(kOneAway, {{"slave", SlaveValue(missing)}});
    } else if (missing == kNoSlave && left.size() == 1) {
      missing = left.front();
      finding.Add(kOneLeft, {{"slave", SlaveValue(missing)}});
    }
    if (missing == kNoSlave) return;
    finding.slave = missing;
    finding.Set("missing", SlaveValue(missing));
  }

  void AddSeveralMissing(Finding& finding, const NoteKind& note, const std::vector<SlaveId>& slaves) const {
    std::vector<Value> labels;
    for (const SlaveId slave : slaves) labels.push_back(SlaveValue(slave));
    Value list = arg::List(std::move(labels));
    finding.Add(note, {{"slaves", list}});
    finding.Set("missing", std::move(list));
  }

  static void AddHint(Finding& finding, const Episode& episode) {
    if (!episode.hint) return;
    finding.notes.push_back(*episode.hint);
    const NoteKind* kind = episode.hint->kind;
    if (kind == &kMoreCounted) finding.Set("more_counted", arg::Flag());
    if (kind != &kOutputsMissing && kind != &kInputsMissing) return;
    finding.Set(kind == &kOutputsMissing ? "outputs_of" : "inputs_of", *episode.hint->arguments.Find("slave"));
    if (const Value* manager = episode.hint->arguments.Find("sync_manager")) finding.Set("sync_manager", *manager);
  }

  /// Adds the only slave whose inputs returned unchanged.
  [[nodiscard]] SlaveId OnlySilent(const Episode& episode, Finding& finding) const {
    SlaveId missing = kNoSlave;
    std::size_t silent = 0;
    for (const Episode::Watched& w : episode.slaves) {
      if (w.refreshed != 0) continue;
      ++silent;
      missing = w.slave;
    }
    if (episode.frames < 3 || silent != 1) return kNoSlave;
    finding.Add(kInputsNotRefreshed, {{"slave", SlaveValue(missing)}});
    finding.confidence = Confidence::kInferred;
    return missing;
  }

  /// Some slaves in the middle have left, not the last ones: a count does not show which.
  static bool IsOfABranch(const Finding& changed) { return changed.arguments.Has("still_answers"); }

  [[nodiscard]] Value SlaveValue(SlaveId slave) const { return arg::Slave(slave, context().Label(slave)); }

  /// The slaves after the place where the bus ends since about then, if exactly their shares are missing. A slave that
  /// still delivers inputs has not left, whatever its position.
  [[nodiscard]] std::vector<SlaveId> SlavesThatLeft(const Episode& episode) const {
    constexpr FrameNo kAtOnce = 20;
    const Finding& own = context().store[episode.finding];
    for (const Finding& f : context().store.findings()) {
      if (f.rule != "bus-slave-count-changed" || Distance(f, own) > kAtOnce) continue;
      const std::optional<std::int64_t> end = SlavesNow(f);
      if (!end || IsOfABranch(f)) continue;
      int worth = 0;
      std::vector<SlaveId> left;
      for (const Episode::Watched& w : episode.slaves) {
        const SlavePos* position = context().network().slaves()[w.slave].position.if_known();
        if (position == nullptr || *position < *end || w.refreshed != 0) continue;
        worth += w.worth;
        left.push_back(w.slave);
      }
      if (worth == episode.missing) return left;
    }
    return {};
  }

  /// Several slaves that stopped answering at about that time, if exactly their shares are missing.
  [[nodiscard]] std::vector<SlaveId> SlavesAway(const Episode& episode) const {
    const Finding& own = context().store[episode.finding];
    int worth = 0;
    std::vector<SlaveId> away;
    for (const Finding& f : context().store.findings()) {
      if (!IsAway(f) || f.first.number > own.last.number + kAbout || f.last.number < own.first.number) continue;
      for (const Episode::Watched& w : episode.slaves) {
        if (w.slave != f.slave) continue;
        worth += w.worth;
        away.push_back(w.slave);
      }
    }
    return worth == episode.missing ? away : std::vector<SlaveId>{};
  }

  void AddNotAllKnown(const track::LogicalAccess& e) {
    if (unknown_reported_) return;
    unknown_reported_ = true;
    NotEvaluable(kNoSlave, ReasonCode::kNotInCapture, what::kFmmusOfAll, e.frame().number);
  }

  /// Exactly the slaves with known FMMUs counted. So other FMMUs map nothing here, until the next request or set-up.
  [[nodiscard]] bool WasRight(const track::LogicalAccess& e) const {
    const Habit& habit = habits_[Key(e) % habits_.size()];
    return habit.key == Key(e) && habit.times >= kTimesUntilRight &&
           habit.right_for == context().network().mapping_version();
  }

  /// They have counted for a while, so the counter is that of the slaves.
  [[nodiscard]] bool HeldAtLeast(const track::LogicalAccess& e, std::uint16_t least) const {
    constexpr std::uint32_t kForAWhile = 3;
    const Habit& habit = habits_[Key(e) % habits_.size()];
    return habit.key == Key(e) && habit.wkc >= least && habit.times >= kForAWhile;
  }

  void ForgetHabits() {
    habits_ = {};
    early_ = {};
  }

  void EvaluateByHabit(const track::LogicalAccess& e, const model::CounterRange& range) {
    const std::uint64_t key = Key(e);
    Habit& habit = habits_[key % habits_.size()];
    if (habit.key != key) {
      habit = {key, e.wkc, 1, e.frame().number, {}};
      return;
    }
    if (e.wkc == habit.wkc) {
      ++habit.times;
      const bool right = range.most > 0 && e.wkc == range.least && e.wkc == range.most;
      habit.right_for = right ? std::optional(context().network().mapping_version()) : std::nullopt;
      SettleEarlyDrop(e, habit);
      return;
    }
    if (e.wkc > habit.wkc || habit.times < kTimesUntilHabit) {
      FollowEarlyDrop(e, habit);
      return;
    }
    const std::uint64_t fold = key ^ static_cast<std::uint64_t>(e.wkc) << 48U;
    if (Repeat(kNoSlave, fold, e.frame()) != kNoFinding) return;
    ReportDrop(e, {key, habit.wkc, e.wkc, habit.times, 1, habit.since, e.frame(), e.frame()});
  }

  /// The AL states of some slaves are not known, so they may count. All of them did for long, and no request came
  /// since.
  void EvaluateUnconfirmed(const track::LogicalAccess& e, const model::LogicalExpectation& expected,
                           const model::CounterRange& range) {
    const std::uint64_t key = Key(e);
    Habit& habit = habits_[key % habits_.size()];
    if (habit.key == key && e.wkc == habit.wkc) {
      ++habit.times;
      return;
    }
    const bool all_counted = habit.key == key && habit.times >= kTimesUntilHabit && habit.wkc == range.most;
    if (!all_counted || e.wkc > habit.wkc || CountsNowAndThen(expected)) {
      habit = {key, e.wkc, 1, e.frame().number, {}};
      return;
    }
    const std::uint64_t fold = key ^ static_cast<std::uint64_t>(e.wkc) << 48U;
    if (Repeat(kNoSlave, fold, e.frame()) != kNoFinding) return;
    ReportDrop(e, {key, habit.wkc, e.wkc, habit.times, 1, habit.since, e.frame(), e.frame()});
  }

  /// A mailbox counts while a message lies in it, and one buffer if it was filled or emptied.
  static bool CountsNowAndThen(const model::LogicalExpectation& expected) {
    return std::any_of(expected.shares.begin(), expected.shares.end(), [](const model::LogicalShare& share) {
      return share.mailbox_only || share.inputs_one_buffer || share.outputs_one_buffer;
    });
  }

  /// A drop within the first frames of a habit. Which of both values is the right one shows only later: the lower one
  /// lasts although no request explains it, or the counter returns to the higher one.
  void FollowEarlyDrop(const track::LogicalAccess& e, Habit& habit) {
    Drop& drop = early_[habit.key % early_.size()];
    const bool open = drop.key == habit.key && drop.count > 0;
    if (e.wkc > habit.wkc) {
      const bool back = open && e.wkc == drop.before && habit.wkc == drop.wkc;
      if (!back) drop = {};
      habit = {habit.key, e.wkc, back ? drop.times + 1 : 1, back ? drop.since : e.frame().number, {}};
      return;
    }
    // The share of inputs alone may be that of a mailbox, which counts only while a message lies in it.
    const bool of_outputs =
        e.command == wire::Command::LWR || (e.command == wire::Command::LRW && habit.wkc > e.wkc + 1);
    const bool held = habit.times >= kTimesUntilRight && of_outputs;
    drop = held ? Drop{habit.key, habit.wkc, e.wkc, habit.times, 1, habit.since, e.frame(), e.frame()} : Drop{};
    habit = {habit.key, e.wkc, 1, e.frame().number, {}};
  }

  /// The counter stays the same.
  void SettleEarlyDrop(const track::LogicalAccess& e, Habit& habit) {
    Drop& drop = early_[habit.key % early_.size()];
    if (drop.key != habit.key || drop.count == 0) return;
    const bool lasts = habit.wkc == drop.wkc;
    if (lasts) {
      ++drop.count;
      drop.last = e.frame();
    }
    if (habit.times < kTimesUntilHabit) return;
    const std::uint64_t fold = drop.key ^ static_cast<std::uint64_t>(drop.wkc) << 48U;
    if (Repeat(kNoSlave, fold, drop.first) == kNoFinding) ReportDrop(e, drop);
    // The higher value is what the slaves count if all take part.
    if (lasts) habit = {habit.key, drop.before, kTimesUntilHabit, drop.since, {}};
    drop = {};
  }

  void ReportDrop(const track::LogicalAccess& e, const Drop& drop) {
    Finding finding = Found(kDropped, kNoSlave, drop.first);
    finding.last = drop.last;
    finding.count = drop.count;
    finding.confidence = Confidence::kInferred;
    finding.Set("command", arg::Text(wire::Name(e.command)))
        .Set("length", arg::Count(e.length, "byte"))
        .Set("address", arg::Hex(e.address, 8))
        .Set("working_counter", arg::Number(drop.wkc))
        .Set("before", arg::Number(drop.before))
        .Set("times", arg::Count(drop.times, "frame"))
        .Set("since_frame", arg::Frame(drop.since));
    AddRelated(finding, drop.since);
    const FindingIndex index =
        Report(drop.key ^ static_cast<std::uint64_t>(drop.wkc) << 48U, Severity::kWarning, std::move(finding));
    if (drop.wkc == e.wkc) AddSubject(index, context().bus().Expect(e), e, drop.before);
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

  /// Reads of registers that every ESC has at a station address where no slave ever answered.
  struct Unanswered {
    FrameRef first, last;
    EscAddress address = 0;
    std::uint64_t accesses = 0;
  };

  /// Accesses to a station address that the master did not assign, after it assigned others.
  void AddUnassigned(const track::Answered& e) {
    constexpr EscAddress kMailboxes = 0x1000;
    const bool configured =
        e.command == wire::Command::FPRD || e.command == wire::Command::FPWR || e.command == wire::Command::FPRW;
    if (!assigned_ || !configured || e.slave != kNoSlave || e.address >= kMailboxes) return;
    if (e.wkc != 0) {
      unassigned_.erase(e.adp);
      return;
    }
    constexpr std::size_t kMost = 64;
    if (unassigned_.size() == kMost && !unassigned_.contains(e.adp)) return;
    Unanswered& accesses = unassigned_[e.adp];
    if (accesses.accesses++ == 0) {
      accesses.first = e.returned;
      accesses.address = e.address;
    }
    accesses.last = e.returned;
  }
  void ReportUnassigned(std::uint16_t station, const Unanswered& accesses) {
    constexpr TimeNs kLong = 1'000'000'000;
    constexpr std::uint64_t kEnough = 10;
    if (accesses.accesses < kEnough || !accesses.first.has_time || !accesses.last.has_time) return;
    if (Elapsed(accesses.first.time, accesses.last.time) < kLong) return;
    Finding finding = Found(kNoSlaveThere, kNoSlave, accesses.first);
    finding.last = accesses.last;
    finding.Set("working_counter", arg::Number(0))
        .Set("expected", arg::Number(1))
        .Set("station_address", arg::Hex(station))
        .Set("register", arg::Hex(accesses.address))
        .Set("accesses", arg::Count(accesses.accesses, "time"))
        .Set("assigned", arg::Flag());
    Report(0x2000000000000000ULL | station, Severity::kError, std::move(finding));
  }

  void AddUnanswered(const track::Answered& e) {
    constexpr std::size_t kMost = 64;
    if (e.wkc != 0 || assigned_ || (unanswered_.size() == kMost && !unanswered_.contains(e.adp))) return;
    Unanswered& reads = unanswered_[e.adp];
    if (!reads.first.seen()) reads = {e.returned, e.returned, e.address};
    reads.last = e.returned;
  }

  /// A master that has set its bus up reads from the slaves that it has found.
  void ReportNoSlave(std::uint16_t station, const Unanswered& reads) {
    constexpr TimeNs kLong = 500'000'000;
    if (assigned_ || !answered_ || !reads.first.has_time || !reads.last.has_time) return;
    if (Elapsed(reads.first.time, reads.last.time) < kLong) return;
    Finding finding = Found(kNoSlaveThere, kNoSlave, reads.first);
    finding.last = reads.last;
    finding.confidence = Confidence::kInferred;
    finding.Set("working_counter", arg::Number(0))
        .Set("expected", arg::Number(1))
        .Set("station_address", arg::Hex(station))
        .Set("register", arg::Hex(reads.address));
    const std::uint64_t key = 0x2000000000000000ULL | station;
    if (Repeat(kNoSlave, key, reads.first) == kNoFinding) Report(key, Severity::kWarning, std::move(finding));
  }

  void EvaluateAddressedRead(const track::Answered& e) {
    if (e.command != wire::Command::FPRD || !EveryEscAnswers(e.address, e.length)) return;
    if (e.slave == kNoSlave) return AddUnanswered(e);
    answered_ = true;
    if (!unanswered_.empty()) unanswered_.erase(e.adp);
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

  /// Registers that no ESC lacks and that can always be read: type to features, station address, DL and AL status.
  static bool EveryEscAnswers(EscAddress address, std::uint16_t length) {
    return length > 0 && (address < 0x000A || address == 0x0010 || address == 0x0110 || address == kLastAlwaysThere);
  }

  /// What each slave counts: "slave 1 (0x1002) 3".
  [[nodiscard]] Value SharesOf(const model::LogicalExpectation& expected, wire::Command command) const {
    std::vector<Value> shares;
    for (const model::LogicalShare& share : expected.shares) {
      shares.push_back(arg::Text(context().Label(share.slave) + " " + std::to_string(model::WorthOf(share, command))));
    }
    return Named(std::move(shares));
  }

  /// The first of them, and the number of the others.
  static Value Named(std::vector<Value> values) {
    constexpr std::size_t kNamed = 6;
    if (values.size() > kNamed) {
      const std::size_t others = values.size() - kNamed;
      values.resize(kNamed);
      values.push_back(arg::Count(others, "other"));
    }
    return arg::List(std::move(values));
  }

  /// Why the expected working counter is a range although all slaves are in OP.
  void AddOneBuffers(Finding& finding, const model::LogicalExpectation& expected, bool inputs) const {
    std::vector<Value> managers;
    for (const model::LogicalShare& share : expected.shares) {
      if (!context().slave(share.slave).al.SettledIn(esc::AlState::OP)) continue;
      const std::optional<std::uint8_t> mailbox = share.mailbox_only ? share.input_manager : std::nullopt;
      const std::optional<std::uint8_t> manager = !inputs                   ? share.outputs_one_buffer
                                                  : share.inputs_one_buffer ? share.inputs_one_buffer
                                                                            : mailbox;
      if (!manager) continue;
      managers.push_back(arg::Text("SM" + std::to_string(*manager) + " of " + context().Label(share.slave)));
    }
    if (managers.empty()) return;
    Arguments arguments{{"several", arg::Flag(managers.size() > 1)}, {"inputs", arg::Flag(inputs)}};
    arguments.Set("managers", Named(std::move(managers)));
    finding.Add(kOneBuffer, std::move(arguments));
  }

  /// The slave whose share is exactly what is missing, when only one is.
  [[nodiscard]] SlaveId OnlyCandidate(const model::LogicalExpectation& expected, const track::LogicalAccess& e,
                                      const model::CounterRange& range) const {
    if (e.wkc >= range.most) return kNoSlave;
    const int missing = range.most - e.wkc;
    SlaveId found = kNoSlave;
    for (const model::LogicalShare& share : expected.shares) {
      const int worth = model::WorthOf(share, e.command);
      const bool fits =
          worth == missing || (e.command == wire::Command::LRW && share.inputs && share.outputs && missing < worth);
      if (!fits) continue;
      if (found != kNoSlave) return kNoSlave;
      found = share.slave;
    }
    return found;
  }

  /// One is what a slave counts for inputs; for outputs it counts two.
  static bool AreInputs(const track::LogicalAccess& e, int missing) {
    return e.command == wire::Command::LRW && missing == 1;
  }

  [[nodiscard]] Note HintOf(const model::LogicalExpectation& expected, const track::LogicalAccess& e,
                            const model::CounterRange& range) const {
    if (e.wkc > range.most) return {&kMoreCounted, {}};
    const int missing = range.most - e.wkc;
    const SlaveId one = OnlyCandidate(expected, e, range);
    if (one == kNoSlave) {
      Note note{&kSeveralFit, {{"difference", arg::Number(missing)}}};
      if (AreInputs(e, missing)) note.arguments.Set("inputs", arg::Flag());
      return note;
    }
    for (const model::LogicalShare& share : expected.shares) {
      if (share.slave != one || model::WorthOf(share, e.command) == missing) continue;
      Note note{missing == 2 ? &kOutputsMissing : &kInputsMissing, {{"slave", SlaveValue(one)}}};
      const std::optional<std::uint8_t> manager = missing == 2 ? share.output_manager : share.input_manager;
      if (manager) note.arguments.Set("sync_manager", arg::Number(*manager));
      return note;
    }
    return {&kShareMissing, {{"slave", SlaveValue(one)}}};
  }

  std::vector<Episode> episodes_;
  std::vector<Subject> subjects_;
  std::vector<FrameNo> last_answers_;  ///< of each slave, at its station address
  std::array<Habit, 32> habits_{};
  std::array<Drop, 32> early_{};  // not settled yet
  bool unknown_reported_ = false;
  bool more_reported_ = false;
  std::uint64_t mapped_version_ = 0;
  bool any_mapped_ = false;
  std::map<std::uint16_t, Unanswered> unanswered_, unassigned_;
  bool answered_ = false;   ///< a slave answered at its own address
  bool assigned_ = false;   ///< station addresses were assigned in the capture
  bool numbering_ = false;  ///< station addresses were assigned and not used yet
};

const RuleRegistration kRegistration{kInfo, MakeRule<WkcMismatch>};

}  // namespace
}  // namespace ecaudit::wkc_mismatch
