#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/bus_model.h"
#include "decoder/base/text.h"
#include "decoder/base/time.h"
#include "decoder/pipeline.h"
#include "decoder/track/events.h"

namespace ecaudit::wkc_mismatch {
namespace {

constexpr RuleInfo kInfo{.id = "wkc-mismatch",
                         .group = "Frame and bus",
                         .severity = Severity::kError,
                         .title = "The working counter is not what the slaves should have counted",
                         .needs = "returned frames; for logical datagrams the FMMUs and AL states of all slaves",
                         .source = "ETG1000.4, working counter",
                         .doc = R"(
## What it checks
Logical datagrams: each slave whose FMMUs overlap adds 1 when it is read and 2 when it is written (LRW; 1 each for LRD
and LWR). Configured address: a register that every ESC has must be answered. Broadcast reads of such registers: every
slave that the position counter shows must count.

## Why it matters
A slave that does not count has not taken its set points or not given its actual values in that cycle.

## How it is decided
Slaves settled in OP must count in full; slaves in another state, or with a request under way, may. Outside that range
the rule fires and names the slaves whose share is missing where that is unambiguous. When FMMUs were not seen (the
capture starts in operation, or between two that are set) those that were have to count all the same; above that the
value that was constant before serves as expectation: a drop below it, without any state request or configuration in
between, is reported as inferred warning. An FMMU that was not seen is known to map nothing where its activate byte
was, where the ESC has no such FMMU (0x0004), where the capture shows the set-up of the slave from its address or INIT
on, and where for a while all others counted and nobody else. Refusals that are normal (mailbox empty or full,
registers an ESC does not implement, a second AL Control write) are not judged, nor addresses that two slaves share for
a moment while the master gives them out anew. Nor is a counter above what the FMMUs explain where the capture misses
packets or frames never came back: one of them may have set another FMMU; nor any where no slave has an FMMU. Where a
capture begins behind the start-up, an address that is asked for half a second or longer and never answers, while others
do, is an inferred warning.

## Example
samples/captures/wkc-link-break.pcapng

## What to do
If slaves are named, look at their AL status and power. If the number of slaves changed, the cable behind the last one
that answers is broken. A share of 2 missing from one slave means its outputs were not taken: their sync manager is off.
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
    // Who has an FMMU counts, whatever others have: how many may count at most is what is not known.
    if (!all_known) SayNotAllKnown(e);
    if (!all_known && (e.wkc >= range.least || !HeldAtLeast(e, range.least))) return JudgeByHabit(e, range);
    if (e.wkc >= range.least && e.wkc <= range.most) return;
    // Without outbound frames nothing shows what is missing. Where no slave has an FMMU at all none can count: how they
    // were set is not in the capture, though no gap shows.
    const bus::PairingStatistics& pairing = context().pairing();
    const bool nobodys = range.most == 0 && !AnyMapped();
    // A frame that is under way still, when this one is back, may turn out to be lost.
    const bool open = pairing.in_flight > 0;
    const bool missed = MissesAny(pairing) || context().network().last_gap() != 0;
    if (e.wkc > range.most && (missed || LosesAny(pairing) || open || pairing.paired == 0 || nobodys)) {
      if (!said_more_) {
        said_more_ = true;
        NotEvaluable(kNoSlave,
                     std::string("more slaves take part than have FMMUs, which may have been set in frames that ") +
                         (missed || (!LosesAny(pairing) && !open) ? "the capture misses" : "did not come back"),
                     e.frame().number);
      }
      return;
    }
    const std::uint64_t key = Key(e) ^ static_cast<std::uint64_t>(e.wkc) << 48U;
    WatchInputs(key, expected, e);
    if (Repeat(kNoSlave, key, e.frame()) != kNoFinding) return;
    Finding finding;
    finding.first = e.frame();
    finding.title = std::string(wire::Name(e.command)) + " working counter " + std::to_string(e.wkc) + " instead of " +
                    Expected(range, all_known);
    finding.message = std::string(wire::Name(e.command)) + " of " + Count(e.length, "byte") + " at logical address " +
                      Hex(e.address, 8) + " came back with working counter " + std::to_string(e.wkc) + "; expected " +
                      (all_known ? std::to_string(range.most) : "at least " + std::to_string(range.least)) + " from " +
                      Shares(expected, e.command) + ". ";
    finding.evidence.push_back(Number("working_counter", e.wkc));
    finding.evidence.push_back(Number("expected_least", range.least));
    if (all_known) finding.evidence.push_back(Number("expected_most", range.most));
    finding.evidence.push_back(HexNumber("logical_address", e.address));
    const FindingIndex index = Report(key, std::move(finding));
    for (Episode& episode : episodes_) {
      if (episode.key != key) continue;
      episode.finding = index;
      // Whose FMMUs are not known may have counted in the place of somebody.
      if (!all_known) continue;
      episode.only_candidate = OnlyCandidate(expected, e, range);
      episode.hint = Missing(expected, e, range);
      episode.missing = range.most - e.wkc;
    }
  }

