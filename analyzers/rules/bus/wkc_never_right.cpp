#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
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

constexpr FindingKind kNone{
    .name = "none-counts",
    .title =
        "[{?none_active}No FMMU is active: working counter 0 in {frames}]"
        "[{!none_active}No slave counts in process data: working counter 0 in {frames}]",
    .message =
        R"(From {frame} to {last_frame} the master sends {frames} with logical addresses, the last by {command}. All of
them return with working counter 0. AL Status shows {witness} in {state}.[{?none_active} The FMMUs of all slaves are known,
and none is active.][{!none_active} So no active FMMU of any slave maps these addresses, or no sync manager is enabled.])",
    .next =
        R"([{?none_active}Write the FMMUs (0x0600) before SAFEOP is requested, with the addresses of these
datagrams.][{!none_active}Read the FMMUs (0x0600) and sync managers (0x0800) of the slaves, and compare the logical
addresses. Capture the start-up.])",
    .identity = ""};

constexpr FindingKind kElsewhere{
    .name = "elsewhere",
    .title = "Process data at {address}, but FMMUs map {mapped} to {mapped_last}",
    .message =
        R"(From {frame} to {last_frame} the master sends {frames} with logical addresses, the last by {command}. They are
from {address} to {address_last}, and all return with working counter 0. The FMMUs of all slaves are known: the active
ones map {mapped} to {mapped_last}. AL Status shows {witness} in {state}.)",
    .next = "Send process data to the logical addresses that the FMMUs map, or write the FMMUs for these addresses.",
    .identity = ""};

constexpr const FindingKind* kKinds[] = {&kNoLrw, &kNever, &kNone, &kElsewhere};

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

A warning of the bus (`none-counts`) needs no FMMU: at least 20 datagrams with logical addresses over 250 ms, all with
working counter 0, while AL Status shows a slave in SAFEOP or OP. If the FMMUs of all slaves are known, and the active
ones map other addresses only, it is an error (`elsewhere`).

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
    Subscribe<track::LogicalAccess>(&WkcNeverRight::On);
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
      // Not before either: it has not lost what it had.
      if (!exchanges || (outputs ? model.outputs : model.inputs).exchanged > 0) return;
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

  void On(const track::LogicalAccess& e) {
    if (e.assumed || !e.returned.seen()) return;
    if (e.wkc != 0) counted_ = true;
    if (counted_ || !FindWitness()) return;
    if (!none_.first.seen()) none_.first = e.returned;
    none_.last = e.returned;
    none_.command = e.command;
    ++none_.count;
    unanswered_.Add(e.address, e.length);
  }

  void Finish() override {
    if (NotEvaluableWithoutReturns()) return;
    for (const auto& [id, watched] : slaves_) Evaluate(id, watched);
    EvaluateBus();
  }

 private:
  struct Missed {
    FrameRef first, last;
    wire::Command command = wire::Command::NOP;
    std::uint64_t count = 0;
  };
  /// From the lowest to the highest logical address of some data.
  struct Span {
    std::uint64_t first = ~std::uint64_t{0}, end = 0;

    void Add(std::uint64_t address, std::uint64_t bytes) {
      if (bytes == 0) return;
      first = std::min(first, address);
      end = std::max(end, address + bytes);
    }
    [[nodiscard]] bool empty() const { return end == 0; }
    [[nodiscard]] bool Meets(const Span& other) const { return first < other.end && other.first < end; }
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

  /// A slave that exchanges process data by its AL state.
  [[nodiscard]] bool Exchanges(SlaveId id) const {
    const model::AlMachine& al = context().slave(id).al;
    return al.SettledIn(esc::AlState::OP) || al.SettledIn(esc::AlState::SAFEOP);
  }
  bool FindWitness() {
    constexpr unsigned kEach = 16;  // datagrams, so that a long bus in INIT costs nothing
    if (witness_ && *witness_ < context().slave_count() && Exchanges(*witness_)) return true;
    witness_.reset();
    if (looked_++ % kEach != 0) return false;
    for (std::size_t s = 0; s < context().slave_count() && !witness_; ++s) {
      if (Exchanges(static_cast<SlaveId>(s))) witness_ = static_cast<SlaveId>(s);
    }
    return witness_.has_value();
  }

  /// Where the FMMUs are not known, which names the slave; else a finding of it, or of wkc-mismatch, reports it.
  void EvaluateBus() {
    if (counted_ || !slaves_.empty() || none_.count < kLeast || !witness_ || !Exchanges(*witness_)) return;
    if (!none_.first.has_time || !none_.last.has_time || Elapsed(none_.first.time, none_.last.time) < kLong) return;
    for (const Finding& other : context().store.findings()) {
      if (other.rule == "wkc-mismatch") return;
    }
    const bool op = context().slave(*witness_).al.SettledIn(esc::AlState::OP);
    const std::optional<Span> mapped = Mapped();
    const bool elsewhere = mapped && !mapped->empty() && !mapped->Meets(unanswered_);
    Finding finding = Found(elsewhere ? kElsewhere : kNone, kNoSlave, none_.first);
    if (elsewhere) {
      finding.Set("address", arg::Hex(unanswered_.first, 8))
          .Set("address_last", arg::Hex(unanswered_.end - 1, 8))
          .Set("mapped", arg::Hex(mapped->first, 8))
          .Set("mapped_last", arg::Hex(mapped->end - 1, 8));
    }
    if (mapped && mapped->empty()) finding.Set("none_active", arg::Flag());
    finding.last = none_.last;
    finding.Set("frames", arg::Count(none_.count, "datagram"))
        .Set("command", arg::Text(wire::Name(none_.command)))
        .Set("last_frame", arg::Frame(none_.last.number))
        .Set("witness", arg::Slave(*witness_, context().Label(*witness_)))
        .Set("state", arg::State(static_cast<std::uint8_t>(op ? esc::AlState::OP : esc::AlState::SAFEOP)));
    AddRelated(finding, none_.last.number);
    (void)Report(4, elsewhere ? Severity::kError : Severity::kWarning, std::move(finding));
  }

  /// What the active FMMUs map; nothing if some slave may have others.
  [[nodiscard]] std::optional<Span> Mapped() const {
    const std::uint16_t* const count = context().network().slave_count().if_known();
    if (count == nullptr || *count > context().slave_count()) return std::nullopt;
    Span mapped;
    for (std::size_t s = 0; s < context().slave_count(); ++s) {
      const track::KnownFmmus& known = context().network().fmmus(static_cast<SlaveId>(s));
      if (!known.all) return std::nullopt;
      for (const track::KnownFmmus::Unit& unit : known.active) mapped.Add(unit.fmmu.logical_start, unit.fmmu.length);
    }
    return mapped;
  }

  static constexpr Word kOutputs{"outputs", "outputs", true};
  static constexpr Word kInputs{"inputs", "inputs", true};
  std::map<SlaveId, Watched> slaves_;  // those that OP was requested of, or that did not count
  Missed none_;                        ///< logical datagrams that no slave counted in ...
  Span unanswered_;                    ///< ... and where these are
  bool counted_ = false;               ///< one has a working counter
  std::optional<SlaveId> witness_;     ///< in SAFEOP or OP
  unsigned looked_ = 0;
};

const RuleRegistration kRegistration{kInfo, MakeRule<WkcNeverRight>};

}  // namespace
}  // namespace ecaudit::wkc_never_right
