#include "analyzers/compare/comparison.h"

#include <algorithm>
#include <functional>
#include <iterator>
#include <utility>

#include "analyzers/compare/longest_common.h"
#include "analyzers/compare/slave_matches.h"
#include "analyzers/compare/startup_registers.h"
#include "analyzers/model/model_events.h"
#include "analyzers/result/further_startups.h"
#include "decoder/base/time.h"
#include "decoder/esc/al.h"

namespace ecaudit::startup {
namespace {

constexpr Word kStartup{"startup", "the start-up"};
constexpr Word kControlWord{"control-word", "the control word (6040h)"};
constexpr Word kAddressing{"addressing", "the addressing of the slave"};
constexpr Word kOutcome{"outcome", "the outcome of a step"};
constexpr Word kLogicalAddresses{"logical-addresses", "logical addresses of a bus with other slaves or process data",
                                 true};
constexpr Word kFurtherStartup{"further-startup", "a further start-up (--from selects it)"};
constexpr Word kSteps{"startup-steps", "start-up steps", true};
constexpr Word kBroadcasts{"startup-broadcasts", "the start-up steps for all slaves", true};
constexpr Word kPlaces{"slave-at-position", "the slave at an expected position"};
constexpr Word kNewSlave{"new-slave", "a slave that the expectation, which is not strict, does not list"};

constexpr std::size_t kNone = static_cast<std::size_t>(-1);

/// What is evaluated in one order: everything, or the mailbox by itself, or steps that have no order.
enum class Chain : std::uint8_t { kMain, kMailbox, kWithoutOrder };

Chain ChainOf(const StartupKey& key, bool separate_mailbox) {
  if (IsWithoutOrder(key)) return Chain::kWithoutOrder;
  const bool mailbox = key.kind == StartupKey::Kind::kDownload || key.kind == StartupKey::Kind::kUpload;
  return mailbox && separate_mailbox ? Chain::kMailbox : Chain::kMain;
}

bool IsRequest(const StartupKey& key) {
  return key.kind == StartupKey::Kind::kRequest;
}

bool IsDrive(const StartupKey& key) {
  return key.kind == StartupKey::Kind::kDrive;
}

bool Failed(const ExpectedStep& expected, const StartupStep& actual) {
  return expected.succeeds &&
         (actual.outcome == StartupOutcome::kRefused || actual.outcome == StartupOutcome::kUnanswered);
}

/// Compares one chain.
class ChainComparison {
 public:
  ChainComparison(std::vector<const ExpectedStep*> expected, std::vector<const StartupStep*> actual, bool ordered)
      : expected_(std::move(expected)),
        actual_(std::move(actual)),
        ordered_(ordered),
        actual_of_(expected_.size(), kNone),
        expected_of_(actual_.size(), kNone) {}

  void Run(bool strict, std::vector<Deviation>& out) {
    for (const auto& [e, a] : LongestCommon(expected_.size(), actual_.size(), [&](std::size_t e, std::size_t a) {
           return Same(e, a) && !Failed(*expected_[e], *actual_[a]);
         })) {
      Pair(e, a);
    }
    aligned_ = actual_of_;
    PairCovered();
    PairFailed(true);
    PairMoved(out);
    PairFailed(false);
    AddFailed(out);
    AddNotShown(out);
    PairChanged(out);
    Missing(out);
    if (strict) Unexpected(out);
  }

 private:
  [[nodiscard]] bool Same(std::size_t e, std::size_t a) const {
    return expected_[e]->key == actual_[a]->key && HasValue(*expected_[e], *actual_[a]);
  }

  void Pair(std::size_t e, std::size_t a) {
    actual_of_[e] = a;
    expected_of_[a] = e;
  }

  /// A register may be written together with its neighbours, or in parts. What counts is what was written to it,
  /// between the steps between which it is expected.
  void PairCovered() {
    std::vector<std::pair<std::size_t, std::size_t>> pairs;
    for (std::size_t e = 0; e < expected_.size(); ++e) {
      if (actual_of_[e] != kNone || expected_[e]->key.kind != StartupKey::Kind::kWrite) continue;
      const auto [low, high] = Gap(e);
      for (const std::size_t a : WritesOf(*expected_[e], low, high)) pairs.emplace_back(e, a);
    }
    for (const auto& [e, a] : pairs) {
      expected_of_[a] = e;
      if (actual_of_[e] == kNone) actual_of_[e] = aligned_[e] = a;
    }
  }

