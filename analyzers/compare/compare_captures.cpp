#include "analyzers/compare/compare_captures.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>
#include <utility>

#include "analyzers/compare/comparison.h"
#include "analyzers/compare/extra_steps.h"
#include "analyzers/compare/slave_matches.h"
#include "analyzers/compare/startup_registers.h"
#include "analyzers/result/further_startups.h"
#include "analyzers/words/step_text.h"
#include "decoder/base/text.h"
#include "decoder/esc/al.h"
#include "decoder/esc/fmmu.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/process/pdo_mapping.h"

namespace ecaudit::diff {
namespace {

using startup::Deviation;
using startup::ExpectedStep;

/// Phases are compared where one takes more than this many times as long, and at least so much longer.
constexpr double kSlower = 2.0;
constexpr TimeNs kAtLeastSlower = 10'000'000;
/// Cycle times are the same within this part.
constexpr double kSameCycle = 0.05;
constexpr std::size_t kListed = 4;
constexpr EscAddress kFirstFmmu = 0x0600;

// Ranks, the most important first: which slaves there are, what they came to, what they exchange, how they are set, how
// the frames look, clocks last.
constexpr int kRankBus = -2;
constexpr int kRankRefused = -1;  ///< only one of them was refused a state
constexpr int kRankOutcome = 0;
constexpr int kRankReason = 1;    ///< a finding of one of them only that explains the rest
constexpr int kRankRelevant = 2;  ///< the AL status code of the refusal is about it
constexpr int kRankSuspect = 3;   ///< a finding cites the step that differs
constexpr int kRankMapping = 4;   ///< sync managers, FMMUs, PDOs
constexpr int kRankStep = 5;
constexpr int kRankFrames = 6;  ///< distributed clocks, and what the cyclic frames hold
constexpr int kRankFinding = 7;
constexpr int kRankEarly = 8;  ///< scan and addressing: masters do it in many ways
constexpr int kRankConsequence = 9;
constexpr int kRankTiming = 10;

std::string ValueOf(const std::string& name, const std::string& text) {
  if (text.empty()) return "done";
  const std::string prefix = name + ": ";
  return text.starts_with(prefix) ? text.substr(prefix.size()) : text;
}

std::string WithNote(const StartupStep& step) {
  std::string text = ValueOf(step.name, step.text);
  if (!step.note.empty()) text = text == "done" ? step.note : text + ", " + step.note;
  return text;
}

template <typename Steps, typename NameOf>
std::string List(const Steps& steps, NameOf&& name_of) {
  std::string list;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (i == kListed && steps.size() > kListed + 1) return list + " and " + Grouped(steps.size() - kListed) + " more";
    list += (i == 0 ? "" : ", ") + name_of(*steps[i]);
  }
  return list;
}

/// Of several steps the first that changes something.
const StartupStep& FirstThatChanges(const std::vector<const StartupStep*>& steps) {
  for (const StartupStep* step : steps) {
    if (step->key.kind != StartupKey::Kind::kUpload && step->key.kind != StartupKey::Kind::kRequest) return *step;
  }
  return *steps.front();
}

/// @param with_drive  false: the other capture cannot show whether the drive was enabled
std::string StateReached(const StartupSummary& startup, bool with_drive) {
  const auto failed = std::ranges::find_if(startup.phases, &StartupPhaseSummary::failed);
  std::string text;
  if (failed != startup.phases.end()) text = failed->result;
  const StartupPhaseSummary* drive = startup.phase(StartupPhase::kDriveEnable);
  const bool enabled = with_drive && drive != nullptr && !drive->result.empty();
  const std::string state = startup.reached == 0 ? "no state seen" : esc::StateName(startup.reached) + " reached";
  if (text.empty()) {
    text = enabled ? state + ", drive enabled" : state;
    for (const StartupStep& step : startup.steps) {
      if (step.key.kind != StartupKey::Kind::kRequest || step.outcome != StartupOutcome::kRefused) continue;
      return text + "; before that the " + startup::StepNoun(step.key, step.name) + " was " + step.note;
    }
    return text;
  }
  return text + "; " + (startup.reached == 0 ? state : "highest state " + esc::StateName(startup.reached));
}

FrameNo FrameOfOutcome(const StartupSummary& startup) {
  for (const StartupStep& step : startup.steps) {
    if (step.key.kind == StartupKey::Kind::kRequest && step.outcome == StartupOutcome::kRefused) {
      return step.last.number;
    }
  }
  return startup.end.number;
}

/// First frame of the last phase that failed; 0 when none did.
FrameNo FailedAt(const StartupSummary& startup) {
  for (const StartupStep& step : startup.steps) {
    if (step.key.kind == StartupKey::Kind::kRequest && step.outcome == StartupOutcome::kRefused) {
      return step.frame.number;
    }
  }
  return 0;
}

std::string MappingText(const PdoSummary& pdo) {
  if (!pdo.bytes) return "not known" + (pdo.reason.empty() ? "" : ": " + pdo.reason);
  std::string text = Count(*pdo.bytes, "byte");
  for (std::size_t i = 0; i < pdo.pdos.size(); ++i) text += (i == 0 ? " in " : ", ") + ObjectName(pdo.pdos[i]);
  std::string objects;
  for (const MappedObject& object : pdo.objects) {
    if (object.index == 0) continue;
    objects += (objects.empty() ? ": " : ", ") + ObjectName(object.index, object.subindex);
  }
  return text + objects;
}

bool SameMapping(const PdoSummary& a, const PdoSummary& b) {
  const auto same = [](const MappedObject& x, const MappedObject& y) {
    return x.pdo == y.pdo && x.index == y.index && x.subindex == y.subindex && x.bits == y.bits;
  };
  return a.bytes == b.bytes && a.pdos == b.pdos && std::ranges::equal(a.objects, b.objects, same);
}

bool IsClock(const StartupKey& key) {
  return key.kind == StartupKey::Kind::kWrite && key.address >= 0x0900 && key.address < 0x0A00;
}

/// A write that reached the slave and changed nothing there: it has no such register, or did not want it.
bool NotTaken(const StartupStep& step) {
  return step.key.kind == StartupKey::Kind::kWrite && step.outcome == StartupOutcome::kRefused;
}

/// "LRW", "2 LRD, LWR": what carries the process data in every cycle.
std::string LayoutText(const BusSummary& bus) {
  std::map<std::string, std::uint64_t> commands;
  for (const CyclicDatagram& datagram : bus.cyclic_datagrams) ++commands[datagram.command];
  std::string text;
  for (const auto& [command, count] : commands) {
    text += (text.empty() ? "" : ", ") + (count > 1 ? Grouped(count) + " " : std::string()) + command;
  }
  return text;
}

std::string SmText(const SyncManagerSummary& manager) {
  return Hex(manager.start) + " " + Count(manager.length, "byte") + ", control " + Hex(manager.control, 2) +
         (manager.enabled ? ", enabled" : ", disabled");
}

/// Whether the capture shows that no slave is at this position but those it holds.
bool ShowsAbsence(const AnalysisResult& result, SlavePos position) {
  const std::optional<std::uint16_t>& count = result.bus.slave_count;
  return count && (position >= *count || result.slaves.size() >= *count);
}

/// Whether the words of a drive can be seen: it must have answered, and what its process data hold must be known.
bool ShowsDrive(const AnalysisResult& result, const SlaveSummary& slave) {
  return slave.drive && (result.capture.returned_frames > 0 || slave.startup.phase(StartupPhase::kDriveEnable));
}

/// Why the capture cannot show such a step of a slave; empty where it can.
std::string WhyHidden(const AnalysisResult& result, const SlaveSummary* slave, const StartupStep& step) {
  if (slave == nullptr) return {};
  if (step.key.kind == StartupKey::Kind::kDrive && !ShowsDrive(result, *slave)) {
    return "commands to the drive: which of its process data is the control word is not known";
  }
  if (slave->startup.steps_left_out > 0 && !slave->startup.steps.empty()) {
    return "all steps of its start-up: " + Grouped(slave->startup.steps_left_out) + " were not kept";
  }
  if (step.phase <= StartupPhase::kEeprom && slave->position_inferred) {
    return "the beginning of its start-up: it has its address already";
  }
  return {};
}

/// "not done", as far as the capture shows it.
std::string NotDone(const StartupStep& step, const StartupSummary& there, bool late) {
  if (step.key.kind == StartupKey::Kind::kRequest && step.key.address == static_cast<unsigned>(esc::AlState::INIT)) {
    return "not for this slave alone";
  }
  return late && !there.ended && FailedAt(there) == 0 ? "not done up to the end of the capture" : "not done";
}

std::string TimesDone(std::size_t times) {
  return times == 1 ? "once" : Grouped(times) + " times";
}

bool IsBlank(const Identity& identity) {
  constexpr std::uint32_t kErased = 0xFFFF'FFFF;
  const auto all = [&](std::uint32_t value) { return identity.vendor_id == value && identity.product_code == value; };
  return all(kErased) || all(0);
}
std::string IdentityText(const Identity& identity) {
  return "vendor " + Hex(identity.vendor_id.value_or(0), 8) + ", product " + Hex(identity.product_code.value_or(0), 8) +
         (IsBlank(identity) ? " (blank)" : "");
}

/// The finding that others of the capture follow from, in the end.
const Finding& RootOf(const AnalysisResult& result, const Finding& finding) {
  const Finding* root = &finding;
  for (std::size_t steps = 0; steps < result.findings.size() && root->caused_by < result.findings.size(); ++steps) {
    root = &result.findings[root->caused_by];
  }
  return *root;
}

bool IsOfFailedRequest(const Finding& finding) {
  return finding.rule == "al-refused" || finding.rule == "al-timeout";
}

class Builder {
 public:
  Builder(const AnalysisResult& a, const AnalysisResult& b, const Knowledge& knowledge)
      : a_(a), b_(b), knowledge_(knowledge) {}

