/// in: decoder events, process data, measurements of the clocks.  out: Timeline, for reports that draw.
///
/// Only made when such a report is wanted. Memory is constant in the length of the
/// capture: series of BucketSeries, a bounded number of them, of CloseSeries around findings, and a bounded number of
/// SDO transfers. The fewer signals there are, the finer are their series.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <unordered_map>
#include <utility>
#include <vector>

#include "analyzers/collect/bucket_series.h"
#include "analyzers/collect/close_series.h"
#include "analyzers/collect/collector.h"
#include "analyzers/collect/exchange_runs.h"
#include "analyzers/model/bus_model.h"
#include "analyzers/model/drive_events.h"
#include "analyzers/model/model_events.h"
#include "analyzers/result/timeline.h"
#include "analyzers/sync/sync_model.h"
#include "analyzers/wiring/event_bus.h"
#include "decoder/track/events.h"

namespace ecaudit::timeline {

class TimelineCollector final : public Collector {
 public:
  static constexpr std::size_t kMaxSignals = 160;       ///< series of process data in all
  static constexpr std::size_t kMaxSlaveSignals = 16;   ///< of one slave
  static constexpr std::size_t kFinestBuckets = 6400;   ///< of a series, while there are few
  static constexpr std::size_t kAllBuckets = 256'000;   ///< of the series of process data in all
  static constexpr std::size_t kMaxUnmet = 64;          ///< slaves that only the ENI file knows
  static constexpr std::size_t kMaxSeriesSlaves = 128;  ///< slaves with series of their clocks and mailboxes
  static constexpr std::size_t kMaxClose = 24'000;   ///< single values around findings in all; warnings leave half of
                                                     ///< it to errors, infos three quarters
  static constexpr std::size_t kMaxCloseOfBus = 48;  ///< signals of which a finding about the whole bus keeps them
  static constexpr std::size_t kMaxSdos = 3000;      ///< transfers in all
  static constexpr std::size_t kMaxSlaveSdos = 400;  ///< of one slave

  /// @param timeline  receives what was collected, in Summarise()
  /// All arguments must outlive this.
  TimelineCollector(const model::BusModel& model, const sync::SyncModel& sync, EventBus& bus, Timeline& timeline);

  void On(const model::ProcessCycle& cycle);
  void On(const track::SlaveAccess& access);
  void On(const track::FrameLost& event);
  void On(const track::Answered& event);
  void On(const track::LogicalAccess& event);
  void On(const mailbox::MailboxMessage& message);
  /// After the model: names and values as they are known then.
  void On(const mailbox::SdoTransfer& transfer);

  void On(const model::DriveStateChanged& event);
  void On(const model::AlChangedByItself& event);

  void On(const sync::IntervalMeasured& event);
  void On(const sync::PhaseMeasured& event);

  void Follow(const std::vector<Finding>& findings) override { findings_ = &findings; }
  void Summarise(AnalysisResult& result) override;
  void Conclude() override;

 private:
  struct Signal {
    SignalSeries about;
    mailbox::DataType type = mailbox::DataType::kUnknown;
    double divisor = 1;
    BucketSeries series;
    CloseSeries close;
  };
  struct Cycle {
    BucketSeries series;
    CloseSeries close;
  };
  struct Slave {
    std::vector<std::unique_ptr<Signal>> signals;
    std::unique_ptr<BucketSeries> mailbox, phase, difference;
    ExchangeRuns outputs, inputs;
    std::vector<SdoRow> sdos;
    std::uint64_t sdos_left_out = 0;
  };
  /// A signal that is followed in one kind of datagram.
  struct Followed {
    std::uint16_t place = 0;  ///< in ImagePart::places
    Signal* signal = nullptr;
  };

  /// @param cycle  the image whose intervals are the cycle; null: none
  [[nodiscard]] Timeline Draw(const sync::CyclicImage* cycle) const;
  Slave& Of(SlaveId slave);
  /// Null beyond the limit.
  Slave* Of(const model::ImagePart& part);
  void TakeUnmet(const model::ImagePart& part);
  [[nodiscard]] bool HasSeries(SlaveId slave) const { return slave < kMaxSeriesSlaves; }
  const std::vector<Followed>& FollowedIn(const model::ImagePart& part);
  /// Holds what lies around a frame that a finding may cite later.
  void Remember(SlaveId slave, FrameNo frame);
  /// Keeps what lies around findings that are new.
  void LookCloser();
  void LookCloser(const Finding& finding);
  Signal* Find(Slave& slave, const model::Signal& entry, bool output);
  /// Makes all series of process data coarser where another signal needs room.
  void MakeRoom();
  template <typename Do>
  void ForEachSignal(Do&& act);

  const model::BusModel& model_;
  const sync::SyncModel& sync_;
  Timeline& timeline_;
  std::deque<Slave> slaves_;
  std::deque<std::pair<const model::SlaveModel*, Slave>> unmet_;
  std::unordered_map<std::uint64_t, std::vector<Followed>> followed_;  ///< by serial of the part
  std::size_t signals_ = 0;
  std::size_t buckets_each_ = kFinestBuckets;
  bool signals_left_out_ = false;
  std::size_t sdos_ = 0;
  const std::vector<Finding>* findings_ = nullptr;
  const sync::CyclicImage* cycle_ = nullptr;  ///< whose intervals are the cycle
  std::size_t looked_at_ = 0;                 ///< of them
  std::size_t close_ = 0;                     ///< values kept around findings
  BucketSeries lost_, frames_;
  std::map<const sync::CyclicImage*, Cycle> cycles_;  ///< at most CyclicImages::kMost
};

}  // namespace ecaudit::timeline