  /// The steps of [low, high) that nothing else expects and that together write what `expected` does; none where they
  /// do not.
  [[nodiscard]] std::vector<std::size_t> WritesOf(const ExpectedStep& expected, std::size_t low,
                                                  std::size_t high) const {
    const WantedBytes wanted = BytesOf(expected);
    std::vector<std::size_t> writes;
    std::vector<bool> written(wanted.data.size());
    for (std::size_t a = low; a < high; ++a) {
      if (expected_of_[a] != kNone || Failed(expected, *actual_[a])) continue;
      const std::vector<bool> here = WrittenBy(*actual_[a], wanted);
      if (std::ranges::find(here, true) == here.end()) continue;
      writes.push_back(a);
      std::transform(here.begin(), here.end(), written.begin(), written.begin(), std::logical_or<>());
    }
    if (std::ranges::find(written, false) != written.end()) writes.clear();
    return writes;
  }

  /// The step, maybe together with other registers.
  [[nodiscard]] bool Covers(std::size_t e, std::size_t a) const {
    if (expected_[e]->key.kind != StartupKey::Kind::kWrite) return false;
    const std::vector<bool> written = WrittenBy(*actual_[a], BytesOf(*expected_[e]));
    return !written.empty() && std::ranges::find(written, false) == written.end();
  }

  /// The first step that nothing else expects and that is the same, else one that does the same together with others.
  [[nodiscard]] std::size_t Elsewhere(std::size_t e) const {
    std::size_t covering = kNone;
    for (std::size_t a = 0; a < actual_.size(); ++a) {
      if (expected_of_[a] != kNone || Failed(*expected_[e], *actual_[a])) continue;
      if (Same(e, a)) return a;
      if (covering == kNone && Covers(e, a)) covering = a;
    }
    return covering;
  }

  /// Steps with the right value at the wrong place; all of one chain are one deviation.
  void PairMoved(std::vector<Deviation>& out) {
    Deviation moved;
    moved.kind = Deviation::Kind::kOrder;
    for (std::size_t e = 0; e < expected_.size(); ++e) {
      if (actual_of_[e] != kNone) continue;
      const std::size_t a = Elsewhere(e);
      if (a == kNone) continue;
      Pair(e, a);
      if (!ordered_) continue;
      if (moved.expected.empty()) {
        moved.phase = expected_[e]->phase;
        moved.frame = actual_[a]->frame;
        moved.after = e > 0 ? expected_[e - 1] : nullptr;
        moved.previous = a > 0 ? actual_[a - 1] : nullptr;
        moved.next = a + 1 < actual_.size() ? actual_[a + 1] : nullptr;
      }
      moved.expected.push_back(expected_[e]);
      moved.actual.push_back(actual_[a]);
    }
    if (!moved.expected.empty()) out.push_back(std::move(moved));
  }

  /// Steps with the right value that had to succeed and did not.
  /// @param in_place  only those where they should be; else wherever they are
  void PairFailed(bool in_place) {
    for (std::size_t e = 0; e < expected_.size(); ++e) {
      if (actual_of_[e] != kNone || !expected_[e]->succeeds) continue;
      const auto [low, high] = in_place ? Gap(e) : std::pair(std::size_t{0}, actual_.size());
      for (std::size_t a = low; a < high; ++a) {
        if (expected_of_[a] != kNone || !Same(e, a)) continue;
        Pair(e, a);
        if (in_place) aligned_[e] = a;
        break;
      }
    }
  }

  /// A state that is not reached has others after it that are not either, and a drive that cannot be enabled.
  void AddFailed(std::vector<Deviation>& out) {
    const std::size_t before = out.size();
    for (std::size_t e = 0; e < expected_.size(); ++e) {
      if (actual_of_[e] == kNone || !Failed(*expected_[e], *actual_[actual_of_[e]])) continue;
      const ExpectedStep& expected = *expected_[e];
      const StartupStep& actual = *actual_[actual_of_[e]];
      if (IsRequest(expected.key) || IsDrive(expected.key)) {
        const auto cause = std::find_if(out.begin() + static_cast<std::ptrdiff_t>(before), out.end(),
                                        [](const Deviation& d) { return IsRequest(d.expected.front()->key); });
        if (cause != out.end()) {
          cause->expected.push_back(&expected);
          cause->actual.push_back(&actual);
          continue;
        }
      }
      out.push_back({.kind = Deviation::Kind::kFailed,
                     .phase = actual.phase,
                     .expected = {&expected},
                     .actual = {&actual},
                     .frame = actual.frame});
    }
  }

