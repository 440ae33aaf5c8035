#include "analyzers/compare/comparison.h"

#include <algorithm>
#include <utility>

#include "analyzers/compare/startup_registers.h"
#include "decoder/base/text.h"
#include "decoder/esc/al.h"

namespace ecaudit::startup {
namespace {

constexpr std::size_t kNone = static_cast<std::size_t>(-1);

/// What is judged in one order: everything, or the mailbox by itself, or steps that have no order.
enum class Chain : std::uint8_t { kMain, kMailbox, kWithoutOrder };

Chain ChainOf(const StartupKey& key, bool separate_mailbox) {
  if (IsWithoutOrder(key)) return Chain::kWithoutOrder;
  const bool mailbox = key.kind == StartupKey::Kind::kDownload || key.kind == StartupKey::Kind::kUpload;
  return mailbox && separate_mailbox ? Chain::kMailbox : Chain::kMain;
}

bool IsRequest(const StartupKey& key) {
  return key.kind == StartupKey::Kind::kRequest;
}

/// Pairs of places, ascending on both sides, as many as possible.
/// @param same  (place on the left, place on the right)
template <typename Same>
std::vector<std::pair<std::size_t, std::size_t>> LongestCommon(std::size_t left, std::size_t right, Same&& same) {
  // What both begin or end with needs no table.
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  std::size_t begin = 0;
  while (begin < left && begin < right && same(begin, begin)) {
    pairs.emplace_back(begin, begin);
    ++begin;
  }
  std::size_t tail = 0;
  while (begin + tail < left && begin + tail < right && same(left - 1 - tail, right - 1 - tail)) ++tail;
  const std::size_t rows = left - begin - tail;
  const std::size_t columns = right - begin - tail;
  std::vector<std::uint16_t> table((rows + 1) * (columns + 1), 0);
  const auto at = [&](std::size_t row, std::size_t column) -> std::uint16_t& {
    return table[row * (columns + 1) + column];
  };
  for (std::size_t below = rows; below > 0; --below) {
    const std::size_t row = below - 1;
    for (std::size_t behind = columns; behind > 0; --behind) {
      const std::size_t column = behind - 1;
      at(row, column) = same(begin + row, begin + column) ? static_cast<std::uint16_t>(at(row + 1, column + 1) + 1)
                                                          : std::max(at(row + 1, column), at(row, column + 1));
    }
  }
  for (std::size_t row = 0, column = 0; row < rows && column < columns;) {
    if (same(begin + row, begin + column) && at(row, column) == at(row + 1, column + 1) + 1) {
      pairs.emplace_back(begin + row++, begin + column++);
    } else if (at(row + 1, column) >= at(row, column + 1)) {
      ++row;
    } else {
      ++column;
    }
  }
  for (std::size_t i = tail; i > 0; --i) pairs.emplace_back(left - i, right - i);
  return pairs;
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
           return expected_[e]->key == actual_[a]->key && HasValue(*expected_[e], *actual_[a]);
         })) {
      actual_of_[e] = a;
      expected_of_[a] = e;
    }
    aligned_ = actual_of_;
    PairMoved(out);
    PairChanged(out);
    Missing(out);
    if (strict) Unexpected(out);
  }

 private:
  void Pair(std::size_t e, std::size_t a) {
    actual_of_[e] = a;
    expected_of_[a] = e;
  }

  /// Steps with the right value at the wrong place; all of one chain are one deviation.
  void PairMoved(std::vector<Deviation>& out) {
    Deviation moved;
    moved.kind = Deviation::Kind::kOrder;
    for (std::size_t e = 0; e < expected_.size(); ++e) {
      if (actual_of_[e] != kNone) continue;
      for (std::size_t a = 0; a < actual_.size(); ++a) {
        if (expected_of_[a] != kNone || expected_[e]->key != actual_[a]->key || !HasValue(*expected_[e], *actual_[a])) {
          continue;
        }
        Pair(e, a);
        if (!ordered_) break;
        if (moved.expected.empty()) {
          moved.phase = expected_[e]->phase;
          moved.frame = actual_[a]->frame;
          moved.after = e > 0 ? expected_[e - 1] : nullptr;
          moved.previous = a > 0 ? actual_[a - 1] : nullptr;
          moved.next = a + 1 < actual_.size() ? actual_[a + 1] : nullptr;
        }
        moved.expected.push_back(expected_[e]);
        moved.actual.push_back(actual_[a]);
        break;
      }
    }
    if (!moved.expected.empty()) out.push_back(std::move(moved));
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
      Deviation changed;
      changed.kind = Deviation::Kind::kValue;
      changed.phase = actual_[found]->phase;
      changed.frame = actual_[found]->frame;
      changed.expected.push_back(expected_[e]);
      changed.actual.push_back(actual_[found]);
      out.push_back(std::move(changed));
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

bool Fits(const std::optional<std::uint32_t>& a, const std::optional<std::uint32_t>& b) {
  return !a || !b || *a == *b;
}

bool SameDevice(const ExpectedSlave& expected, const SlaveSummary& actual) {
  return Fits(expected.vendor_id, actual.identity.vendor_id) &&
         Fits(expected.product_code, actual.identity.product_code) && Fits(expected.revision, actual.identity.revision);
}

void CompareLimits(const Expectation& expectation, const ExpectedSlave& expected, const SlaveSummary& slave,
                   Comparison& comparison) {
  bool without_time = false;
  for (const StartupPhaseSummary& phase : slave.startup.phases) {
    const auto p = static_cast<std::size_t>(phase.phase);
    const std::optional<TimeNs>& limit = expected.limits[p] ? expected.limits[p] : expectation.limits[p];
    if (!limit) continue;
    without_time = without_time || !phase.duration;
    if (!phase.duration || *phase.duration <= *limit) continue;
    Deviation slow;
    slow.kind = Deviation::Kind::kSlow;
    slow.slave = slave.id;
    slow.phase = phase.phase;
    slow.frame = phase.last;
    slow.limit = *limit;
    slow.took = *phase.duration;
    slow.expected_slave = &expected;
    comparison.deviations.push_back(std::move(slow));
  }
  if (without_time) {
    comparison.not_compared.push_back({slave.id, "frames of its start-up have no time stamps", Deviation::Kind::kSlow});
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

/// Of a slave that can be compared: what of its start-up the capture does not show.
void LeaveOutUnseen(const SlaveSummary& slave, std::vector<Deviation>& found, Comparison& comparison) {
  const auto of_drive = [](const ExpectedStep* step) { return step->key.kind == StartupKey::Kind::kDrive; };
  if (!slave.drive && LeaveOut(found, of_drive)) {
    comparison.not_compared.push_back(
        {slave.id,
         "the control word of the drive is not known: neither mapped by what the capture shows nor written by SDO",
         Deviation::Kind::kMissing});
  }
  if (slave.startup.steps_left_out > 0) {
    // What came behind the last step that was kept is cut off, not missing.
    const std::size_t before = found.size();
    std::erase_if(found, [](const Deviation& deviation) {
      return deviation.kind == Deviation::Kind::kMissing && (deviation.to_the_end || deviation.next == nullptr);
    });
    if (found.size() < before) {
      comparison.not_compared.push_back(
          {slave.id, Grouped(slave.startup.steps_left_out) + " further steps of its start-up were not kept",
           Deviation::Kind::kMissing});
    }
  }
  const auto early = [](const ExpectedStep* step) { return step->phase <= StartupPhase::kEeprom; };
  if (slave.position_inferred && LeaveOut(found, early)) {
    comparison.not_compared.push_back(
        {slave.id, "the capture begins when the slave has its address already", Deviation::Kind::kMissing});
  }
}

/// Why nothing can be said of a slave's start-up; empty where something can.
std::string WhyNotCompared(const SlaveSummary& slave, const CaptureSummary& capture) {
  const StartupSummary& startup = slave.startup;
  constexpr auto kPreop = static_cast<std::uint8_t>(esc::AlState::PREOP);
  const bool from_init = std::any_of(startup.steps.begin(), startup.steps.end(), [](const StartupStep& step) {
    return IsRequest(step.key) && step.key.address == static_cast<std::uint32_t>(esc::AlState::PREOP);
  });
  if (!from_init && startup.first_state && *startup.first_state >= kPreop) {
    return "the capture begins when the slave is in " + esc::StateName(*startup.first_state) + " already";
  }
  if (startup.steps.empty()) return "the capture holds nothing of its start-up";
  if (!capture.complete && !startup.ended) return "the capture was not read to its end, and the start-up goes on there";
  return {};
}

/// Whether the capture tells who is at this place of the bus, or that nobody is.
bool ShowsPlace(const AnalysisResult& result, SlavePos position) {
  if (result.bus.slave_count && position >= *result.bus.slave_count) return true;
  return std::any_of(result.slaves.begin(), result.slaves.end(),
                     [&](const SlaveSummary& slave) { return slave.position == position; });
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

std::vector<std::optional<std::size_t>> MatchSlaves(std::span<const ExpectedSlave> expected,
                                                    std::span<const SlaveSummary> actual) {
  std::vector<std::optional<std::size_t>> matches(expected.size());
  // An untouched bus: everybody where he is expected.
  bool in_place = true;
  for (std::size_t e = 0; e < expected.size() && in_place; ++e) {
    const auto found = std::find_if(actual.begin(), actual.end(),
                                    [&](const SlaveSummary& s) { return s.position == expected[e].position; });
    in_place = found != actual.end() && SameDevice(expected[e], *found);
    if (in_place) matches[e] = static_cast<std::size_t>(found - actual.begin());
  }
  if (in_place) return matches;
  std::fill(matches.begin(), matches.end(), std::nullopt);
  for (const auto& [e, a] : LongestCommon(expected.size(), actual.size(), [&](std::size_t e, std::size_t a) {
         const bool known = expected[e].product_code && actual[a].identity.product_code;
         return SameDevice(expected[e], actual[a]) && (known || expected[e].position == actual[a].position);
       })) {
    matches[e] = a;
  }
  return matches;
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

/// One expectation against one result.
class WholeComparison {
 public:
  WholeComparison(const Expectation& expectation, const AnalysisResult& result)
      : expectation_(expectation), result_(result), end_(result.capture.last) {}

  Comparison Run() {
    if (!expectation_.bus.empty() || expectation_.strict) CompareBus();
    const auto matches = MatchSlaves(expectation_.slaves, result_.slaves);
    std::vector<bool> used(result_.slaves.size(), false);
    for (std::size_t e = 0; e < expectation_.slaves.size(); ++e) {
      const ExpectedSlave& expected = expectation_.slaves[e];
      if (!matches[e]) {
        Miss(expected);
        continue;
      }
      used[*matches[e]] = true;
      CompareSlave(expected, result_.slaves[*matches[e]]);
    }
    for (std::size_t a = 0; a < used.size() && expectation_.strict; ++a) {
      if (!used[a]) Unexpected(result_.slaves[a]);
    }
    return std::move(out_);
  }

 private:
  void Add(std::vector<Deviation> found, SlaveId slave, const ExpectedSlave* expected, const FrameRef& startup_end) {
    for (Deviation& deviation : found) {
      deviation.slave = slave;
      deviation.expected_slave = expected;
      if (deviation.to_the_end || !deviation.frame.seen()) deviation.frame = startup_end.seen() ? startup_end : end_;
      out_.deviations.push_back(std::move(deviation));
    }
  }

  [[nodiscard]] std::vector<Deviation> Steps(const std::vector<ExpectedStep>& expected,
                                             const StartupSummary& actual) const {
    return CompareSteps(expected, actual.steps, expectation_.separate_mailbox, expectation_.strict);
  }

  void CompareBus() {
    // A capture that begins behind the scan shows slaves, but not the broadcasts before.
    const StartupSummary& bus = result_.bus.startup;
    if (bus.steps.empty() && !expectation_.bus.empty()) {
      out_.not_compared.push_back({kNoSlave, "the capture holds nothing that was sent to all slaves at once", {}});
    } else {
      Add(Steps(expectation_.bus, bus), kNoSlave, nullptr, bus.end);
    }
  }

  void Miss(const ExpectedSlave& expected) {
    if (!ShowsPlace(result_, expected.position)) {
      out_.not_compared.push_back(
          {kNoSlave, "the capture does not show which slave is at position " + std::to_string(expected.position),
           Deviation::Kind::kSlaveMissing});
      return;
    }
    Deviation missing;
    missing.kind = Deviation::Kind::kSlaveMissing;
    missing.expected_slave = &expected;
    missing.frame = end_;
    out_.deviations.push_back(std::move(missing));
  }

  void CompareSlave(const ExpectedSlave& expected, const SlaveSummary& slave) {
    if (std::string reason = WhyNotCompared(slave, result_.capture); !reason.empty()) {
      out_.not_compared.push_back({slave.id, std::move(reason), {}});
      return;
    }
    std::vector<Deviation> found = Steps(expected.steps, slave.startup);
    LeaveOutUnseen(slave, found, out_);
    Add(std::move(found), slave.id, &expected, slave.startup.end);
    CompareLimits(expectation_, expected, slave, out_);
  }

  void Unexpected(const SlaveSummary& slave) {
    Deviation extra;
    extra.kind = Deviation::Kind::kSlaveUnexpected;
    extra.slave = slave.id;
    extra.frame = slave.startup.phases.empty() ? end_ : slave.startup.phases.front().first;
    out_.deviations.push_back(std::move(extra));
  }

  const Expectation& expectation_;
  const AnalysisResult& result_;
  const FrameRef& end_;  // of the capture
  Comparison out_;
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
    for (const StartupStep& step : slave.startup.steps) expected.steps.push_back(Expected(step));
  }
  return expectation;
}

}  // namespace ecaudit::startup