  CaptureDiff Build() {
    MatchSlaves();
    Bus();
    for (std::size_t p = 0; p < out_.pairs.size(); ++p) {
      const SlavePair& pair = out_.pairs[p];
      if (pair.a == nullptr || pair.b == nullptr) continue;
      about_.clear();
      Devices(p);
      Startups(p);
      Mappings(p);
      Timing(p);
    }
    Findings();
    Frames();
    Cycle();
    // What reads alike is none: registers cleared by writes of other lengths, for example.
    std::erase_if(out_.differences, [](const Difference& d) { return d.in_a == d.in_b; });
    for (std::size_t p = 0; p < out_.pairs.size(); ++p) CutStartups(p);
    LeadWithFindings();
    Fold();
    AddUnknownIdentities();
    AddFurther(a_, "A");
    AddFurther(b_, "B");
    std::ranges::stable_sort(out_.differences, [](const Difference& x, const Difference& y) {
      return std::tuple(!x.counts, x.rank, x.place) < std::tuple(!y.counts, y.rank, y.place);
    });
    return std::move(out_);
  }

 private:
  [[nodiscard]] const SlaveNames& names() const { return a_.slave_names; }

  Difference& Add(Area area, int rank, std::optional<std::size_t> pair, std::string what, std::string in_a,
                  std::string in_b) {
    Difference& d = out_.differences.emplace_back();
    d.area = area;
    d.rank = rank;
    if (pair) d.pairs.push_back(*pair);
    d.what = std::move(what);
    d.in_a = std::move(in_a);
    d.in_b = std::move(in_b);
    return d;
  }

