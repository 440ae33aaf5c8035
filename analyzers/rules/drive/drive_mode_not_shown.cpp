#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "analyzers/judge/drive_knowledge.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/drive_places.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/drive_text.h"
#include "decoder/mailbox/events.h"
#include "decoder/track/events.h"

namespace ecaudit::drive_mode_not_shown {
namespace {

constexpr FindingKind kNotShown{
    .name = "not-shown",
    .title =
        "[{?absent}Mode {mode} is not in 6502h, and 6061h shows {mode_shown}]"
        "[{!absent}Mode {mode} selected, but the drive shows mode {mode_shown}]",
    .message = R"({object} selects mode {mode} in {request_frame} ({way}). {display} shows {mode_shown} up to {frame},
{waited_ns} after [{?written}the write][{!written}{since_frame}, from which on the drive has to follow] (limit {limit_ms}).
Until {display} shows the new mode, the drive takes set points for the old one.[ By 6502h ({absent}) the drive does
not have this mode.])",
    .next =
        "[{?absent}Select a mode that 6502h lists.][{!absent}Read 6502h to check whether the drive has the mode, and "
        "whether it accepts a new mode in its state.]",
    .identity = "mode mode_shown"};

constexpr FindingKind kLeaves{
    .name = "leaves-enabled",
    .title = "Mode changed from {mode_before} to {mode} while enabled: then {state}",
    .message =
        R"(The drive shows Operation enabled when the master changes {object} from {mode_before} to {mode} in
{request_frame} ({way}). In {frame}, {waited_ns} later, the status word {status_word} shows {state}. No control word asked
for that. Many drives change some modes only while they are disabled.)",
    .next =
        "Disable the drive (control word 0x0006), change the mode, wait for {display}, and enable it again. Look up in "
        "the manual which modes the drive changes while enabled.",
    .identity = "mode_before mode state"};
constexpr const FindingKind* kKinds[] = {&kNotShown, &kLeaves};

// It is its cause.
constexpr std::string_view kAfter[] = {"drive-unsupported-mode"};

constexpr RuleInfo kInfo{.id = "drive-mode-not-shown",
                         .group = "Drive profile (DS402)",
                         .severity = Severity::kWarning,
                         .title = "The drive does not change to the mode that the master selects",
                         .needs = "6060h and 6061h, each in the process data or by SDO; time stamps",
                         .source = "CIA402, modes of operation; AKD-2011, 4.7; MKD, 4.8; PILZ, 4.5",
                         .kinds = kKinds,
                         .after = kAfter,
                         .doc = R"(
## What it checks
Whether the mode that the drive shows (6061h) becomes the one that the master selected (6060h), and whether an enabled
drive stays enabled when the mode changes.

## Why it matters
Until the drive shows the new mode it works in the old one: it may take positions for speeds. A master has to wait for
6061h before it enables the drive or sends set points of the new mode.

## How it is decided
The drive accepted a value other than 0 in 6060h, and 6061h does not show it within the limit (1 s, limit
`drive-mode-not-shown`).

- In the process data 6060h counts in OP only, and the time starts when the slave reaches OP.
- By SDO the time starts with the download, and the master has to read 6061h after the limit.
- Two values that differ from the first frame on count like a change.
- 6502h, where the master read it, shows whether the drive has the mode at all.
- If the mode is not in the family's list, caused_by names drive-unsupported-mode.

An enabled drive leaves Operation enabled within 100 ms after the mode changes, and no control word asked for it: it
goes to a fault or disables itself. The mode before is that of 6061h, or of 6060h if 6061h is not in the capture.

## Example
tests/rules/drive-mode-not-shown/violates.trace

## What to do
Read 6502h to check whether the drive has the mode. Check whether it accepts a new mode in its state (many only while
disabled), and whether something else writes 6060h: process data override SDO.
)"};

constexpr Word kModeShown{"mode-shown", "the mode that the drive shows (6061h)"};
constexpr Word kModeSelected{"mode-selected", "the mode that the master selects (6060h)"};

constexpr TimeNs kLimitNs = 1'000'000'000;
/// An enabled drive that does not accept a mode leaves its state this soon.
constexpr TimeNs kLeavesNs = 100'000'000;
constexpr std::uint64_t kLeavesKey = 1U << 16U;