  /// A step done again after the one whose outcome is not known, as masters do where an answer is lost, settles it.
  [[nodiscard]] bool DoneAgain(std::size_t e) const {
    for (std::size_t a = actual_of_[e] + 1; a < actual_.size(); ++a) {
      if (expected_of_[a] == kNone && Same(e, a) && actual_[a]->outcome == StartupOutcome::kDone) return true;
    }
    return false;
  }

  void AddNotShown(std::vector<Deviation>& out) const {
    Deviation unknown;
    unknown.kind = Deviation::Kind::kNotShown;
    for (std::size_t e = 0; e < expected_.size(); ++e) {
      if (actual_of_[e] == kNone || !expected_[e]->succeeds || DoneAgain(e)) continue;
      if (actual_[actual_of_[e]]->outcome != StartupOutcome::kUnknown) continue;
      unknown.expected.push_back(expected_[e]);
      unknown.actual.push_back(actual_[actual_of_[e]]);
    }
    if (!unknown.expected.empty()) out.push_back(std::move(unknown));
  }

  void PairChanged(std::vector<Deviation>& out) {
    for (std::size_t e = 0; e < expected_.size(); ++e) {
      // A state or a command of the drive has no value: another one is another step.
      if (actual_of_[e] != kNone) continue;
      const auto [low, high] = Gap(e);
      std::size_t found = kNone;
      for (std::size_t a = 0; a < actual_.size(); ++a) {
        if (expected_of_[a] != kNone || expected_[e]->key != actual_[a]->key) continue;
        // The one at the same place, where there are several.
        if (found == kNone || (a >= low && a < high && (found < low || found >= high))) found = a;
      }
      if (found == kNone) continue;
      Pair(e, found);
      out.push_back({.kind = Deviation::Kind::kValue,
                     .phase = actual_[found]->phase,
                     .expected = {expected_[e]},
                     .actual = {actual_[found]},
                     .frame = actual_[found]->frame});
    }
  }

  /// Places of actual steps between the aligned neighbours of an expected one: [first, last).
  [[nodiscard]] std::pair<std::size_t, std::size_t> Gap(std::size_t e) const {
    std::size_t low = 0;
    std::size_t high = actual_.size();
    for (std::size_t before = e; before > 0; --before) {
      if (aligned_[before - 1] == kNone) continue;
      low = aligned_[before - 1] + 1;
      break;
    }
    for (std::size_t behind = e + 1; behind < expected_.size(); ++behind) {
      if (aligned_[behind] == kNone) continue;
      high = aligned_[behind];
      break;
    }
    return {low, high};
  }

  void Missing(std::vector<Deviation>& out) {
    std::size_t last_happened = expected_.size();
    while (last_happened > 0 && actual_of_[last_happened - 1] == kNone) --last_happened;
    for (std::size_t e = 0; e < expected_.size(); ++e) {
      if (actual_of_[e] != kNone) continue;
      Deviation missing;
      missing.kind = Deviation::Kind::kMissing;
      missing.phase = expected_[e]->phase;
      missing.to_the_end = e >= last_happened && ordered_ && EndsEarly(e);
      const std::size_t first = e;
      for (; e < expected_.size() && actual_of_[e] == kNone; ++e) {
        if (!missing.to_the_end && expected_[e]->phase != missing.phase) break;
        missing.expected.push_back(expected_[e]);
      }
      --e;
      for (std::size_t before = first; before > 0 && missing.previous == nullptr; --before) {
        if (aligned_[before - 1] != kNone) missing.previous = actual_[aligned_[before - 1]];
      }
      // The phase ended with the next state that was requested; where none was, with the next step.
      for (std::size_t behind = e + 1; behind < expected_.size(); ++behind) {
        if (aligned_[behind] == kNone) continue;
        if (missing.next == nullptr) missing.next = actual_[aligned_[behind]];
        if (!IsRequest(expected_[behind]->key)) continue;
        missing.next = actual_[aligned_[behind]];
        break;
      }
      if (missing.next != nullptr) {
        missing.frame = missing.next->frame;
      } else if (missing.previous != nullptr) {
        missing.frame = missing.previous->last;
      }
      out.push_back(std::move(missing));
    }
  }