  void MatchSlaves() {
    if (a_.bus.slave_count && b_.bus.slave_count && *a_.bus.slave_count != *b_.bus.slave_count) {
      Add(Area::kBus, kRankBus, std::nullopt, "slaves on the bus", Count(*a_.bus.slave_count, "slave"),
          Count(*b_.bus.slave_count, "slave"));
    }
    std::vector<startup::ExpectedSlave> expected;
    for (const SlaveSummary& slave : a_.slaves) {
      startup::ExpectedSlave& e = expected.emplace_back();
      e.position = slave.position;
      e.vendor_id = slave.identity.vendor_id;
      e.product_code = slave.identity.product_code;
    }
    const auto matches = startup::MatchSlaves(expected, b_.slaves);
    std::vector<bool> used(b_.slaves.size(), false);
    for (std::size_t i = 0; i < matches.size(); ++i) {
      SlavePair pair{&a_.slaves[i], nullptr};
      if (matches[i].place) {
        pair.b = &b_.slaves[*matches[i].place];
        used[*matches[i].place] = true;
      }
      if (matches[i].moved) {
        Add(Area::kBus, kRankBus, out_.pairs.size(), "place on the bus", names().Of(pair.a->position),
            names().Of(pair.b->position));
      }
      out_.pairs.push_back(pair);
    }
    MatchBlank(used);
    for (std::size_t i = 0; i < used.size(); ++i) {
      if (!used[i]) out_.pairs.push_back({nullptr, &b_.slaves[i]});
    }
    for (std::size_t p = 0; p < out_.pairs.size(); ++p) {
      const SlavePair& pair = out_.pairs[p];
      if (pair.a != nullptr && pair.b != nullptr) continue;
      const SlaveSummary& met = pair.a != nullptr ? *pair.a : *pair.b;
      if (!ShowsAbsence(pair.a != nullptr ? b_ : a_, met.position)) {
        out_.notes.push_back(names().Of(met.position) + ": met in " + (pair.a != nullptr ? "A" : "B") +
                             " only; which slaves are on the bus " + (pair.a != nullptr ? "B" : "A") +
                             " does not show");
        continue;
      }
      Add(Area::kBus, kRankBus, p, "presence", pair.a != nullptr ? "on the bus" : "not on the bus",
          pair.b != nullptr ? "on the bus" : "not on the bus");
    }
  }

  /// A slave whose EEPROM is blank has no identity: it is the one at its position.
  void MatchBlank(std::vector<bool>& used) {
    for (std::size_t p = 0; p < out_.pairs.size(); ++p) {
      if (out_.pairs[p].b != nullptr) continue;
      const SlaveSummary& a = *out_.pairs[p].a;
      for (std::size_t i = 0; i < used.size(); ++i) {
        const SlaveSummary& b = b_.slaves[i];
        if (used[i] || a.position != b.position || IsBlank(a.identity) == IsBlank(b.identity)) continue;
        out_.pairs[p].b = &b;
        used[i] = true;
        Add(Area::kBus, kRankBus, p, "identity in the EEPROM", IdentityText(a.identity), IdentityText(b.identity));
        break;
      }
    }
  }

  void Bus() {
    const StartupSummary& a = a_.bus.startup;
    const StartupSummary& b = b_.bus.startup;
    if (a.steps.empty() != b.steps.empty()) {
      out_.notes.push_back(std::string(a.steps.empty() ? "A" : "B") +
                           " holds nothing that was sent to all slaves at once, so that is not compared");
      return;
    }
    Steps(std::nullopt, a, b);
  }

  void Devices(std::size_t p) {
    const Identity& a = out_.pairs[p].a->identity;
    const Identity& b = out_.pairs[p].b->identity;
    const bool known_a = a.product_code.has_value();
    const bool known_b = b.product_code.has_value();
    if (!known_a || !known_b) unidentified_[known_a ? "B" : known_b ? "A" : "both"].insert(out_.pairs[p].a->position);
    if (a.revision && b.revision && *a.revision != *b.revision) {
      Add(Area::kBus, kRankBus, p, "revision of the device", Hex(*a.revision, 8), Hex(*b.revision, 8));
    }
    if (a.serial && b.serial && *a.serial != *b.serial) {
      Add(Area::kBus, kRankTiming, p, "serial number of the device", std::to_string(*a.serial),
          std::to_string(*b.serial))
          .counts = false;
    }
  }

  /// Such slaves are matched by their position only.
  void AddUnknownIdentities() {
    for (const auto& [where, positions] : unidentified_) {
      out_.notes.push_back(names().List(positions, positions.size()) + ": the identity is not in " +
                           (where == "both" ? "either capture" : where) + ", so matched by position");
    }
  }

  /// Only one start-up of each slave is kept.
  void AddFurther(const AnalysisResult& result, const std::string& which) {
    if (const FrameNo next = startup::NextStartup(result); next != 0) {
      out_.notes.push_back(which + " starts slaves again from frame " + std::to_string(next) +
                           " on; what is before is compared, that start-up is not");
    }
  }

  static bool ShowsStartup(const StartupSummary& startup) {
    return std::ranges::any_of(startup.steps,
                               [](const StartupStep& step) { return step.key.kind == StartupKey::Kind::kRequest; });
  }

