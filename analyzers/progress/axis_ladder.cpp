#include <array>

#include "analyzers/progress/axis_facts.h"
#include "analyzers/progress/ladder.h"

namespace ecaudit::progress {
namespace {

constexpr Word kNoFault{"no-fault", "no fault"};
constexpr Word kVoltage{"voltage", "voltage enabled"};
constexpr Word kEnabled{"enabled", "enabled"};
constexpr Word kMode{"mode", "mode shown"};
constexpr Word kCommanded{"commanded", "commanded"};
constexpr Word kFollows{"follows", "follows"};

constexpr Word kNoStatusWord{"no-status-word", "the status word is not in the capture"};
constexpr Word kNoControlWord{"no-control-word", "the control word is not in the capture"};
constexpr Word kInFault{"fault", "the drive is in Fault"};
constexpr Word kVoltageMissing{"no-voltage", "bit 4 of the status word is 0"};
constexpr Word kLeftEnabled{"left-enabled", "the drive left Operation enabled without a command"};
constexpr Word kWentIntoFault{"went-into-fault", "the drive went from Operation enabled into a fault"};
constexpr Word kModeDiffers{"mode-differs", "6061h does not show the mode that 6060h selects"};
constexpr Word kModeNotShown{"mode-not-in-capture", "6061h is not in the capture"};
constexpr Word kModeUnknown{"mode-not-known", "the mode of operation (6060h, 6061h) is not in the capture"};
constexpr Word kSetpointUnknown{"setpoint-not-in-capture", "the set point of the mode is in no object of CiA 402"};
constexpr Word kActualUnknown{"actual-not-in-capture", "the actual value is not in the capture"};
constexpr Word kNotMeasured{"too-short", "the axis did not move far enough to compare"};
constexpr Word kNoSetpoint{"no-setpoint", "homing has no set point that the actual value could follow"};
constexpr Word kLimited{"limit-active", "an internal limit is active (bit 11 of the status word)"};
constexpr Word kOtherUnits{"other-scaling", "target and actual velocity may be in different units"};
constexpr Word kCaptureEnds{"capture-ends", "the capture ends before 6061h can follow 6060h"};

/// As drive-mode-not-shown.
constexpr TimeNs kModeLimitNs = 1'000'000'000;

/// The ladder of one axis, rung by rung; each looks at those below it.
class AxisClimb {
 public:
  AxisClimb(const AxisWatch& watch, std::uint8_t axis, const SlaveSummary& slave, const AnalysisResult& result)
      : watch_(watch), axis_(axis), slave_(slave), result_(result) {}

  Ladder Build() {
    Ladder ladder;
    const Rung enabled = Enabled();
    const Rung commanded = Commanded(enabled);
    ladder.rungs = {NoFault(), Voltage(), enabled, Mode(), commanded, Follows(enabled, commanded)};
    return ladder;
  }

 private:
  [[nodiscard]] static Rung Of(const Word& word) {
    Rung rung;
    rung.rung = &word;
    return rung;
  }
  static void Take(Rung& rung, const Span& span) {
    rung.since = span.since;
    rung.until = span.lost;
  }
  /// The first fact of this rung that was not over before `reached`, or null.
  [[nodiscard]] const AxisRecord* FactOf(std::string_view rung, const FrameRef& reached) const {
    for (const AxisRecord& record : watch_.records()) {
      if (FactRow(record.fact).rung == rung && !record.healthy && record.last.number >= reached.number) return &record;
    }
    return nullptr;
  }
  void Hold(Rung& rung, const AxisRecord& record) const {
    const AxisFactRow& row = FactRow(record.fact);
    rung.why = &row.word;
    rung.held_since = record.since;
    rung.held_by = Holder({row.rule}, record.last, record.since.seen() ? record.since.number : record.frame.number);
  }
  [[nodiscard]] FindingIndex Holder(std::initializer_list<std::string_view> rules, const FrameRef& lost,
                                    FrameNo first = 0) const {
    return HolderOf(result_, slave_, rules, {axis_, lost, first});
  }