  /// A state request is among what is missing from `e` on: the master did not get, or go, further.
  [[nodiscard]] bool EndsEarly(std::size_t e) const {
    return std::any_of(expected_.begin() + static_cast<std::ptrdiff_t>(e), expected_.end(),
                       [](const ExpectedStep* step) { return IsRequest(step->key); });
  }

  void Unexpected(std::vector<Deviation>& out) {
    for (std::size_t a = 0; a < actual_.size(); ++a) {
      if (expected_of_[a] != kNone) continue;
      Deviation unexpected;
      unexpected.kind = Deviation::Kind::kUnexpected;
      unexpected.phase = actual_[a]->phase;
      unexpected.frame = actual_[a]->frame;
      unexpected.previous = a > 0 ? actual_[a - 1] : nullptr;
      for (; a < actual_.size() && expected_of_[a] == kNone && actual_[a]->phase == unexpected.phase; ++a) {
        unexpected.actual.push_back(actual_[a]);
      }
      --a;
      out.push_back(std::move(unexpected));
    }
  }

  std::vector<const ExpectedStep*> expected_;
  std::vector<const StartupStep*> actual_;
  bool ordered_;
  std::vector<std::size_t> actual_of_;    ///< by expected step, kNone: not found
  std::vector<std::size_t> expected_of_;  ///< by actual step
  std::vector<std::size_t> aligned_;      ///< actual_of_ of steps in the common sequence
};

void CompareLimits(const Expectation& expectation, const ExpectedSlave& expected, const SlaveSummary& slave,
                   Comparison& comparison) {
  bool without_time = false;
  for (const StartupPhaseSummary& phase : slave.startup.phases) {
    const auto p = static_cast<std::size_t>(phase.phase);
    const std::optional<TimeNs>& limit = expected.limits[p] ? expected.limits[p] : expectation.limits[p];
    if (!limit) continue;
    without_time = without_time || !phase.duration;
    if (!phase.duration || *phase.duration <= *limit) continue;
    comparison.deviations.push_back({.kind = Deviation::Kind::kSlow,
                                     .slave = slave.id,
                                     .phase = phase.phase,
                                     .expected_slave = &expected,
                                     .frame = phase.last,
                                     .limit = *limit,
                                     .took = *phase.duration});
  }
  if (without_time) {
    comparison.not_compared.push_back({slave.id, Reason::Of(ReasonCode::kNoStamps), Deviation::Kind::kSlow});
  }
}

/// Takes steps out of what is missing that the capture cannot show.
/// @return false when there was nothing of that kind
template <typename Hidden>
bool LeaveOut(std::vector<Deviation>& deviations, Hidden&& hidden) {
  std::size_t left_out = 0;
  for (Deviation& deviation : deviations) {
    if (deviation.kind == Deviation::Kind::kMissing) left_out += std::erase_if(deviation.expected, hidden);
  }
  std::erase_if(deviations, [](const Deviation& deviation) {
    return deviation.kind == Deviation::Kind::kMissing && deviation.expected.empty();
  });
  return left_out > 0;
}

/// What a start-up shows last came shortly before the end of the capture.
bool EndsWith(const StartupSummary& startup, const FrameRef& end) {
  return startup.end.has_time && end.has_time && Elapsed(startup.end.time, end.time) < model::kGivenUpNs;
}

/// A master that is at it when the capture ends has not left out yet what it did not come to.
/// @return whether there was anything of that kind
bool LeaveOutToCome(SlaveId slave, std::vector<Deviation>& found, Comparison& comparison) {
  const std::size_t before = found.size();
  std::erase_if(found, [](const Deviation& d) {
    const bool refused = d.previous != nullptr && d.previous->outcome == StartupOutcome::kRefused;
    return d.kind == Deviation::Kind::kMissing && (d.to_the_end || d.next == nullptr) && !refused;
  });
  if (found.size() == before) return false;
  comparison.not_compared.push_back({slave, Reason::Of(ReasonCode::kCaptureEnds, kStartup), Deviation::Kind::kMissing});
  return true;
}

/// Of a slave that can be compared: what of its start-up the capture does not show.
void LeaveOutUnseen(const SlaveSummary& slave, std::vector<Deviation>& found, Comparison& comparison) {
  const auto of_drive = [](const ExpectedStep* step) { return step->key.kind == StartupKey::Kind::kDrive; };
  if (!slave.drive && LeaveOut(found, of_drive)) {
    comparison.not_compared.push_back(
        {slave.id, Reason::Of(ReasonCode::kNotInCapture, kControlWord), Deviation::Kind::kMissing});
  }
  if (slave.startup.steps_left_out > 0) {
    // What came after the last step that was kept is cut off, not missing.
    const std::size_t before = found.size();
    std::erase_if(found, [](const Deviation& deviation) {
      return deviation.kind == Deviation::Kind::kMissing && (deviation.to_the_end || deviation.next == nullptr);
    });
    if (found.size() < before) {
      comparison.not_compared.push_back(
          {slave.id, Reason::Of(ReasonCode::kListFull, kSteps), Deviation::Kind::kMissing});
    }
  }
  const auto early = [](const ExpectedStep* step) { return step->phase <= StartupPhase::kEeprom; };
  if (slave.position_inferred && LeaveOut(found, early)) {
    comparison.not_compared.push_back(
        {slave.id, Reason::Of(ReasonCode::kNotInCapture, kAddressing), Deviation::Kind::kMissing});
  }
}

/// Why a slave's start-up cannot be compared; unset where it can.
std::optional<Reason> WhyNotCompared(const SlaveSummary& slave, const CaptureSummary& capture) {
  const StartupSummary& startup = slave.startup;
  constexpr auto kPreop = static_cast<std::uint8_t>(esc::AlState::PREOP);
  const bool from_init = std::ranges::any_of(startup.steps, [](const StartupStep& step) {
    return IsRequest(step.key) && step.key.address == static_cast<std::uint32_t>(esc::AlState::PREOP);
  });
  if (!from_init && startup.first_state && *startup.first_state >= kPreop) {
    return Reason::Of(ReasonCode::kNotInCapture, kStartup);
  }
  if (startup.steps.empty()) return Reason::Of(ReasonCode::kNotInCapture, kStartup);
  if (!capture.complete && !startup.ended) return Reason::Of(ReasonCode::kCaptureEnds, kStartup);
  return std::nullopt;
}

/// Whether the capture shows which slave is at this place of the bus, or that none is.
bool ShowsPlace(const AnalysisResult& result, SlavePos position) {
  if (result.bus.slave_count && position >= *result.bus.slave_count) return true;
  return std::ranges::any_of(result.slaves, [&](const SlaveSummary& slave) { return slave.position == position; });
}

}  // namespace

bool HasValue(const ExpectedStep& expected, const StartupStep& actual) {
  if (expected.any_value()) return true;
  // Too long to be kept: its size is all that can be compared.
  if (actual.data.empty() && actual.size > 0) return !expected.data || expected.data->size() == actual.size;
  if (expected.data) return SameValue(expected.key, *expected.data, actual.data);
  if (actual.data.empty() || actual.data.size() > 8) return false;
  std::uint64_t raw = 0;
  for (std::size_t i = actual.data.size(); i > 0; --i) raw = raw << 8U | actual.data[i - 1];
  const auto wanted = static_cast<std::uint64_t>(*expected.number);
  const unsigned unused = 64U - 8U * static_cast<unsigned>(actual.data.size());
  if (*expected.number >= 0) return raw == wanted;
  return raw == (wanted & ~std::uint64_t{0} >> unused);
}

std::vector<Deviation> CompareSteps(std::span<const ExpectedStep> expected, std::span<const StartupStep> actual,
                                    bool separate_mailbox, bool strict) {
  std::vector<Deviation> deviations;
  for (const Chain chain : {Chain::kMain, Chain::kMailbox, Chain::kWithoutOrder}) {
    std::vector<const ExpectedStep*> wanted;
    std::vector<const StartupStep*> happened;
    for (const ExpectedStep& step : expected) {
      if (ChainOf(step.key, separate_mailbox) == chain) wanted.push_back(&step);
    }
    for (const StartupStep& step : actual) {
      if (ChainOf(step.key, separate_mailbox) == chain) happened.push_back(&step);
    }
    if (wanted.empty() && (happened.empty() || !strict)) continue;
    ChainComparison(std::move(wanted), std::move(happened), chain != Chain::kWithoutOrder).Run(strict, deviations);
  }
  return deviations;
}

namespace {

/// Takes requests out of what failed, or may have: a higher state was reached, and so was theirs.
void LeaveOutOvercome(const StartupSummary& startup, std::vector<Deviation>& found) {
  for (Deviation& d : found) {
    if (d.kind != Deviation::Kind::kFailed && d.kind != Deviation::Kind::kNotShown) continue;
    for (std::size_t i = d.expected.size(); i > 0; --i) {
      const StartupStep& step = *d.actual[i - 1];
      const bool refused = step.outcome == StartupOutcome::kRefused;
      if (!IsRequest(step.key) || refused || step.key.address >= startup.reached) continue;
      d.expected.erase(d.expected.begin() + static_cast<std::ptrdiff_t>(i - 1));
      d.actual.erase(d.actual.begin() + static_cast<std::ptrdiff_t>(i - 1));
    }
  }
  std::erase_if(found, [](const Deviation& d) {
    return (d.kind == Deviation::Kind::kFailed || d.kind == Deviation::Kind::kNotShown) && d.expected.empty();
  });
}

/// What the capture does not show the end of is no deviation; after a refused state it adds nothing.
void AddNotShown(const SlaveSummary& slave, std::vector<Deviation>& found, Comparison& comparison) {
  const auto cause = std::ranges::find_if(found, [](const Deviation& d) {
    return d.kind == Deviation::Kind::kFailed && IsRequest(d.expected.front()->key);
  });
  const FrameNo until = cause != found.end() ? cause->frame.number : ~FrameNo{0};
  std::vector<const StartupStep*> steps;
  for (const Deviation& d : found) {
    if (d.kind != Deviation::Kind::kNotShown) continue;
    std::ranges::copy_if(d.actual, std::back_inserter(steps),
                         [&](const StartupStep* step) { return step->frame.number < until; });
  }
  std::erase_if(found, [](const Deviation& d) { return d.kind == Deviation::Kind::kNotShown; });
  if (steps.empty()) return;
  comparison.not_compared.push_back(
      {slave.id, Reason::Of(ReasonCode::kNotInCapture, kOutcome), Deviation::Kind::kFailed});
}

/// What a start-up did not reach, because a state was not reached, is reported with that state.
void TakeConsequences(std::vector<Deviation>& found) {
  const auto cause = std::ranges::find_if(found, [](const Deviation& d) {
    return d.kind == Deviation::Kind::kFailed && IsRequest(d.expected.front()->key);
  });
  if (cause == found.end()) return;
  const FrameNo since = cause->actual.front()->frame.number;
  for (Deviation& d : found) {
    const bool at_end = d.kind == Deviation::Kind::kMissing && (d.to_the_end || d.next == nullptr);
    if (!at_end || d.previous == nullptr || d.previous->frame.number < since) continue;
    cause->behind.insert(cause->behind.end(), d.expected.begin(), d.expected.end());
    d.expected.clear();
  }
  std::erase_if(found, [](const Deviation& d) { return d.kind == Deviation::Kind::kMissing && d.expected.empty(); });
}

/// One expectation against one result.
class WholeComparison {
 public:
  WholeComparison(const Expectation& expectation, const AnalysisResult& result)
      : expectation_(expectation), result_(result), end_(result.capture.last) {
    under_way_ = std::ranges::any_of(result.slaves, [&](const SlaveSummary& slave) {
      return !slave.startup.ended && EndsWith(slave.startup, end_);
    });
  }