  void Startups(std::size_t p) {
    const SlavePair& pair = out_.pairs[p];
    const StartupSummary& a = pair.a->startup;
    const StartupSummary& b = pair.b->startup;
    if (ShowsStartup(a) != ShowsStartup(b)) {
      out_.notes.push_back(names().Of(pair.a->position) + ": only " + (ShowsStartup(a) ? "A" : "B") +
                           " holds its start-up, so what is configured at the end is compared");
    }
    if (!ShowsStartup(a) || !ShowsStartup(b)) return Configuration(p);

    const bool with_drive = ShowsDrive(a_, *pair.a) && ShowsDrive(b_, *pair.b);
    const std::string reached_a = StateReached(a, with_drive);
    const std::string reached_b = StateReached(b, with_drive);
    if ((a.reached == 0) != (b.reached == 0)) {
      out_.notes.push_back(names().Of(pair.a->position) + ": " + (a.reached == 0 ? "A" : "B") +
                           " does not show its AL states, so what its start-up came to is not compared");
    } else if (reached_a != reached_b) {
      const bool one_refused = (FailedAt(a) == 0) != (FailedAt(b) == 0);
      Difference& d =
          Add(Area::kOutcome, one_refused ? kRankRefused : kRankOutcome, p, "start-up", reached_a, reached_b);
      d.frame_a = FrameOfOutcome(a);
      d.frame_b = FrameOfOutcome(b);
    }
    LearnFailure(a, b);
    Steps(p, a, b);
  }

  /// The first request that was refused, else the first whose state the master waited for without result.
  static const StartupStep* FailedRequest(const StartupSummary& startup) {
    for (const StartupOutcome outcome : {StartupOutcome::kRefused, StartupOutcome::kUnanswered}) {
      for (const StartupStep& step : startup.steps) {
        if (step.key.kind == StartupKey::Kind::kRequest && step.outcome == outcome) return &step;
      }
    }
    return nullptr;
  }

  /// Where only one of the two failed at a state: what that request is about.
  void LearnFailure(const StartupSummary& a, const StartupSummary& b) {
    const StartupStep* in_a = FailedRequest(a);
    const StartupStep* in_b = FailedRequest(b);
    if ((in_a == nullptr) == (in_b == nullptr)) return;
    const StartupStep& failed = in_a != nullptr ? *in_a : *in_b;
    const auto code = static_cast<std::uint16_t>(failed.code);
    const auto state = static_cast<std::uint8_t>(failed.key.address);
    if (knowledge_.settings) about_ = knowledge_.settings(code, state);
    failed_in_a_ = in_a != nullptr;
    failed_at_ = failed.frame.number;
    about_any_.insert(about_any_.end(), about_.begin(), about_.end());
    if (out_.failed.empty()) {
      out_.failed = esc::StateName(state) + (failed.outcome == StartupOutcome::kRefused ? " refused" : " not reached");
      if (failed.code != 0) out_.failed += " with " + Hex(code);
    }
  }

  /// Place among the settings that the refusal is about, the likeliest reason first; `about_.size()`: it is not.
  [[nodiscard]] std::size_t PlaceOf(const StartupKey& key, std::uint64_t bytes) const {
    const auto range = std::ranges::find_if(about_, [&](const SettingRange& r) { return r.Holds(key, bytes); });
    return static_cast<std::size_t>(range - about_.begin());
  }
  [[nodiscard]] bool IsAbout(const StartupKey& key, std::uint64_t bytes) const {
    return PlaceOf(key, bytes) < about_.size();
  }
  /// The start-up that failed did it before that, or not at all: what comes after is no reason.
  [[nodiscard]] bool IsBeforeFailure(FrameNo frame_a, FrameNo frame_b) const {
    return (failed_in_a_ ? frame_a : frame_b) <= failed_at_;
  }
  void MarkRelevant(const StartupStep& step, FrameNo frame_a, FrameNo frame_b, Difference& d) const {
    if (about_.empty() || !IsBeforeFailure(frame_a, frame_b)) return;
    if (d.rank != kRankRelevant && d.rank != kRankSuspect) return;
    d.relevant = true;
    d.place = PlaceOf(step.key, step.size);
  }
  /// The whole bus does it; `key` stands for it.
  static void MarkOfBus(const std::vector<SettingRange>& about, const StartupKey& key, Difference& d) {
    if (std::ranges::none_of(about, [&](const SettingRange& r) { return r.Holds(key, 1); })) return;
    d.relevant = true;
    d.rank = kRankRelevant;
  }

  /// True when a finding of this slave rests on the frame.
  static bool IsSuspect(const AnalysisResult& result, const SlaveSummary* slave, FrameNo frame) {
    if (slave == nullptr || frame == 0) return false;
    return std::ranges::any_of(result.findings, [&](const Finding& finding) {
      if (finding.slave != slave->id || finding.severity == Severity::kInfo || finding.rule == "al-refused")
        return false;
      return (finding.first.number >= frame && finding.first.number <= frame + 1) ||
             std::ranges::find(finding.related_frames, frame) != finding.related_frames.end();
    });
  }

  static std::set<const StartupStep*> All(const std::vector<Deviation>& deviations) {
    std::set<const StartupStep*> all;
    for (const Deviation& deviation : deviations) all.insert(deviation.actual.begin(), deviation.actual.end());
    return all;
  }

  /// Two start-ups whose steps are compared. A's are what is expected; its frames are found again by the place of the
  /// step.
  struct Compared {
    std::optional<std::size_t> pair;
    const StartupSummary& a;
    const StartupSummary& b;
    startup::Expectation expectation;

    [[nodiscard]] const StartupStep& InA(const ExpectedStep* expected) const {
      return a.steps[static_cast<std::size_t>(expected - expectation.bus.data())];
    }
  };

