#include "analyzers/progress/enable_check.h"

#include <algorithm>
#include <utility>

namespace ecaudit::progress {
namespace {

using device::DriveState;

constexpr std::uint16_t kNeeded = 0x0007;  ///< besides bit 3

// CiA 402 gives no times. What no drive can follow needs a few cycles; what a drive may be slow in, a second.
constexpr TimeNs kImpossibleNs = 200'000'000;
constexpr TimeNs kEdgeNs = 500'000'000;
constexpr TimeNs kSlowNs = 1'000'000'000;
// Drives need some milliseconds for each state; brakes and converters take longer.
constexpr TimeNs kHastyNs = 50'000'000;
constexpr std::uint32_t kAttempts = 10;
constexpr std::size_t kNoCommands = 24;

/// Bits 0 to 2 and 7 of the control word: Shutdown is 6 of them.
constexpr std::uint16_t kShutdownMask = 0x0087;
constexpr std::uint16_t kShutdown = 0x0006;

bool IsWhole(std::uint16_t word) {
  return (word & kEnableWord) == kEnableWord;
}

}  // namespace

void EnableCheck::Forget() {
  const FrameRef enabled = enabled_since_;
  const bool wanted = wanted_;
  const bool ignores_remote = ignores_remote_;
  *this = {};
  enabled_since_ = enabled;
  wanted_ = wanted;
  ignores_remote_ = ignores_remote;
}

void EnableCheck::FollowWish(const AxisView& now) {
  if (now.control_first) {
    wish_ = !now.Control(kEnableOperationBit) ? Wish::kNone : now.began ? Wish::kShown : Wish::kStands;
  } else if (now.control_changed) {
    if (!now.Control(kEnableOperationBit)) {
      wish_ = Wish::kNone;
    } else if (now.Rises(kEnableOperationBit)) {
      wish_ = now.enabled() ? Wish::kStands : Wish::kShown;
    } else if (IsWhole(now.control_before) && !IsWhole(*now.control)) {
      wish_ = Wish::kNone;  // a quick stop, or the way down
    } else if (IsWhole(*now.control)) {
      wish_ = Wish::kShown;
    }
  }
}

void EnableCheck::Step(const AxisView& now, AxisRecords& out) {
  FollowWish(now);
  if (now.state_changed && now.enabled()) {
    enabled_since_ = now.frame;
    out.SolveEnabling(now.frame);
  }
  if (now.Status(kVoltageBit)) had_voltage_ = true;
  if (now.state_changed) {
    if (IsFault(now.state) && !IsFault(now.state_before)) {
      fault_began_ = now.state_before.has_value();
      resets_ = 0;
      last_reset_ = {};
    }
    if (now.enabled()) {
      asked_before_ = 0;
      if (wish_ == Wish::kShown) wish_ = Wish::kStands;  // it came true
    }
  }
  if ((wish_ == Wish::kShown && !now.enabled()) || (now.Rises(kResetBit) && IsFault(now.state))) wanted_ = true;
  FollowSdo(now, out);
  Attempts(now, out);
  Values(now, out);
  Drops(now, out);
  Dips(now, out);
  InFault(now, out);
  Disabled(now, out);
  OnTheWay(now, out);
  Swapped(now, out);
}

/// A master that does not wait for the drive goes through its sequence again and again.
void EnableCheck::Attempts(const AxisView& now, AxisRecords& out) {
  if (now.enabled() || IsFault(now.state) || now.in_op == InOp::kNo || !now.control) {
    attempts_ = 0;
    return;
  }
  const bool rises = now.Rises(kEnableOperationBit);
  const bool falls = now.control_changed && !now.Control(kEnableOperationBit) && attempt_.seen();
  if (falls && now.frame.has_time && attempt_.has_time) {
    longest_ = std::max(longest_, Elapsed(attempt_.time, now.frame.time));
    attempt_ = {};
  }
  if (!rises || value_count_ >= kNoCommands) return;
  if (attempts_++ == 0) {
    first_attempt_ = now.frame;
    longest_ = 0;
    hasty_ = false;
  }
  attempt_ = now.frame;
  if (attempts_ < kAttempts || longest_ >= kHastyNs || !first_attempt_.has_time || !now.frame.has_time) return;
  const TimeNs lasted = Elapsed(first_attempt_.time, now.frame.time);
  if (lasted < kEdgeNs) return;
  if (std::exchange(hasty_, true)) return out.Extend(AxisFact::kHasty, Quantity::kNone, now.frame);
  AxisRecord record = now.Record(AxisFact::kHasty, first_attempt_, lasted);
  record.a = attempts_;
  record.b = longest_;
  out.Add(record);
}

/// The commands of CiA 402 need a dozen values: data of something else have many more.
void EnableCheck::Values(const AxisView& now, AxisRecords& out) {
  if (now.enabled() || now.in_op == InOp::kNo || !now.control) {
    values_.reset();
    value_count_ = 0;
    return;
  }
  if (!now.control_changed) return;
  const auto low = static_cast<std::size_t>(*now.control & 0x00FFU);
  if (!values_.test(low)) {
    values_.set(low);
    if (value_count_++ == 0) first_value_ = now.frame;
  }
  if (value_count_ < kNoCommands) return;
  AxisRecord* const known = out.Find(AxisFact::kNoControlWord);
  if (known != nullptr && known->since.number == first_value_.number) {
    known->a = static_cast<std::int64_t>(value_count_);
    return out.Extend(AxisFact::kNoControlWord, Quantity::kNone, now.frame);
  }
  wanted_ = true;
  out.Drop(AxisFact::kHasty);  // bit 3 of other data
  const bool timed = first_value_.has_time && now.frame.has_time;
  AxisRecord record =
      now.Record(AxisFact::kNoControlWord, first_value_, timed ? Elapsed(first_value_.time, now.frame.time) : 0);
  record.a = static_cast<std::int64_t>(value_count_);
  out.Add(record);
}

/// A drive that gets its Shutdown and does not take it: something that it needs is not there.
void EnableCheck::Disabled(const AxisView& now, AxisRecords& out) {
  const bool disabled = now.state == DriveState::kSwitchOnDisabled && now.in_op == InOp::kYes && now.control;
  if (!disabled) {
    shutdown_ = first_shutdown_ = {};
    shutdown_sent_ = 0;
    shutdown_due_ = false;
    disabled_.Reset();
    last_wish_ = {};
    return;
  }
  if (shutdown_.seen() && shutdown_.has_time && now.frame.has_time) {
    shutdown_due_ = shutdown_due_ || Elapsed(shutdown_.time, now.frame.time) >= kHastyNs;
  }
  const bool shutdown = (*now.control & kShutdownMask) == kShutdown;
  if (!shutdown && shutdown_.seen() && shutdown_.has_time && now.frame.has_time) {
    shutdown_sent_ = std::max(shutdown_sent_, Elapsed(shutdown_.time, now.frame.time));
  }
  if (!shutdown || !shutdown_.seen()) shutdown_ = shutdown ? now.frame : FrameRef{};
  if (!first_shutdown_.seen()) first_shutdown_ = shutdown_;
  if (now.Control(kEnableOperationBit)) last_wish_ = now.frame;
  const bool wishes = last_wish_.seen() && last_wish_.has_time && now.frame.has_time &&
                      Elapsed(last_wish_.time, now.frame.time) < kSlowNs;
  const bool wished = disabled_.Hold(shutdown_due_ && wishes, now.frame) >= kImpossibleNs;
  // The wait begins with Shutdown: the words after it need not last.
  const bool timed = first_shutdown_.has_time && now.frame.has_time;
  const TimeNs waited = timed ? Elapsed(first_shutdown_.time, now.frame.time) : 0;
  if (wished && out.IsDue(AxisFact::kStaysDisabled, disabled_, waited, kSlowNs, now.frame)) {
    wanted_ = true;
    out.Add(now.Record(AxisFact::kStaysDisabled, first_shutdown_, waited));
  }
}

/// 0x0600, 0x0700, 0x0F00: the enable sequence in the wrong order of bytes.
void EnableCheck::Swapped(const AxisView& now, AxisRecords& out) {
  const std::uint16_t control = now.control.value_or(0);
  const auto high = static_cast<std::uint16_t>(control >> 8U);
  const bool acts = now.in_op != InOp::kNo && now.state && !now.enabled() && !IsFault(now.state);
  if (!acts || (control & 0x00FFU) != 0) {
    swapped_before_ = false;
  } else if (control != 0 && (high == kShutdown || high == kNeeded)) {
    swapped_before_ = true;
  }
  const bool swapped = acts && swapped_before_ && (control & 0x00FFU) == 0 && high == kEnableWord;
  if (const TimeNs held = swapped_.Hold(swapped, now.frame);
      out.IsDue(AxisFact::kBytesSwapped, swapped_, held, kEdgeNs, now.frame)) {
    wanted_ = true;
    out.Add(now.Record(AxisFact::kBytesSwapped, swapped_.since(), held));
  }
}

/// A drive that accepts Shutdown or Switch on and leaves that state at once: something that it needs is not there.
void EnableCheck::Drops(const AxisView& now, AxisRecords& out) {
  if (now.enabled() || now.in_op == InOp::kNo) {
    drops_ = 0;
    return;
  }
  const bool was_on_the_way =
      now.state_before == DriveState::kReadyToSwitchOn || now.state_before == DriveState::kSwitchedOn;
  const bool by_itself = now.Control(kEnableVoltageBit) && now.Control(kQuickStopBit);
  if (!now.state_changed || now.state != DriveState::kSwitchOnDisabled || !was_on_the_way || !by_itself) return;
  if (drops_++ == 0) first_drop_ = now.frame;
  if (drops_ < kDrops) return;
  wanted_ = true;
  if (drops_ > kDrops) return out.Extend(AxisFact::kDropsBack, Quantity::kNone, now.frame);
  const bool timed = first_drop_.has_time && now.frame.has_time;
  AxisRecord record =
      now.Record(AxisFact::kDropsBack, first_drop_, timed ? Elapsed(first_drop_.time, now.frame.time) : 0);
  record.a = drops_;
  out.Add(record);
}

/// The master sends another word for some cycles, perhaps that of an empty process image. The drive obeys, and does not
/// go up again by the word that follows.
void EnableCheck::Dips(const AxisView& now, AxisRecords& out) {
  FollowDip(now);
  const bool fell = dip_ && dip_->until.seen() && now.state && !now.enabled() && !IsFault(now.state);
  const TimeNs held = dipped_.Hold(fell && now.in_op != InOp::kNo, now.frame);
  if (!out.IsDue(AxisFact::kDipped, dipped_, held, kEdgeNs, now.frame)) return;
  wanted_ = true;
  AxisRecord record = now.Record(AxisFact::kDipped, dip_->since, held);
  record.a = dip_->word;
  record.b = Elapsed(dip_->since.time, dip_->until.time);
  out.Add(record);
}

void EnableCheck::FollowDip(const AxisView& now) {
  if (!now.frame.has_time || (now.state_changed && now.enabled())) dip_.reset();
  if (dip_ && dip_->until.seen() && now.enabled() && Elapsed(dip_->until.time, now.frame.time) > kImpossibleNs) {
    dip_.reset();  // the drive did not obey
  }
  if (!now.control_changed || !now.frame.has_time) return;
  const bool whole = IsWhole(*now.control);
  if (now.enabled() && IsWhole(now.control_before) && !whole) {
    dip_ = Dip{*now.control, now.frame, {}};
  } else if (dip_ && !dip_->until.seen() && whole) {
    dip_->until = now.frame;
    if (Elapsed(dip_->since.time, now.frame.time) > kHastyNs) dip_.reset();
  } else if (dip_ && dip_->until.seen() && !whole) {
    dip_.reset();  // the master goes on
  }
}

void EnableCheck::InFault(const AxisView& now, AxisRecords& out) {
  const bool fault = now.state == DriveState::kFault && now.in_op != InOp::kNo;
  if (fault && now.Rises(kResetBit)) {
    ++resets_;
    last_reset_ = now.frame;
  }
  if (const TimeNs held = reset_stands_.Hold(fault && resets_ == 0 && now.Control(kResetBit), now.frame);
      out.IsDue(AxisFact::kResetStands, reset_stands_, held, kEdgeNs, now.frame)) {
    wanted_ = true;
    AxisRecord record = now.Record(AxisFact::kResetStands, reset_stands_.since(), held);
    record.inferred = !fault_began_ && !now.began;
    out.Add(record);
  }
  const bool asks = wish_ == Wish::kShown && fault && resets_ == 0 && !now.Control(kResetBit);
  if (const TimeNs held = reset_missing_.Hold(asks, now.frame);
      out.IsDue(AxisFact::kResetMissing, reset_missing_, held, kSlowNs, now.frame)) {
    out.Add(now.Record(AxisFact::kResetMissing, reset_missing_.since(), held));
  }
  if (const TimeNs held = fault_stays_.Hold(fault && resets_ > 0, now.frame);
      out.IsDue(AxisFact::kFaultStays, fault_stays_, held, kSlowNs, now.frame)) {
    AxisRecord record = now.Record(AxisFact::kFaultStays, fault_stays_.since(), held);
    record.a = resets_;
    out.Add(record);
  }
}

void EnableCheck::OnTheWay(const AxisView& now, AxisRecords& out) {
  const bool acts = now.in_op != InOp::kNo;
  const bool known = now.state.has_value() && !now.enabled() && !IsFault(now.state);
  const std::uint16_t control = now.control.value_or(0);
  const bool shown = wish_ == Wish::kShown;

  const std::uint16_t missing = static_cast<std::uint16_t>(~control) & kNeeded;
  if (const TimeNs held =
          bit_missing_.Hold(acts && known && shown && missing != 0 && !now.Control(kResetBit), now.frame);
      out.IsDue(AxisFact::kControlBitMissing, bit_missing_, held, kImpossibleNs, now.frame)) {
    AxisRecord record = now.Record(AxisFact::kControlBitMissing, bit_missing_.since(), held);
    record.a = missing;
    out.Add(record);
  }

  const bool whole = now.control && IsWhole(control) && !now.Control(kResetBit);
  const bool disabled = now.state == DriveState::kSwitchOnDisabled;
  const bool lost_voltage = had_voltage_ && now.status && !now.Status(kVoltageBit);
  const AxisFact no_shutdown = lost_voltage ? AxisFact::kNoVoltage : AxisFact::kShutdownMissing;
  if (const TimeNs held =
          shutdown_missing_.Hold(acts && whole && disabled && !shutdown_due_ && (shown || !ever_enabled()), now.frame);
      out.IsDue(no_shutdown, shutdown_missing_, held, kEdgeNs, now.frame)) {
    wanted_ = true;
    AxisRecord record = now.Record(no_shutdown, shutdown_missing_.since(), held);
    record.b = shutdown_sent_;
    record.inferred = !shown && !now.began;
    out.Add(record);
  }

  const bool ready = now.state == DriveState::kReadyToSwitchOn || now.state == DriveState::kSwitchedOn;
  const bool asked = acts && whole && ready;
  const AxisFact no_way = !now.Status(kVoltageBit)          ? AxisFact::kNoVoltage
                          : IsLocal(now.status.value_or(0)) ? AxisFact::kLocalControl
                                                            : AxisFact::kNoReaction;
  if (!asked && asked_.since().seen() && known && asked_.since().has_time && now.frame.has_time) {
    asked_before_ += Elapsed(asked_.since().time, now.frame.time);
  }
  if (const TimeNs held = asked_.Hold(asked, now.frame);
      held > 0 && out.IsDue(no_way, asked_, held + asked_before_, kSlowNs, now.frame)) {
    wanted_ = true;
    asked_before_ = 0;
    AxisRecord record = now.Record(no_way, asked_.since(), held);
    record.inferred = !shown && !now.began;
    out.Add(record);
  }

  if (const TimeNs held =
          quick_stop_.Hold(acts && whole && shown && now.state == DriveState::kQuickStopActive, now.frame);
      out.IsDue(AxisFact::kQuickStopStays, quick_stop_, held, kSlowNs, now.frame)) {
    out.Add(now.Record(AxisFact::kQuickStopStays, quick_stop_.since(), held));
  }
  const bool not_ready = acts && now.state == DriveState::kNotReadyToSwitchOn;
  if (!not_ready) asked_last_ = {};
  if (not_ready && shown) asked_last_ = now.frame;
  const bool asked_for =
      asked_last_.has_time && now.frame.has_time && Elapsed(asked_last_.time, now.frame.time) < kSlowNs;
  if (const TimeNs held = not_ready_.Hold(not_ready && (shown || asked_for), now.frame);
      out.IsDue(AxisFact::kNotReady, not_ready_, held, kSlowNs, now.frame)) {
    out.Add(now.Record(AxisFact::kNotReady, not_ready_.since(), held));
  }
  if (const TimeNs held = not_in_op_.Hold(now.in_op == InOp::kNo && now.began && now.op_request != OpRequest::kNow &&
                                              wish_ == Wish::kShown && !now.enabled(),
                                          now.frame);
      out.IsDue(AxisFact::kNotInOp, not_in_op_, held, kSlowNs, now.frame)) {
    AxisRecord record = now.Record(AxisFact::kNotInOp, not_in_op_.since(), held);
    record.a = now.op_request == OpRequest::kEarlier ? 1 : 0;
    out.Add(record);
  }
}

void EnableCheck::OnFollowedWithoutRemote(AxisRecords& out) {
  ignores_remote_ = true;
  out.Rename(AxisFact::kLocalControl, AxisFact::kNoReaction);
}

void EnableCheck::OnSdoControl(const AxisView& now, std::uint16_t word, const FrameRef& frame) {
  by_sdo_.reset();
  const bool asks = (word & (1U << kEnableOperationBit | 1U << kResetBit | 1U)) != 0;
  if (asks && now.control_mapped && now.control && *now.control != word && !now.enabled()) by_sdo_ = {word, frame};
}

void EnableCheck::FollowSdo(const AxisView& now, AxisRecords& out) {
  if (!by_sdo_) return;
  // The process data ask for the same by now, or the drive did what the download asked for.
  if (now.enabled() || now.control == by_sdo_->word || (IsFault(now.state_before) && !IsFault(now.state))) {
    by_sdo_.reset();
    return;
  }
  if (!now.frame.has_time || !by_sdo_->frame.has_time || now.in_op != InOp::kYes) return;
  const TimeNs held = Elapsed(by_sdo_->frame.time, now.frame.time);
  if (held < kEdgeNs || now.Control(kEnableOperationBit)) return;
  wanted_ = true;
  AxisRecord record = now.Record(AxisFact::kOverwrittenControl, by_sdo_->frame, held);
  record.a = by_sdo_->word;
  record.b = now.control.value_or(0);
  out.Add(record);
  by_sdo_.reset();
}

}  // namespace ecaudit::progress