  Comparison Run() {
    if (!expectation_.bus.empty() || expectation_.strict) CompareBus();
    const std::vector<SlaveMatch> matches = MatchSlaves(expectation_.slaves, result_.slaves);
    std::vector<bool> used(result_.slaves.size(), false);
    for (std::size_t e = 0; e < expectation_.slaves.size(); ++e) {
      const ExpectedSlave& expected = expectation_.slaves[e];
      if (!matches[e].place) {
        Miss(expected);
        continue;
      }
      used[*matches[e].place] = true;
      const SlaveSummary& slave = result_.slaves[*matches[e].place];
      if (matches[e].moved) Moved(expected, slave);
      CompareRevision(expected, slave);
      CompareSlave(expected, slave);
    }
    for (std::size_t a = 0; a < used.size(); ++a) {
      if (used[a]) continue;
      other_layout_ = true;
      if (expectation_.strict) {
        Unexpected(result_.slaves[a]);
      } else {
        New(result_.slaves[a]);
      }
    }
    AddShifted();
    AddFurther();
    return std::move(out_);
  }

 private:
  void Add(std::vector<Deviation> found, SlaveId slave, const ExpectedSlave* expected, const FrameRef& startup_end) {
    for (Deviation& deviation : found) {
      deviation.slave = slave;
      deviation.expected_slave = expected;
      if (deviation.to_the_end || !deviation.frame.seen()) deviation.frame = startup_end.seen() ? startup_end : end_;
      const bool shifted = deviation.kind == Deviation::Kind::kValue && deviation.expected.front()->data &&
                           LogicalStartOnly(deviation.expected.front()->key, *deviation.expected.front()->data,
                                            deviation.actual.front()->data);
      other_layout_ = other_layout_ || (!shifted && ChangesMapping(deviation));
      (shifted ? shifted_ : out_.deviations).push_back(std::move(deviation));
    }
  }

