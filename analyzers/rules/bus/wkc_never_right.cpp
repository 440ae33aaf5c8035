#include <array>
#include <map>
#include <string>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/process_image.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/time.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/track/network.h"

namespace ecaudit::wkc_never_right {
namespace {

constexpr FindingKind kNoLrw{
    .name = "lrw-not-supported",
    .title = "The slave does not support LRW, but the master exchanges data by LRW",
    .message =
        R"([From {request_frame} on, when OP was requested, the slave][{!request_frame}In {state} the slave] counts in none of
{frames} with its process data. The master sends them by LRW. Bit 9 of the ESC features (0x0008 = {features}) shows that
this slave controller does not support LRW.)",
    .next = "Use LRD for the inputs and LWR for the outputs of this slave (\"separate input and output\", \"no LRW\").",
    .identity = ""};

constexpr FindingKind kNever{
    .name = "never-counted",
    .title = "The slave never counts for its {direction}: 0 of {frames}",
    .message =
        R"([From {request_frame} on, when OP was requested, the slave][{!request_frame}In {state} the slave] counts in none of
{frames} ({command}) that hold its {direction}. Its FMMU maps them, but the working counter does not include it.)",
    .next = "Check direction and physical address of the FMMU, and the sync manager of the {direction}.",
    .identity = "direction"};

constexpr const FindingKind* kKinds[] = {&kNoLrw, &kNever};

constexpr RuleInfo kInfo{.id = "wkc-never-right",
                         .group = "Frame and bus",
                         .severity = Severity::kError,
                         .subject = Subject::kProcessData,
                         .title = "A slave never counts in the process data that its FMMUs map",
                         .needs = "returned frames, the FMMUs and the AL state of the slave",
                         .source = "ETG1000.4, working counter; ESC-2, register 0x0008",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
Whether a slave takes its outputs and gives its inputs at least once after OP was requested of it, or while it is in
SAFEOP (inputs) or OP.

## Why it matters
The slave does not reach OP, or its watchdog takes it out of it. No single frame looks wrong: the working counter is
the same in all of them.

## How it is decided
The finding needs all of these:

- An active FMMU maps the data of the slave.
- OP is requested of the slave in SAFEOP. Or the slave is in SAFEOP (inputs) or OP (inputs and outputs) for at least
  250 ms.
- From then on, the working counters of at least 20 datagrams show that the slave did not count.
- No working counter shows that it did. If OP was not requested, this holds for the whole capture.

In SAFEOP without such a request the finding is a warning. The reason is the use of LRW if the datagrams are LRW and
bit 9 of the ESC features (0x0008) is 1.

## Example
tests/rules/wkc-never-right/violates.trace: LRW to a slave that does not support it.

## What to do
Correct what the finding names. Compare with the FMMUs and sync managers that the capture shows.
)"};

constexpr std::uint16_t kNoLrwBit = 0x0200;
constexpr std::uint64_t kLeast = 20;
constexpr TimeNs kLong = 250'000'000;

class WkcNeverRight final : public Rule {
 public:
  WkcNeverRight() : Rule(kInfo) {
    Subscribe<model::AlRequestJudged>(&WkcNeverRight::On);
    Subscribe<model::ProcessCycle>(&WkcNeverRight::On);
  }

  void On(const model::AlRequestJudged& e) {
    constexpr auto kOp = static_cast<std::uint8_t>(esc::AlState::OP);
    constexpr auto kSafeop = static_cast<std::uint8_t>(esc::AlState::SAFEOP);
    if (e.request.control.state() != kOp || e.request.from != kSafeop) return;
    Watched& watched = slaves_[e.slave];
    if (watched.request.seen()) return;
    const model::SlaveModel& model = context().slave(e.slave);
    watched = {.request = e.request.frame,
               .state = e.request.from,
               .before = {model.outputs.exchanged, model.inputs.exchanged},
               .missed = {}};
  }