  void On(const track::Answered& e) {
    if (!e.returned.seen()) return;  // there is no answer to judge
    if (wire::IsBroadcast(e.command)) {
      JudgeBroadcastRead(e);
    } else {
      JudgeAddressedRead(e);
    }
  }

  // Whatever changes states or the mapping ends the habit.
  void On(const track::AlRequest& e) {
    habits_ = {};
    if (!e.broadcast) numbering_ = false;
  }
  void On(const track::AddressAssigned&) { numbering_ = assigned_ = true; }
  void On(const track::SlaveFound&) { habits_ = {}; }

  void Finish() override {
    if (NotEvaluableWithoutReturns()) return;
    for (const auto& [station, reads] : unanswered_) TellNobody(station, reads);
    for (const Episode& episode : episodes_) NameMissing(episode);
    // What a slave that left the bus or its state does not count any more is a consequence of that.
    std::vector<Finding>& findings = context().store.findings();
    for (Finding& own : findings) {
      if (own.rule != kInfo.id || own.caused_by != kNoFinding) continue;
      FindingIndex best = kNoFinding;
      for (std::size_t i = 0; i < findings.size(); ++i) {
        const Finding& f = findings[i];
        const bool fell = f.rule == "al-unexpected-change";
        if (!fell && f.rule != "bus-slave-count-changed" && f.rule != "bus-link-errors" &&
            f.rule != "bus-duplicate-address" && !(IsAway(f) && !IsAway(own))) {
          continue;
        }
        if (f.first.number > own.last.number + kAbout || f.last.number + 20 < own.first.number) continue;
        // It was away and answers again when it is seen to have fallen: being away is the cause then.
        if (fell && IsAway(own) && f.first.number > own.last.number) continue;
        if (own.slave != kNoSlave && f.slave != kNoSlave && f.slave != own.slave) continue;
        if (best == kNoFinding || Distance(f, own) < Distance(findings[best], own)) best = static_cast<FindingIndex>(i);
      }
      own.caused_by = best != kNoFinding ? best : EndOfTheBusBefore(own);
      if (best != kNoFinding) SayWhoFell(own, findings[best]);
    }
  }

 private:
  /// One kind of mismatch: which slaves' inputs were refreshed while it lasted.
  struct Episode {
    std::uint64_t key = 0;
    FindingIndex finding = kNoFinding;
    SlaveId only_candidate = kNoSlave;
    std::string hint;
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
  static constexpr FrameNo kAbout = 2000;  ///< what is seen so many frames later may be the same matter

  static constexpr std::string_view kSeveralFit = " missing; the shares of several slaves fit.";