class DriveModeNotShown final : public Rule {
 public:
  DriveModeNotShown() : Rule(kInfo) {
    Subscribe<model::DriveMode>(&DriveModeNotShown::On);
    Subscribe<model::DriveStateChanged>(&DriveModeNotShown::On);
    Subscribe<model::AlAnswered>(&DriveModeNotShown::On);
    Subscribe<model::AlRequestJudged>(&DriveModeNotShown::On);
    Subscribe<model::AlChangedByItself>(&DriveModeNotShown::On);
    Subscribe<mailbox::SdoTransfer>(&DriveModeNotShown::On);
    Subscribe<track::CaptureGap>(&DriveModeNotShown::On);
    Subscribe<track::RunBegan>(&DriveModeNotShown::On);
  }

  void On(const model::DriveMode& e) {
    const Axis id{e.slave, e.axis};
    Slave& slave = slaves_[id];
    if (e.shown) {
      // By SDO the drive may have followed long before: only what showed the old mode counts.
      Evaluate(id, e.by_sdo ? slave.shown_last : e.frame);
      slave.shown = e;
      slave.shown_last = e.frame;
      if (slave.requested && !slave.of_run_before && slave.requested->value != e.value) {
        if (!slave.since.seen() && Acts(e.slave, *slave.requested)) slave.since = slave.requested->frame;
      } else {
        slave.since = {};
      }
      return;
    }
    Evaluate(id, slave.shown && slave.shown->by_sdo ? slave.shown_last : e.frame);
    slave.since = {};
    slave.change = ChangeBy(slave, e);
    slave.of_run_before = false;
    slave.requested = e;
    if (Differ(slave) && Acts(e.slave, e)) slave.since = e.frame;
  }

  void On(const model::DriveStateChanged& e) {
    const auto found = slaves_.find({e.slave, e.axis});
    if (found == slaves_.end()) return;
    const auto change = std::exchange(found->second.change, std::nullopt);
    if (!change || e.from != device::DriveState::kOperationEnabled || !e.to || e.command.seen()) return;
    if (!change->request.frame.has_time || !e.frame.has_time) return;
    const TimeNs waited = Elapsed(change->request.frame.time, e.frame.time);
    if (waited > kLeavesNs || change->request.frame.number > e.frame.number) return;
    ReportLeaving(e, *change, waited);
  }

  void On(const mailbox::SdoTransfer& e) {
    if (!e.has_object || e.service != mailbox::SdoService::kUpload || e.outcome != mailbox::SdoOutcome::kCompleted ||
        e.data.size() != 1) {
      return;
    }
    ForEachOf(e.slave, [&](const Axis& id, Slave& slave) {
      if (e.index != model::ObjectOfAxis(model::kModesDisplay, id.second)) return;
      if (!slave.shown || static_cast<std::int8_t>(e.data[0]) != slave.shown->value) return;
      slave.shown_last = e.response.seen() ? e.response : e.last;
      Evaluate(id, slave.shown_last);
    });
  }

  void On(const model::AlAnswered& e) {
    if (e.status.raw != static_cast<std::uint16_t>(esc::AlState::OP)) return;
    ForEachOf(e.slave, [&](const Axis&, Slave& slave) {
      if (!slave.requested || slave.requested->by_sdo) return;
      slave.since = Differ(slave) ? e.frame : FrameRef{};
    });
  }
  void On(const model::AlRequestJudged& e) {
    const std::uint8_t target = e.request.control.state();
    if (target != static_cast<std::uint8_t>(esc::AlState::OP)) Leave(e.slave, e.request.frame);
    if (target != static_cast<std::uint8_t>(esc::AlState::INIT)) return;
    ForEachOf(e.slave, [](const Axis&, Slave& slave) { slave.of_run_before = true; });
  }
  void On(const model::AlChangedByItself& e) { Leave(e.slave, e.frame); }
  void On(const track::CaptureGap& e) {
    if (!e.certain) return;
    for (auto& [id, slave] : slaves_) {
      slave.since = {};
      slave.change.reset();
    }
  }