  [[nodiscard]] int RankOf(std::optional<std::size_t> p, const StartupStep& step, StartupPhase phase, FrameNo frame_a,
                           FrameNo frame_b) const {
    const StartupKey& key = step.key;
    const std::uint64_t bytes = step.size;
    // What is only read changes nothing, and another sequence of states is part of the outcome.
    if (key.kind == StartupKey::Kind::kUpload) return kRankEarly;
    if (key.kind == StartupKey::Kind::kRequest) return kRankStep;
    const SlaveSummary* slave_a = p ? out_.pairs[*p].a : nullptr;
    const SlaveSummary* slave_b = p ? out_.pairs[*p].b : nullptr;
    if (p && IsAbout(key, bytes) && IsBeforeFailure(frame_a, frame_b)) return kRankRelevant;
    if (IsSuspect(a_, slave_a, frame_a) || IsSuspect(b_, slave_b, frame_b)) return kRankSuspect;
    if (startup::IsMapping(key) && phase > StartupPhase::kEeprom) return kRankMapping;
    if (IsClock(key)) return kRankFrames;
    return phase <= StartupPhase::kEeprom ? kRankEarly : kRankStep;
  }

  void Steps(std::optional<std::size_t> p, const StartupSummary& a, const StartupSummary& b) {
    AnalysisResult only_a;
    only_a.bus.startup = a;
    const Compared compared{p, a, b, startup::ExpectationOf(only_a)};
    out_.steps_compared += a.steps.size();
    out_.compared = out_.compared || !a.steps.empty() || !b.steps.empty();
    const std::vector<Deviation> deviations = startup::CompareSteps(compared.expectation.bus, b.steps, false, true);
    for (const Deviation& deviation : deviations) Step(compared, deviation);
    Outcomes(p, a, b, All(deviations));
  }

  void Step(const Compared& compared, const Deviation& deviation) {
    switch (deviation.kind) {
      case Deviation::Kind::kValue:
        OtherValue(compared, deviation);
        break;
      case Deviation::Kind::kMissing: {
        std::vector<const StartupStep*> steps;
        for (const ExpectedStep* step : deviation.expected) steps.push_back(&compared.InA(step));
        const bool late = deviation.to_the_end || (FailedAt(compared.b) != 0 && deviation.next == nullptr);
        OneSided(compared.pair, {true, compared.a, compared.b, late}, std::move(steps));
        break;
      }
      case Deviation::Kind::kUnexpected: {
        const FrameNo failed = FailedAt(compared.a);
        const bool late = failed != 0 && GoesOnBehind(compared.a, failed, deviation);
        OneSided(compared.pair, {false, compared.b, compared.a, late}, deviation.actual);
        break;
      }
      case Deviation::Kind::kOrder:
        OtherPlace(compared, deviation);
        break;
      // Outcomes() shows the result of the steps.
      case Deviation::Kind::kFailed:
      case Deviation::Kind::kNotShown:
      case Deviation::Kind::kSlow:
      case Deviation::Kind::kSlaveMissing:
      case Deviation::Kind::kSlaveUnexpected:
      case Deviation::Kind::kSlaveMoved:
      case Deviation::Kind::kRevision:
        break;
    }
  }

  void OtherValue(const Compared& compared, const Deviation& deviation) {
    const StartupStep& in_a = compared.InA(deviation.expected.front());
    const StartupStep& in_b = *deviation.actual.front();
    const auto [part_a, part_b] = startup::DifferingParts(in_b.key, in_a.data, in_b.data);
    const int rank = RankOf(compared.pair, in_b, in_b.phase, in_a.frame.number, in_b.frame.number);
    Difference& d = Add(Area::kStep, rank, compared.pair, startup::StepNoun(in_b.key, in_b.name),
                        part_a.empty() ? WithNote(in_a) : part_a, part_b.empty() ? WithNote(in_b) : part_b);
    MarkRelevant(in_b, in_a.frame.number, in_b.frame.number, d);
    d.other_value = true;
    d.frame_a = in_a.frame.number;
    d.frame_b = in_b.frame.number;
    if (startup::LogicalStartOnly(in_b.key, in_a.data, in_b.data)) {
      d.counts = false;
      d.relevant = false;
      d.rank = kRankTiming;
    }
  }

  void OtherPlace(const Compared& compared, const Deviation& deviation) {
    const StartupStep& in_a = compared.InA(deviation.expected.front());
    const std::string behind_a =
        deviation.after != nullptr ? "after " + compared.InA(deviation.after).name : "at the beginning";
    const std::string behind_b =
        deviation.previous != nullptr ? "after " + deviation.previous->name : "at the beginning";
    std::string what = "place of the " + startup::StepNoun(in_a.key, in_a.name);
    if (deviation.expected.size() > 1) what += " and " + Grouped(deviation.expected.size() - 1) + " more";
    const int rank = RankOf(compared.pair, in_a, in_a.phase, in_a.frame.number, deviation.frame.number);
    Difference& d = Add(Area::kStep, rank, compared.pair, what, behind_a, behind_b);
    MarkRelevant(in_a, in_a.frame.number, deviation.frame.number, d);
    d.frame_a = in_a.frame.number;
    d.frame_b = deviation.frame.number;
  }

  /// Which start-up has the steps that the other one lacks.
  struct Side {
    bool of_a = true;
    const StartupSummary& here;
    const StartupSummary& there;
    bool late = false;  ///< the other one did not come that far
  };

  /// Steps that one start-up has and the other has not, or less often.
  void OneSided(std::optional<std::size_t> p, const Side& side, std::vector<const StartupStep*> steps) {
    LeaveOutHidden(p, side.of_a, steps);
    const ExtraSteps extra = SortOut(steps, side.here, side.there);
    Again(p, side, extra.again);
    std::vector<const StartupStep*> taken, unanswered;
    for (const StartupStep* step : extra.fresh) (NotTaken(*step) ? unanswered : taken).push_back(step);
    if (!taken.empty()) {
      const StartupStep& first = *taken.front();
      AddStep(p, side, {MostImportant(taken), first, nullptr}, List(taken, TextOf), "done",
              NotDone(first, side.there, side.late));
    }
    if (!unanswered.empty()) {
      const StartupStep& first = *unanswered.front();
      Difference& d = AddStep(p, side, {MostImportant(unanswered), first, nullptr}, List(unanswered, TextOf),
                              "tried, and not taken by the slave", NotDone(first, side.there, side.late));
      d.counts = false;
      d.relevant = false;
      d.rank = kRankTiming;
    }
  }

