#include <array>
#include <cstdint>
#include <map>
#include <string_view>
#include <tuple>
#include <utility>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/sync_text.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/object_values.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/sync/sync_model.h"
#include "analyzers/sync/sync_type.h"
#include "decoder/base/bytes.h"
#include "decoder/mailbox/events.h"

namespace ecaudit::sync_type_mismatch {
namespace {

constexpr FindingKind kType{
    .name = "type",
    .title = "{object} = {type}, but {pulse} is [{?active}on][{!active}off]",
    .message =
        R"([{?in_op}In OP the master reads {object} (synchronisation type) in {frame}: it is {type}.][{!in_op}When {frame}
shows OP, {object} (synchronisation type) is {type}, as the master [{?written}wrote][{!written}read] in {value_frame}.]
{pulse} is [{?active}on][{!active}off] (0x0981 = {activation}). [{?active}With this type a
slave does not take its outputs at SYNC0.][{!active}With this type a slave waits for a pulse that does not come.])",
    .next =
        R"([{?active}Set {object} to 2 (SYNC0), or leave it to the slave. Without distributed clocks, write 0 to 0x0981.]
[{!active}Set {pulse} before OP is requested (0x0981, times from 0x0990 on), or set {object} to 1 (SM event).])",
    .identity = "object"};
constexpr FindingKind kUnsupported{
    .name = "unsupported-type",
    .title = "{object} = {type}: the slave does not list this synchronisation type",
    .message = R"(When {frame} shows OP, {object} is {type}, as the master wrote in {value_frame}. The supported types
({supported_object}) are {supported}, and that one is not among them.)",
    .next = "Set {object} to a type that {supported_object} lists.",
    .identity = "object"};
constexpr FindingKind kCycle{
    .name = "cycle",
    .title = "{object} is {value_us}, but SYNC0 comes every {cycle_us}",
    .message =
        R"(The master wrote a cycle of {value_us} to {object} in {value_frame}. SYNC0 came every {cycle_us} when
{frame} showed OP. The slave expects a pulse every {value_us}.)",
    .next = "Write one cycle to both: {object} in ns, and 0x09A0.",
    .identity = "object"};
constexpr FindingKind kCounter{
    .name = "counter",
    .title = "{object} rises by {rise} in OP ({counter})",
    .message =
        R"({object} ({counter}) was {before} in {before_frame} and is {after} in {frame}, read in OP. [{?sync_manager}An
event is missed if process data come too late or not at all.][{?short_cycle}A cycle is too short if the slave has not
finished the work of the one before.][{?shift}The shift time is too short if outputs are needed before they are ready.])",
    .next =
        R"([{?sync_manager}Check when the master sends: compare its cycle with SYNC0 in the report.][{?short_cycle}Set a
longer cycle: 1C32h:5 is the shortest one that the slave supports.][{?shift}Set a longer shift time (0x0990), or send
earlier.])",
    .identity = "object"};
constexpr FindingKind kError{
    .name = "error",
    .title = "The slave reports a synchronisation error ({object} = 1)",
    .message =
        R"({object} (synchronisation error) is 1 in {frame}, read in OP: the slave was not synchronised in the last
cycle.)",
    .next = "Look for findings of synchronisation before this frame, and read the counters 1C32h:11 to 1C32h:13.",
    .identity = "object"};
constexpr const FindingKind* kKinds[] = {&kType, &kUnsupported, &kCycle, &kCounter, &kError};

