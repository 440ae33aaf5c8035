#include "analyzers/progress/terminal_watch.h"

#include <algorithm>
#include <string_view>

#include "analyzers/model/slave_model.h"
#include "analyzers/model/terminal_channels.h"
#include "decoder/base/bytes.h"

namespace ecaudit::progress {
namespace {

struct MotorEntry {
  bool output;
  std::uint8_t subindex;
  std::uint16_t bits;
  MotorRole role;
  std::string_view name;  ///< letters only, in lower case
};

/// Module profiles 703 and 733.
constexpr std::array kMotorEntries{
    MotorEntry{true, 0x01, 1, MotorRole::kEnable, "enable"},
    MotorEntry{true, 0x02, 1, MotorRole::kReset, "reset"},
    MotorEntry{true, 0x11, 32, MotorRole::kPosition, "position"},
    MotorEntry{true, 0x21, 16, MotorRole::kVelocity, "velocity"},
    MotorEntry{false, 0x01, 1, MotorRole::kReadyToEnable, "readytoenable"},
    MotorEntry{false, 0x02, 1, MotorRole::kReady, "ready"},
    MotorEntry{false, 0x03, 1, MotorRole::kWarning, "warning"},
    MotorEntry{false, 0x04, 1, MotorRole::kError, "error"},
    MotorEntry{false, 0x05, 1, MotorRole::kMovingPositive, "movingpositive"},
    MotorEntry{false, 0x06, 1, MotorRole::kMovingNegative, "movingnegative"},
};

constexpr std::array<std::uint32_t, 2> kMotorModules{703, 733};

// A terminal releases its output stage within some milliseconds; a second is long for any.
constexpr TimeNs kMotorNs = 1'000'000'000;
constexpr TimeNs kMotorErrorNs = 20'000'000;
/// A position that changes more often moves.
constexpr std::uint32_t kMotorMoves = 20;
constexpr std::size_t kMostRecords = 16;

const MotorEntry* MotorEntryOf(const model::Signal& signal) {
  const bool output = signal.index >= model::kTerminalOutputs;
  for (const MotorEntry& entry : kMotorEntries) {
    if (entry.output == output && entry.subindex == signal.subindex && entry.bits == signal.bits) return &entry;
  }
  return nullptr;
}

enum class Evidence : std::uint8_t { kNone, kShape, kKnown };

/// Whether the channel is a motor, by its entries in both directions.
Evidence EvidenceOf(const model::SlaveModel& slave, std::uint8_t channel) {
  std::array<bool, kMotorRoles> has{};
  bool named = false;
  for (const model::ProcessLayout* layout : {&slave.process.rx(), &slave.process.tx()}) {
    for (const model::Signal& signal : layout->signals) {
      if (signal.gap() || model::TerminalChannelOf(signal.index) != channel) continue;
      const MotorEntry* const entry = MotorEntryOf(signal);
      if (entry == nullptr) continue;
      if (!signal.name.empty() && !signal.name_inferred) {
        if (!model::LettersOf(signal.name).ends_with(entry->name)) return Evidence::kNone;
        named = true;
      }
      has[static_cast<std::size_t>(entry->role)] = true;
    }
  }
  const auto all = [&](std::initializer_list<MotorRole> roles) {
    return std::all_of(roles.begin(), roles.end(), [&](MotorRole role) { return has[static_cast<std::size_t>(role)]; });
  };
  if (!all({MotorRole::kEnable, MotorRole::kReset, MotorRole::kReadyToEnable, MotorRole::kReady, MotorRole::kError})) {
    return Evidence::kNone;
  }
  if (const auto module = model::ModuleProfileOf(slave)) {
    return std::find(kMotorModules.begin(), kMotorModules.end(), *module) != kMotorModules.end() ? Evidence::kKnown
                                                                                                 : Evidence::kNone;
  }
  if (named) return Evidence::kKnown;
  if (!all({MotorRole::kVelocity})) return Evidence::kNone;
  // Nothing else has all of these bits in this order.
  const bool whole = all({MotorRole::kWarning, MotorRole::kMovingPositive, MotorRole::kMovingNegative});
  return whole ? Evidence::kKnown : Evidence::kShape;
}

}  // namespace

MotorPlaces::MotorPlaces(const model::ImagePart& part) {
  if (!part.layout->known()) return;
  for (const model::ImagePart::Place& place : part.places) {
    const model::Signal& signal = part.layout->signals[place.signal];
    const std::optional<std::uint8_t> channel = model::TerminalChannelOf(signal.index);
    const MotorEntry* const entry = channel ? MotorEntryOf(signal) : nullptr;
    if (entry == nullptr) continue;
    const Evidence evidence = EvidenceOf(*part.model, *channel);
    if (evidence == Evidence::kNone) continue;
    places_.push_back({*channel, entry->role, place.bits, place.bit, evidence == Evidence::kShape});
  }
  std::stable_sort(places_.begin(), places_.end(),
                   [](const Place& a, const Place& b) { return a.channel < b.channel; });
}

void MotorWatch::Report(MotorFact fact, bool holds, TimeNs limit, const FrameRef& frame) {
  Lasting& lasting = lasting_[static_cast<std::size_t>(fact)];
  const TimeNs held = lasting.Hold(holds, frame);
  if (held < limit || held == 0) return;
  if (!lasting.Report()) {
    for (MotorRecord& known : records_) {
      if (known.fact != fact) continue;
      known.last = frame;
      if (known.count == 1) known.lasted = held;
    }
    return;
  }
  for (MotorRecord& known : records_) {
    if (known.fact != fact) continue;
    ++known.count;
    known.last = frame;
    return;
  }
  if (records_.size() >= kMostRecords) return;
  MotorRecord record;
  record.fact = fact;
  record.channel = channel_;
  record.since = lasting.since();
  record.frame = record.last = frame;
  record.lasted = held;
  record.velocity = Value(MotorRole::kVelocity).has_value();
  record.set_point = Value(record.velocity ? MotorRole::kVelocity : MotorRole::kPosition).value_or(0);
  record.reset_stands = Is(MotorRole::kReset, true) && !reset_low_;
  record.began = error_began_ != 0 && error_began_ == record.since.number;
  record.by_shape = by_shape_;
  records_.push_back(record);
}

void MotorWatch::Step(const FrameRef& frame) {
  const auto& position = Value(MotorRole::kPosition);
  if (position && last_position_ && *position != *last_position_) ++position_changes_;
  last_position_ = position;
  const bool velocity = Value(MotorRole::kVelocity).value_or(0) != 0;
  const bool wants = velocity || position_changes_ >= kMotorMoves;
  const bool enabled = Is(MotorRole::kEnable, true);
  was_enabled_ = was_enabled_ || enabled;
  const bool error = Is(MotorRole::kError, true);
  if (!error) reset_low_ = false;
  if (error && !Is(MotorRole::kReset, true)) reset_low_ = true;
  if (error) {
    if (error_low_) error_began_ = frame.number;
    without_error_ = {};
  } else if (Is(MotorRole::kError, false) && !without_error_.seen()) {
    without_error_ = frame;
  }
  error_low_ = Is(MotorRole::kError, false);
  const bool ready = Is(MotorRole::kReady, true);
  if (ready && (!ready_since_.seen() || ready_lost_.seen())) {
    ready_since_ = frame;
    ready_lost_ = {};
  } else if (!ready && ready_since_.seen() && !ready_lost_.seen()) {
    ready_lost_ = frame;
  }
  if (ready && wants && !commanded_.seen()) commanded_ = frame;
  if (Is(MotorRole::kMovingPositive, true) || Is(MotorRole::kMovingNegative, true)) {
    if (!first_moved_.seen()) first_moved_ = frame;
    moved_ = frame;
  }
  const bool idle = Is(MotorRole::kError, false) && Is(MotorRole::kReady, false);
  Report(MotorFact::kError, error && (enabled || wants), kMotorErrorNs, frame);
  Report(MotorFact::kEnableMissing, wants && !was_enabled_ && Is(MotorRole::kEnable, false), kMotorNs, frame);
  Report(MotorFact::kNotReadyToEnable, enabled && idle && Is(MotorRole::kReadyToEnable, false), kMotorNs, frame);
  Report(MotorFact::kNotReady, enabled && idle && Is(MotorRole::kReadyToEnable, true), kMotorNs, frame);
  const bool still = Is(MotorRole::kMovingPositive, false) && Is(MotorRole::kMovingNegative, false);
  Report(MotorFact::kStandsStill, enabled && Is(MotorRole::kReady, true) && velocity && still, kMotorNs, frame);
}

void MotorWatch::Forget() {
  values_ = {};
  last_position_.reset();
  position_changes_ = 0;
  was_enabled_ = reset_low_ = error_low_ = false;
  error_began_ = 0;
  for (Lasting& lasting : lasting_) lasting.Reset();
}

}  // namespace ecaudit::progress