  /// A drive that was without power has forgotten what was selected.
  void On(const track::RunBegan&) {
    for (auto& [id, slave] : slaves_) {
      slave.since = {};
      slave.change.reset();
      slave.of_run_before = true;
    }
  }

  void Finish() override {
    for (const auto& [id, slave] : slaves_) {
      if (!slave.requested && !slave.shown) continue;
      const FrameRef& mapped = context().slave(id.first).inputs.last;
      Evaluate(id, slave.shown && !slave.shown->by_sdo && mapped.seen() ? mapped : slave.shown_last);
      if (slave.requested && !slave.shown) {
        NotEvaluable(id.first, ReasonCode::kNotInCapture, kModeShown);
      } else if (slave.shown && !slave.requested) {
        NotEvaluable(id.first, ReasonCode::kNotInCapture, kModeSelected);
      }
    }
    LinkCauses();
    NotEvaluableFor([](const model::SlaveModel& slave) { return DriveWordsMissing(slave, true); });
  }

 private:
  /// The master selects another mode while the drive is enabled.
  struct Change {
    std::int8_t before = 0;
    model::DriveMode request;
  };
  struct Slave {
    std::optional<model::DriveMode> requested, shown;
    std::optional<Change> change;  ///< the last one since the drive was enabled
    FrameRef shown_last;  ///< last read of 6061h that showed this value by SDO, or its first frame in process data
    bool of_run_before = false;  ///< the request
    FrameRef since;              ///< from here on the two differ and the drive is to follow; not seen(): they do not
  };

  using Axis = std::pair<SlaveId, std::uint8_t>;

  /// Calls `visit(axis, what is kept)` for each axis of the slave that a mode was requested for.
  template <class Visit>
  void ForEachOf(SlaveId slave, Visit visit) {
    for (auto it = slaves_.lower_bound({slave, 0}); it != slaves_.end() && it->first.first == slave; ++it) {
      visit(it->first, it->second);
    }
  }

  static constexpr std::uint16_t kSupportedModes = 0x6502;

  static bool Differ(const Slave& slave) {
    return slave.requested && !slave.of_run_before && slave.shown && slave.requested->value != 0 &&
           slave.requested->value != slave.shown->value;
  }

  /// Whether the drive takes 6060h as it was written.
  [[nodiscard]] bool Acts(SlaveId id, const model::DriveMode& requested) const {
    if (requested.by_sdo) return true;
    const model::StateSet possible = context().slave(id).al.possible();
    return possible.empty() || possible == model::StateSet::Of(static_cast<std::uint8_t>(esc::AlState::OP));
  }

  [[nodiscard]] std::optional<Change> ChangeBy(const Slave& slave, const model::DriveMode& request) const {
    const model::DriveUnit& unit = context().slave(request.slave).drives.axis(request.axis);
    if (unit.status().state != device::DriveState::kOperationEnabled || !Acts(request.slave, request)) return {};
    if (slave.of_run_before || !slave.requested || request.value == 0) return {};
    const std::int8_t before = slave.shown ? slave.shown->value : slave.requested->value;
    if (before == 0 || before == request.value) return {};
    return Change{before, request};
  }

  void ReportLeaving(const model::DriveStateChanged& e, const Change& change, TimeNs waited) {
    const std::uint64_t key = kLeavesKey | AxisKey(e.axis) |
                              static_cast<std::uint64_t>(static_cast<std::uint8_t>(change.request.value)) << 8U |
                              static_cast<std::uint8_t>(change.before);
    if (Repeat(e.slave, key, e.frame) != kNoFinding) return;
    Finding finding = Found(kLeaves, e.slave, e.frame);
    finding.confidence = e.inferred || change.request.inferred ? Confidence::kInferred : Confidence::kObserved;
    finding.Set("mode_before", arg::Number(change.before))
        .Set("mode", arg::Number(change.request.value))
        .Set("state", StateValue(e.to))
        .Set("status_word", arg::Hex(e.word))
        .Set("waited_ns", arg::Ns(waited))
        .Set("object", arg::Object(model::ObjectOfAxis(model::kModesOfOperation, e.axis)))
        .Set("display", arg::Object(model::ObjectOfAxis(model::kModesDisplay, e.axis)))
        .Set("way", WayValue(change.request.by_sdo))
        .Set("request_frame", arg::Frame(change.request.frame.number));
    AddRelated(finding, change.request.frame.number);
    NameAxis(finding, e.axis);
    (void)Report(key, std::move(finding));
  }