constexpr RuleInfo kInfo{.id = "sync-type-mismatch",
                         .group = "Synchronisation",
                         .severity = Severity::kWarning,
                         .subject = Subject::kClock,
                         .title = "Objects 1C32h and 1C33h do not fit SYNC0, or count missed cycles",
                         .needs = "SDO transfers of 1C32h or 1C33h, 0x0981 and AL Status OP",
                         .source = "ETG1020, synchronisation",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
- The synchronisation type (1C32h:1, 1C33h:1) against SYNC0 or SYNC1 (0x0981), and against the types that the slave
  supports (1C32h:4).
- The cycle time that the master wrote (1C32h:2) against the cycle of SYNC0.
- The counters of missed events, short cycles and short shift times (1C32h:11 to 1C32h:13), and the synchronisation
  error (1C32h:32).

## Why it matters
A slave of type "SYNC0" without pulses does not output anything, or drops to SAFEOP with AL status code 0x001A or
0x002C. A slave of type "SM event" outputs when the frame comes, also if SYNC0 is on: all jitter of the master goes to
the axis. The counters are the slave's own record of its cycles.

## How it is decided
- The value that counts is the last one before OP that the master wrote, or read after SYNC0 was set, and what it reads
  in OP. Slaves change the type themselves when SYNC0 is switched on: what was read before shows nothing.
- The slave reached OP with the type and the cycle and may not use the object: such findings are inferred.
- With SYNC0 on and 1C32h:1 not in the capture, the rule is not evaluated.
- A counter has to rise between two reads in OP. What it counted before the first one may be old.
- A refusal because of the type belongs to al-refused.

## Example
tests/rules/sync-type-mismatch/violates.trace

## What to do
Take the type, the cycle and AssignActivate from one operation mode (OpMode) of the ESI file.
)"};

constexpr std::uint8_t kCycleEntry = 2, kSupportedEntry = 4, kErrorEntry = 32;

constexpr Word kTypeOfOutputs{"sync-type", "the synchronisation type (1C32h:1)"};

/// A counter of 1C32h and 1C33h.
struct Counter {
  std::uint8_t entry;
  Word word;
  std::string_view flag;
};
constexpr std::array<Counter, 3> kCounters{{
    {11, {"missed-events", "missed SM events"}, "sync_manager"},
    {12, {"short-cycles", "cycles that are too short"}, "short_cycle"},
    {13, {"short-shifts", "shift times that are too short"}, "shift"},
}};

class SyncTypeMismatch final : public Rule {
 public:
  SyncTypeMismatch() : Rule(kInfo) {
    Subscribe<model::AlAnswered>(&SyncTypeMismatch::On);
    Subscribe<mailbox::SdoTransfer>(&SyncTypeMismatch::On);
  }

  void On(const model::AlAnswered& e) {
    const bool reached = e.outcome != model::AlAnswered::Outcome::kRefused;
    if (!reached || e.request.control.state() != static_cast<std::uint8_t>(esc::AlState::OP)) return;
    const auto& activation = context().sync().dc(e.slave).activation();
    const bool by_pulse = activation && activation->sync0();
    if (by_pulse && ValueOf(e.slave, sync::kSyncObjects[0], sync::kSyncTypeEntry) == nullptr) {
      unread_.try_emplace(e.slave, e.frame.number);
    }
    for (const std::uint16_t object : sync::kSyncObjects) {
      const model::ObjectValue* type = ValueOf(e.slave, object, sync::kSyncTypeEntry);
      if (activation && type != nullptr) CheckType(e.slave, e.frame, object, *type, *activation, false);
      CheckSupported(e, object);
      CheckCycle(e, object);
    }
  }

  /// Counters and the error are what the slave shows in OP.
  void On(const mailbox::SdoTransfer& e) {
    const bool upload = e.service == mailbox::SdoService::kUpload && e.outcome == mailbox::SdoOutcome::kCompleted;
    if (!upload || !e.has_object || e.complete_access || e.data.empty() || e.data.size() > 4) return;
    if (e.index != sync::kSyncObjects[0] && e.index != sync::kSyncObjects[1]) return;
    if (!context().slave(e.slave).al.SettledIn(esc::AlState::OP)) return;
    const std::uint64_t value = UnsignedOf(e.data);
    const auto& activation = context().sync().dc(e.slave).activation();
    if (e.subindex == sync::kSyncTypeEntry && activation) {
      if (e.index == sync::kSyncObjects[0]) unread_.erase(e.slave);
      const model::ObjectValue read{.raw = value, .since = e.response.number};
      CheckType(e.slave, e.response, e.index, read, *activation, true);
    }
    if (e.subindex == kErrorEntry && (value & 1U) != 0) ReportError(e);
    for (const Counter& counter : kCounters) {
      if (counter.entry == e.subindex) CheckCounter(e, counter, value);
    }
  }