  static bool ChangesMapping(const Deviation& deviation) {
    if (deviation.kind == Deviation::Kind::kFailed) return false;
    return std::ranges::any_of(deviation.expected, [](const ExpectedStep* step) { return IsMapping(step->key); }) ||
           std::ranges::any_of(deviation.actual, [](const StartupStep* step) { return IsMapping(step->key); });
  }

  /// Where process data lie depends on those of all slaves. With another bus, or other data of one slave, they lie
  /// elsewhere; nothing is wrong with that.
  void AddShifted() {
    if (shifted_.empty()) return;
    if (!other_layout_) {
      std::move(shifted_.begin(), shifted_.end(), std::back_inserter(out_.deviations));
      return;
    }
    out_.not_compared.push_back(
        {kNoSlave, Reason::Of(ReasonCode::kAmbiguous, kLogicalAddresses), Deviation::Kind::kValue});
  }

  /// Only one start-up of each slave is kept.
  void AddFurther() {
    const FrameNo next = NextStartup(result_);
    if (next == 0) return;
    out_.not_compared.push_back(
        {kNoSlave, Reason::Of(ReasonCode::kNotFollowed, kFurtherStartup), Deviation::Kind::kMissing});
  }

  [[nodiscard]] std::vector<Deviation> Steps(const std::vector<ExpectedStep>& expected,
                                             const StartupSummary& actual) const {
    return CompareSteps(expected, actual.steps, expectation_.separate_mailbox, expectation_.strict);
  }