  /// Of several shares that fit, that of the slave which left its state is missing.
  void SayWhoFell(Finding& own, Finding& cause) const {
    const std::size_t at = own.message.find(kSeveralFit);
    if (cause.rule != "al-unexpected-change" || cause.slave == kNoSlave || at == std::string::npos) return;
    for (const Episode& episode : episodes_) {
      if (episode.finding == kNoFinding || &context().store[episode.finding] != &own) continue;
      const bool fits = std::any_of(episode.slaves.begin(), episode.slaves.end(), [&](const Episode::Watched& w) {
        return w.slave == cause.slave && w.worth >= episode.missing;
      });
      if (!fits) continue;
      own.message.replace(at, kSeveralFit.size(),
                          " missing: it fits what " + context().Label(cause.slave) + " counts, which left its state.");
      if (own.first.number < cause.first.number) {
        cause.message += " Its working counter is missing from frame " + std::to_string(own.first.number) + " on.";
        AddRelated(cause, own.first.number);
      }
      return;
    }
  }

  /// A slave that does not answer any more at its own address.
  static bool IsAway(const Finding& f) {
    if (f.rule != kInfo.id || f.slave == kNoSlave) return false;
    bool none = false;
    bool at_address = false;
    for (const Evidence& evidence : f.evidence) {
      const auto* number = std::get_if<std::int64_t>(&evidence.value);
      none = none || (evidence.name == "working_counter" && number != nullptr && *number == 0);
      at_address = at_address || evidence.name == "station_address";
    }
    return none && at_address;
  }

  /// The last change of the number of slaves before, if the bus ended in front of this slave since then, or a branch
  /// left that it may be of.
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
    for (const Evidence& evidence : changed.evidence) {
      if (const auto* now = std::get_if<std::int64_t>(&evidence.value); now && evidence.name == "slaves_now")
        return *now;
    }
    return std::nullopt;
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

  /// Working counters of one kind of datagram while its expectation is not known.
  struct Habit {
    std::uint64_t key = 0;
    std::uint16_t wkc = 0;
    std::uint32_t times = 0;
    FrameNo since = 0;
    std::optional<std::uint64_t> right_for;  ///< version of the mappings with which it was just what those known count
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
    // Captured behind slaves, what was sent holds their inputs already.
    if (e.sent_wkc != 0) return;
    ++episode->frames;
    for (std::size_t i = 0; i < expected.shares.size(); ++i) {
      const model::LogicalShare& share = expected.shares[i];
      const ByteSpan sent = Slice(e.sent_data, share.input_offset, share.input_bytes);
      const ByteSpan returned = Slice(e.returned_data, share.input_offset, share.input_bytes);
      if (!std::equal(sent.begin(), sent.end(), returned.begin(), returned.end())) ++episode->slaves[i].refreshed;
    }
  }

  /// Says which slave is missing: by its share, or because its inputs came back as they were sent while those of all
  /// others were refreshed.
  void NameMissing(const Episode& episode) const {
    if (episode.finding == kNoFinding) return;
    Finding& finding = context().store[episode.finding];
    const std::vector<SlaveId> left = ThoseThatLeft(episode);
    if (left.size() > 1) {
      finding.message += "What is missing is the share of " + LabelsOf(left) + ", which left the bus.";
      finding.evidence.push_back(Text("missing", LabelsOf(left)));
      return;
    }
    const std::vector<SlaveId> away = ThoseAway(episode);
    if (away.size() > 1) {
      finding.message +=
          "What is missing is the share of " + LabelsOf(away) + ", which do not answer at their addresses either.";
      finding.evidence.push_back(Text("missing", LabelsOf(away)));
      return;
    }
    finding.message += episode.hint;
    SlaveId missing = episode.only_candidate;
    if (missing == kNoSlave) missing = OnlySilent(episode, finding);
    if (missing == kNoSlave && away.size() == 1) {
      missing = away.front();
      finding.message += " One of them is that of " + context().Label(missing) + ", which does not answer either.";
    } else if (missing == kNoSlave && left.size() == 1) {
      missing = left.front();
      finding.message += " One of them is that of " + context().Label(missing) + ", which left the bus.";
    }
    if (missing == kNoSlave) return;
    finding.slave = missing;
    finding.evidence.push_back(Text("missing", context().Label(missing)));
  }