  void Finish() override {
    if (NotEvaluableWithoutReturns()) return;
    for (const auto& [slave, frame] : unread_) NotEvaluable(slave, ReasonCode::kNotRead, kTypeOfOutputs, frame);
  }

 private:
  [[nodiscard]] const model::ObjectValue* ValueOf(SlaveId slave, std::uint16_t object, std::uint8_t entry) const {
    return context().slave(slave).objects.Find(object, entry);
  }

  /// Kind and object of a finding.
  static std::uint64_t KeyOf(std::uint64_t kind, std::uint16_t object, std::uint8_t entry) {
    return kind << 32U | std::uint64_t{object} << 8U | entry;
  }

  Finding FindingOf(const FindingKind& kind, SlaveId slave, const FrameRef& frame, std::uint16_t object,
                    std::uint8_t entry, const model::ObjectValue& value) const {
    Finding finding = Found(kind, slave, frame);
    finding.confidence = Confidence::kInferred;
    finding.Set("object", arg::Object(object, entry)).Set("value_frame", arg::Frame(value.since));
    AddRelated(finding, value.since);
    return finding;
  }

  void CheckType(SlaveId slave, const FrameRef& frame, std::uint16_t object, const model::ObjectValue& type,
                 const esc::SyncActivation& activation, bool in_op) {
    if (!sync::IsKnownSyncType(type.raw)) return;
    const bool after = in_op || type.since > context().sync().dc(slave).activation_changed();
    if (!type.written && !after) return;
    const auto by = static_cast<sync::SyncType>(type.raw);
    const bool by_pulse = sync::NeedsPulses(by);
    const bool active = by == sync::SyncType::kSync1 ? activation.sync1() : activation.sync0();
    // Inputs may follow the outputs, or be read whenever: that is no fault while SYNC0 is on.
    if (by_pulse == active || (activation.sync0() && object != sync::kSyncObjects[0])) return;
    if (Repeat(slave, KeyOf(0, object, sync::kSyncTypeEntry), frame) != kNoFinding) return;
    Finding finding = FindingOf(kType, slave, frame, object, sync::kSyncTypeEntry, type);
    finding
        .Set("type",
             arg::Number(static_cast<std::int64_t>(type.raw), sync::Name(static_cast<sync::SyncType>(type.raw))))
        .Set("written", arg::Flag(type.written))
        .Set("active", arg::Flag(active))
        .Set("pulse", arg::Of(PulseOf(by)))
        .Set("activation", arg::Hex(activation.raw, 2));
    if (in_op) finding.Set("in_op", arg::Flag());
    Report(KeyOf(0, object, sync::kSyncTypeEntry), std::move(finding));
  }

  void CheckSupported(const model::AlAnswered& e, std::uint16_t object) {
    const model::ObjectValue* type = ValueOf(e.slave, object, sync::kSyncTypeEntry);
    const model::ObjectValue* supported = ValueOf(e.slave, object, kSupportedEntry);
    if (type == nullptr || !type->written || supported == nullptr) return;
    if (!sync::IsKnownSyncType(type->raw) || supported->raw == 0) return;
    if (sync::SupportsSyncType(supported->raw, static_cast<sync::SyncType>(type->raw))) return;
    if (Repeat(e.slave, KeyOf(1, object, sync::kSyncTypeEntry), e.frame) != kNoFinding) return;
    Finding finding = FindingOf(kUnsupported, e.slave, e.frame, object, sync::kSyncTypeEntry, *type);
    finding
        .Set("type",
             arg::Number(static_cast<std::int64_t>(type->raw), sync::Name(static_cast<sync::SyncType>(type->raw))))
        .Set("supported_object", arg::Object(object, kSupportedEntry))
        .Set("supported", arg::Hex(supported->raw, 4));
    AddRelated(finding, supported->since);
    Report(KeyOf(1, object, sync::kSyncTypeEntry), std::move(finding));
  }