  void CompareBus() {
    // A capture that begins after the scan shows slaves, but not the broadcasts before.
    const StartupSummary& bus = result_.bus.startup;
    if (bus.steps.empty() && !expectation_.bus.empty()) {
      out_.not_compared.push_back({kNoSlave, Reason::Of(ReasonCode::kNotInCapture, kBroadcasts), {}});
      return;
    }
    std::vector<Deviation> found = Steps(expectation_.bus, bus);
    std::erase_if(found, [](const Deviation& d) { return d.kind == Deviation::Kind::kNotShown; });
    if (EndsWith(bus, end_) || under_way_) LeaveOutToCome(kNoSlave, found, out_);
    Add(std::move(found), kNoSlave, nullptr, bus.end);
  }

  void Miss(const ExpectedSlave& expected) {
    if (!ShowsPlace(result_, expected.position)) {
      out_.not_compared.push_back(
          {kNoSlave, Reason::Of(ReasonCode::kNotInCapture, kPlaces), Deviation::Kind::kSlaveMissing});
      return;
    }
    other_layout_ = true;
    // The scan shows which slaves are present; what this means for them comes after it.
    const StartupPhaseSummary* scan = result_.bus.startup.phase(StartupPhase::kScan);
    out_.deviations.push_back({.kind = Deviation::Kind::kSlaveMissing,
                               .expected_slave = &expected,
                               .frame = scan != nullptr ? scan->first : end_});
  }

  [[nodiscard]] const FrameRef& FirstFrame(const SlaveSummary& slave) const {
    return slave.startup.phases.empty() ? end_ : slave.startup.phases.front().first;
  }

  void Moved(const ExpectedSlave& expected, const SlaveSummary& slave) {
    other_layout_ = true;
    out_.deviations.push_back({.kind = Deviation::Kind::kSlaveMoved,
                               .slave = slave.id,
                               .expected_slave = &expected,
                               .frame = FirstFrame(slave),
                               .position = slave.position});
  }

