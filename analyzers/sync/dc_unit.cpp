#include "analyzers/sync/dc_unit.h"

#include "decoder/esc/register_addresses.h"

namespace ecaudit::sync {
namespace {

bool Overlaps(const track::SlaveAccess& access, std::size_t length, EscAddress address, std::size_t bytes) {
  return access.address < address + bytes && access.address + length > address;
}

/// ARMW and FRMW hand the time of one slave to the others.
bool Distributes(const track::SlaveAccess& access) {
  return access.command == wire::Command::ARMW || access.command == wire::Command::FRMW;
}

}  // namespace

void DcUnit::Remember(const track::SlaveAccess& access) {
  if (steps_.size() >= (access.broadcast ? kMaxBroadcasts : kMaxSteps)) {
    ++steps_left_out_;
    return;
  }
  DcStep step;
  step.frame = access.frame();
  step.address = access.address;
  step.length = static_cast<std::uint16_t>(access.written.size());
  step.value = UnsignedOf(access.written);
  step.broadcast = access.broadcast;
  step.refused = access.acceptance == track::Acceptance::kRefused;
  steps_.push_back(step);
}

void DcUnit::Meet(const esc::RegisterImage& registers) {
  const auto activation = registers.Value<std::uint8_t>(esc::kDcActivation);
  if (activation && *activation == 0) activation_ = told_activation_ = esc::SyncActivation{*activation};
}

DcUnit::Change DcUnit::On(const track::SlaveAccess& access, const esc::RegisterImage& registers) {
  const std::size_t length = access.length();
  if (access.address >= esc::kDcEnd || access.address + length <= esc::kDcFirst) return Change::kNone;
  const bool configures = !access.written.empty() && !Distributes(access);
  // The receive times are latched by any write to them: nothing is configured by it.
  if (configures && !(access.address == esc::kReceiveTimes && access.written.size() <= 16)) Remember(access);
  if (!access.done()) {
    if (access.acceptance == track::Acceptance::kUnknown) Doubt(access);
    return Change::kNone;
  }
  if (!access.broadcast && length > 0 && access.address + length > esc::kSystemTime) present_ = true;

  // The system time is read in every cycle, nearly always alone.
  if (access.address == esc::kSystemTime && access.read.size() == 8 && access.written.empty() && !access.broadcast) {
    SawOwnTime(LittleEndian<std::uint64_t>(access.read, 0), true, access.frame());
    return Change::kNone;
  }
  if (!access.read.empty() && !access.broadcast) OnRead(access);
  if (configures) OnWrite(access, registers);
  if (Overlaps(access, length, esc::kSync0Cycle, 4)) cycle_ = registers.Value<std::uint32_t>(esc::kSync0Cycle);
  return OnActivation(access, registers);
}

void DcUnit::Doubt(const track::SlaveAccess& access) {
  if (access.written.empty()) return;
  if (Overlaps(access, access.written.size(), esc::kSync0Cycle, 4)) {
    cycle_.reset();
    cycle_changed_ = access.frame().number;
  }
  if (!Overlaps(access, access.written.size(), esc::kDcActivation, 1)) return;
  activation_.reset();
  activation_changed_ = access.frame().number;
  active_.reset();
  FindPulses();
}

void DcUnit::SawOwnTime(std::uint64_t time, bool wide, const FrameRef& frame) {
  own_time_ = time;
  own_time_wide_ = wide;
  upper_half_used_ = upper_half_used_ || time > UINT32_MAX;
  own_time_frame_ = frame;
}

void DcUnit::OnRead(const track::SlaveAccess& access) {
  for (std::size_t port = 0; port < receive_times_.size(); ++port) {
    const ByteSpan time = access.Covered(access.read, static_cast<EscAddress>(esc::kReceiveTimes + 4 * port), 4);
    if (time.empty()) continue;
    receive_times_[port] = LittleEndian<std::uint32_t>(time, 0);
    latched_ = access.frame();
  }
  if (const ByteSpan core = access.Covered(access.read, esc::kReceiveTimeCore, 8); !core.empty()) {
    receive_time_core_ = LittleEndian<std::uint64_t>(core, 0);
  }
  if (const ByteSpan wide = access.Covered(access.read, esc::kSystemTime, 8); !wide.empty()) {
    SawOwnTime(LittleEndian<std::uint64_t>(wide, 0), true, access.frame());
  } else if (const ByteSpan low = access.Covered(access.read, esc::kSystemTime, 4); !low.empty()) {
    SawOwnTime(LittleEndian<std::uint32_t>(low, 0), false, access.frame());
  }
  OnDifference(access);
}

void DcUnit::OnDifference(const track::SlaveAccess& access) {
  const ByteSpan raw = access.Covered(access.read, esc::kSystemTimeDifference, 4);
  if (raw.empty()) return;
  difference_last_ = esc::TimeDifference{LittleEndian<std::uint32_t>(raw, 0)}.magnitude_ns();
  difference_frame_ = access.frame().number;
  if (difference_reads_++ == 0 || difference_last_ > difference_max_) {
    difference_max_ = difference_last_;
    difference_max_frame_ = access.frame();
  }
  if (difference_last_ > kClockSettledNs) {
    if (!difference_above_.seen()) difference_above_ = access.frame();
    settled_ = {};
  } else if (difference_above_.seen() && !settled_.seen()) {
    settled_ = access.frame();
  }
}

void DcUnit::OnWrite(const track::SlaveAccess& access, const esc::RegisterImage& registers) {
  const bool sets_clock = Overlaps(access, access.written.size(), esc::kSystemTime, 8) ||
                          Overlaps(access, access.written.size(), esc::kSystemTimeOffset, 12);
  if (sets_clock && left_on_ && left_on_->clock_set == 0 && left_on_->off == 0) {
    left_on_->clock_set = access.frame().number;
  }
  if (Overlaps(access, access.written.size(), esc::kSystemTimeOffset, 12)) {
    adjusted_ = adjusted_ || !access.broadcast;
    offset_written_ = access.frame().number;
    own_time_.reset();  // taken before the clock was set
  }
  if (Overlaps(access, access.written.size(), esc::kSystemTime, 8)) own_time_.reset();
  if (Overlaps(access, access.written.size(), esc::kSync0Cycle, 4)) {
    const auto cycle = registers.Value<std::uint32_t>(esc::kSync0Cycle);
    if (!cycle || cycle != cycle_) cycle_changed_ = access.frame().number;
    cycle_configured_ = cycle && *cycle != 0 && !access.broadcast ? access.frame() : FrameRef{};
    if (active_ && cycle) {
      cycle_rewritten_.reset();
      if (cycle != active_->sync0_cycle_ns) cycle_rewritten_ = {access.frame(), *cycle};
    }
  }
}

/// 0x0981, as it was written or, by the slave's own address, read.
DcUnit::Change DcUnit::OnActivation(const track::SlaveAccess& access, const esc::RegisterImage& registers) {
  ByteSpan activation = access.Covered(access.written, esc::kDcActivation, 1);
  const bool written = !activation.empty() && !Distributes(access);
  if (activation.empty() && !access.broadcast) activation = access.Covered(access.read, esc::kDcActivation, 1);
  if (activation.empty()) return Change::kNone;
  const esc::SyncActivation now{activation[0]};
  const Change change = Activate(access, now, written, registers);
  FindPulses();
  return change;
}

DcUnit::Change DcUnit::Activate(const track::SlaveAccess& access, esc::SyncActivation now, bool written,
                                const esc::RegisterImage& registers) {
  const bool was_active = activation_ && activation_->active();
  was_known_ = activation_.has_value();
  if (written && (!was_known_ || activation_->raw != now.raw)) activation_changed_ = access.frame().number;
  activation_ = told_activation_ = now;
  if (!now.active()) {
    if (left_on_ && left_on_->clock_set == 0) left_on_.reset();  // in time
    if (left_on_ && left_on_->off == 0 && written) left_on_->off = access.frame().number;
    active_.reset();
    return was_active && written ? Change::kSwitchedOff : Change::kNone;
  }
  if (was_active) return Change::kNone;
  SyncSettings settings = SettingsIn(registers);
  settings.frame = access.frame();
  settings.written = written;
  settings.was_off = was_known_;
  settings.activation = now;
  active_ = settings;
  cycle_rewritten_.reset();
  last_active_ = activated_ = settings;
  return written ? Change::kSwitchedOn : Change::kNone;
}

void DcUnit::StartHadPassed() {
  if (active_) active_->start_had_passed = true;
  FindPulses();
}

void DcUnit::FindPulses() {
  constexpr std::uint32_t kTooLong = 0x80000000U;
  const bool known =
      generates_sync0() && active_->start_ns && !active_->start_had_passed && !activation_->auto_activation();
  const std::uint32_t cycle = known ? active_->sync0_cycle_ns.value_or(0) : 0;
  pulse_cycle_ns_ = cycle < kTooLong ? cycle : 0;
}

SyncSettings DcUnit::SettingsIn(const esc::RegisterImage& registers) const {
  SyncSettings settings;
  if (const auto wide = registers.Value<std::uint64_t>(esc::kDcStartTime)) {
    settings.start_ns = *wide;
    settings.start_is_64_bit = IsWide(registers);
  } else if (const auto low = registers.Value<std::uint32_t>(esc::kDcStartTime)) {
    settings.start_ns = *low;
  }
  settings.sync0_cycle_ns = registers.Value<std::uint32_t>(esc::kSync0Cycle);
  settings.sync1_cycle_ns = registers.Value<std::uint32_t>(esc::kSync1Cycle);
  return settings;
}

void DcUnit::BeginAnew() {
  if (active_) {
    left_on_ = SyncLeftOn{active_->frame.number, active_->written, 0, 0};
  } else if (left_on_ && left_on_->off != 0) {
    left_on_.reset();
  }
  // What was off is off after a power cycle, too.
  if (activation_ && activation_->active()) activation_.reset();
  active_.reset();
  last_active_.reset();
  FindPulses();
  cycle_configured_ = {};
  cycle_rewritten_.reset();
  difference_above_ = settled_ = {};
  difference_frame_ = offset_written_ = 0;
  own_time_.reset();
}

DcSummary DcUnit::Summary(const esc::RegisterImage& registers) const {
  DcSummary s;
  s.receive_times_ns = receive_times_;
  s.receive_time_core_ns = receive_time_core_;
  s.latched_frame = latched_.number;
  if (const auto offset = registers.Value<std::uint64_t>(esc::kSystemTimeOffset))
    s.offset_ns = static_cast<std::int64_t>(*offset);
  s.delay_ns = registers.Value<std::uint32_t>(esc::kSystemTimeDelay);
  s.difference_reads = difference_reads_;
  s.difference_last_ns = difference_last_;
  s.difference_max_ns = difference_max_;
  s.difference_max_frame = difference_max_frame_.number;
  s.difference_above = difference_above_;
  s.settled = settled_;
  if (const auto start = registers.Value<std::uint16_t>(esc::kSpeedCounterStart))
    s.speed_counter_start = esc::SpeedCounterStart(*start);
  if (const auto difference = registers.Value<std::uint16_t>(esc::kSpeedCounterDifference)) {
    s.speed_counter_difference = esc::SpeedCounterDifference(*difference);
  }
  s.assignment = registers.Value<std::uint8_t>(esc::kCyclicUnitControl);
  if (told_activation_) s.activation = told_activation_->raw;
  if (activated_) {
    s.activated = activated_->frame;
    s.activated_with = activated_->activation.raw;
    s.start_time_ns = activated_->start_ns;
    s.sync0_cycle_ns = activated_->sync0_cycle_ns;
    s.sync1_cycle_ns = activated_->sync1_cycle_ns;
  }
  for (std::size_t i = 0; i < 2; ++i) {
    s.latch_control[i] = registers.Value<std::uint8_t>(static_cast<EscAddress>(esc::kLatchControl + i));
    s.latch_status[i] = registers.Value<std::uint8_t>(static_cast<EscAddress>(esc::kLatchStatus + i));
  }
  for (std::size_t i = 0; i < 4; ++i) {
    s.latch_times_ns[i] = registers.Value<std::uint64_t>(static_cast<EscAddress>(esc::kLatchTimes + 8 * i));
  }
  s.configuration = steps_;
  s.configuration_left_out = steps_left_out_;
  return s;
}

}  // namespace ecaudit::sync