  void CheckCycle(const model::AlAnswered& e, std::uint16_t object) {
    const model::ObjectValue* cycle = ValueOf(e.slave, object, kCycleEntry);
    const auto& settings = context().sync().dc(e.slave).last_active();
    if (cycle == nullptr || !cycle->written || cycle->raw == 0 || !settings) return;
    const bool active = context().sync().dc(e.slave).active() && settings->activation.sync0();
    const std::uint64_t sync0 = settings->sync0_cycle_ns.value_or(0);
    if (!active || sync0 == 0 || cycle->raw == sync0) return;
    if (Repeat(e.slave, KeyOf(2, object, kCycleEntry), e.frame) != kNoFinding) return;
    Finding finding = FindingOf(kCycle, e.slave, e.frame, object, kCycleEntry, *cycle);
    finding.Set("value_us", arg::Us(static_cast<TimeNs>(cycle->raw)))
        .Set("cycle_us", arg::Us(static_cast<TimeNs>(sync0)));
    AddRelated(finding, settings->frame.number);
    Report(KeyOf(2, object, kCycleEntry), std::move(finding));
  }

  void CheckCounter(const mailbox::SdoTransfer& e, const Counter& counter, std::uint64_t value) {
    const auto key = std::tuple{e.slave, e.index, e.subindex};
    const auto found = counted_.find(key);
    const std::pair<std::uint64_t, FrameNo> now{value, e.last.number};
    if (found == counted_.end()) {
      if (counted_.size() < kMostCounters) counted_.emplace(key, now);
      return;
    }
    const auto before = std::exchange(found->second, now);
    if (value <= before.first || Repeat(e.slave, KeyOf(3, e.index, e.subindex), e.last) != kNoFinding) return;
    Finding finding = Found(kCounter, e.slave, e.last);
    finding.Set("object", arg::Object(e.index, e.subindex))
        .Set("counter", arg::Of(counter.word))
        .Set("rise", arg::Number(static_cast<std::int64_t>(value - before.first)))
        .Set("before", arg::Number(static_cast<std::int64_t>(before.first)))
        .Set("before_frame", arg::Frame(before.second))
        .Set("after", arg::Number(static_cast<std::int64_t>(value)))
        .Set(counter.flag, arg::Flag());
    AddRelated(finding, before.second);
    Report(KeyOf(3, e.index, e.subindex), std::move(finding));
  }

  void ReportError(const mailbox::SdoTransfer& e) {
    if (Repeat(e.slave, KeyOf(4, e.index, e.subindex), e.last) != kNoFinding) return;
    Finding finding = Found(kError, e.slave, e.last);
    finding.Set("object", arg::Object(e.index, e.subindex));
    Report(KeyOf(4, e.index, e.subindex), std::move(finding));
  }

  static constexpr std::size_t kMostCounters = 4096;
  /// By slave, object and subindex: value as last read in OP, and its frame.
  std::map<std::tuple<SlaveId, std::uint16_t, std::uint8_t>, std::pair<std::uint64_t, FrameNo>> counted_;
  std::map<SlaveId, FrameNo> unread_;  ///< in OP by SYNC0 without a known type, and the frame that shows OP
};

const RuleRegistration kRegistration{kInfo, MakeRule<SyncTypeMismatch>};

}  // namespace
}  // namespace ecaudit::sync_type_mismatch