  /// Steps that both have, and one has more often.
  void Again(std::optional<std::size_t> p, const Side& side, const std::vector<StepAgain>& steps) {
    for (std::size_t i = 0; i < steps.size(); ++i) {
      const StepAgain& again = steps[i];
      const StartupStep& step = *again.step;
      if (again.same_value) {
        // What is done once more for the same reason is one difference.
        std::vector<const StartupStep*> all{&step};
        while (i + 1 < steps.size() && steps[i + 1].same_value && steps[i + 1].here == again.here &&
               steps[i + 1].there == again.there) {
          all.push_back(steps[++i].step);
        }
        const std::size_t more = again.here > again.there ? again.here - again.there : 1;
        Difference& d = AddStep(
            p, side, {step, step, again.other}, List(all, TextOf),
            (more == 1 ? "once more" : Grouped(more) + " times more") + ", in " + std::string(Title(step.phase)),
            TimesDone(again.there));
        // The same value once more sets nothing else.
        d.relevant = false;
        if (d.rank == kRankRelevant) d.rank = kRankStep;
        continue;
      }
      const auto [part_here, part_there] = startup::DifferingParts(step.key, step.data, again.other->data);
      std::string here = part_here.empty() ? WithNote(step) : part_here;
      if (again.as_there != nullptr) {
        here += again.as_there->frame.number > step.frame.number ? ", later as " : ", before as ";
        here += side.of_a ? "in B" : "in A";
      }
      Difference& d = AddStep(p, side, {step, step, again.other}, startup::StepNoun(step.key, step.name),
                              std::move(here), part_there.empty() ? WithNote(*again.other) : part_there);
      d.other_value = true;
      if (startup::LogicalStartOnly(step.key, step.data, again.other->data)) {
        d.counts = false;
        d.relevant = false;
        d.rank = kRankTiming;
      }
    }
  }

  /// Of several steps one that the refusal is about, else the first that changes something.
  [[nodiscard]] const StartupStep& MostImportant(const std::vector<const StartupStep*>& steps) const {
    const auto about =
        std::ranges::find_if(steps, [this](const StartupStep* step) { return IsAbout(step->key, step->size); });
    return about != steps.end() ? **about : FirstThatChanges(steps);
  }

  static std::string TextOf(const StartupStep& s) {
    return startup::StepNoun(s.key, s.name) + (s.text.empty() ? "" : " = " + ValueOf(s.name, s.text));
  }

  struct StepsAt {
    const StartupStep& telling;  ///< decides how much it matters
    const StartupStep& first;
    const StartupStep* other = nullptr;  ///< in the other start-up
  };

  Difference& AddStep(std::optional<std::size_t> p, const Side& side, const StepsAt& steps, std::string what,
                      std::string here, std::string there) {
    const FrameNo frame = steps.first.frame.number;
    const FrameNo other_frame = steps.other == nullptr ? 0 : steps.other->frame.number;
    const FrameNo frame_a = side.of_a ? frame : other_frame;
    const FrameNo frame_b = side.of_a ? other_frame : frame;
    const int rank = side.late ? kRankConsequence : RankOf(p, steps.telling, steps.first.phase, frame_a, frame_b);
    Difference& d = Add(Area::kStep, rank, p, std::move(what), side.of_a ? std::move(here) : std::move(there),
                        side.of_a ? std::move(there) : std::move(here));
    MarkRelevant(steps.telling, frame_a, frame_b, d);
    d.frame_a = frame_a;
    d.frame_b = frame_b;
    d.consequence = side.late;
    return d;
  }

  /// What the other capture cannot show is no difference.
  void LeaveOutHidden(std::optional<std::size_t> p, bool of_a, std::vector<const StartupStep*>& steps) {
    const SlaveSummary* other = !p ? nullptr : of_a ? out_.pairs[*p].b : out_.pairs[*p].a;
    std::erase_if(steps, [&](const StartupStep* step) {
      const std::string why = WhyHidden(of_a ? b_ : a_, other, *step);
      if (why.empty()) return false;
      std::string note = names().Of(other->position) + ": " + (of_a ? "B" : "A") + " does not show " + why;
      if (std::ranges::find(out_.notes, note) == out_.notes.end()) {
        out_.notes.push_back(std::move(note));
      }
      return true;
    });
  }

  /// B's additional steps come after everything that the failed start-up of A holds.
  static bool GoesOnBehind(const StartupSummary& a, FrameNo failed_a, const Deviation& deviation) {
    const StartupStep* before = deviation.previous;
    if (before == nullptr || before->key.kind != StartupKey::Kind::kRequest) return false;
    for (const StartupStep& step : a.steps) {
      if (step.frame.number == failed_a) return step.key == before->key;
    }
    return false;
  }

