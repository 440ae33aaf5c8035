// What the synchronisation model makes of small scenarios.
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "analyzers/analysis.h"
#include "tests/support/trace_builder.h"

namespace ecaudit::test {
namespace {

/// A slave with two bytes each way at 0x10000, in OP.
constexpr const char* kInOp = R"(@slaves 1
+0us  APRD 0:0x0010 01 10
+1ms  FPWR 0x1001:0x0600 00 00 01 00 02 00 00 07 00 11 00 02 01 00 00 00
+1ms  FPWR 0x1001:0x0610 00 00 01 00 02 00 00 07 40 11 00 01 01 00 00 00
+1ms  FPWR 0x1001:0x0810 00 11 02 00 64 00 01 00
+1ms  FPRD 0x1001:0x0130 08 00 00 00 00 00
)";

std::string Hex8(std::uint64_t value) {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string out;
  for (int i = 0; i < 8; ++i) {
    const auto byte = static_cast<std::uint8_t>(value >> (8 * i));
    out += ' ';
    out += kDigits[byte >> 4U];
    out += kDigits[byte & 0xFU];
  }
  return out;
}

AnalysisResult AnalyseText(const std::string& text, const AnalysisOptions& options = {}) {
  const auto trace = Trace::Parse(text);
  if (!trace) {
    ADD_FAILURE() << trace.error().message;
    return {};
  }
  return Analyse(*trace->Source(), options);
}

TEST(SyncModel, TheTimeOfAFrameMayStandBehindItsProcessData) {
  std::string behind = kInOp;
  std::string before = kInOp;
  for (std::uint64_t i = 0; i < 30; ++i) {
    const std::string time = Hex8(1'000'000'000'000 + i * 500'000);
    behind += "+1ms LRW 0x10000 01 00 -> 00 00 wkc=3 & FRMW 0x1001:0x0910" + time + " wkc=1\n";
    before += "+1ms FRMW 0x1001:0x0910" + time + " wkc=1 & LRW 0x10000 01 00 -> 00 00 wkc=3\n";
  }
  for (const std::string& text : {behind, before}) {
    const CycleSummary cycle = AnalyseText(text).bus.cycle;
    EXPECT_EQ(cycle.time_source, "dc");
    EXPECT_EQ(cycle.cycles, 29U);
    EXPECT_DOUBLE_EQ(cycle.mean_us, 500);
    EXPECT_DOUBLE_EQ(cycle.stddev_us, 0);
  }
}

/// 100 frames with process data. The master sends every 1 ms, `late_us` later each second time; the stamps show
/// `stamped_us` of that; they return after `trip_us`, `longer_us` later each second time.
CycleSummary CycleOf(int late_us, int stamped_us, int trip_us, int longer_us) {
  std::string text = kInOp;
  int stamp_us = 4'000;
  for (int i = 0; i < 100; ++i) {
    const int odd = i % 2;
    const int at_us = 10'000 + 1'000 * i + odd * stamped_us;
    const std::string time =
        Hex8(1'000'000'000'000 + std::uint64_t(i) * 1'000'000 + std::uint64_t(odd * late_us) * 1'000);
    text += "+" + std::to_string(at_us - stamp_us) + "us LRW 0x10000 01 00 -> 00 00 wkc=3 & FRMW 0x1001:0x0910" + time +
            " wkc=1 rtt=" + std::to_string(trip_us + odd * longer_us) + "us\n";
    stamp_us = at_us;
  }
  return AnalyseText(text).bus.cycle;
}

TEST(SyncModel, DifferencesBetweenCyclesHaveTheirOrigin) {
  const auto master = CycleOf(100, 100, 30, 0).origins;
  ASSERT_TRUE(master && master->recorder_us);
  EXPECT_NEAR(master->master_us, 200, 1) << "900 us and 1,100 us take turns";
  EXPECT_NEAR(master->ShareOf(master->master_us), 100, 1);
  EXPECT_NEAR(master->round_trip_us, 30, 0.1);

  const auto recorder = CycleOf(0, 100, 30, 0).origins;
  ASSERT_TRUE(recorder && recorder->recorder_us);
  EXPECT_NEAR(recorder->ShareOf(*recorder->recorder_us), 100, 1);
  EXPECT_NEAR(*recorder->recorder_us, 200, 1);

  const auto way = CycleOf(0, 0, 30, 60).origins;
  ASSERT_TRUE(way);
  EXPECT_NEAR(way->ShareOf(way->return_us), 100, 1);
  EXPECT_NEAR(way->return_us, 60, 1);
  EXPECT_NEAR(way->longest_round_trip_us, 90, 0.1);
}

/// Process data every millisecond, 30 us on their way; the first frame number of each exchange is that of its sending.
std::vector<Packet> EveryMillisecond(int exchanges) {
  Trace trace = *Trace::Parse(kInOp);
  for (int i = 0; i < exchanges; ++i) {
    trace.At(10'000 + i * 1'000).Lrw(0x10000, {1, 0}, {0, static_cast<std::uint8_t>(i)}).Wkc(3);
  }
  return trace.Packets();
}

void ExpectEveryMillisecond(std::vector<Packet> packets, std::uint64_t cycles) {
  MemorySource source(std::move(packets));
  const CycleSummary cycle = Analyse(source, {}).bus.cycle;
  EXPECT_EQ(cycle.cycles, cycles);
  EXPECT_EQ(cycle.missing, 0U);
  EXPECT_DOUBLE_EQ(cycle.min_us, 1000);
  EXPECT_DOUBLE_EQ(cycle.max_us, 1000);
}

TEST(SyncModel, FramesThatDoNotComeBackAreSentAllTheSame) {
  std::vector<Packet> packets = EveryMillisecond(60);
  const std::size_t first = packets.size() - 120;
  for (const std::size_t lost : {50U, 31U, 30U}) {  // two neighbours among them; from the end, so that places stay
    packets.erase(packets.begin() + static_cast<std::ptrdiff_t>(first + 2 * lost + 1));
  }
  ExpectEveryMillisecond(std::move(packets), 59 - 5);  // of intervals that touch a lost one nothing is said
}

TEST(SyncModel, ReturnsInAnotherOrderDoNotTurnTimeBack) {
  Trace trace = *Trace::Parse(kInOp);
  for (int i = 0; i < 40; ++i) {
    // The 20th is on its way for longer than a cycle.
    trace.At(10'000 + i * 1'000).Lrw(0x10000, {1, 0}, {0, 1}).Wkc(3).Rtt(i == 20 ? 1'050'000 : 30'000);
  }
  ExpectEveryMillisecond(trace.Packets(), 39 - 3);
}

TEST(SyncModel, TimesOfSendingAndReturnAreNotMixed) {
  Trace trace;
  trace.Slaves(1);
  for (int i = 0; i < 300; ++i) trace.At(i * 1'000).Lrw(0x10000, {1, 0}, {0, 1}).Wkc(3);
  std::vector<Packet> packets = trace.Packets();
  packets.erase(packets.begin());  // the capture begins with a return
  ExpectEveryMillisecond(std::move(packets), 298);
}

TEST(SyncModel, AClockThatTellsOfFewFramesIsNotTheBase) {
  std::string text = kInOp;
  for (std::uint64_t i = 0; i < 30; ++i) {
    text += "+1ms LRW 0x10000 01 00 -> 00 00 wkc=3";
    if (i % 2 == 0) text += " & FRMW 0x1001:0x0910" + Hex8(1'000'000'000'000 + i * 1'000'000) + " wkc=1";
    text += "\n";
  }
  EXPECT_EQ(AnalyseText(text).bus.cycle.time_source, "capture");
}

// SYNC0 every millisecond from 1,000,010,000,000 on. A frame of 60 bytes and 4 of FCS lasts 5.12 us.
TEST(SyncModel, PhaseAgainstSync0) {
  std::string text = kInOp;
  text += "+1ms FPWR 0x1001:0x0920 00 00 00 00 00 00 00 00\n";
  text += "+1ms FPWR 0x1001:0x0990" + Hex8(1'000'010'000'000) + "\n";
  text += "+1ms FPWR 0x1001:0x09A0 40 42 0f 00\n";
  text += "+1ms FPWR 0x1001:0x0981 03\n";
  std::uint64_t time = 1'000'010'300'000;
  for (int i = 0; i < 30; ++i) {
    if (i == 10) time += 1'000'000;  // an interval without a frame
    if (i == 20) time -= 800'000;    // on the other side of the pulse: two frames in one interval
    text += "+1ms LRW 0x10000 01 00 -> 00 00 wkc=3 & FRMW 0x1001:0x0910" + Hex8(time) + " wkc=1\n";
    time += i == 20 ? 1'800'000 : 1'000'000;
  }
  const AnalysisResult result = AnalyseText(text);
  ASSERT_EQ(result.slaves.size(), 1U);
  ASSERT_TRUE(result.slaves[0].dc && result.slaves[0].dc->phase);
  const SyncPhase& phase = *result.slaves[0].dc->phase;
  EXPECT_EQ(phase.frames, 30U);
  EXPECT_NEAR(phase.min_us, 305.12, 0.5);
  EXPECT_NEAR(phase.max_us, 505.12, 0.5);
  EXPECT_EQ(phase.empty_intervals, 2U);  // the second where the frame that came early is missing
  EXPECT_EQ(phase.double_intervals, 1U);
}

std::string Sync0From(std::uint64_t start) {
  return "+1ms FPWR 0x1001:0x0981 00\n+1ms FPWR 0x1001:0x0990" + Hex8(start) +
         "\n+1ms FPWR 0x1001:0x09A0 40 42 0f 00\n+1ms FPWR 0x1001:0x0981 03\n";
}

std::string FramesFrom(std::uint64_t time, std::uint64_t count) {
  std::string text;
  for (std::uint64_t i = 0; i < count; ++i) {
    text += "+1ms LRW 0x10000 01 00 -> 00 00 wkc=3 & FRMW 0x1001:0x0910" + Hex8(time + i * 1'000'000) + " wkc=1\n";
  }
  return text;
}

TEST(SyncModel, APhaseIsThatOfTheLastSettingsAndTheLastTimeInOp) {
  const std::string first = kInOp + std::string("+1ms FPWR 0x1001:0x0920 00 00 00 00 00 00 00 00\n") +
                            Sync0From(1'000'010'000'000) + FramesFrom(1'000'010'300'000, 20);
  const std::string leave_op = "+1ms FPWR 0x1001:0x0120 04 00\n+1ms FPRD 0x1001:0x0130 04 00 00 00 00 00\n";
  const std::string back = "+1ms FPWR 0x1001:0x0120 08 00\n+1ms FPRD 0x1001:0x0130 08 00 00 00 00 00\n";
  // In OP with other settings, and with the same when it was left.
  const std::string shifted = first + Sync0From(1'000'040'200'000) + FramesFrom(1'000'041'300'000, 10);
  const std::string again = first + leave_op + back + FramesFrom(1'000'041'100'000, 10);
  for (const std::string& text : {shifted, again}) {
    const AnalysisResult result = AnalyseText(text);
    ASSERT_TRUE(result.slaves.size() == 1 && result.slaves[0].dc && result.slaves[0].dc->phase);
    EXPECT_EQ(result.slaves[0].dc->phase->frames, 10U);
    EXPECT_NEAR(result.slaves[0].dc->phase->mean_us, 105.12, 0.5);
  }
  // No frame in OP since: the last phase stands.
  const AnalysisResult stopped = AnalyseText(first + leave_op);
  ASSERT_TRUE(stopped.slaves.size() == 1 && stopped.slaves[0].dc && stopped.slaves[0].dc->phase);
  EXPECT_GE(stopped.slaves[0].dc->phase->frames, 19U);
}

TEST(SyncModel, FramesOnBothSidesOfAPulseAreAtItInTheMean) {
  std::string text =
      kInOp + std::string("+1ms FPWR 0x1001:0x0920 00 00 00 00 00 00 00 00\n") + Sync0From(1'000'010'000'000);
  for (std::uint64_t i = 0; i < 20; ++i) {
    text += FramesFrom(1'000'010'974'880 + i * 1'000'000 + (i % 2) * 50'000, 1);
  }
  const AnalysisResult result = AnalyseText(text);
  ASSERT_TRUE(result.slaves.size() == 1 && result.slaves[0].dc && result.slaves[0].dc->phase);
  EXPECT_NEAR(result.slaves[0].dc->phase->mean_us, 5, 0.5);
  EXPECT_NEAR(result.slaves[0].dc->phase->stddev_us, 25, 0.5);
}

/// An AKD in OP with SYNC0 every millisecond; 100 us before each frame with its process data comes one with the time.
class ByStamps {
 public:
  ByStamps() : trace_(*Trace::Parse(kSync0On)) {}

  /// Process data that arrive `phase_us` behind a pulse, with half a microsecond besides, as the stamps tell; these are
  /// so much too late.
  void Cycle(int phase_us, int late_of_time_us = 0, int late_of_data_us = 0) {
    const std::int64_t at = 20'000 + 1'000 * cycles_++ + phase_us;
    const std::uint64_t dc = 1'000'010'000'000 + static_cast<std::uint64_t>(at - 20'000) * 1000 + 1'000'000 - 104'620;
    Bytes time;
    for (int i = 0; i < 8; ++i) time.push_back(static_cast<std::uint8_t>(dc >> (8 * i)));
    trace_.At(at - 100).Frmw(0x1001, 0x0910, time).Wkc(1).Rtt(30'000 + 1000 * late_of_time_us);
    trace_.At(at).Lrw(0x10000, {1, 0}, {0, 0}).Wkc(3).Rtt(30'000 + 1000 * late_of_data_us);
  }
  [[nodiscard]] AnalysisResult Result() const {
    AnalysisOptions options;
    options.default_profile = "kollmorgen-akd-2011";
    return Analyse(*trace_.Source(), options);
  }

 private:
  static inline const std::string kSync0On = kInOp + std::string("+1ms FPWR 0x1001:0x0920 00 00 00 00 00 00 00 00\n") +
                                             "+1ms FPWR 0x1001:0x0990" + Hex8(1'000'010'000'000) +
                                             "\n+1ms FPWR 0x1001:0x09A0 40 42 0f 00\n+1ms FPWR 0x1001:0x0981 03\n";

  Trace trace_;
  int cycles_ = 0;
};

std::vector<Finding> WindowViolations(const AnalysisResult& result) {
  std::vector<Finding> found;
  for (const Finding& finding : result.findings) {
    if (finding.rule == "sync-window-violation") found.push_back(finding);
  }
  return found;
}

/// Reasons why the window was not evaluated.
std::vector<Reason> WindowNotEvaluated(const AnalysisResult& result) {
  std::vector<Reason> reasons;
  for (const NotEvaluable& not_evaluable : result.not_evaluable) {
    if (not_evaluable.rule == "sync-window-violation") reasons.push_back(not_evaluable.reason);
  }
  return reasons;
}

TEST(SyncModel, FramesThatCreepOverSync0AreFoundByStampsToo) {
  ByStamps frames;
  for (int phase = -300; phase < 300; ++phase) frames.Cycle(phase);  // how good the stamps are is known after twenty
  const std::vector<Finding> found = WindowViolations(frames.Result());
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].count, 1U);
  EXPECT_TRUE(found[0].Is("sync-window-violation", "interval-empty")) << IdentityOf(found[0]);
}

// Of half a second, one stamp is wrong one way and one the other.
TEST(SyncModel, AStampThatIsWrongMovesNoFrameOverSync0) {
  ByStamps frames;
  for (int i = 0; i < 520; ++i) frames.Cycle(0, i == 100 ? 20 : 0, i == 300 ? 20 : 0);
  const AnalysisResult result = frames.Result();
  EXPECT_TRUE(WindowViolations(result).empty());
  EXPECT_EQ(WindowNotEvaluated(result).size(), 1U);
}

// Nor one that creeps, as long as it is not well over it: that it may have been is told.
TEST(SyncModel, FramesThatCreepALittleOverSync0AreNotJudgedByStamps) {
  ByStamps frames;
  for (int phase = -100; phase < 100; ++phase) frames.Cycle(phase);
  const AnalysisResult result = frames.Result();
  EXPECT_TRUE(WindowViolations(result).empty());
  EXPECT_EQ(WindowNotEvaluated(result).size(), 1U);
}

/// A Pilz drive in OP without SYNC0, 60C2h 500 us. Frames are 60 us late and in time by turns, so that no interval is
/// as long as a cycle, and one comes `late_us` late.
AnalysisResult AlternatingFrames(int late_us) {
  std::string text = kInOp;
  text += "+1ms FPWR 0x1001:0x0800 00 18 10 00 26 00 01 00\n+1ms FPWR 0x1001:0x0808 00 1C 10 00 22 00 01 00\n";
  text += "+100us FPWR 0x1001:0x1800 0A 00 00 00 00 13 00 20 2F C2 60 01 05 00 00 00\n";
  text += "+100us FPRD 0x1001:0x1C00 0A 00 00 00 00 13 00 30 60 C2 60 01 00 00 00 00\n";
  text += "+100us FPWR 0x1001:0x1800 0A 00 00 00 00 23 00 20 2F C2 60 02 FC 00 00 00\n";
  text += "+100us FPRD 0x1001:0x1C00 0A 00 00 00 00 23 00 30 60 C2 60 02 00 00 00 00\n";
  int behind = 0;
  for (int i = 0; i < 400; ++i) {
    const int now = i == 300 ? late_us : i % 2 * 60;
    text += "+" + std::to_string(500 + now - behind) + "us LRW 0x10000 01 00 -> 00 00 wkc=3\n";
    behind = now;
  }
  AnalysisOptions options;
  options.default_profile = "pilz-pmcprotego-d";
  return AnalyseText(text, options);
}

TEST(SyncModel, JitterWithinTheLimitIsNone) {
  const AnalysisResult result = AlternatingFrames(60);
  for (const Finding& finding : result.findings) {
    EXPECT_NE(finding.rule, "sync-window-violation") << IdentityOf(finding);
    EXPECT_NE(finding.rule, "sync-lost") << IdentityOf(finding);
  }
}

TEST(SyncModel, JitterBeyondTheLimitIsFoundOnce) {
  const AnalysisResult result = AlternatingFrames(150);
  std::size_t found = 0;
  for (const Finding& finding : result.findings) {
    EXPECT_NE(finding.rule, "sync-lost") << IdentityOf(finding);
    if (finding.rule != "sync-window-violation") continue;
    ++found;
    EXPECT_EQ(finding.count, 1U) << IdentityOf(finding);
  }
  EXPECT_EQ(found, 1U);
}

TEST(SyncModel, SettingsAreThoseOfTheMomentSync0WasSwitchedOn) {
  std::string text = kInOp;
  text += "+1ms FPWR 0x1001:0x0990" + Hex8(5'000'000) + "\n";
  text += "+1ms FPWR 0x1001:0x09A0 40 42 0f 00\n";
  text += "+1ms FPWR 0x1001:0x0980 00 03\n";
  text += "+1ms FPWR 0x1001:0x0980 00 00\n";
  text += "+1ms FPWR 0x1001:0x09A0 00 00 00 00\n";
  const AnalysisResult result = AnalyseText(text);
  ASSERT_EQ(result.slaves.size(), 1U);
  ASSERT_TRUE(result.slaves[0].dc);
  const DcSummary& dc = *result.slaves[0].dc;
  EXPECT_EQ(dc.activated.number, 16U);
  EXPECT_EQ(dc.activated_with, 3);
  EXPECT_EQ(dc.sync0_cycle_ns, 1'000'000U);
  EXPECT_EQ(dc.start_time_ns, 5'000'000U);
  EXPECT_EQ(dc.activation, 0);
  EXPECT_EQ(dc.configuration.size(), 5U);
}

TEST(SyncModel, StepsAreBounded) {
  std::string text = kInOp;
  for (int i = 0; i < 100; ++i) text += "+1ms FPWR 0x1001:0x0990" + Hex8(5'000'000) + "\n";
  const AnalysisResult result = AnalyseText(text);
  ASSERT_TRUE(result.slaves.size() == 1 && result.slaves[0].dc);
  EXPECT_EQ(result.slaves[0].dc->configuration.size(), 64U);
  EXPECT_EQ(result.slaves[0].dc->configuration_left_out, 36U);
}

/// Two slaves, whose clocks are read every 10 ms.
AnalysisResult AnalyseDifferences(const std::vector<std::pair<std::string, std::string>>& reads) {
  std::string text = R"(@slaves 2
+0us  APRD 0:0x0010 01 10
+1ms  APRD 1:0x0010 02 10
+1ms  FRMW 0x1001:0x0910 00 00 00 00 01 00 00 00 wkc=2
)";
  for (const auto& [first, second] : reads) {
    text += "+5ms FPRD 0x1001:0x092C " + first + "\n+5ms FPRD 0x1002:0x092C " + second + "\n";
  }
  return AnalyseText(text);
}

constexpr const char* kNear = "0A 00 00 80";  // 10 ns
constexpr const char* kFar = "10 27 00 00";   // 10 us

TEST(SyncModel, AClockSettlesWithTheFirstOfTheReadsThatStayWithinTheLimit) {
  const AnalysisResult result =
      AnalyseDifferences({{kNear, kNear}, {kFar, kFar}, {kNear, kFar}, {kFar, kNear}, {kNear, kNear}});
  ASSERT_EQ(result.slaves.size(), 2U);
  const DcSummary& first = *result.slaves[0].dc;
  const DcSummary& second = *result.slaves[1].dc;
  EXPECT_EQ(Elapsed(first.difference_above.time, first.settled.time), 30'000'000);
  EXPECT_EQ(Elapsed(second.difference_above.time, second.settled.time), 20'000'000);
  EXPECT_EQ(result.bus.dc.settled_clocks, 2U);
  EXPECT_EQ(result.bus.dc.unsettled_clocks, 0U);
  EXPECT_EQ(result.bus.dc.settled_last, result.slaves[0].id);
  EXPECT_EQ(result.bus.dc.settled.number, first.settled.number);
}

TEST(SyncModel, AClockThatIsAboveTheLimitAtLastHasNotSettled) {
  const AnalysisResult result = AnalyseDifferences({{kNear, kFar}, {kNear, kNear}, {kNear, kFar}});
  ASSERT_EQ(result.slaves.size(), 2U);
  // One that was never above shows no moment.
  EXPECT_FALSE(result.slaves[0].dc->difference_above.seen());
  EXPECT_FALSE(result.slaves[0].dc->settled.seen());
  EXPECT_TRUE(result.slaves[1].dc->difference_above.seen());
  EXPECT_FALSE(result.slaves[1].dc->settled.seen());
  EXPECT_EQ(result.bus.dc.settled_clocks, 0U);
  EXPECT_EQ(result.bus.dc.unsettled_clocks, 1U);
}

}  // namespace
}  // namespace ecaudit::test