  void CompareRevision(const ExpectedSlave& expected, const SlaveSummary& slave) {
    const std::optional<std::uint32_t>& revision = slave.identity.revision;
    if (!expected.revision || !revision || *expected.revision == *revision) return;
    const StartupPhaseSummary* eeprom = slave.startup.phase(StartupPhase::kEeprom);
    out_.deviations.push_back({.kind = Deviation::Kind::kRevision,
                               .slave = slave.id,
                               .expected_slave = &expected,
                               .frame = eeprom != nullptr ? eeprom->first : FirstFrame(slave),
                               .revision = *revision});
  }

  void CompareSlave(const ExpectedSlave& expected, const SlaveSummary& slave) {
    if (const std::optional<Reason> reason = WhyNotCompared(slave, result_.capture)) {
      out_.not_compared.push_back({slave.id, *reason, {}});
      return;
    }
    std::vector<Deviation> found = Steps(expected.steps, slave.startup);
    LeaveOutUnseen(slave, found, out_);
    if (EndsWith(slave.startup, end_) || (!slave.startup.ended && under_way_)) {
      const bool cut = LeaveOutToCome(slave.id, found, out_);
      if (cut && !slave.startup.ended) ++out_.cut;
    }
    LeaveOutOvercome(slave.startup, found);
    TakeConsequences(found);
    AddNotShown(slave, found, out_);
    Add(std::move(found), slave.id, &expected, slave.startup.end);
    CompareLimits(expectation_, expected, slave, out_);
  }

  void New(const SlaveSummary& slave) {
    out_.not_compared.push_back(
        {slave.id, Reason::Of(ReasonCode::kNotFollowed, kNewSlave), Deviation::Kind::kSlaveUnexpected});
  }

  void Unexpected(const SlaveSummary& slave) {
    out_.deviations.push_back(
        {.kind = Deviation::Kind::kSlaveUnexpected, .slave = slave.id, .frame = FirstFrame(slave)});
  }

  const Expectation& expectation_;
  const AnalysisResult& result_;
  const FrameRef& end_;  // of the capture
  Comparison out_;
  std::vector<Deviation> shifted_;  // FMMUs whose logical address alone differs
  bool under_way_ = false;     // some slave is brought up, one after the other as masters do, when the capture ends
  bool other_layout_ = false;  // other slaves, or other process data, than expected
};

}  // namespace

Comparison Compare(const Expectation& expectation, const AnalysisResult& result) {
  return WholeComparison(expectation, result).Run();
}

namespace {

ExpectedStep Expected(const StartupStep& step) {
  ExpectedStep expected;
  expected.key = step.key;
  expected.phase = step.phase;
  expected.name = step.name;
  expected.text = step.text;
  const bool reads = step.key.kind == StartupKey::Kind::kUpload;
  const bool whole = step.data.size() == step.size;
  // What a slave answers is not what the master does; a value of which only a part was kept cannot be compared.
  if (!reads && !step.volatile_value && whole && !step.data.empty()) expected.data = step.data;
  return expected;
}

/// What a slave answered is what it has to answer again; who answers what is sent to all depends on who is there.
ExpectedStep ExpectedOfSlave(const StartupStep& step) {
  ExpectedStep expected = Expected(step);
  // Of what a drive is commanded only that it was enabled in the end is an outcome.
  expected.succeeds = step.outcome == StartupOutcome::kDone && (!IsDrive(step.key) || Enables(step.key));
  return expected;
}

}  // namespace

Expectation ExpectationOf(const AnalysisResult& result) {
  Expectation expectation;
  for (const StartupStep& step : result.bus.startup.steps) expectation.bus.push_back(Expected(step));
  for (const SlaveSummary& slave : result.slaves) {
    ExpectedSlave& expected = expectation.slaves.emplace_back();
    expected.position = slave.position;
    expected.vendor_id = slave.identity.vendor_id;
    expected.product_code = slave.identity.product_code;
    expected.revision = slave.identity.revision;
    expected.name = slave.name;
    for (const StartupStep& step : slave.startup.steps) expected.steps.push_back(ExpectedOfSlave(step));
  }
  return expectation;
}

}  // namespace ecaudit::startup