  /// Steps that both do with the same value, and that one slave refused. What was reported already is left out.
  void Outcomes(std::optional<std::size_t> p, const StartupSummary& a, const StartupSummary& b,
                const std::set<const StartupStep*>& reported) {
    using Name = std::tuple<int, bool, std::uint8_t, std::uint32_t>;
    std::map<Name, std::vector<const StartupStep*>> by_key;
    const auto name_of = [](const StartupKey& key) {
      return Name{static_cast<int>(key.kind), key.complete_access, key.subindex, key.address};
    };
    for (const StartupStep& step : a.steps) by_key[name_of(step.key)].push_back(&step);
    std::map<Name, std::size_t> next;
    for (const StartupStep& step : b.steps) {
      const auto found = by_key.find(name_of(step.key));
      if (found == by_key.end()) continue;
      const std::size_t place = next[found->first]++;
      if (place >= found->second.size() || reported.contains(&step)) continue;
      const StartupStep& other = *found->second[place];
      if (step.outcome == other.outcome && step.code == other.code) continue;
      if (step.outcome == StartupOutcome::kUnknown || other.outcome == StartupOutcome::kUnknown) continue;
      // The outcome shows the refused state.
      if (p && step.key.kind == StartupKey::Kind::kRequest) continue;
      const int rank = step.phase <= StartupPhase::kEeprom ? kRankEarly : kRankStep;
      Difference& d = Add(Area::kStep, rank, p, startup::StepNoun(step.key, step.name),
                          other.note.empty() ? "done" : other.note, step.note.empty() ? "done" : step.note);
      d.frame_a = other.last.number;
      d.frame_b = step.last.number;
    }
  }

  /// Sync managers at the end, where start-ups cannot be compared.
  void Configuration(std::size_t p) {
    const SlavePair& pair = out_.pairs[p];
    for (const SyncManagerSummary& a : pair.a->sync_managers) {
      const auto b = std::ranges::find(pair.b->sync_managers, a.number, &SyncManagerSummary::number);
      if (b == pair.b->sync_managers.end()) continue;  // one capture may simply not show it
      out_.compared = true;
      if (a.start == b->start && a.length == b->length && a.control == b->control && a.enabled == b->enabled) continue;
      Difference& d =
          Add(Area::kConfiguration, kRankMapping, p, "SM" + std::to_string(a.number), SmText(a), SmText(*b));
      d.other_value = true;
      d.frame_a = a.since;
      d.frame_b = b->since;
    }
    const auto cycle = [](const SlaveSummary& slave) {
      return slave.dc && slave.dc->sync0_cycle_ns ? slave.dc->sync0_cycle_ns : std::nullopt;
    };
    if (cycle(*pair.a) && cycle(*pair.b) && *cycle(*pair.a) != *cycle(*pair.b)) {
      Add(Area::kConfiguration, kRankFrames, p, "SYNC0 cycle time", Duration(*cycle(*pair.a)),
          Duration(*cycle(*pair.b)))
          .other_value = true;
    }
  }

  /// What was not kept cannot be called the same.
  void CutStartups(std::size_t p) {
    if (out_.pairs[p].a == nullptr || out_.pairs[p].b == nullptr) return;
    const std::uint64_t a = out_.pairs[p].a->startup.steps_left_out;
    const std::uint64_t b = out_.pairs[p].b->startup.steps_left_out;
    if (a == 0 && b == 0) return;
    const auto text = [](std::uint64_t steps) {
      return steps == 0 ? "all steps compared" : Count(steps, "step") + " not kept";
    };
    Add(Area::kStep, kRankConsequence, p, "end of the start-up", text(a), text(b));
  }

  void Mappings(std::size_t p) {
    const SlavePair& pair = out_.pairs[p];
    for (const bool outputs : {true, false}) {
      const PdoSummary& a = outputs ? pair.a->rx_pdo : pair.a->tx_pdo;
      const PdoSummary& b = outputs ? pair.b->rx_pdo : pair.b->tx_pdo;
      if (!a.bytes || !b.bytes) continue;
      out_.compared = true;
      if (SameMapping(a, b)) continue;
      Difference& d = Add(Area::kMapping, kRankMapping, p, outputs ? "outputs (RxPDO)" : "inputs (TxPDO)",
                          MappingText(a), MappingText(b));
      d.other_value = true;
      const StartupKey assignment{.kind = StartupKey::Kind::kDownload,
                                  .address = outputs ? process::kRxAssignment : process::kTxAssignment};
      if (IsAbout(assignment, 0) && IsBeforeFailure(a.since, b.since)) {
        d.relevant = true;
        d.rank = kRankRelevant;
        d.place = PlaceOf(assignment, 0);
      }
      d.frame_a = a.since;
      d.frame_b = b.since;
    }
  }

  void Timing(std::size_t p) {
    const SlavePair& pair = out_.pairs[p];
    for (const StartupPhaseSummary& a : pair.a->startup.phases) {
      const StartupPhaseSummary* b = pair.b->startup.phase(a.phase);
      if (b == nullptr || !a.duration || !b->duration) continue;
      const TimeNs less = std::min(*a.duration, *b->duration);
      const TimeNs more = std::max(*a.duration, *b->duration);
      if (more - less < kAtLeastSlower || static_cast<double>(more) < kSlower * static_cast<double>(less)) continue;
      Difference& d = Add(Area::kTiming, kRankTiming, p, "phase " + std::string(Title(a.phase)), Duration(*a.duration),
                          Duration(*b->duration));
      d.frame_a = a.first.number;
      d.frame_b = b->first.number;
      d.counts = false;
    }
  }

  /// What carries process data and time in every cycle.
  void Frames() {
    // What one direction alone does not show is no difference.
    if (!out_.compared || a_.capture.direction != DirectionSeen::kBoth || b_.capture.direction != DirectionSeen::kBoth)
      return;
    const std::string layout_a = LayoutText(a_.bus);
    const std::string layout_b = LayoutText(b_.bus);
    if (layout_a.empty() || layout_b.empty()) return;
    if (layout_a != layout_b) {
      MarkOfBus(
          about_any_, {.address = kFirstFmmu},
          Add(Area::kTiming, kRankFrames, std::nullopt, "datagrams that carry the process data", layout_a, layout_b));
    }
    const std::uint64_t times_a = a_.bus.dc.distributions;
    const std::uint64_t times_b = b_.bus.dc.distributions;
    if ((times_a == 0) == (times_b == 0)) return;
    const auto text = [](std::uint64_t times) { return times == 0 ? std::string("never") : Count(times, "time"); };
    MarkOfBus(about_any_, {.address = esc::kSystemTime},
              Add(Area::kTiming, kRankFrames, std::nullopt, "distribution of the system time (FRMW or ARMW of 0x0910)",
                  text(times_a), text(times_b)));
  }