  /// What stands at the end: a fault that was reset holds nothing, and after INIT the state of the drive is not known.
  [[nodiscard]] Rung NoFault() const {
    Rung rung = Of(kNoFault);
    const Span& span = watch_.without_fault();
    Take(rung, span);
    if (span.holds()) {
      rung.status = RungStatus::kReached;
    } else if (!IsFault(watch_.now().state)) {
      rung.why = &kNoStatusWord;
    } else {
      rung.status = span.ever() ? RungStatus::kLost : RungStatus::kNotReached;
      rung.why = &kInFault;
      rung.held_by = Holder({"drive-fault"}, span.lost);
    }
    return rung;
  }

  [[nodiscard]] Rung Voltage() const {
    Rung rung = Of(kVoltage);
    const Span& span = watch_.voltage();
    Take(rung, span);
    if (!watch_.status_seen()) {
      rung.why = &kNoStatusWord;
    } else if (span.holds() || watch_.enabled().holds()) {
      rung.status = RungStatus::kReached;  // not every drive has the bit
      if (!span.ever()) rung.since = watch_.enabled().since;
    } else if (!watch_.control_seen()) {
      rung.why = &kNoControlWord;
    } else if (!watch_.enable().wanted()) {
      rung.status = RungStatus::kNotAsked;
    } else if (span.ever() && !watch_.voltage_lost_unasked() && !AsksToEnable()) {
      rung.status = RungStatus::kReached;
    } else {
      rung.status = span.ever() ? RungStatus::kLost : RungStatus::kNotReached;
      rung.why = &kVoltageMissing;
      rung.held_by = Holder({"drive-not-enabled", "drive-no-reaction"}, span.lost);
    }
    return rung;
  }

  /// By the last control word.
  [[nodiscard]] bool AsksToEnable() const {
    const AxisView& now = watch_.now();
    return !now.leaving && now.control && (*now.control & kEnableWord) == kEnableWord;
  }

  /// Outside OP a drive does not stay enabled, whether or not its status word was read again.
  [[nodiscard]] const Rung* LeftOp() const {
    const Rung* const op = slave_.progress.Find("op");
    return op != nullptr && op->until.seen() && op->until.number > watch_.status_frame() ? op : nullptr;
  }

  [[nodiscard]] Rung Enabled() const {
    Rung rung = Of(kEnabled);
    const Span& span = watch_.enabled();
    Take(rung, span);
    const AxisRecord* const fact = FactOf("enabled", span.lost);
    if (!watch_.status_seen()) {
      rung.why = &kNoStatusWord;
    } else if (span.holds()) {
      rung.status = RungStatus::kReached;
      if (const Rung* const op = LeftOp()) {
        rung.status = op->status;
        rung.until = op->until;
        rung.why = op->why;
        rung.held_by = op->held_by;
      }
    } else if (span.ever() && fact == nullptr) {
      rung.status = watch_.lost_unasked() ? RungStatus::kLost : RungStatus::kReached;
      if (rung.status == RungStatus::kLost) {
        rung.why = watch_.lost_by_fault() ? &kWentIntoFault : &kLeftEnabled;
        rung.held_by = Holder(
            {"drive-fault", "al-unexpected-change", "drive-illegal-state-change", "drive-not-enabled"}, span.lost);
      }
    } else if (!watch_.control_seen()) {
      rung.why = &kNoControlWord;
    } else if (!watch_.enable().wanted()) {
      rung.status = RungStatus::kNotAsked;
    } else {
      rung.status = span.ever() ? RungStatus::kLost : RungStatus::kNotReached;
      if (fact != nullptr) Hold(rung, *fact);
      if (rung.held_by == kNoFinding) {
        rung.held_by =
            Holder({"drive-not-enabled", "drive-no-reaction", "drive-illegal-command", "drive-fault"}, span.lost);
      }
    }
    return rung;
  }

