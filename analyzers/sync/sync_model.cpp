#include "analyzers/sync/sync_model.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "analyzers/model/drive_parameters.h"
#include "decoder/base/time.h"
#include "decoder/base/wrapping.h"
#include "decoder/bus/thresholds.h"
#include "decoder/esc/fmmu.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/esc/register_map.h"

namespace ecaudit::sync {
namespace {

/// Value of 0x0420 after power-on.
constexpr std::uint16_t kDefaultWatchdogSteps = 1000;
/// Slaves are synchronised within it, ns: a delay that was measured again differs by less.
constexpr std::int64_t kSameDelay = 1000;

/// Whether an access reads or writes some of `bytes` registers from `first` on.
bool Touches(const track::SlaveAccess& access, EscAddress first, std::size_t bytes) {
  return access.address < first + bytes && access.address + access.length() > first;
}

}  // namespace

SyncModel::SyncModel(const model::BusModel& model, const Pipeline& pipeline, EventBus& bus)
    : bus_(model), sink_(bus), trust_(pipeline), delays_(model), meter_(model, sent_frames_, trust_, delays_, bus) {
  bus.ListenTo<FrameSeen, track::LogicalAccess, track::Answered, track::CaptureGap, track::WriteDoubtful,
               track::AlRequest>(Stage::kBeforeModel, *this);
  // What the slaves' models conclude is news to this one.
  bus.ListenTo<track::SlaveFound, track::RunBegan, model::AlChangedByItself, model::AlErrorCode>(Stage::kModel, *this);
  // Objects and registers as the event left them.
  bus.ListenTo<mailbox::SdoTransfer, track::SlaveAccess, track::AlStatusRead>(Stage::kAfterModel, *this);
}

SyncModel::Slave& SyncModel::Of(SlaveId id) {
  Slave& slave = Grow(id);
  slave.outputs.Part();
  return slave;
}

SyncModel::Slave& SyncModel::Add(SlaveId slave) {
  while (slaves_.size() <= slave) slaves_.push_back(std::make_unique<Slave>());
  return *slaves_[slave];
}

void SyncModel::On(const track::SlaveFound& event) {
  Slave& slave = Grow(event.slave);
  slave.dc.Meet(bus_.network().state(event.slave).registers);
  slave.fmmus_known = bus_.network().fmmus(event.slave).any;
}

const DcUnit& SyncModel::dc(SlaveId slave) const {
  static const DcUnit kNothing;
  return slave < slaves_.size() ? slaves_[slave]->dc : kNothing;
}

const OutputWatch& SyncModel::outputs(SlaveId slave) const {
  static const OutputWatch kNothing;
  if (slave >= slaves_.size()) return kNothing;
  slaves_[slave]->outputs.Part();
  return slaves_[slave]->outputs;
}

void SyncModel::On(const FrameSeen& seen) {
  const wire::FrameView& frame = seen.frame;
  if (seen.direction == bus::Direction::kForeign) return;
  sent_frames_.Add(frame);
  const bool outbound = seen.direction == bus::Direction::kOutbound;
  const bool copy = outbound && IsCopyOfLast(frame);
  last_seen_ = frame.ref();
  last_key_ = outbound ? frame.key() : 0;
  if (!outbound || copy) return;
  for (std::size_t i = 0; i < frame.size(); ++i) {
    const wire::DatagramView datagram = frame[i];
    const wire::Command command = datagram.command();
    if (!wire::IsLogical(command)) continue;
    if (command != wire::Command::LRD) {
      sent_frames_.AddOutputs(frame.ref().number, datagram.logical_address(), datagram.length());
    }
    images_.OnSent(command, datagram.logical_address(), frame.ref().number);
  }
}

/// The packet before this one was the same frame: captured twice, but sent once.
bool SyncModel::IsCopyOfLast(const wire::FrameView& frame) const {
  if (frame.key() != last_key_ || frame.ref().number != last_seen_.number + 1) return false;
  if (!frame.ref().has_time || !last_seen_.has_time) return false;
  const std::int64_t apart = Elapsed(last_seen_.time, frame.ref().time);
  return apart >= -bus::threshold::kCopyNs && apart <= bus::threshold::kCopyNs;
}

void SyncModel::BeginFrame(const FrameRef& sent, const FrameRef& returned) {
  if (at_hand_.Is(sent, returned)) return;
  Flush();
  at_hand_.Begin(sent, returned);
}

void SyncModel::On(const track::LogicalAccess& access) {
  pauses_.On(access);
  BeginFrame(access.sent, access.returned);
  if (access.circulating ||
      !at_hand_.Add({access.command, access.address, access.length, access.wkc, access.assumed})) {
    return;
  }
  if (wire::Reads(access.command) && !access.returned_data.empty()) ReadStatusWords(access);
}

void SyncModel::ReadStatusWords(const track::LogicalAccess& access) {
  const model::LogicalExpectation& expected = bus_.Expect(access);
  // The owner of these inputs is not certain, or no slave fills whole bytes.
  if (access.wkc != expected.full || !expected.fills_bytes) return;
  for (const model::LogicalShare& share : expected.shares) {
    const model::SlaveModel& slave = bus_.slave(share.slave);
    if (share.input_bytes == 0 || !slave.profile->sync.lost_after_missing.value) continue;
    Grow(share.slave).outputs.ReadStatusWord(slave, share, access.returned_data);
  }
}

void SyncModel::On(const track::Answered& answer) {
  if (!answer.returned.seen()) return;  // there is no answer to measure
  BeginFrame(answer.sent, answer.returned);
  if (!DcClock::Concerns(answer)) return;
  if (const auto time = clock_.On(answer)) at_hand_.SetTime(*time);
}

void SyncModel::Flush() {
  if (at_hand_.Complete(sent_frames_, clock_, delays_)) {
    trust_.AddRoundTrip(at_hand_.sent(), at_hand_.returned());
    if (at_hand_.sent().seen() && at_hand_.returned().seen()) sent_frames_.Returned(at_hand_.sent().number);
    FeedEach();
  }
  at_hand_.Begin({}, {});
}

void SyncModel::FeedEach() {
  for (const ProcessDatagram& datagram : at_hand_.datagrams()) {
    if (datagram.slave != kNoSlave) {
      Slave& slave = Of(datagram.slave);
      meter_.Feed(datagram.slave, slave.outputs, slave.dc, at_hand_, nullptr);
      slave.outputs.direct = true;
      continue;
    }
    const model::LogicalExpectation& expected = bus_.Expect(datagram.command, datagram.address, datagram.length);
    const CyclicImage* image = Measure(datagram, IsOfOp(expected));
    if (datagram.brings_outputs() && expected.outputs > 0) FeedAll(datagram, expected, image);
  }
}

/// Those of its slaves that are fed together, and each of the others by itself.
void SyncModel::FeedAll(const ProcessDatagram& datagram, const model::LogicalExpectation& expected,
                        const CyclicImage* image) {
  const auto feed = [&](SlaveId id) -> Slave& {
    Slave& slave = Of(id);
    meter_.Feed(id, slave.outputs, slave.dc, at_hand_, image);
    slave.outputs.direct = false;
    return slave;
  };
  if (image == nullptr || sink_.HasSubscribers<PhaseMeasured>()) {
    for (const model::LogicalShare& share : expected.shares) {
      if (share.outputs) feed(share.slave);
    }
    return;
  }
  Feeds& feeds = feeds_[images_.NumberOf(*image)];
  const std::uint64_t mappings = bus_.network().mapping_version();
  const bool same_slaves = feeds.mappings == mappings && feeds.length == datagram.length;
  if (same_slaves && feeds.together.Take(*image, at_hand_)) {
    for (const SlaveId id : feeds.others) feed(id);
    return;
  }
  feeds.together.Settle();
  feeds.mappings = mappings;
  feeds.length = datagram.length;
  feeds.others.clear();
  feeds.together.Begin(*image, at_hand_);
  for (const model::LogicalShare& share : expected.shares) {
    if (!share.outputs) continue;
    Slave& slave = feed(share.slave);
    if (!feeds.together.Join(bus_.slave(share.slave).al, slave.outputs, slave.dc)) feeds.others.push_back(share.slave);
  }
}

/// Some slave that has a part in it is in OP.
bool SyncModel::IsOfOp(const model::LogicalExpectation& expected) const {
  return std::any_of(expected.shares.begin(), expected.shares.end(), [this](const model::LogicalShare& share) {
    return bus_.slave(share.slave).al.SettledIn(esc::AlState::OP);
  });
}

const CyclicImage* SyncModel::Measure(const ProcessDatagram& datagram, bool in_op) {
  CyclicImage* image = images_.Find(datagram.command, datagram.address);
  if (image == nullptr) return nullptr;
  const FrameTime& time = at_hand_.time();
  const bool interval = image->Add(time, at_hand_.sent().seen(), datagram.wkc > 0 || datagram.assumed, in_op);
  if (interval && image->rhythm.base != TimeBase::kNone && sink_.HasSubscribers<IntervalMeasured>()) {
    sink_.Publish(IntervalMeasured{*image, time.frame, image->rhythm.ns});
  }
  return image;
}

void SyncModel::On(const track::SlaveAccess& access) {
  if (Touches(access, esc::kSystemTimeDelay, 4)) OnDelayAccess(access);
  BeginFrame(access.sent, access.returned);
  if (Touches(access, esc::kFmmuBase, esc::kMaxFmmus * esc::kFmmuBytes)) OnFmmus(access);
  if (access.address >= esc::kProcessRam) {
    OnMemoryWritten(access);
  } else if (Touches(access, esc::kDcFirst, esc::kDcEnd - esc::kDcFirst)) {
    OnDcAccess(access);
  } else if (Touches(access, esc::kWatchdogDivider, esc::kProcessWatchdog + 2 - esc::kWatchdogDivider)) {
    const esc::RegisterImage& registers = bus_.network().state(access.slave).registers;
    Of(access.slave).outputs.watchdog_ns =
        esc::WatchdogNs(registers.Value<std::uint16_t>(esc::kWatchdogDivider).value_or(esc::kDefaultWatchdogDivider),
                        registers.Value<std::uint16_t>(esc::kProcessWatchdog).value_or(kDefaultWatchdogSteps));
  }
}

/// With another delay the same frame lies elsewhere between two pulses: what comes is not compared with what was.
void SyncModel::OnDelayAccess(const track::SlaveAccess& access) {
  OutputWatch& outputs = Of(access.slave).outputs;
  const std::int64_t before = delays_.Of(access.slave);
  delays_.Touched();
  const std::int64_t moved = delays_.Of(access.slave) - before;
  if (moved > kSameDelay || moved < -kSameDelay) outputs.phase.BeginAnew();
}

/// Before it was known what maps its outputs, it is unknown which frames brought some: it is known to wait from here.
void SyncModel::OnFmmus(const track::SlaveAccess& access) {
  if (!access.done()) return;
  Slave& slave = Of(access.slave);
  const track::KnownFmmus& fmmus = bus_.network().fmmus(access.slave);
  const bool mapped =
      std::any_of(fmmus.active.begin(), fmmus.active.end(), [](const auto& unit) { return unit.fmmu.writes(); });
  const bool was_known = std::exchange(slave.fmmus_known, fmmus.any);
  const bool was_mapped = std::exchange(slave.outputs_mapped, mapped);
  if (was_mapped || !mapped || (was_known && !access.written.empty())) return;
  OutputWatch& watch = slave.outputs;
  if (!watch.seen && watch.op_since.seen()) watch.op_since = access.frame();
}

/// Outputs may be written without FMMU, straight to the memory that the sync manager guards. The slave gets them when
/// the last byte is written.
void SyncModel::OnMemoryWritten(const track::SlaveAccess& access) {
  if (access.written.empty() || access.broadcast || !access.done()) return;
  const auto manager = bus_.network().state(access.slave).process_manager(esc::SmDirection::ECAT_WRITES);
  if (!manager || access.address >= manager->end() || access.address + access.written.size() < manager->end()) return;
  at_hand_.Add({.slave = access.slave});
}

void SyncModel::OnDcAccess(const track::SlaveAccess& access) {
  // The time alone is read in nearly every cycle, and changes nothing in how outputs come.
  const bool only_time = access.address == esc::kSystemTime && access.length() <= 8;
  Slave& slave = only_time ? Grow(access.slave) : Of(access.slave);
  const bool distributes = access.command == wire::Command::ARMW || access.command == wire::Command::FRMW;
  // A write of 0x0910 sets nothing: the clock is compared with it, and made a little faster or slower.
  if (!access.written.empty() && !distributes && access.acceptance != track::Acceptance::kRefused &&
      Touches(access, esc::kSystemTimeOffset, 12)) {
    clock_.WasSet(access.slave);
  }
  const DcUnit::Change change = slave.dc.On(access, bus_.network().state(access.slave).registers);
  // What came so far is evaluated while it is known by which settings.
  if (change == DcUnit::Change::kSwitchedOff) meter_.EndRate(access.slave, slave.outputs);
  if (change == DcUnit::Change::kSwitchedOn) {
    slave.outputs.rate.BeginAnew();
    SwitchedOn(access.slave, slave.dc);
  }
}

void SyncModel::SwitchedOn(SlaveId slave, DcUnit& unit) {
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
  const FrameRef& sent = at_hand_.frame();
  const auto uncertainty = Uncertainty(TimeBase::kCapture);
  if (event.read_time_ns && event.read_frame.has_time && sent.has_time && uncertainty) {
    event.since_read_ns = Elapsed(event.read_frame.time, sent.time);
    event.uncertainty_ns = *uncertainty;
  }
  if (event.StartHadPassed()) unit.StartHadPassed();
  sink_.Publish(event);
}

/// What was sent in a capture gap is unknown: no interval, no slot and no rhythm reaches over it.
void SyncModel::On(const track::CaptureGap& gap) {
  Flush();
  for (const auto& slave : slaves_) {
    slave->outputs.Part();
    slave->outputs.OnHole(gap);
    if (gap.certain) slave->dc.OnGap();
  }
  if (gap.certain) images_.ForgetLast();
}

void SyncModel::On(const track::WriteDoubtful& write) {
  const track::SlaveAccess& access = write.access;
  if (access.command != wire::Command::ARMW && access.command != wire::Command::FRMW) Of(access.slave).dc.Doubt(access);
}

/// Another cycle, other settings, perhaps another clock: nothing that was measured so far is compared with what
/// follows.
void SyncModel::On(const track::RunBegan& run) {
  Flush();
  const bool asked = run.reason == track::RunBegan::Reason::kInitialised;
  for (std::size_t s = 0; s < slaves_.size(); ++s) {
    if (asked)
      meter_.Starve(static_cast<SlaveId>(s), outputs(static_cast<SlaveId>(s)), run.frame, OutputGap::End::kRequest);
    EndRun(static_cast<SlaveId>(s));
  }
  CycleSummary ended = SummariseRun();
  if (ended.cycles > earlier_.cycles) earlier_ = std::move(ended);
  images_ = {};
  clock_.WasSet(clock_.reference());
}

void SyncModel::EndRun(SlaveId id) {
  Slave& slave = Of(id);
  meter_.EndRate(id, slave.outputs);
  sink_.Publish(SlaveRunEnded{id});
  slave.dc.BeginAnew();
  slave.outputs.BeginAnew();
}

void SyncModel::On(const model::AlChangedByItself& change) {
  if (change.before.state() == static_cast<std::uint8_t>(esc::AlState::OP) &&
      change.status.state() != static_cast<std::uint8_t>(esc::AlState::OP)) {
    OutputWatch& watch = Of(change.slave).outputs;
    // It left OP before it got outputs there: it waited since it was in OP.
    const bool never_fed = !watch.fell.seen() && !watch.FedInOp() && watch.op_since.seen();
    if (never_fed) meter_.StarvedUntil(change.slave, watch, change.frame, change.status, change.code);
    watch.Fell(change.frame, change.status, change.code);
  }
}

void SyncModel::On(const model::AlErrorCode& code) {
  OutputWatch& watch = Of(code.slave).outputs;
  if (watch.fell.seen() && !watch.fell_code) watch.fell_code = code.code;
}

/// The master lets the slave leave OP: what it waited for until now it does not get any more.
void SyncModel::On(const track::AlRequest& request) {
  if (request.acceptance == track::Acceptance::kRefused ||
      request.control.state() == static_cast<std::uint8_t>(esc::AlState::OP) || request.slave >= slaves_.size()) {
    return;
  }
  OutputWatch& watch = Of(request.slave).outputs;
  if (watch.fell.seen()) {
    // The master acknowledges the drop before outputs come again.
    meter_.StarvedUntil(request.slave, watch, watch.fell, watch.fell_to, watch.fell_code);
    watch.fell = {};
  } else {
    meter_.Starve(request.slave, watch, request.frame(), OutputGap::End::kRequest);
  }
  meter_.EndRate(request.slave, watch);
  watch.LeaveOp();
  if (request.control.state() < static_cast<std::uint8_t>(esc::AlState::SAFEOP)) watch.in_safeop = false;
  if (request.control.state() == static_cast<std::uint8_t>(esc::AlState::INIT)) EndRun(request.slave);
}

void SyncModel::On(const track::AlStatusRead& read) {
  const bool op = read.status.state() == static_cast<std::uint8_t>(esc::AlState::OP);
  if (read.slave < slaves_.size() ? slaves_[read.slave]->outputs.op_since.seen() == op : !op) return;
  OutputWatch& watch = Of(read.slave).outputs;
  if (!op) {
    watch.op_since = {};
  } else if (bus_.slave(read.slave).al.SettledIn(esc::AlState::OP)) {
    watch.op_since = read.frame;
    Of(read.slave).dc.ReachedOp();
  }
}

void SyncModel::On(const mailbox::SdoTransfer& transfer) {
  const model::SlaveModel& slave = bus_.slave(transfer.slave);
  if (!PllWatch::Concerns(transfer, slave)) return;
  Slave& own = Of(transfer.slave);
  const bool evaluated = own.outputs.in_op && own.dc.generates_sync0();
  if (const auto measured = own.pll.On(transfer, slave, evaluated, own.outputs.frames_in_op)) sink_.Publish(*measured);
}

void SyncModel::Finish() {
  Flush();
  for (std::size_t s = 0; s < slaves_.size(); ++s) {
    const OutputWatch& watch = outputs(static_cast<SlaveId>(s));
    if (!watch.fell.seen()) {
      meter_.Starve(static_cast<SlaveId>(s), watch, last_seen_, OutputGap::End::kCapture);
      continue;
    }
    meter_.StarvedUntil(static_cast<SlaveId>(s), watch, watch.fell, watch.fell_to, watch.fell_code);
  }
}

CycleSummary SyncModel::SummariseCycle() const {
  CycleSummary last = SummariseRun();
  return last.cycles >= earlier_.cycles ? last : earlier_;
}

CycleSummary SyncModel::SummariseRun() const {
  const CyclicImage* image = cycle();
  if (image == nullptr) return {};
  const auto [best, base] = image->Best();
  CycleSummary summary = best->Summary();
  summary.time_source = Name(base);
  if (const auto uncertainty = Uncertainty(base)) summary.uncertainty_us = static_cast<double>(*uncertainty) / 1e3;
  summary.command = wire::Name(image->command);
  summary.logical_address = image->address;
  summary.origins = OriginsOf(*image, *best, base);
  return summary;
}

/// What the stamps differ by beyond a better clock is the recorder's doing.
std::optional<DelayOrigins> SyncModel::OriginsOf(const CyclicImage& image, const IntervalStatistics& best,
                                                 TimeBase base) const {
  const IntervalHistogram* trips = trust_.RoundTrips();
  if (trips == nullptr || best.count() < kEnoughIntervals) return std::nullopt;
  const auto us = [](TimeNs ns) { return static_cast<double>(ns) / 1e3; };
  DelayOrigins origins;
  origins.master_us = us(best.Width());
  origins.return_us = us(trips->Width());
  origins.round_trip_us = us(trips->Percentile(0.5));
  origins.longest_round_trip_us = us(trips->longest());
  if (base != TimeBase::kCapture && image.by_stamp.count() >= kEnoughIntervals) {
    const double stamps = us(image.by_stamp.Width());
    origins.recorder_us = std::sqrt(std::max(0.0, stamps * stamps - origins.master_us * origins.master_us));
  }
  return origins;
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
  summary.pll = slaves_[slave]->pll.Summary(bus_.slave(slave));
  const Sync0Phase& phase = outputs(slave).phase;
  if (phase.frames() > 0 && unit.activated()) {
    summary.phase = phase.Summary(unit.activated()->sync0_cycle_ns.value_or(0));
  }
  return summary;
}

}  // namespace ecaudit::sync