  void Cycle() {
    const CycleSummary& a = a_.bus.cycle;
    const CycleSummary& b = b_.bus.cycle;
    if (a.cycles == 0 || b.cycles == 0) return;
    if (std::abs(a.median_us - b.median_us) <= kSameCycle * std::max(a.median_us, b.median_us)) return;
    MarkOfBus(about_any_, {.address = esc::kSync0Cycle},
              Add(Area::kTiming, kRankFrames, std::nullopt, "cycle of the process data (median)",
                  Fixed(a.median_us, 1) + " us", Fixed(b.median_us, 1) + " us"));
  }

  void Findings() {
    using Key = std::tuple<std::string_view, std::size_t, std::string>;
    constexpr std::size_t kBusPair = static_cast<std::size_t>(-1);
    const auto collect = [&](const AnalysisResult& result, bool of_a) {
      std::map<Key, const Finding*> all;
      for (const Finding& finding : result.findings) {
        if (finding.severity == Severity::kInfo) continue;
        std::size_t pair = kBusPair;
        for (std::size_t p = 0; p < out_.pairs.size(); ++p) {
          const SlaveSummary* slave = of_a ? out_.pairs[p].a : out_.pairs[p].b;
          if (slave != nullptr && slave->id == finding.slave) pair = p;
        }
        all.emplace(Key{finding.rule, pair, IdentityOf(finding)}, &finding);
      }
      return all;
    };
    const auto in_a = collect(a_, true);
    const auto in_b = collect(b_, false);
    const auto add = [&](const std::map<Key, const Finding*>& here, const std::map<Key, const Finding*>& there,
                         bool of_a) {
      const AnalysisResult& result = of_a ? a_ : b_;
      for (const auto& [key, finding] : here) {
        if (there.contains(key)) continue;
        const std::size_t pair = std::get<1>(key);
        const std::string text = std::string(Name(finding->severity)) + ": " + knowledge_.title(*finding);
        // A cause is more useful than its consequences, and a request that failed is none.
        const bool root = finding->caused_by == kNoFinding && !IsOfFailedRequest(*finding);
        Difference& d =
            Add(Area::kFinding, root ? kRankFinding : kRankEarly, pair == kBusPair ? std::nullopt : std::optional(pair),
                std::string(finding->rule), of_a ? text : "no such finding", of_a ? "no such finding" : text);
        (of_a ? d.frame_a : d.frame_b) = finding->first.number;
        if (!root) continue;
        d.place = 1;
        for (const Finding& other : result.findings) {
          if (&other == finding || &RootOf(result, other) != finding) continue;
          d.place = 0;
          const bool observed = finding->confidence != Confidence::kInferred;
          d.relevant = d.relevant || (observed && !out_.failed.empty() && IsOfFailedRequest(other));
        }
        if (d.relevant) d.rank = kRankReason;
      }
    };
    add(in_a, in_b, true);
    add(in_b, in_a, false);
  }

  /// Steps that one of them has not follow from what a finding names. Another value of a setting that both have is a
  /// reason itself, and so is one that the refusal is about.
  void LeadWithFindings() {
    const auto is_setting = [](const Difference& d) {
      return d.counts && d.area != Area::kFinding && (d.relevant || (d.other_value && d.rank <= kRankFrames));
    };
    if (std::ranges::any_of(out_.differences, is_setting)) return;
    for (Difference& d : out_.differences) {
      if (d.area != Area::kFinding || d.rank != kRankFinding) continue;
      d.rank = kRankReason;
      out_.findings_lead = true;
    }
  }

  /// The same difference of several slaves is one.
  void Fold() {
    std::vector<Difference> folded;
    std::map<std::tuple<int, std::string, std::string, std::string>, std::size_t> known;
    for (Difference& d : out_.differences) {
      const auto key = std::tuple(static_cast<int>(d.area), d.what, d.in_a, d.in_b);
      const auto [at, first] = known.emplace(key, folded.size());
      if (first || d.pairs.empty() || folded[at->second].pairs.empty()) {
        folded.push_back(std::move(d));
      } else {
        Difference& known_one = folded[at->second];
        for (const std::size_t pair : d.pairs) {
          // The same slave may do it several times.
          if (std::ranges::find(known_one.pairs, pair) == known_one.pairs.end()) {
            known_one.pairs.push_back(pair);
          }
        }
        known_one.rank = std::min(known_one.rank, d.rank);
        known_one.relevant = known_one.relevant || d.relevant;
      }
    }
    out_.differences = std::move(folded);
  }

  const AnalysisResult& a_;
  const AnalysisResult& b_;
  const Knowledge& knowledge_;
  std::vector<SettingRange> about_;      ///< of the pair that is compared: what the refusal of one of them is about
  bool failed_in_a_ = false;             ///< likewise: which of them
  FrameNo failed_at_ = 0;                ///< likewise: the request
  std::vector<SettingRange> about_any_;  ///< likewise of all pairs
  std::map<std::string, std::set<unsigned>> unidentified_;  ///< positions, by where the identity is missing
  CaptureDiff out_;
};

}  // namespace

CaptureDiff Compare(const AnalysisResult& a, const AnalysisResult& b, const Knowledge& knowledge) {
  return Builder(a, b, knowledge).Build();
}

}  // namespace ecaudit::diff