  /// The only slave whose inputs came back as they were sent, and says so.
  [[nodiscard]] SlaveId OnlySilent(const Episode& episode, Finding& finding) const {
    SlaveId missing = kNoSlave;
    std::size_t silent = 0;
    for (const Episode::Watched& w : episode.slaves) {
      if (w.refreshed != 0) continue;
      ++silent;
      missing = w.slave;
    }
    if (episode.frames < 3 || silent != 1) return kNoSlave;
    finding.message += " The inputs of " + context().Label(missing) +
                       " came back as the master sent them in all of these frames, those of the other slaves were "
                       "refreshed: it is " +
                       context().Label(missing) +
                       " that does not take part. Look at its power, the cable to it, and its AL status.";
    finding.confidence = Confidence::kInferred;
    return missing;
  }

  /// Not the last slaves have left, but some in the middle: which, a count does not tell.
  static bool IsOfABranch(const Finding& changed) {
    return std::any_of(changed.evidence.begin(), changed.evidence.end(),
                       [](const Evidence& evidence) { return evidence.name == "still_answers"; });
  }

  [[nodiscard]] std::string LabelsOf(const std::vector<SlaveId>& slaves) const {
    std::string names;
    for (const SlaveId slave : slaves) names += (names.empty() ? "" : ", ") + context().Label(slave);
    return names;
  }

