// Nearly all frames are one cycle after the last one: the models have a short way for these. Whatever comes, it counts
// the same as the full way.
#include <algorithm>
#include <array>
#include <cstdint>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "analyzers/sync/output_rate.h"
#include "analyzers/sync/sync0_phase.h"
#include "decoder/base/bytes.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/esc/register_image.h"

namespace ecaudit::sync {
namespace {

constexpr TimeNs kCycle = 1'000'000;

struct Way {
  TimeNs jitter;  ///< each frame is up to so much late
  TimeNs drift;   ///< each cycle is so much longer
};
constexpr std::array kWays{
    Way{0, 0},       Way{600, 0},       Way{5'000, 37},    Way{0, -700},         Way{5'000, 9'000},
    Way{240'000, 0}, Way{600'000, 0},   Way{0, 100'000},   Way{900'000, 40'000}, Way{100'000, -90},
    Way{0, 499'000}, Way{0, 1'000'000}, Way{1'500'000, 0}, Way{0, -400'000}};

/// When frames are sent: by `way`, with a pause, a burst or a lost frame here and there.
class Sender {
 public:
  explicit Sender(const Way& way, unsigned seed) : way_(way), random_(seed) {}

  TimeNs Next() {
    const unsigned chance = static_cast<unsigned>(random_() % 200);
    const TimeNs cycles = chance == 0 ? 40 : chance < 3 ? 2 : chance == 3 ? 0 : 1;
    due_ += cycles * (kCycle + way_.drift) + (cycles == 0 ? 20'000 : 0);
    const TimeNs late = way_.jitter == 0 ? 0 : static_cast<TimeNs>(random_() % static_cast<std::uint64_t>(way_.jitter));
    last_ = std::max(last_ + 5'000, due_ + late);
    return last_;
  }
  [[nodiscard]] bool Chance(unsigned one_in) { return random_() % one_in == 0; }

 private:
  Way way_;
  std::mt19937_64 random_;
  TimeNs due_ = kCycle;
  TimeNs last_ = 0;
};

FrameRef FrameAt(FrameNo number, TimeNs time) {
  FrameRef frame;
  frame.number = number;
  frame.time = time;
  frame.has_time = true;
  return frame;
}

TEST(ShortWays, OfTheRateCountTheSame) {
  for (unsigned seed = 1; seed <= kWays.size(); ++seed) {
    SCOPED_TRACE(seed);
    Sender sender(kWays[seed - 1], seed);
    OutputRate by_short, in_full;
    CyclicImage image;
    image.nominal_ns = kCycle + kWays[seed - 1].drift;
    image.spread_ns = kWays[seed - 1].jitter / 4;
    TimeNs before = 0;
    for (FrameNo number = 1; number <= 20'000; ++number) {
      if (number % 500 == 1) {
        image.nominal_of = number;
        EXPECT_EQ(by_short.Renew(image, 0, false), in_full.Renew(image, 0, false));
      }
      const TimeNs now = sender.Next();
      const TimeBase base = sender.Chance(900) ? TimeBase::kNone : sender.Chance(1500) ? TimeBase::kEsl : TimeBase::kDc;
      const Interval interval{now - before, base};
      by_short.Add(interval, FrameAt(number - 1, before), FrameAt(number, now));
      in_full.AddInFull(interval, FrameAt(number - 1, before), FrameAt(number, now));
      before = now;
      ASSERT_EQ(by_short.cycles(), in_full.cycles()) << number;
      ASSERT_EQ(by_short.ns(), in_full.ns()) << number;
      ASSERT_EQ(by_short.first().number, in_full.first().number) << number;
      ASSERT_EQ(by_short.last().number, in_full.last().number) << number;
      ASSERT_EQ(by_short.turn_from(), in_full.turn_from()) << number;
      ASSERT_EQ(by_short.MayTurn(image, 0), in_full.MayTurn(image, 0)) << number;
      ASSERT_DOUBLE_EQ(by_short.JitterShare(), in_full.JitterShare()) << number;
    }
  }
}

/// A slave whose SYNC0 has pulses each kCycle, from one cycle on.
class Unit {
 public:
  Unit() {
    Write(esc::kSync0Cycle, {0x40, 0x42, 0x0F, 0x00});
    Write(esc::kDcStartTime, {0x40, 0x42, 0x0F, 0, 0, 0, 0, 0});
    Write(esc::kDcActivation, {0x03});
  }
  [[nodiscard]] const DcUnit& unit() const { return unit_; }

 private:
  void Write(EscAddress address, const std::vector<std::uint8_t>& bytes) {
    registers_.Write(address, bytes, Certainty::kObserved);
    track::SlaveAccess access;
    access.slave = 0;
    access.returned = FrameAt(++frames_, 0);
    access.command = wire::Command::FPWR;
    access.address = address;
    access.written = bytes;
    access.acceptance = track::Acceptance::kAccepted;
    (void)unit_.On(access, registers_);
  }

  esc::RegisterImage registers_;
  DcUnit unit_;
  FrameNo frames_ = 0;
};

/// Frames that each come well between the next two pulses are counted by their phases, and added later at once.
class ByPhases {
 public:
  explicit ByPhases(const DcUnit& unit) : unit_(unit), margin_(Sync0Phase::UncertaintyOf(unit)) {}

  void Add(const FrameRef& frame, const DcTime& now, std::int64_t way) {
    const auto since = static_cast<TimeNs>(now.ns) - static_cast<TimeNs>(last_time_.ns);
    const TimeNs phase = phase_ + since - kCycle;
    const bool next = steady_ && now.epoch == last_time_.epoch && since > 0 && since < kCycle + kCycle / 2 &&
                      phase >= margin_ && phase < kCycle - margin_;
    if (next) {
      measured.CountSteady(frame, phase, kCycle);
      phase_ = phase;
      ++count_;
      ++counted;
    } else {
      Settle();
      (void)measured.Add(unit_, frame, now, true, way);
      steady_ = measured.IsSteady(unit_, now);
      phase_ = measured.last_ns();
    }
    last_time_ = now;
    last_ = frame;
  }
  void Settle() {
    if (count_ > 0) measured.GoOn(last_, count_, phase_, kCycle);
    count_ = 0;
  }

  Sync0Phase measured;
  std::uint64_t counted = 0;

 private:
  const DcUnit& unit_;
  TimeNs margin_;
  bool steady_ = false;
  TimeNs phase_ = 0;
  DcTime last_time_;
  FrameRef last_;
  std::uint64_t count_ = 0;
};

TEST(ShortWays, OfThePhaseCountTheSame) {
  const Unit slave;
  ASSERT_GT(slave.unit().pulse_cycle_ns(), 0U);
  for (unsigned seed = 1; seed <= kWays.size(); ++seed) {
    SCOPED_TRACE(seed);
    Sender sender(kWays[seed - 1], seed);
    ByPhases short_way(slave.unit());
    Sync0Phase in_full;
    const Sync0Phase& by_short = short_way.measured;
    for (FrameNo number = 1; number <= 20'000; ++number) {
      const TimeNs now = sender.Next();
      const DcTime time{static_cast<std::uint64_t>(now), sender.Chance(4000) ? 1U : 0U};
      const FrameRef frame = FrameAt(number, now);
      constexpr std::int64_t kWay = 700;
      short_way.Add(frame, time, kWay);
      const Sync0Phase::Arrival arrival = in_full.Add(slave.unit(), frame, time, true, kWay);
      if (number % 50 != 0) continue;
      short_way.Settle();
      ASSERT_EQ(by_short.frames(), in_full.frames()) << number;
      ASSERT_EQ(by_short.missed(), in_full.missed()) << number << " " << arrival.empty;
      ASSERT_EQ(by_short.undecided(), in_full.undecided()) << number;
      ASSERT_EQ(by_short.last_ns(), in_full.last_ns()) << number;
    }
    const SyncPhase a = by_short.Summary(kCycle), b = in_full.Summary(kCycle);
    EXPECT_EQ(a.empty_intervals, b.empty_intervals);
    EXPECT_EQ(a.double_intervals, b.double_intervals);
    EXPECT_EQ(a.histogram, b.histogram);
    EXPECT_EQ(a.margin_frame.number, b.margin_frame.number);
    EXPECT_DOUBLE_EQ(a.mean_us, b.mean_us);
    EXPECT_DOUBLE_EQ(a.stddev_us, b.stddev_us);
    if (seed == 1) EXPECT_GT(short_way.counted, 15'000U);
  }
}

}  // namespace
}  // namespace ecaudit::sync
