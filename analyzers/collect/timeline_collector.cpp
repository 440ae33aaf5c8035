#include "analyzers/collect/timeline_collector.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <variant>

#include "analyzers/objects/object_value.h"
#include "analyzers/signals/signal_value.h"
#include "decoder/base/text.h"
#include "decoder/esc/dc_registers.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/mailbox/coe_types.h"

namespace ecaudit::timeline {
namespace {

constexpr std::size_t kMaxParts = 512;
constexpr std::size_t kMaxValueBytes = 120;

/// What people look at first, best first (CIA402); everything else follows in the order of the mapping.
constexpr std::array<std::uint16_t, 13> kFirst{0x6041, 0x6040, 0x6064, 0x6063, 0x607A, 0x606C, 0x60FF,
                                               0x6077, 0x6071, 0x60F4, 0x6061, 0x6060, 0x603F};

std::size_t Rank(std::uint16_t index) {
  return static_cast<std::size_t>(std::ranges::find(kFirst, index) - kFirst.begin());
}

/// What people read bit by bit: by the object where a standard fixes it, else by its name.
bool IsBitField(const model::Signal& entry) {
  if (entry.bits < 8 || entry.bits > 32 || !entry.unit.empty() || !entry.scale.empty()) return false;
  if (entry.index == 0x6040 || entry.index == 0x6041 || entry.index == 0x60FD || entry.index == 0x60FE) return true;
  std::string name = entry.name;
  std::ranges::transform(name, name.begin(),
                         [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  const auto has = [&name](std::string_view part) { return name.find(part) != std::string::npos; };
  const auto any = [&has](auto... parts) { return (has(parts) || ...); };
  return any("word", "latch", "status", "control", "input", "output") &&
         !any("position", "velocity", "speed", "torque", "current", "value");
}

double AsDouble(const signals::SignalValue& value) {
  return std::visit([](auto number) { return static_cast<double>(number); }, value);
}

std::string OutcomeText(mailbox::SdoOutcome outcome) {
  switch (outcome) {
    case mailbox::SdoOutcome::kCompleted:
      return "completed";
    case mailbox::SdoOutcome::kAborted:
      return "aborted";
    case mailbox::SdoOutcome::kMailboxError:
      return "mailbox error";
    default:
      return "not finished";
  }
}

void Count(std::unique_ptr<BucketSeries>& series, const FrameRef& frame, double value) {
  if (!frame.has_time) return;
  if (!series) series = std::make_unique<BucketSeries>();
  series->Add(frame.time, value);
}

}  // namespace

template <typename Do>
void TimelineCollector::ForEachSignal(Do&& act) {
  for (Slave& slave : slaves_) {
    for (const std::unique_ptr<Signal>& signal : slave.signals) act(*signal);
  }
  for (auto& [model, slave] : unmet_) {
    for (const std::unique_ptr<Signal>& signal : slave.signals) act(*signal);
  }
}

void TimelineCollector::MakeRoom() {
  const std::size_t before = buckets_each_;
  while (buckets_each_ > BucketSeries::kBuckets && buckets_each_ * signals_ > kAllBuckets) buckets_each_ /= 2;
  if (buckets_each_ == before) return;
  ForEachSignal([this](Signal& signal) { signal.series.Limit(buckets_each_); });
}

TimelineCollector::TimelineCollector(const model::BusModel& model, const sync::SyncModel& sync, EventBus& bus,
                                     Timeline& timeline)
    : model_(model), sync_(sync), timeline_(timeline) {
  frames_.Limit(kFinestBuckets);
  bus.ListenTo<model::ProcessCycle, sync::IntervalMeasured, sync::PhaseMeasured, track::FrameLost, track::Answered,
               track::LogicalAccess, mailbox::MailboxMessage>(Stage::kBeforeModel, *this);
  bus.ListenTo<mailbox::SdoTransfer, model::DriveStateChanged, model::AlChangedByItself>(Stage::kAfterModel, *this);
  bus.Listen<track::SlaveAccess>(Stage::kAfterModel, *this, &TimelineCollector::On,
                                 MemoryRange::Of(esc::kSystemTimeDifference, 4));
}

TimelineCollector::Slave& TimelineCollector::Of(SlaveId slave) {
  while (slaves_.size() <= slave) slaves_.emplace_back();
  return slaves_[slave];
}

TimelineCollector::Slave* TimelineCollector::Of(const model::ImagePart& part) {
  if (part.slave != kNoSlave) {
    if (!unmet_.empty()) TakeUnmet(part);
    return &Of(part.slave);
  }
  const auto found = std::ranges::find_if(unmet_, [&](const auto& entry) { return entry.first == part.model; });
  if (found != unmet_.end()) return &found->second;
  if (unmet_.size() >= kMaxUnmet) return nullptr;
  unmet_.emplace_back(part.model, Slave());
  return &unmet_.back().second;
}

/// A slave that only the ENI named until now: what was drawn of it goes on as its own.
void TimelineCollector::TakeUnmet(const model::ImagePart& part) {
  const auto found = std::ranges::find_if(
      unmet_, [&](const auto& entry) { return entry.first->eni != nullptr && entry.first->eni == part.model->eni; });
  Slave& slave = Of(part.slave);
  if (found == unmet_.end() || !slave.signals.empty()) return;
  slave.signals = std::move(found->second.signals);
  slave.outputs = std::move(found->second.outputs);
  slave.inputs = std::move(found->second.inputs);
  unmet_.erase(found);
}

void TimelineCollector::On(const track::SlaveAccess& access) {
  if (access.broadcast || !access.done() || !HasSeries(access.slave)) return;
  const ByteSpan raw = access.Covered(access.read, esc::kSystemTimeDifference, 4);
  if (raw.empty()) return;
  Count(Of(access.slave).difference, access.frame(),
        esc::TimeDifference{LittleEndian<std::uint32_t>(raw, 0)}.magnitude_ns());
}

void TimelineCollector::On(const track::FrameLost& event) {
  if (event.sent.ref().has_time) lost_.Add(event.sent.ref().time, 1);
}

void TimelineCollector::On(const track::Answered& event) {
  const FrameRef& frame = event.returned.seen() ? event.returned : event.sent;
  if (frame.has_time) frames_.Add(frame.time, static_cast<double>(frame.number));
}

void TimelineCollector::On(const track::LogicalAccess& event) {
  if (event.frame().has_time) frames_.Add(event.frame().time, static_cast<double>(event.frame().number));
}

void TimelineCollector::On(const mailbox::MailboxMessage& message) {
  if (message.slave != kNoSlave && HasSeries(message.slave)) Count(Of(message.slave).mailbox, message.frame(), 1);
}

void TimelineCollector::On(const mailbox::SdoTransfer& transfer) {
  if (transfer.slave >= model_.size()) return;
  Slave& slave = Of(transfer.slave);
  if (sdos_ >= kMaxSdos || slave.sdos.size() >= kMaxSlaveSdos) {
    ++slave.sdos_left_out;
    return;
  }
  ++sdos_;
  const model::SlaveModel& model = model_.slave(transfer.slave);
  SdoRow row;
  row.request = transfer.request;
  row.response = transfer.response;
  row.download = transfer.service == mailbox::SdoService::kDownload;
  row.complete_access = transfer.complete_access;
  row.outcome = OutcomeText(transfer.outcome);
  row.duration = transfer.duration;
  if (transfer.has_object) {
    row.index = transfer.index;
    row.subindex = transfer.subindex;
    row.name = transfer.complete_access ? model.names.FindWhole(model.profile, transfer.index).name
                                        : model.names.Find(model.profile, transfer.index, transfer.subindex).name;
    const bool whole = row.download || transfer.outcome == mailbox::SdoOutcome::kCompleted;
    if (whole && !transfer.data_gap && !transfer.data.empty()) {
      const ByteSpan data = Slice(transfer.data, 0, kMaxValueBytes);
      row.value = Shortened(
          transfer.complete_access
              ? events::ReadCompleteAccess(model.names, model.profile, transfer.index, transfer.subindex, data).text
              : events::ReadValue(model.names, model.profile, transfer.index, transfer.subindex, data).text,
          kMaxValueBytes);
    }
  }
  if (transfer.outcome == mailbox::SdoOutcome::kAborted) {
    row.abort_code = transfer.abort_code;
    row.abort_text = mailbox::AbortCodeText(transfer.abort_code);
  }
  slave.sdos.push_back(std::move(row));
}

TimelineCollector::Signal* TimelineCollector::Find(Slave& slave, const model::Signal& entry, bool output) {
  for (const std::unique_ptr<Signal>& signal : slave.signals) {
    const SignalSeries& about = signal->about;
    if (about.index == entry.index && about.subindex == entry.subindex && about.output == output &&
        about.bits == entry.bits) {
      return signal.get();
    }
  }
  if (slave.signals.size() >= kMaxSlaveSignals || signals_ >= kMaxSignals) {
    signals_left_out_ = true;
    return nullptr;
  }
  ++signals_;
  MakeRoom();
  Signal& signal = *slave.signals.emplace_back(std::make_unique<Signal>());
  signal.series.Limit(buckets_each_);
  signal.type = entry.type;
  signal.about.word = IsBitField(entry);
  signal.divisor = signals::DivisorOf(entry.scale).value_or(1);
  signal.about.output = output;
  signal.about.index = entry.index;
  signal.about.subindex = entry.subindex;
  signal.about.bits = entry.bits;
  signal.about.name = entry.name;
  signal.about.name_inferred = entry.name_inferred;
  signal.about.variable = entry.variable;
  // A unit belongs to the scaled value: where the scale is not a plain ratio, the numbers have none.
  if (entry.scale.empty() || signals::DivisorOf(entry.scale)) signal.about.unit = entry.unit;
  signal.about.scaled = signal.divisor != 1;
  return &signal;
}

const std::vector<TimelineCollector::Followed>& TimelineCollector::FollowedIn(const model::ImagePart& part) {
  const auto found = followed_.find(part.serial);
  if (found != followed_.end()) return found->second;
  if (followed_.size() >= kMaxParts) followed_.clear();
  std::vector<Followed>& list = followed_[part.serial];
  Slave* const slave = Of(part);
  if (slave == nullptr) return list;
  std::vector<std::uint16_t> order(part.places.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = static_cast<std::uint16_t>(i);
  std::ranges::stable_sort(order, [&](std::uint16_t a, std::uint16_t b) {
    return Rank(part.layout->signals[part.places[a].signal].index) <
           Rank(part.layout->signals[part.places[b].signal].index);
  });
  for (const std::uint16_t place : order) {
    const model::Signal& entry = part.layout->signals[part.places[place].signal];
    if (part.places[place].bits > 64 || entry.gap()) continue;
    if (Signal* signal = Find(*slave, entry, part.direction == device::PdoDirection::kRx)) {
      list.push_back({place, signal});
    }
  }
  return list;
}

void TimelineCollector::On(const model::ProcessCycle& cycle) {
  LookCloser();
  if (cycle.lost || !cycle.frame().has_time) return;
  if (Slave* const slave = Of(cycle.part); slave != nullptr) {
    const bool outputs = cycle.part.direction == device::PdoDirection::kRx;
    (outputs ? slave->outputs : slave->inputs).Add(cycle.frame(), cycle.exchange);
  }
  if (!cycle.has_data()) return;
  for (const Followed& followed : FollowedIn(cycle.part)) {
    const model::ImagePart::Place& place = cycle.part.places[followed.place];
    const std::optional<std::uint64_t> raw = cycle.Value(place);
    if (!raw) continue;
    Signal& signal = *followed.signal;
    const double value = AsDouble(signals::ReadSignal(signal.type, place.bits, *raw)) / signal.divisor;
    if (!std::isfinite(value)) continue;
    signal.series.Add(cycle.frame().time, value);
    signal.close.Add(cycle.frame(), value);
  }
}

void TimelineCollector::On(const sync::IntervalMeasured& event) {
  if (!event.frame.has_time) return;
  Cycle& cycle = cycles_[&event.image];
  const double us = static_cast<double>(event.interval) / 1e3;
  if (cycle.series.empty()) cycle.series.Limit(kFinestBuckets);
  cycle.series.Add(event.frame.time, us);
  cycle.close.Add(event.frame, us);
}

void TimelineCollector::On(const sync::PhaseMeasured& event) {
  if (HasSeries(event.slave)) Count(Of(event.slave).phase, event.frame, static_cast<double>(event.phase) / 1e3);
}

/// The evaluation of a fault waits for the drive's own reason, maybe until the end of the capture.
void TimelineCollector::On(const model::DriveStateChanged& event) {
  using device::DriveState;
  if (!event.from || (event.to && *event.to != DriveState::kFault && *event.to != DriveState::kFaultReactionActive)) {
    return;
  }
  Remember(event.slave, event.frame.number);
}

void TimelineCollector::On(const model::AlChangedByItself& event) {
  Remember(event.slave, event.frame.number);
}

void TimelineCollector::Remember(SlaveId slave, FrameNo frame) {
  for (auto& [image, cycle] : cycles_) cycle.close.Remember(frame);
  if (slave >= slaves_.size()) return;
  for (const std::unique_ptr<Signal>& signal : slaves_[slave].signals) signal->close.Remember(frame);
}

void TimelineCollector::LookCloser() {
  if (findings_ == nullptr) return;
  for (; looked_at_ < findings_->size(); ++looked_at_) LookCloser((*findings_)[looked_at_]);
}

void TimelineCollector::LookCloser(const Finding& finding) {
  const std::size_t most = finding.severity == Severity::kError     ? kMaxClose
                           : finding.severity == Severity::kWarning ? kMaxClose / 2
                                                                    : kMaxClose / 4;
  if (!finding.first.seen()) return;
  const auto keep = [&](CloseSeries& series) {
    if (close_ < most) close_ += series.Keep(finding.first.number);
  };
  for (auto& [image, cycle] : cycles_) keep(cycle.close);
  if (finding.slave != kNoSlave) {
    if (finding.slave >= slaves_.size()) return;
    for (const std::unique_ptr<Signal>& signal : slaves_[finding.slave].signals) keep(signal->close);
    return;
  }
  // Of a bus of many slaves the first signals of each are the most useful.
  std::size_t left = kMaxCloseOfBus;
  const std::size_t each = std::max<std::size_t>(2, kMaxCloseOfBus / std::max<std::size_t>(1, slaves_.size()));
  for (Slave& slave : slaves_) {
    for (std::size_t i = 0; i < std::min(each, slave.signals.size()) && left > 0; ++i, --left) {
      keep(slave.signals[i]->close);
    }
  }
}

void TimelineCollector::Summarise(AnalysisResult& /*result*/) {
  cycle_ = sync_.cycle();
}

/// What only the whole capture showed is looked at, too, as far as it is not forgotten.
void TimelineCollector::Conclude() {
  LookCloser();
  timeline_ = Draw(cycle_);
}

Timeline TimelineCollector::Draw(const sync::CyclicImage* cycle) const {
  Timeline timeline;
  timeline.lost = lost_.series();
  timeline.frames = frames_.series();
  if (const auto found = cycles_.find(cycle); found != cycles_.end()) {
    timeline.cycle_us = found->second.series.series();
    timeline.cycle_close = found->second.close.kept();
  }
  timeline.signals_left_out = signals_left_out_;
  const auto add = [&timeline](const Slave& slave) -> SlaveTimeline& {
    SlaveTimeline& out = timeline.slaves.emplace_back();
    for (const std::unique_ptr<Signal>& signal : slave.signals) {
      if (signal->series.empty()) continue;
      out.signals.push_back(signal->about);
      out.signals.back().values = signal->series.series();
      out.signals.back().close = signal->close.kept();
    }
    out.outputs = slave.outputs.lane();
    out.inputs = slave.inputs.lane();
    if (slave.mailbox) out.mailbox = slave.mailbox->series();
    if (slave.phase) out.phase_us = slave.phase->series();
    if (slave.difference) out.difference_ns = slave.difference->series();
    out.sdos = slave.sdos;
    out.sdos_left_out = slave.sdos_left_out;
    return out;
  };
  for (std::size_t id = 0; id < slaves_.size(); ++id) add(slaves_[id]).slave = static_cast<SlaveId>(id);
  for (const auto& [model, slave] : unmet_) {
    SlaveTimeline& out = add(slave);
    if (model->eni == nullptr) continue;
    out.eni_position = model->eni->position();
    out.eni_address = model->eni->station_address;
    out.eni_name = model->name;
  }
  return timeline;
}

}  // namespace ecaudit::timeline