  /// The slaves behind the place where the bus ends since about then, where what is missing is just their shares. Who
  /// still gives inputs has not left, wherever it stands.
  [[nodiscard]] std::vector<SlaveId> ThoseThatLeft(const Episode& episode) const {
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

  /// Several slaves that stopped answering at about that time, where what is missing is just their shares.
  [[nodiscard]] std::vector<SlaveId> ThoseAway(const Episode& episode) const {
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

  void SayNotAllKnown(const track::LogicalAccess& e) {
    if (said_unknown_) return;
    said_unknown_ = true;
    NotEvaluable(kNoSlave, "the FMMUs of all slaves are not in the capture; only drops below a constant value are seen",
                 e.frame().number);
  }

  /// All whose FMMUs are known counted, and nobody else: what was not seen maps nothing here, until something is asked
  /// for or set anew.
  [[nodiscard]] bool WasRight(const track::LogicalAccess& e) const {
    const Habit& habit = habits_[Key(e) % habits_.size()];
    return habit.key == Key(e) && habit.times >= kTimesUntilRight &&
           habit.right_for == context().network().mapping_version();
  }

  /// They have counted for a while, so what came back is what the slaves made of it.
  [[nodiscard]] bool HeldAtLeast(const track::LogicalAccess& e, std::uint16_t least) const {
    constexpr std::uint32_t kForAWhile = 3;
    const Habit& habit = habits_[Key(e) % habits_.size()];
    return habit.key == Key(e) && habit.wkc >= least && habit.times >= kForAWhile;
  }

  void JudgeByHabit(const track::LogicalAccess& e, const model::CounterRange& range) {
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
      return;
    }
    if (e.wkc > habit.wkc || habit.times < kTimesUntilHabit) {
      habit = {key, e.wkc, 1, e.frame().number, {}};
      return;
    }
    const std::uint64_t fold = key ^ static_cast<std::uint64_t>(e.wkc) << 48U;
    if (Repeat(kNoSlave, fold, e.frame()) != kNoFinding) return;
    Finding finding;
    finding.first = e.frame();
    finding.confidence = Confidence::kInferred;
    finding.title = std::string(wire::Name(e.command)) + " working counter " + std::to_string(e.wkc) + " instead of " +
                    std::to_string(habit.wkc);
    finding.message =
        std::string(wire::Name(e.command)) + " of " + Count(e.length, "byte") + " at logical address " +
        Hex(e.address, 8) + " came back with working counter " + std::to_string(e.wkc) + "; it was " +
        std::to_string(habit.wkc) + " in " + Count(habit.times, "frame") + " from frame " +
        std::to_string(habit.since) +
        " on, with no state request in between. The FMMUs are not, or no longer, known from the capture, so "
        "which slave is missing cannot be told.";
    finding.evidence.push_back(Number("working_counter", e.wkc));
    finding.evidence.push_back(Number("before", habit.wkc));
    AddRelated(finding, habit.since);
    Report(fold, Severity::kWarning, std::move(finding));
  }

  void JudgeBroadcastRead(const track::Answered& e) {
    if (e.command != wire::Command::BRD || !e.slaves_passed || !EveryEscAnswers(e.address, e.length)) return;
    if (e.wkc == *e.slaves_passed) return;
    const std::uint64_t key = 0x8000000000000000ULL | static_cast<std::uint64_t>(e.address) << 16U | e.wkc;
    if (Repeat(kNoSlave, key, e.returned) != kNoFinding) return;
    Finding finding;
    finding.first = e.returned;
    finding.title = "BRD of " + Hex(e.address) + ": " + std::to_string(e.wkc) + " of " +
                    Count(*e.slaves_passed, "slave") + " answer";
    finding.message = "The broadcast read of register " + Hex(e.address) + ", which every ESC has, passed " +
                      Count(*e.slaves_passed, "slave") + " but the working counter is " + std::to_string(e.wkc) +
                      ". A broadcast cannot show which slave did not answer; look for one that misses its own reads.";
    finding.evidence.push_back(Number("working_counter", e.wkc));
    finding.evidence.push_back(Number("expected", *e.slaves_passed));
    Report(key, std::move(finding));
  }

  /// Reads of registers that every ESC has at a station address where no slave was ever met.
  struct Unanswered {
    FrameRef first, last;
    EscAddress address = 0;
  };

  void NoteUnanswered(const track::Answered& e) {
    constexpr std::size_t kMost = 64;
    if (e.wkc != 0 || assigned_ || (unanswered_.size() == kMost && !unanswered_.contains(e.adp))) return;
    Unanswered& reads = unanswered_[e.adp];
    if (!reads.first.seen()) reads = {e.returned, e.returned, e.address};
    reads.last = e.returned;
  }

  /// A master that has set its bus up asks those whom it has found.
  void TellNobody(std::uint16_t station, const Unanswered& reads) {
    constexpr TimeNs kLong = 500'000'000;
    if (assigned_ || !answered_ || !reads.first.has_time || !reads.last.has_time) return;
    if (Elapsed(reads.first.time, reads.last.time) < kLong) return;
    Finding finding;
    finding.first = reads.first;
    finding.last = reads.last;
    finding.confidence = Confidence::kInferred;
    finding.title = "Nobody answers at station address " + Hex(station);
    finding.message = "FPRD of register " + Hex(reads.address) + " at station address " + Hex(station) +
                      " comes back with working counter 0 from frame " + std::to_string(reads.first.number) +
                      " to frame " + std::to_string(reads.last.number) +
                      ", while other slaves answer at theirs. The capture begins behind the start-up: the "
                      "master asks for a slave that it has found, and that has lost power, link or its address since.";
    finding.evidence.push_back(Number("working_counter", 0));
    finding.evidence.push_back(Number("expected", 1));
    finding.evidence.push_back(HexNumber("station_address", station));
    const std::uint64_t key = 0x2000000000000000ULL | station;
    if (Repeat(kNoSlave, key, reads.first) == kNoFinding) Report(key, Severity::kWarning, std::move(finding));
  }

  void JudgeAddressedRead(const track::Answered& e) {
    if (e.command != wire::Command::FPRD || !EveryEscAnswers(e.address, e.length)) return;
    if (e.slave == kNoSlave) return NoteUnanswered(e);
    answered_ = true;
    if (!unanswered_.empty()) unanswered_.erase(e.adp);
    if (e.wkc == 1 || (e.wkc > 1 && numbering_)) return;
    const std::uint64_t key = 0x4000000000000000ULL | static_cast<std::uint64_t>(e.wkc);
    if (Repeat(e.slave, key, e.returned) != kNoFinding) return;
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.returned;
    if (e.wkc == 0) {
      finding.title = "Slave does not answer at its station address " + Hex(e.adp);
      finding.message = "FPRD of register " + Hex(e.address) + " at station address " + Hex(e.adp) +
                        " came back with working counter 0 although a slave answered there before. It lost power or "
                        "link, or its address (a restart clears it).";
    } else {
      finding.title = "Several slaves answer at station address " + Hex(e.adp);
      finding.message = "FPRD of register " + Hex(e.address) + " came back with working counter " +
                        std::to_string(e.wkc) +
                        ": that many slaves have this station address, and their data are mixed.";
    }
    finding.evidence.push_back(Number("working_counter", e.wkc));
    finding.evidence.push_back(Number("expected", 1));
    finding.evidence.push_back(HexNumber("station_address", e.adp));
    Report(key, std::move(finding));
  }

  /// Registers that no ESC lacks and that can always be read: type to features, station address, DL and AL status.
  static bool EveryEscAnswers(EscAddress address, std::uint16_t length) {
    return length > 0 && (address < 0x000A || address == 0x0010 || address == 0x0110 || address == kLastAlwaysThere);
  }

  static std::string Expected(const model::CounterRange& range, bool all_known) {
    if (!all_known) return "at least " + std::to_string(range.least);
    if (range.least == range.most) return std::to_string(range.most);
    return std::to_string(range.least) + " to " + std::to_string(range.most);
  }

  static std::string ManagerText(std::optional<std::uint8_t> number, std::string_view otherwise) {
    return (number ? "sync manager " + std::to_string(*number) : std::string(otherwise)) + ".";
  }

  [[nodiscard]] std::string Shares(const model::LogicalExpectation& expected, wire::Command command) const {
    std::string out;
    std::size_t n = 0;
    for (const model::LogicalShare& share : expected.shares) {
      if (n++ == 6) return out + ", ...";
      out += (out.empty() ? "" : ", ") + context().Label(share.slave) + " " +
             std::to_string(model::WorthOf(share, command));
    }
    return out.empty() ? "no slave" : out;
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

  [[nodiscard]] std::string Missing(const model::LogicalExpectation& expected, const track::LogicalAccess& e,
                                    const model::CounterRange& range) const {
    if (e.wkc > range.most) return "More slaves took part than have FMMUs for this address.";
    const int missing = range.most - e.wkc;
    if (const SlaveId one = OnlyCandidate(expected, e, range); one != kNoSlave) {
      for (const model::LogicalShare& share : expected.shares) {
        if (share.slave != one || model::WorthOf(share, e.command) == missing) continue;
        return missing == 2 ? "Missing are the outputs of " + context().Label(one) +
                                  ": it does not take them. Look at its AL status and " +
                                  ManagerText(share.output_manager, "the sync manager of its outputs")
                            : "Missing are the inputs of " + context().Label(one) +
                                  ": it does not give them. Look at its AL status and " +
                                  ManagerText(share.input_manager, "the sync manager of its inputs");
      }
      return "What is missing is the share of " + context().Label(one) + ": look at its AL status, power and cable.";
    }
    return std::to_string(missing) + std::string(kSeveralFit);
  }

  std::vector<Episode> episodes_;
  std::array<Habit, 32> habits_{};
  bool said_unknown_ = false;
  bool said_more_ = false;
  std::uint64_t mapped_version_ = 0;
  bool any_mapped_ = false;
  std::map<std::uint16_t, Unanswered> unanswered_;
  bool answered_ = false;   ///< a slave did, at its own address
  bool assigned_ = false;   ///< station addresses were given out in the capture
  bool numbering_ = false;  ///< station addresses were given out and not used yet
};

const RuleRegistration kRegistration{kInfo, MakeRule<WkcMismatch>};

}  // namespace
}  // namespace ecaudit::wkc_mismatch