  [[nodiscard]] Rung Mode() const {
    Rung rung = Of(kMode);
    const Span& span = watch_.mode();
    Take(rung, span);
    const AxisView& now = watch_.now();
    const auto asked = now.mode_asked();
    const AxisRecord* const fact = FactOf("mode", span.holds() ? span.since : FrameRef{});
    if (fact != nullptr) {
      rung.status = RungStatus::kNotReached;
      Hold(rung, *fact);
    } else if (span.holds()) {
      rung.status = RungStatus::kReached;
    } else if (!now.mode_shown) {
      rung.status = asked ? RungStatus::kUnknown : RungStatus::kNotAsked;
      if (asked) rung.why = &kModeNotShown;
    } else if (asked.value_or(0) == 0) {
      rung.status = RungStatus::kNotAsked;
    } else {
      rung.held_by = Holder({"drive-mode-not-shown", "drive-unsupported-mode", "pdo-object-type"}, span.lost);
      if (rung.held_by == kNoFinding && span.ever() && EndsAfter(span.lost)) {
        rung.why = &kCaptureEnds;  // unknown
        return rung;
      }
      rung.status = span.ever() ? RungStatus::kLost : RungStatus::kNotReached;
      rung.why = &kModeDiffers;
    }
    return rung;
  }

  /// The capture is over before the drive had to show the mode.
  [[nodiscard]] bool EndsAfter(const FrameRef& moment) const {
    const FrameRef& last = watch_.now().frame;
    return !moment.has_time || !last.has_time || Elapsed(moment.time, last.time) < kModeLimitNs;
  }

  [[nodiscard]] Rung Commanded(const Rung& enabled) const {
    Rung rung = Of(kCommanded);
    const CommandCheck& command = watch_.command();
    rung.since = command.commanded();
    const AxisRecord* const fact = FactOf("commanded", command.last_commanded());
    if (fact != nullptr) {
      rung.status = RungStatus::kNotReached;
      Hold(rung, *fact);
    } else if (command.commanded().seen()) {
      rung.status = RungStatus::kReached;
      if (enabled.until.seen()) rung.until = enabled.until;
    } else if (enabled.status == RungStatus::kUnknown) {
      rung.why = enabled.why;
    } else if (command.without_setpoint()) {
      rung.why = &kSetpointUnknown;
    } else {
      rung.status = RungStatus::kNotAsked;
    }
    return rung;
  }

  [[nodiscard]] Rung Follows(const Rung& enabled, const Rung& commanded) const {
    Rung rung = Of(kFollows);
    const AxisRecord* const fact = FactOf("follows", watch_.follow().followed());
    rung.since = watch_.follow().follows();
    if (fact != nullptr) {
      rung.status = rung.since.seen() ? RungStatus::kLost : RungStatus::kNotReached;
      if (rung.status == RungStatus::kLost) rung.until = fact->since;
      Hold(rung, *fact);
    } else if (rung.since.seen()) {
      rung.status = RungStatus::kReached;
      if (enabled.until.seen()) rung.until = enabled.until;
    } else if (commanded.status != RungStatus::kReached) {
      rung.status = commanded.status == RungStatus::kUnknown ? RungStatus::kUnknown : RungStatus::kNotAsked;
      rung.why = commanded.status == RungStatus::kUnknown ? commanded.why : nullptr;
    } else {
      rung.why = &WhyUnknown();
    }
    return rung;
  }
  [[nodiscard]] const Word& WhyUnknown() const {
    const AxisView& now = watch_.now();
    if (!now.mode()) return kModeUnknown;
    if (now.mode() == kHoming) return kNoSetpoint;
    for (const AxisRecord& record : watch_.records()) {
      if (FactRow(record.fact).rung == "follows" && record.healthy && record.limited) return kLimited;
      if (record.fact == AxisFact::kOtherScale) return kOtherUnits;
    }
    const Quantity quantity = QuantityOf(*now.mode());
    const bool actual = quantity != Quantity::kNone && now.Actual(quantity).has_value();
    return actual ? kNotMeasured : kActualUnknown;
  }

  const AxisWatch& watch_;
  std::uint8_t axis_;
  const SlaveSummary& slave_;
  const AnalysisResult& result_;
};

}  // namespace

Ladder LadderOf(const AxisWatch& axis, std::uint8_t number, const SlaveSummary& slave, const AnalysisResult& result) {
  return AxisClimb(axis, number, slave, result).Build();
}

}  // namespace ecaudit::progress
