#include "analyzers/progress/progress_model.h"

#include <utility>

#include "decoder/base/bytes.h"
#include "decoder/base/time.h"

namespace ecaudit::progress {
namespace {

/// Parts are made again whenever a mapping changes.
constexpr std::size_t kMostPlaces = 16'384;

constexpr std::uint16_t kSoftwareLimits = 0x607D;

}  // namespace

ProgressModel::ProgressModel(const model::BusModel& model, EventBus& bus) : model_(model) {
  bus.ListenTo<model::ProcessCycle, mailbox::SdoTransfer, model::DriveStateChanged, track::AlRequest, track::CaptureGap,
               track::RunBegan, ClockSet>(Stage::kAfterModel, *this);
}

const AxisWatch* ProgressModel::axis(SlaveId slave, std::uint8_t axis) const {
  const auto found = axes_.find({slave, axis});
  return found != axes_.end() && found->second.seen() ? &found->second : nullptr;
}

SlaveSide& ProgressModel::Get(SlaveId slave) {
  if (slaves_.size() <= slave) slaves_.resize(std::size_t{slave} + 1);
  return slaves_[slave];
}

AxisWatch* ProgressModel::Watch(SlaveId slave, std::uint8_t axis) {
  const device::DeviceDescription* profile = model_.slave(slave).profile;
  const device::DriveProfile* drive = profile != nullptr && profile->drive ? &*profile->drive : nullptr;
  auto found = axes_.find({slave, axis});
  if (found == axes_.end()) {
    if (drive == nullptr || axes_.size() >= kMostAxes) return nullptr;
    found = axes_.emplace(AxisId{slave, axis}, AxisWatch{}).first;
  }
  found->second.SetDrive(drive);
  return &found->second;
}

namespace {

[[gnu::noinline]] InOp MayBeInOp(const model::AlMachine& al) {
  const model::StateSet possible = al.possible();
  const bool may = possible.empty() || possible.contains(static_cast<std::uint8_t>(esc::AlState::OP));
  return may ? InOp::kUnknown : InOp::kNo;
}

}  // namespace

inline SlaveSide ProgressModel::SideOf(SlaveId slave, const model::AlMachine& al) const {
  SlaveSide side;
  if (slave < slaves_.size()) side = slaves_[slave];
  side.in_op = al.SettledIn(esc::AlState::OP) ? InOp::kYes : MayBeInOp(al);
  return side;
}

inline ProgressModel::Part& ProgressModel::PartOf(const model::ImagePart& image) {
  const Recent& recent = recent_[image.serial % recent_.size()];
  return recent.serial == image.serial && recent.part != nullptr ? *recent.part : FindPart(image);
}

[[gnu::noinline]] ProgressModel::Part& ProgressModel::FindPart(const model::ImagePart& image) {
  auto found = parts_.find(image.serial);
  if (found == parts_.end()) {
    if (parts_.size() >= kMostPlaces) {
      parts_.clear();
      recent_ = {};
    }
    found = parts_.emplace(image.serial, Part(image)).first;
  }
  recent_[image.serial % recent_.size()] = {image.serial, &found->second};
  return found->second;
}

[[gnu::noinline]] void ProgressModel::FindWatches(SlaveId slave, Part& part) {
  if (part.shares.empty()) {
    for (const AxisPlaces::Axis& axis : part.places.axes()) part.shares.push_back({axis, nullptr, {}});
  }
  for (Share& share : part.shares) {
    share.watch = Watch(slave, share.places.number);
    if (share.watch != nullptr && part.places.terminal()) share.watch->SetTerminal();
  }
}

[[gnu::always_inline]] inline void ProgressModel::Take(const model::ImagePart& image, Part& part, ByteSpan data,
                                                       const FrameRef& frame) {
  const SlaveSide side = SideOf(image.slave, image.model->al);
  const bool same_side = std::exchange(part.side, side) == side;
  const device::DeviceDescription* const profile = image.model->profile;
  const bool same_profile = std::exchange(part.profile, profile) == profile && !part.shares.empty();
  if (!same_profile) FindWatches(image.slave, part);
  for (Share& share : part.shares) {
    AxisValues& values = share.values;
    part.places.Read(share.places, data, values);
    if (share.watch == nullptr) continue;
    if (!same_side || !same_profile) values.TakeAgain();
    // Most cycles of a machine at rest change nothing.
    if (!values.changed() && share.watch->still()) continue;
    const bool outputs = image.direction == device::PdoDirection::kRx;
    const bool taken = outputs ? share.watch->OnOutputs(values, image.serial, frame, side)
                               : share.watch->OnInputs(values, image.serial, frame, side);
    if (taken) values.Taken();
  }
}

[[gnu::noinline]] void ProgressModel::TakeMotors(const model::ImagePart& image, const Part& part, ByteSpan data,
                                                 const FrameRef& frame) {
  // Outputs act in OP only.
  if (SideOf(image.slave, image.model->al).in_op != InOp::kYes) return;
  MotorWatch* watch = nullptr;
  for (const MotorPlaces::Place& place : part.motors.places()) {
    if (watch == nullptr || watch->channel() != place.channel) {
      if (watch != nullptr) watch->Step(frame);
      const AxisId id{image.slave, place.channel};
      if (motors_.size() >= kMostAxes && motors_.find(id) == motors_.end()) return;
      watch = &motors_.try_emplace(id, place.channel).first->second;
    }
    if (std::uint64_t{place.bit} + place.bits > std::uint64_t{data.size()} * 8) continue;
    const std::uint64_t raw = model::ExtractBits(data, place.bit, place.bits);
    const std::int64_t value = place.bits > 1 ? SignExtend(raw, place.bits) : static_cast<std::int64_t>(raw);
    watch->Take(place.role, value, place.by_shape);
  }
  if (watch != nullptr) watch->Step(frame);
}

void ProgressModel::On(const model::ProcessCycle& cycle) {
  if (cycle.part.slave == kNoSlave || cycle.part.places.empty() || cycle.data.empty()) return;
  const bool outputs = cycle.part.direction == device::PdoDirection::kRx;
  const bool gave = cycle.exchange == model::Exchange::kYes || cycle.exchange == model::Exchange::kInferred;
  if (!outputs && !gave) return;
  const FrameRef& frame = outputs && cycle.sent.seen() ? cycle.sent : cycle.frame();
  if (!frame.seen()) return;
  Part& part = PartOf(cycle.part);
  if (!part.motors.empty()) TakeMotors(cycle.part, part, cycle.data, frame);
  if (part.places.empty()) return;
  if (clock_sets_.empty()) [[likely]] {
    Take(cycle.part, part, cycle.data, frame);
  } else {
    Take(cycle.part, part, cycle.data, Steady(frame));
  }
}

void ProgressModel::On(const mailbox::SdoTransfer& transfer) {
  if (!transfer.has_object || transfer.complete_access || transfer.data_gap ||
      transfer.outcome != mailbox::SdoOutcome::kCompleted || transfer.data.empty() || transfer.data.size() > 8 ||
      transfer.size != transfer.data.size()) {
    return;
  }
  std::uint64_t raw = 0;
  for (std::size_t i = transfer.data.size(); i > 0; --i) raw = raw << 8U | transfer.data[i - 1];
  const bool download = transfer.service == mailbox::SdoService::kDownload;
  const FrameRef frame = Steady(download || !transfer.response.seen() ? transfer.request : transfer.response);
  if (!frame.seen()) return;
  const std::int64_t value = SignExtend(raw, static_cast<unsigned>(8 * transfer.data.size()));
  if (const auto role = RoleOf(transfer.index, transfer.subindex)) {
    const bool word = role->second == Role::kControl || role->second == Role::kStatus;
    // Other devices have other objects at these indices.
    if (word && transfer.data.size() != 2) return;
    if (AxisWatch* const watch = Watch(transfer.slave, role->first)) {
      watch->OnSdo(role->second, value, download, frame, SideOf(transfer.slave, model_.slave(transfer.slave).al));
    }
    return;
  }
  const auto axis = AxisOf(transfer.index);
  const bool limit = transfer.data.size() == 4 && (transfer.subindex == 1 || transfer.subindex == 2);
  if (!axis || axis->second != kSoftwareLimits || !limit) return;
  if (AxisWatch* const watch = Watch(transfer.slave, axis->first)) watch->SetLimit(transfer.subindex == 2, value);
}

void ProgressModel::On(const model::DriveStateChanged& change) {
  if (!change.command.seen() || (change.word >> kRemoteBit & 1U) != 0) return;
  if (AxisWatch* const watch = Watch(change.slave, change.axis)) watch->OnFollowedWithoutRemote();
}

void ProgressModel::ForgetSlave(SlaveId slave) {
  for (auto it = axes_.lower_bound({slave, 0}); it != axes_.end() && it->first.first == slave; ++it) {
    it->second.Forget();
  }
  for (auto it = motors_.lower_bound({slave, 0}); it != motors_.end() && it->first.first == slave; ++it) {
    it->second.Forget();
  }
}

void ProgressModel::On(const track::AlRequest& request) {
  const std::uint8_t target = request.control.state();
  SlaveSide& slave = Get(request.slave);
  if (target == static_cast<std::uint8_t>(esc::AlState::OP)) {
    slave.op_request = OpRequest::kNow;
    slave.leaving = false;
    if (!model_.slave(request.slave).al.SettledIn(esc::AlState::OP)) slave.began = true;
    return;
  }
  slave.began = true;
  slave.leaving = true;
  if (slave.op_request == OpRequest::kNow) slave.op_request = OpRequest::kEarlier;
  const bool init = target == static_cast<std::uint8_t>(esc::AlState::INIT);
  if (init) slave.op_request = OpRequest::kNever;
  // From here on the slave gives no inputs.
  if (init || target == static_cast<std::uint8_t>(esc::AlState::PREOP)) ForgetSlave(request.slave);
}

void ProgressModel::On(const track::CaptureGap& gap) {
  if (!gap.certain) return;
  for (auto& [id, watch] : axes_) watch.ForgetAtGap();
  for (auto& [id, watch] : motors_) watch.Forget();
  for (SlaveSide& slave : slaves_) slave.began = false;
}

void ProgressModel::On(const track::RunBegan&) {
  for (auto& [id, watch] : axes_) watch.Forget();
  for (auto& [id, watch] : motors_) watch.Forget();
  for (SlaveSide& slave : slaves_) slave = {};
}

void ProgressModel::On(const ClockSet& set) {
  // A clock that is set again and again measures nothing.
  constexpr std::size_t kMost = 64;
  if (clock_sets_.size() >= kMost) return;
  const TimeNs before = clock_sets_.empty() ? 0 : clock_sets_.back().by;
  clock_sets_.push_back({set.packet, Later(before, set.by)});
}

/// By a clock that is not set: the axis checks measure how long something lasts.
FrameRef ProgressModel::Steady(FrameRef frame) const {
  if (!clock_sets_.empty()) frame.time = Later(frame.time, Elapsed(clock_sets_.back().by, 0));
  return frame;
}

/// The inverse of Steady().
void ProgressModel::ToCaptureClock(FrameRef& frame) const {
  for (auto set = clock_sets_.rbegin(); set != clock_sets_.rend(); ++set) {
    if (frame.number < set->packet.number) continue;
    frame.time = Later(frame.time, set->by);
    return;
  }
}

void ProgressModel::Finish() {
  for (auto& [id, watch] : axes_) {
    watch.Finish();
    if (!clock_sets_.empty()) watch.ForEachFrame([this](FrameRef& frame) { ToCaptureClock(frame); });
  }
}

}  // namespace ecaudit::progress