  void On(const model::ProcessCycle& cycle) {
    if (cycle.exchange != model::Exchange::kNo || cycle.part.slave == kNoSlave) return;
    const bool outputs = cycle.part.direction == device::PdoDirection::kRx;
    const model::SlaveModel& model = context().slave(cycle.part.slave);
    const bool in_op = model.al.SettledIn(esc::AlState::OP);
    const bool exchanges = in_op || (!outputs && model.al.SettledIn(esc::AlState::SAFEOP));
    auto slave = slaves_.find(cycle.part.slave);
    if (slave == slaves_.end()) {
      // Neither before: it has not lost what it had.
      if (!exchanges || model.inputs.exchanged + model.outputs.exchanged > 0) return;
      slave = slaves_.try_emplace(cycle.part.slave).first;
    }
    if (!slave->second.request.seen()) {
      if (!exchanges) return;
      slave->second.state = static_cast<std::uint8_t>(in_op ? esc::AlState::OP : esc::AlState::SAFEOP);
    }
    Missed& missed = slave->second.missed[outputs ? 0 : 1];
    if (!missed.first.seen()) missed.first = cycle.frame();
    missed.last = cycle.frame();
    missed.command = cycle.command;
    ++missed.count;
  }

  void Finish() override {
    if (NotEvaluableWithoutReturns()) return;
    for (const auto& [id, watched] : slaves_) Evaluate(id, watched);
  }

 private:
  struct Missed {
    FrameRef first, last;
    wire::Command command = wire::Command::NOP;
    std::uint64_t count = 0;
  };
  struct Watched {
    FrameRef request;                       ///< the first of OP; unset: none, or not in SAFEOP
    std::uint8_t state = 0;                 ///< in which it did not count
    std::array<std::uint64_t, 2> before{};  ///< exchanged at the request: outputs, inputs
    std::array<Missed, 2> missed;
  };

  void Evaluate(SlaveId id, const Watched& watched) {
    const model::SlaveModel& model = context().slave(id);
    const std::array<const model::ProcessTraffic*, 2> traffic{&model.outputs, &model.inputs};
    const track::SlaveState& state = context().network().state(id);
    const auto features = state.registers.Value<std::uint16_t>(esc::kEscFeatures, Certainty::kObserved);
    for (std::size_t way = 0; way < traffic.size(); ++way) {
      const Missed& frames = watched.missed[way];
      if (traffic[way]->exchanged != watched.before[way] || frames.count < kLeast || !frames.first.seen()) continue;
      const bool asked = watched.request.seen();
      const bool timed = frames.first.has_time && frames.last.has_time;
      if (!asked && (!timed || Elapsed(frames.first.time, frames.last.time) < kLong)) continue;
      const bool no_lrw = frames.command == wire::Command::LRW && features && (*features & kNoLrwBit) != 0;
      Finding finding = Found(no_lrw ? kNoLrw : kNever, id, frames.first);
      finding.last = frames.last;
      finding.Set("state", arg::State(watched.state)).Set("frames", arg::Count(frames.count, "datagram"));
      if (asked) finding.Set("request_frame", arg::Frame(watched.request.number));
      AddRelated(finding, watched.request.number);
      constexpr auto kOp = static_cast<std::uint8_t>(esc::AlState::OP);
      const Severity severity = asked || watched.state == kOp ? Severity::kError : Severity::kWarning;
      if (no_lrw) {
        finding.Set("features", arg::Hex(*features));
        (void)Report(1, severity, std::move(finding));
        return;
      }
      finding.Set("direction", arg::Of(way == 0 ? kOutputs : kInputs))
          .Set("command", arg::Text(wire::Name(frames.command)));
      (void)Report(2 + way, severity, std::move(finding));
    }
  }

  static constexpr Word kOutputs{"outputs", "outputs", true};
  static constexpr Word kInputs{"inputs", "inputs", true};
  std::map<SlaveId, Watched> slaves_;  // those that OP was requested of, or that did not count
};

const RuleRegistration kRegistration{kInfo, MakeRule<WkcNeverRight>};

}  // namespace
}  // namespace ecaudit::wkc_never_right
