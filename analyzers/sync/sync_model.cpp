#include "analyzers/sync/sync_model.h"

#include <algorithm>
#include <cmath>

#include "analyzers/model/drive_parameters.h"
#include "analyzers/model/model_events.h"
#include "analyzers/sync/sync_events.h"
#include "decoder/esc/register_addresses.h"

namespace ecaudit::sync {
namespace {

constexpr std::uint16_t kStatusWord = 0x6041;
/// Frames that a median has to rest on.
constexpr std::uint64_t kEnough = 20;
/// 100 Mbit/s.
constexpr TimeNs kNsPerByte = 80;
/// Frame check sequence, which captures leave out.
constexpr std::uint32_t kFcsBytes = 4;
constexpr std::uint32_t kMinFrameBytes = 60;
/// How well the slaves' clocks agree with the reference when nothing says better: what counts as synchronised.
constexpr TimeNs kClocksAgree = 1000;
/// One tick of the clocks of ESCs and probes, twice.
constexpr TimeNs kTicks = 40;
/// Stamps of a host, when the capture has no round trips to judge them by (esc-reference 10.3).
constexpr TimeNs kHostStamps = 500'000;
/// Made-up stamps shall not make sums of cycles overflow.
constexpr TimeNs kLongestCycle = 60'000'000'000;
/// Value of 0x0420 after power-on.
constexpr std::uint16_t kDefaultWatchdogSteps = 1000;

}  // namespace

const device::JitterLimit* LimitFor(const device::SyncDescription& family, TimeNs cycle) {
  constexpr TimeNs kRound = 10'000;
  return family.FindJitter((cycle + kRound / 2) / kRound * kRound);
}

std::pair<const IntervalStatistics*, TimeBase> CyclicImage::Best() const {
  // A clock that tells only of some of the frames does not tell of the cycle.
  const std::uint64_t most = std::max({by_dc.count(), by_esl.count(), by_stamp.count()});
  if (most == 0) return {&by_stamp, TimeBase::kNone};
  if (by_dc.count() * 10 >= most * 9) return {&by_dc, TimeBase::kDc};
  if (by_esl.count() * 10 >= most * 9) return {&by_esl, TimeBase::kEsl};
  return {&by_stamp, TimeBase::kCapture};
}

bool CyclicImage::SentNext(FrameNo frame) const {
  for (std::uint64_t i = sent_count; i > 1 && sent_count - i < kSent - 1; --i) {
    if (sent[(i - 1) % kSent] == frame) return sent[(i - 2) % kSent] == last.frame.number;
  }
  return false;
}

SyncModel::Slave& SyncModel::Grow(SlaveId slave) {
  while (slaves_.size() <= slave) slaves_.push_back(std::make_unique<Slave>());
  return *slaves_[slave];
}

const DcUnit& SyncModel::dc(SlaveId slave) const {
  static const DcUnit kNothing;
  return slave < slaves_.size() ? slaves_[slave]->dc : kNothing;
}

const OutputWatch& SyncModel::outputs(SlaveId slave) const {
  static const OutputWatch kNothing;
  return slave < slaves_.size() ? slaves_[slave]->outputs : kNothing;
}

SyncModel::SyncModel(const model::BusModel& model, const Pipeline& pipeline, EventBus& bus)
    : bus_(model), pipeline_(pipeline), sink_(bus) {
  bus.ListenTo<FrameSeen, track::LogicalAccess, track::Answered, track::CaptureHole>(Stage::kBeforeModel, *this);
  // What the slaves' models conclude is news to this one.
  bus.ListenTo<model::AlChangedByItself, model::AlErrorCode>(Stage::kModel, *this);
  // Objects and registers as the event left them.
  bus.ListenTo<mailbox::SdoTransfer, track::SlaveAccess>(Stage::kAfterModel, *this);
}

void SyncModel::On(const FrameSeen& seen) {
  const wire::FrameView& frame = seen.frame;
  if (seen.direction == bus::Direction::kForeign) return;
  FrameFacts& facts = facts_[frame.ref().number % kFacts];
  facts.number = frame.ref().number;
  facts.bytes = static_cast<std::uint32_t>(frame.bytes().size());
  facts.esl.reset();
  if (frame.esl().present && frame.esl().has_time) facts.esl = static_cast<TimeNs>(frame.esl().time_ns);
  if (seen.direction != bus::Direction::kOutbound) return;
  bool outputs = false;
  for (std::size_t i = 0; i < frame.size(); ++i) {
    const wire::DatagramView datagram = frame[i];
    const wire::Command command = datagram.command();
    if (!wire::IsLogical(command)) continue;
    outputs = outputs || command != wire::Command::LRD;
    if (CyclicImage* image = Find(command, datagram.logical_address())) {
      image->sent[image->sent_count++ % CyclicImage::kSent] = frame.ref().number;
    }
  }
  if (outputs) process_sent_[process_count_++ % kSentRing] = frame.ref().number;
}

CyclicImage* SyncModel::Find(wire::Command command, std::uint32_t address) {
  for (CyclicImage& image : images_) {
    if (!image.used) {
      image.used = true;
      image.address = address;
      image.command = command;
      return &image;
    }
    if (image.address == address && image.command == command) return &image;
  }
  return nullptr;
}

const SyncModel::FrameFacts* SyncModel::FactsOf(FrameNo number) const {
  const FrameFacts& facts = facts_[number % kFacts];
  return number != 0 && facts.number == number ? &facts : nullptr;
}

std::uint64_t SyncModel::UnreturnedBetween(FrameNo before, FrameNo after) const {
  std::uint64_t count = 0;
  for (std::uint64_t i = process_count_; i > 0 && process_count_ - i < kSentRing; --i) {
    const FrameNo number = process_sent_[(i - 1) % kSentRing];
    if (number <= before) break;
    if (after == 0 || number < after) ++count;
  }
  return count;
}

void SyncModel::BeginFrame(const FrameRef& sent, const FrameRef& returned) {
  if (sent.number == sent_.number && returned.number == returned_.number) return;
  Flush();
  sent_ = sent;
  returned_ = returned;
}

void SyncModel::On(const track::LogicalAccess& access) {
  BeginFrame(access.sent, access.returned);
  if (access.circulating || pending_count_ == kPending) return;
  pending_[pending_count_++] = {access.command, access.address, access.length, access.wkc, access.assumed};
  if (wire::Reads(access.command) && !access.returned_data.empty()) ReadStatusWords(access);
}

void SyncModel::ReadStatusWords(const track::LogicalAccess& access) {
  const model::LogicalExpectation& expected = bus_.Expect(access);
  if (access.wkc != expected.full) return;  // whose inputs these are is not certain
  for (const model::LogicalShare& share : expected.shares) {
    const model::SlaveModel& slave = bus_.slave(share.slave);
    if (share.input_bytes == 0 || !slave.profile->sync.lost_after_missing.value) continue;
    OutputWatch& watch = Of(share.slave).outputs;
    if (watch.layout_version != slave.process.version()) {
      watch.layout_version = slave.process.version();
      watch.status_at.reset();
      const model::ProcessLayout& inputs = slave.process.tx();
      const model::Signal* word = inputs.known() ? inputs.Find(kStatusWord, 0) : nullptr;
      if (word != nullptr && word->bits == 16 && word->bit_offset % 8 == 0) watch.status_at = word->bit_offset / 8;
    }
    watch.status_word.reset();
    if (!watch.status_at || *watch.status_at + 2 > share.input_bytes) continue;
    const std::size_t at = std::size_t{share.input_offset} + *watch.status_at;
    if (Fits(access.returned_data, at, 2)) watch.status_word = LittleEndian<std::uint16_t>(access.returned_data, at);
  }
}

void SyncModel::On(const track::Answered& answer) {
  if (!answer.returned.seen()) return;  // there is no answer to measure
  BeginFrame(answer.sent, answer.returned);
  if (const auto time = clock_.On(answer)) frame_dc_ = time;
}

std::optional<SyncModel::FrameAtHand> SyncModel::LookAtFrame() {
  FrameAtHand at_hand;
  FrameTime& time = at_hand.time;
  time.frame = sent_.seen() ? sent_ : returned_;
  if (!time.frame.seen()) return std::nullopt;
  if (time.frame.has_time) time.stamp = time.frame.time;
  time.dc = frame_dc_;
  if (const FrameFacts* facts = FactsOf(time.frame.number)) {
    time.esl = facts->esl;
    // Captures leave out the padding of short frames as the check sequence of all.
    at_hand.length_ns = static_cast<std::int64_t>(std::max(facts->bytes, kMinFrameBytes) + kFcsBytes) * kNsPerByte;
  }
  at_hand.reference_delay_ns = DelayOf(clock_.reference());
  return at_hand;
}

void SyncModel::Flush() {
  const std::optional<FrameAtHand> at_hand = pending_count_ > 0 ? LookAtFrame() : std::nullopt;
  if (at_hand) {
    if (sent_.has_time && returned_.has_time) {
      const TimeNs trip = Elapsed(sent_.time, returned_.time);
      if (trip >= 0) round_trips_.Add(trip, sent_, returned_);
    }
    for (std::size_t i = 0; i < pending_count_; ++i) {
      const Pending& pending = pending_[i];
      const CyclicImage* image = Measure(pending, at_hand->time);
      if (pending.command == wire::Command::LRD || (pending.wkc == 0 && !pending.assumed)) continue;
      track::LogicalAccess access;
      access.command = pending.command;
      access.address = pending.address;
      access.length = pending.length;
      for (const model::LogicalShare& share : bus_.Expect(access).shares) {
        if (share.outputs) Feed(share.slave, *at_hand, image);
      }
    }
  }
  pending_count_ = 0;
  frame_dc_.reset();
  sent_ = returned_ = {};
}

const CyclicImage* SyncModel::Measure(const Pending& pending, const FrameTime& time) {
  CyclicImage* found = Find(pending.command, pending.address);
  if (found == nullptr) return nullptr;
  CyclicImage& image = *found;
  if (time.frame.number == image.last.frame.number) return found;
  const FrameTime from = image.last;
  const bool was_sent = image.last_was_sent;
  const bool next = sent_.seen() ? was_sent && image.SentNext(time.frame.number) : !was_sent;
  image.last = time;
  image.last_was_sent = sent_.seen();
  image.gap_from = from.frame.number;
  image.gap = Between(from, time);
  if (!next || !from.frame.seen()) return found;
  // Each clock for itself: which is best is known when all is measured.
  if (from.dc && time.dc && from.dc->epoch == time.dc->epoch && time.dc->ns > from.dc->ns) {
    image.by_dc.Add(static_cast<TimeNs>(time.dc->ns - from.dc->ns), from.frame, time.frame);
  }
  if (from.esl && time.esl && *time.esl >= *from.esl) image.by_esl.Add(*time.esl - *from.esl, from.frame, time.frame);
  if (from.stamp && time.stamp && *time.stamp >= *from.stamp) {
    image.by_stamp.Add(Elapsed(*from.stamp, *time.stamp), from.frame, time.frame);
  }
  if (image.gap.base != TimeBase::kNone) sink_.Publish(IntervalMeasured{image, time.frame, image.gap.ns});
  const auto [best, base] = image.Best();
  const std::uint64_t count = best->count();
  if (base != TimeBase::kNone && (count % 1024 == 0 || (count >= kEnough && image.nominal_of < kEnough) ||
                                  (count < 1024 && count == image.nominal_of * 2))) {
    image.nominal_ns = std::min(best->Percentile(0.5), kLongestCycle);
    image.nominal_of = count;
  }
  return found;
}

std::optional<TimeNs> SyncModel::Uncertainty(TimeBase base) const {
  if (base == TimeBase::kDc || base == TimeBase::kEsl) return kTicks;
  if (base == TimeBase::kNone) return std::nullopt;
  const PipelineStatistics& read = pipeline_.statistics();
  const bus::PairingStatistics& pairing = pipeline_.pairing();
  if (read.backwards > 0 || read.without_time > 0 || read.time_step_ns >= 50'000) return std::nullopt;
  if (pairing.identical_stamps > 2 && pairing.identical_stamps * 10 >= pairing.paired) return std::nullopt;
  const TimeNs step = std::max<TimeNs>(read.time_step_ns, 1);
  if (round_trips_.count() < kEnough) return kHostStamps + step;
  // A frame takes the same way every time: what round trips differ by is the host's doing.
  return (round_trips_.Percentile(0.99) - round_trips_.Percentile(0.01) + 1) / 2 + step;
}

OutputGap SyncModel::GapOf(SlaveId id, const OutputWatch& watch, const Interval& gap) const {
  OutputGap event;
  event.slave = id;
  event.before = watch.last.frame;
  event.gap = gap;
  event.uncertainty_ns = Uncertainty(gap.base);
  if (watch.image != nullptr) {
    event.nominal_ns = watch.image->nominal_of >= kEnough ? watch.image->nominal_ns : 0;
    event.nominal_of = watch.image->nominal_of;
  }
  event.fell = watch.fell;
  event.fell_to = watch.fell_to;
  event.fell_code = watch.fell_code;
  event.status_word = watch.last_status_word;
  return event;
}

void SyncModel::Feed(SlaveId id, const FrameAtHand& at_hand, const CyclicImage* image) {
  const FrameTime& time = at_hand.time;
  Slave& slave = Of(id);
  OutputWatch& watch = slave.outputs;
  if (watch.seen && watch.last.frame.number == time.frame.number) return;
  const bool in_op = bus_.slave(id).al.SettledIn(esc::AlState::OP);
  if (watch.seen && watch.in_op && (in_op || watch.fell.seen())) {
    const bool as_image = image != nullptr && image->gap_from == watch.last.frame.number && image == watch.image;
    const Interval gap = as_image ? image->gap : Between(watch.last, time);
    TimeNs alarm = 0;
    if (image != nullptr && image->nominal_of >= kEnough) alarm = image->nominal_ns + image->nominal_ns / 2;
    if (watch.watchdog_ns > 0) alarm = alarm > 0 ? std::min(alarm, watch.watchdog_ns / 2) : watch.watchdog_ns / 2;
    if (gap.base != TimeBase::kNone && alarm > 0 && gap.ns >= alarm) {
      OutputGap event = GapOf(id, watch, gap);
      event.after = time.frame;
      event.unreturned = UnreturnedBetween(watch.last_sent, sent_.number);
      sink_.Publish(event);
    }
    if (in_op) {
      const std::optional<SyncSettings>& sync = slave.dc.active();
      const bool by_sync0 = sync && sync->activation.sync0();
      MeasureRate(watch, gap, time.frame, by_sync0 ? TimeNs{sync->sync0_cycle_ns.value_or(0)} : 0);
      if (!by_sync0) MeasureArrival(id, watch, time, gap);
    }
  }
  if (in_op && frame_dc_) {
    MeasurePhase(id, slave, at_hand);
  } else {
    watch.has_slot = false;
  }
  watch.last = time;
  watch.last_sent = sent_.number;
  watch.last_status_word = watch.status_word;
  watch.image = image;
  watch.seen = true;
  watch.may_be_hole = false;
  watch.in_op = in_op;
  watch.fell = {};
  watch.fell_code.reset();
  if (in_op) ++watch.frames_in_op;
}

void SyncModel::MeasureRate(OutputWatch& watch, const Interval& interval, const FrameRef& frame, TimeNs configured) {
  if (watch.image == nullptr || watch.image->nominal_of < kEnough || watch.image->nominal_ns <= 0) return;
  // The median jumps where early and late frames alternate: a configured cycle near it counts better.
  TimeNs nominal = watch.image->nominal_ns;
  if (configured > 0 && nominal > configured - configured / 3 && nominal < configured + configured / 3) {
    nominal = configured;
  }
  TimeNs shifted = 0;
  if (__builtin_add_overflow(interval.ns, nominal / 2, &shifted)) return;
  const TimeNs cycles = shifted >= nominal && shifted - nominal < nominal ? 1 : shifted / nominal;
  constexpr TimeNs kPause = 16;
  if (interval.base == TimeBase::kNone || cycles > kPause) return;
  if (interval.base != watch.rate_base) {
    watch.rate_base = interval.base;
    watch.rate_cycles = 0;
    watch.rate_ns = 0;
  }
  if (watch.rate_cycles == 0) watch.rate_first = watch.last.frame;
  if (__builtin_add_overflow(watch.rate_ns, interval.ns, &watch.rate_ns)) {
    watch.rate_base = TimeBase::kNone;  // begins anew with the next one
    return;
  }
  watch.rate_cycles += static_cast<std::uint64_t>(cycles);
  watch.rate_last = frame;
}

void SyncModel::MeasureArrival(SlaveId id, OutputWatch& watch, const FrameTime& time, const Interval& interval) {
  const device::SyncDescription& family = bus_.slave(id).profile->sync;
  if (family.jitter.empty() || watch.image == nullptr || watch.image->nominal_of < kEnough ||
      watch.image->nominal_ns <= 0) {
    return;
  }
  constexpr std::uint64_t kSettle = 100;  // cycles until the grid is good enough to judge by
  constexpr double kPause = 64;
  const bool restart = interval.base == TimeBase::kNone || interval.base != watch.grid_base;
  const double mean = watch.grid_cycles >= kSettle ? watch.grid_ns / static_cast<double>(watch.grid_cycles)
                                                   : static_cast<double>(watch.image->nominal_ns);
  const double cycles = std::round((static_cast<double>(interval.ns) + watch.grid_deviation) / mean);
  if (restart || cycles > kPause) {
    watch.grid_base = interval.base;
    watch.grid_cycles = 0;
    watch.grid_ns = watch.grid_deviation = 0;
    return;
  }
  // The drive follows the mean of what comes, slowly: so does the grid.
  const double follow = std::min(256.0, static_cast<double>(watch.grid_cycles) + 1);
  watch.grid_deviation = watch.grid_deviation * (1 - 1 / follow) + static_cast<double>(interval.ns) - cycles * mean;
  watch.grid_cycles += static_cast<std::uint64_t>(cycles);
  watch.grid_ns += static_cast<double>(interval.ns);
  if (watch.grid_cycles < kSettle) return;
  const device::JitterLimit* limit = LimitFor(family, static_cast<TimeNs>(mean));
  if (limit == nullptr) return;
  const auto deviation = static_cast<TimeNs>(watch.grid_deviation);
  const auto uncertainty = Uncertainty(interval.base);
  if (cycles < 2 && std::abs(deviation) + uncertainty.value_or(0) <= limit->jitter) return;
  ArrivalOff event;
  event.slave = id;
  event.before = watch.last.frame;
  event.frame = time.frame;
  event.deviation_ns = deviation;
  event.missing = cycles < 2 ? 0 : static_cast<std::uint64_t>(cycles) - 1;
  event.cycle = watch.grid_cycles;
  event.cycle_ns = static_cast<TimeNs>(mean);
  event.base = interval.base;
  event.uncertainty_ns = uncertainty;
  event.unreturned = UnreturnedBetween(watch.last_sent, sent_.number);
  sink_.Publish(event);
}

void SyncModel::MeasurePhase(SlaveId id, Slave& slave, const FrameAtHand& at_hand) {
  const FrameTime& time = at_hand.time;
  const DcUnit& unit = slave.dc;
  OutputWatch& watch = slave.outputs;
  const std::optional<SyncSettings>& settings = unit.active();
  const bool usable = settings && settings->activation.sync0() && settings->start_ns && settings->sync0_cycle_ns &&
                      *settings->sync0_cycle_ns > 0 && settings->sync0_cycle_ns < 0x80000000U;
  if (!usable || unit.activation()->auto_activation()) {
    watch.has_slot = false;
    return;
  }
  const DcTime now = *time.dc;
  if (watch.settings_frame.number != settings->frame.number || watch.epoch != now.epoch) {
    watch.settings_frame = settings->frame;
    watch.epoch = now.epoch;
    watch.has_slot = false;
    watch.start_ns =
        static_cast<std::int64_t>(settings->start_is_64_bit && clock_.is_64_bit()
                                      ? *settings->start_ns
                                      : esc::UnwrapDcTime(static_cast<std::uint32_t>(*settings->start_ns), now.ns));
  }
  const auto cycle = static_cast<std::int64_t>(*settings->sync0_cycle_ns);
  const std::int64_t way = DelayOf(id) - at_hand.reference_delay_ns + at_hand.length_ns;
  // Clocks come from the capture and may hold anything: unsigned numbers wrap where signed ones must not.
  const auto since =
      static_cast<std::int64_t>(now.ns + static_cast<std::uint64_t>(way) - static_cast<std::uint64_t>(watch.start_ns));
  constexpr std::int64_t kNever = std::int64_t{1} << 62U;
  watch.uncertainty = std::max<TimeNs>(kClocksAgree, unit.last_difference_ns().value_or(0));
  if (since < watch.uncertainty || since > kNever) {  // SYNC0 has not begun
    watch.has_slot = false;
    return;
  }
  const std::int64_t pulses = since / cycle;
  const TimeNs phase = since - pulses * cycle;
  const TimeNs margin = std::min(phase, cycle - phase);
  if (watch.phases == 0 || phase < watch.phase_min) watch.phase_min = phase;
  if (watch.phases == 0 || phase > watch.phase_max) watch.phase_max = phase;
  if (watch.phases == 0 || margin < watch.margin) {
    watch.margin = margin;
    watch.margin_frame = time.frame;
  }
  ++watch.phases;
  sink_.Publish(PhaseMeasured{id, time.frame, phase});
  const auto value = static_cast<double>(phase);
  const double delta = value - watch.phase_mean;
  watch.phase_mean += delta / static_cast<double>(watch.phases);
  watch.phase_squares += delta * (value - watch.phase_mean);
  ++watch.phase_bins[std::min(
      static_cast<std::size_t>(phase * static_cast<std::int64_t>(watch.phase_bins.size()) / cycle),
      watch.phase_bins.size() - 1)];

  // Near a pulse nobody can say on which side of it the frame arrived.
  const bool narrow = watch.uncertainty < cycle;
  const std::int64_t least = narrow ? pulses - (phase < watch.uncertainty) : (since - watch.uncertainty) / cycle;
  const std::int64_t most =
      narrow ? pulses + (phase >= cycle - watch.uncertainty) : (since + watch.uncertainty) / cycle;
  const std::int64_t between = least - watch.slot_most;
  if (watch.has_slot && (most <= watch.slot_least || between >= 2)) {
    SyncSlotMiss miss;
    miss.slave = id;
    miss.before = watch.last.frame;
    miss.frame = time.frame;
    miss.cycle_ns = *settings->sync0_cycle_ns;
    miss.phase_ns = phase;
    miss.uncertainty_ns = watch.uncertainty;
    if (most <= watch.slot_least) {
      ++watch.doubled;
      sink_.Publish(miss);
    } else {
      miss.empty = static_cast<std::uint64_t>(between - 1);
      miss.unreturned = UnreturnedBetween(watch.last_sent, sent_.number);
      watch.empty += miss.empty;
      sink_.Publish(miss);
    }
  }
  watch.has_slot = true;
  watch.slot_least = least;
  watch.slot_most = most;
}

/// Delay register of a slave. It is asked for of all slaves in every cycle, so it is read only when it may have
/// changed.
std::int64_t SyncModel::ReadDelay(SlaveId id, std::uint64_t version) {
  Slave& slave = Of(id);
  slave.delay_ns = bus_.network().state(id).registers.Value<std::uint32_t>(esc::kSystemTimeDelay).value_or(0);
  slave.delay_version = version;
  return slave.delay_ns;
}

void SyncModel::On(const track::SlaveAccess& access) {
  const std::size_t length = std::max(access.written.size(), access.read.size());
  const auto touches = [&](EscAddress first, std::size_t bytes) {
    return access.address < first + bytes && access.address + length > first;
  };
  if (touches(esc::kSystemTimeDelay, 4)) ++delay_version_;
  BeginFrame(access.sent, access.returned);
  if (touches(0x0900, 0x100)) {
    Slave& slave = Of(access.slave);
    const bool distributes = access.command == wire::Command::ARMW || access.command == wire::Command::FRMW;
    if (!access.written.empty() && !distributes && access.acceptance != track::Acceptance::kRefused &&
        (touches(esc::kSystemTime, 8) || touches(esc::kSystemTimeOffset, 12))) {
      clock_.WasSet(access.slave);
    }
    const DcUnit::Change change = slave.dc.On(access, bus_.network().state(access.slave).registers);
    if (change == DcUnit::Change::kSwitchedOn) SwitchedOn(access.slave, slave.dc);
  } else if (touches(esc::kWatchdogDivider, esc::kProcessWatchdog + 2 - esc::kWatchdogDivider)) {
    const esc::RegisterImage& registers = bus_.network().state(access.slave).registers;
    Of(access.slave).outputs.watchdog_ns =
        esc::WatchdogNs(registers.Value<std::uint16_t>(esc::kWatchdogDivider).value_or(esc::kDefaultWatchdogDivider),
                        registers.Value<std::uint16_t>(esc::kProcessWatchdog).value_or(kDefaultWatchdogSteps));
  }
}

void SyncModel::SwitchedOn(SlaveId slave, const DcUnit& unit) {
  const SyncSettings& settings = *unit.active();
  SyncSwitchedOn event;
  event.slave = slave;
  event.frame = settings.frame;
  event.was_off = unit.activation_was_known();
  event.activation = settings.activation;
  event.start_ns = settings.start_ns;
  event.sync0_cycle_ns = settings.sync0_cycle_ns;
  event.low_half_only = !settings.start_is_64_bit;
  // The slave's own copy of the time is best; the reference's is the same where the slave was adjusted to it.
  if (unit.own_time()) {
    event.read_time_ns = *unit.own_time();
    event.read_frame = unit.own_time_frame();
    if (!unit.own_time_is_64_bit()) event.low_half_only = true;
  } else if (clock_.last() && clock_.last()->epoch == clock_.epoch() && unit.adjusted()) {
    event.read_time_ns = clock_.last()->ns;
    event.read_frame = clock_.last_frame();
    if (!clock_.is_64_bit()) event.low_half_only = true;
  }
  const FrameRef& sent = sent_.seen() ? sent_ : returned_;
  const auto uncertainty = Uncertainty(TimeBase::kCapture);
  if (event.read_time_ns && event.read_frame.has_time && sent.has_time && uncertainty) {
    event.since_read_ns = Elapsed(event.read_frame.time, sent.time);
    event.uncertainty_ns = *uncertainty;
  }
  sink_.Publish(event);
}

/// What was sent in a hole nobody knows: no interval, no slot and no rhythm reaches over it.
void SyncModel::On(const track::CaptureHole& hole) {
  Flush();
  for (const auto& slave : slaves_) {
    OutputWatch& watch = slave->outputs;
    watch.may_be_hole = true;
    if (!hole.certain) continue;
    watch.seen = watch.has_slot = false;
    watch.fell = {};
    watch.grid_base = TimeBase::kNone;
  }
  if (!hole.certain) return;
  for (CyclicImage& image : images_) image.last = {};
}

void SyncModel::On(const model::AlChangedByItself& change) {
  OutputWatch& watch = Of(change.slave).outputs;
  if (!watch.seen || !watch.in_op || change.before.state() != static_cast<std::uint8_t>(esc::AlState::OP) ||
      change.status.state() == static_cast<std::uint8_t>(esc::AlState::OP) || watch.fell.seen()) {
    return;
  }
  watch.fell = change.frame;
  watch.fell_to = change.status;
  watch.fell_code = change.code;
}

void SyncModel::On(const model::AlErrorCode& code) {
  OutputWatch& watch = Of(code.slave).outputs;
  if (watch.fell.seen() && !watch.fell_code) watch.fell_code = code.code;
}

void SyncModel::On(const mailbox::SdoTransfer& transfer) {
  if (transfer.service != mailbox::SdoService::kUpload || transfer.outcome != mailbox::SdoOutcome::kCompleted) return;
  const model::SlaveModel& slave = bus_.slave(transfer.slave);
  const device::SyncDescription& family = slave.profile->sync;
  if (!family.sync_actual || !family.sync_actual->object || transfer.complete_access ||
      transfer.index != family.sync_actual->object->index ||
      transfer.subindex != family.sync_actual->object->subindex) {
    return;
  }
  const auto actual = model::ValueOf(slave, family.sync_actual);
  if (!actual) return;
  Slave& own = Of(transfer.slave);
  ++own.pll_reads;
  const auto& active = own.dc.active();
  if (!own.outputs.in_op || !active || !active->activation.sync0()) return;
  PllMeasured e;
  e.slave = transfer.slave;
  e.frame = transfer.response;
  e.actual = actual->value;
  e.inferred = actual->certainty == Certainty::kInferred;
  if (const auto distance = model::ValueOf(slave, family.sync_distance)) e.distance = distance->value;
  if (const auto window = model::ValueOf(slave, family.sync_window)) e.window = window->value;
  if (const auto threshold = model::ValueOf(slave, family.pll_threshold)) e.threshold = threshold->value;
  // The PLL may still be pulling in.
  if (e.threshold && *e.threshold > 0 && own.outputs.frames_in_op <= static_cast<std::uint64_t>(*e.threshold)) return;
  if (!e.inside().value_or(true)) ++own.pll_outside;
  sink_.Publish(e);
}

void SyncModel::Finish() {
  Flush();
  for (std::size_t s = 0; s < slaves_.size(); ++s) {
    OutputWatch& watch = slaves_[s]->outputs;
    if (!watch.fell.seen()) continue;
    // No outputs any more: the gap lasted at least until the slave was seen to have fallen.
    FrameTime end;
    end.frame = watch.fell;
    if (watch.fell.has_time) end.stamp = watch.fell.time;
    FrameTime begin = watch.last;
    begin.dc.reset();
    begin.esl.reset();
    const Interval gap = Between(begin, end);
    if (gap.base == TimeBase::kNone) continue;
    OutputGap event = GapOf(static_cast<SlaveId>(s), watch, gap);
    event.unreturned = UnreturnedBetween(watch.last_sent, 0);
    sink_.Publish(event);
  }
}

const CyclicImage* SyncModel::cycle() const {
  const auto most = std::max_element(images_.begin(), images_.end(), [](const CyclicImage& a, const CyclicImage& b) {
    return a.Best().first->count() < b.Best().first->count();
  });
  return most->Best().first->count() == 0 ? nullptr : &*most;
}

CycleSummary SyncModel::SummariseCycle() const {
  const CyclicImage* image = cycle();
  if (image == nullptr) return {};
  const auto [best, base] = image->Best();
  CycleSummary summary = best->Summary();
  summary.time_source = Name(base);
  if (const auto uncertainty = Uncertainty(base)) summary.uncertainty_us = static_cast<double>(*uncertainty) / 1e3;
  summary.command = wire::Name(image->command);
  summary.logical_address = image->address;
  return summary;
}

std::optional<PllSummary> SyncModel::SummarisePll(SlaveId id) const {
  const model::SlaveModel& slave = bus_.slave(id);
  const device::SyncDescription& family = slave.profile->sync;
  const auto value = [&](const std::optional<device::DriveParameter>& parameter) -> std::optional<std::int64_t> {
    const auto known = model::ValueOf(slave, parameter);
    return known ? std::optional(known->value) : std::nullopt;
  };
  PllSummary summary;
  summary.distance = value(family.sync_distance);
  summary.window = value(family.sync_window);
  summary.threshold = value(family.pll_threshold);
  summary.reads = slaves_[id]->pll_reads;
  summary.outside = slaves_[id]->pll_outside;
  summary.actual_last = value(family.sync_actual).value_or(0);
  if (!summary.distance && !summary.window && !summary.threshold && summary.reads == 0) return std::nullopt;
  return summary;
}

BusDcSummary SyncModel::SummariseBus() const {
  BusDcSummary summary;
  summary.reference = clock_.reference();
  summary.samples = clock_.samples();
  summary.distributions = clock_.distributions();
  summary.first = clock_.first_distribution();
  summary.last = clock_.last_distribution();
  summary.longest_gap_us = static_cast<double>(clock_.longest_gap()) / 1e3;
  summary.longest_gap_end = clock_.longest_gap_end();
  return summary;
}

std::optional<DcSummary> SyncModel::Summarise(SlaveId slave) const {
  if (slave >= slaves_.size()) return std::nullopt;
  const DcUnit& unit = slaves_[slave]->dc;
  if (!unit.touched()) return std::nullopt;
  DcSummary summary = unit.Summary(bus_.network().state(slave).registers);
  summary.reference = clock_.samples() > 0 && clock_.reference() == slave;
  summary.pll = SummarisePll(slave);
  const OutputWatch& watch = slaves_[slave]->outputs;
  if (watch.phases > 0 && unit.last_active()) {
    SyncPhase phase;
    phase.frames = watch.phases;
    phase.cycle_ns = unit.last_active()->sync0_cycle_ns.value_or(0);
    phase.mean_us = watch.phase_mean / 1e3;
    phase.min_us = static_cast<double>(watch.phase_min) / 1e3;
    phase.max_us = static_cast<double>(watch.phase_max) / 1e3;
    phase.stddev_us = std::sqrt(watch.phase_squares / static_cast<double>(watch.phases)) / 1e3;
    phase.margin_us = static_cast<double>(watch.margin) / 1e3;
    phase.margin_frame = watch.margin_frame;
    phase.empty_intervals = watch.empty;
    phase.double_intervals = watch.doubled;
    phase.uncertainty_us = static_cast<double>(watch.uncertainty) / 1e3;
    phase.histogram.assign(watch.phase_bins.begin(), watch.phase_bins.end());
    summary.phase = std::move(phase);
  }
  return summary;
}

}  // namespace ecaudit::sync