  void Leave(SlaveId of, const FrameRef& frame) {
    ForEachOf(of, [&](const Axis& id, Slave& slave) {
      if (!slave.requested || slave.requested->by_sdo) return;
      Evaluate(id, slave.shown && slave.shown->by_sdo ? slave.shown_last : frame);
      slave.since = {};
    });
  }

  void Evaluate(const Axis& of, const FrameRef& until) {
    const auto& [id, axis] = of;
    Slave& slave = slaves_[of];
    if (!slave.since.seen() || !Differ(slave) || !until.seen() || until.number <= slave.since.number) return;
    if (!until.has_time || !slave.since.has_time) {
      NotEvaluable(id, ReasonCode::kNoStamps, until.number);
      return;
    }
    const TimeNs waited = until.time - slave.since.time;
    const TimeNs limit = context().Limit(kInfo.id, kLimitNs);
    if (waited <= limit) return;
    const model::DriveMode& requested = *slave.requested;
    const model::DriveMode& shown = *slave.shown;
    const std::uint64_t key = AxisKey(axis) |
                              static_cast<std::uint64_t>(static_cast<std::uint8_t>(requested.value)) << 8U |
                              static_cast<std::uint8_t>(shown.value);
    const FrameRef since = std::exchange(slave.since, FrameRef{});
    if (Repeat(id, key, until) != kNoFinding) return;
    const device::DeviceDescription& family = *context().slave(id).profile;
    Finding finding = Found(kNotShown, id, until);
    finding.confidence = requested.inferred || shown.inferred ? Confidence::kInferred : Confidence::kObserved;
    finding.Set("mode", ModeValue(family, requested.value))
        .Set("mode_shown", ModeValue(family, shown.value))
        .Set("waited_ns", arg::Ns(waited))
        .Set("limit_ms", arg::Ms(limit))
        .Set("object", arg::Object(model::ObjectOfAxis(model::kModesOfOperation, axis)))
        .Set("display", arg::Object(model::ObjectOfAxis(model::kModesDisplay, axis)))
        .Set("way", WayValue(requested.by_sdo))
        .Set("request_frame", arg::Frame(requested.frame.number))
        .Set("since_frame", arg::Frame(since.number))
        .Set("written", arg::Flag(since.number == requested.frame.number));
    AddRelated(finding, requested.frame.number);
    const model::ObjectValue* const listed =
        context().slave(id).objects.Find(model::ObjectOfAxis(kSupportedModes, axis), 0);
    if (listed != nullptr && requested.value > 0 && requested.value <= 32 &&
        (listed->raw >> static_cast<unsigned>(requested.value - 1) & 1U) == 0) {
      finding.Set("absent", arg::Frame(listed->since));
      AddRelated(finding, listed->since);
    }
    NameAxis(finding, axis);
    if (const FindingIndex index = Report(key, std::move(finding)); index != kNoFinding) {
      reported_.push_back({index, requested.frame.number});
    }
  }

  /// A mode that the drive does not have cannot be shown.
  void LinkCauses() {
    std::vector<Finding>& findings = context().store.findings();
    for (const auto& [index, request] : reported_) {
      for (std::size_t i = 0; i < findings.size(); ++i) {
        const Finding& other = findings[i];
        if (other.rule == "drive-unsupported-mode" && other.slave == findings[index].slave &&
            other.first.number <= request && request <= other.last.number) {
          findings[index].caused_by = static_cast<FindingIndex>(i);
        }
      }
    }
  }

  std::map<Axis, Slave> slaves_;
  std::vector<std::pair<FindingIndex, FrameNo>> reported_;  // finding, frame that selected the mode
};

const RuleRegistration kRegistration{kInfo, MakeRule<DriveModeNotShown>};

}  // namespace
}  // namespace ecaudit::drive_mode_not_shown
