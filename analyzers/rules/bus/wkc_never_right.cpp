#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <optional>

#include "analyzers/judge/lrw_support.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/sync_text.h"
#include "analyzers/judge/wkc/one_buffer.h"
#include "analyzers/model/bus_model.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/process_image.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/time.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/mailbox/events.h"
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
    .title =
        "[{?apart}Never counts in LRW: maybe FMMUs must overlap (0 of {frames})]"
        "[{!apart}[{?sync_off}SYNC0 is off, and the slave delivers no inputs: 0 of {frames}]"
        "[{!sync_off}The slave never counts for its {direction}: 0 of {frames}]]",
    .message =
        R"([From {request_frame} on, when OP was requested, the slave][{!request_frame}In {state} the slave] counts in none of
{frames} ({command}) that hold its {direction}. Its FMMU maps them, but the working counter does not include it.[{?apart} Its
controller has type 0x90 (0x0000, TI PRU-ICSS), and its FMMUs map outputs and inputs to different logical addresses.
Older firmware of these controllers does not support that with LRW.][{?sync_off} It accepts its outputs. These select
mode {mode}, which works with SYNC0, and SYNC0 is off.])",
    .next =
        "[{?apart}Map outputs and inputs of the slave to the same logical address, or use LRD and LWR. If that does "
        "not help: ][{?sync_off}Set up distributed clocks and activate SYNC0 (0x0981) before SAFEOP is requested. If "
        "that does not help: ]Check direction and physical address of the FMMU, and the sync manager of the "
        "{direction}.",
    .identity = "direction"};

constexpr FindingKind kNone{
    .name = "none-counts",
    .title =
        "[{?none_active}No FMMU is active: working counter 0 in {frames}]"
        "[{!none_active}No slave counts in process data: working counter 0 in {frames}]",
    .message =
        R"(From {frame} to {last_frame} the master sends {frames} with logical addresses, the last by {command}. All of
them return with working counter 0. AL Status showed {witness} in {state} at this time.[{?none_active} The FMMUs of all
slaves are known, and none is active.][{!none_active} So no active FMMU of any slave maps these addresses, or no sync manager is enabled.])",
    .next =
        R"([{?none_active}Write the FMMUs (0x0600) before SAFEOP is requested, with the addresses of these
datagrams.][{!none_active}Read the FMMUs (0x0600) and sync managers (0x0800) of the slaves, and compare the logical
addresses. Capture the start-up.])",
    .identity = ""};

constexpr FindingKind kNeverStarted{
    .name = "never-started",
    .title = "SAFEOP is never requested: process data with working counter 0",
    .message =
        R"(From {frame} to {last_frame} the master sends {frames} with logical addresses, the last by {command}. All of
them return with working counter 0. AL Status of {witness} is {state}, and the master requests neither SAFEOP nor OP of
any slave. It sends no mailbox message in this time either: its configuration of the slaves is over, or has not begun.)",
    .next =
        R"(Read the log of the master. Compare position, alias address, vendor and product in its configuration with the
slaves on the bus.)",
    .identity = ""};

constexpr FindingKind kElsewhere{
    .name = "elsewhere",
    .title = "Process data at {address}, but FMMUs map {mapped} to {mapped_last}",
    .message =
        R"(From {frame} to {last_frame} the master sends {frames} with logical addresses, the last by {command}. They are
from {address} to {address_last}, and all return with working counter 0. The FMMUs of all slaves are known: the active
ones map {mapped} to {mapped_last}. AL Status showed {witness} in {state} at this time.)",
    .next = "Send process data to the logical addresses that the FMMUs map, or write the FMMUs for these addresses.",
    .identity = ""};

constexpr FindingKind kOneBuffer{
    .name = "one-buffer",
    .title = "The slave never [{?inputs}fills][{!inputs}empties] the buffer of its {direction}: 0 of {frames}",
    .message =
        R"(The slave counts in none of {frames} ({command}) that hold its {direction}, from {frame} to {last_frame}.
SM{sync_manager} has one buffer. So the slave counts only if its application has [{?inputs}filled][{!inputs}emptied] it since
the last datagram.[{?others} The working counter is what the other slaves count in OP.][{?no_sync0} SYNC0 is off in this
slave.])",
    .next =
        R"(Check that the application (processor) of the slave runs.[{?no_sync0} Many with one buffer exchange their data
at SYNC0: activate it.] If the slave allows it, use three buffers (control byte of SM{sync_manager}, bits 0 and 1).)",
    .identity = "direction"};

constexpr const FindingKind* kKinds[] = {&kNoLrw, &kNever, &kNone, &kNeverStarted, &kElsewhere, &kOneBuffer};

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
working counter 0, while AL Status shows a slave in SAFEOP or OP. What follows after the slave left that state, or after
another start-up, is not counted. If the FMMUs of all slaves are known, and the active ones map other addresses only, it
is an error (`elsewhere`).

A warning of the bus (`never-started`) needs all of these:

- AL Status shows each slave in INIT or PREOP, and no slave counts in process data since the bus was started up.
- The master requests neither SAFEOP nor OP.
- At least 20 datagrams with logical addresses over 2 s since the last request and the last mailbox message.

A refused download (`sdo-abort`) before it is its cause: many masters stop to configure a slave that refuses one.

A sync manager with one buffer counts only if the application has filled (or emptied) it. If only the sum shows that
it never does, the finding is an inferred warning (`one-buffer`):

- All slaves in the datagram are in OP, and only this one has such a buffer.
- For at least 1 s, in at least 20 datagrams, the working counter is what the others count.

SYNC0 that is off is named if the slave accepts its outputs, and these select an interpolated or cyclic synchronous
mode.

In SAFEOP without such a request the finding is a warning. The reason is the use of LRW if the datagrams are LRW and
bit 9 of the ESC features (0x0008) is 1. A controller of type 0x90 (0x0000) may need FMMUs with the same logical address
for outputs and inputs.

## Example
tests/rules/wkc-never-right/violates.trace: LRW to a slave that does not support it.

## What to do
Correct what the finding names. Compare with the FMMUs and sync managers that the capture shows.
)"};

constexpr std::uint16_t kNoLrwBit = 0x0200;
constexpr std::uint64_t kLeast = 20;
constexpr TimeNs kLong = 250'000'000;
constexpr TimeNs kLongOneBuffer = 1'000'000'000;
constexpr TimeNs kLongIdle = 2'000'000'000;

class WkcNeverRight final : public Rule {
 public:
  WkcNeverRight() : Rule(kInfo) {
    Subscribe<model::AlRequestJudged>(&WkcNeverRight::On);
    Subscribe<model::ProcessDataMissed>(&WkcNeverRight::On);
    Subscribe<track::LogicalAccess>(&WkcNeverRight::On);
    Subscribe<track::RunBegan>(&WkcNeverRight::On);
    Subscribe<mailbox::MailboxMessage>(&WkcNeverRight::On);
  }

  /// The master configures a slave.
  void On(const mailbox::MailboxMessage&) { idle_.none = {}; }

  void On(const model::AlRequestJudged& e) {
    constexpr auto kOp = static_cast<std::uint8_t>(esc::AlState::OP);
    constexpr auto kSafeop = static_cast<std::uint8_t>(esc::AlState::SAFEOP);
    idle_.none = {};
    idle_.asked = idle_.asked || e.request.control.state() >= kSafeop;
    if (e.request.control.state() != kOp || e.request.from != kSafeop) return;
    Watched& watched = slaves_[e.slave];
    if (watched.request.seen()) return;
    const model::SlaveModel& model = context().slave(e.slave);
    watched = {.request = e.request.frame,
               .state = e.request.from,
               .before = {model.outputs.exchanged, model.inputs.exchanged},
               .missed = {}};
  }

  void On(const model::ProcessDataMissed& e) { Count(e.cycle); }

  void On(const track::LogicalAccess& e) {
    if (e.assumed || !e.returned.seen()) return;
    WatchOneBuffer(e);
    if (e.wkc != 0) bus_.counted = true;
    if (bus_.counted) return;
    if (!FindWitness()) {
      if (!idle_.asked) idle_.none.Add(e);
      return;
    }
    idle_.asked = true;  // of that slave, perhaps before the capture
    bus_.witness = *witness_;
    bus_.in_op = context().slave(bus_.witness).al.SettledIn(esc::AlState::OP);
    if (bus_.mapped_version != context().network().mapping_version()) {
      bus_.mapped_version = context().network().mapping_version();
      bus_.mapped = Mapped();
    }
    bus_.none.Add(e);
    bus_.unanswered.Add(e.address, e.length);
  }

  void On(const track::RunBegan&) {
    if (!earlier_ && Lasts(bus_)) earlier_ = bus_;
    bus_ = {};
    idle_ = {};
  }

  void Finish() override {
    if (NotEvaluableWithoutReturns()) return;
    for (const auto& [id, watched] : slaves_) Evaluate(id, watched);
    for (const auto& [id, buffers] : one_buffers_) {
      for (std::size_t way = 0; way < buffers.size(); ++way) EvaluateOneBuffer(id, buffers[way], way == 1);
    }
    if (earlier_ || Lasts(bus_)) {
      EvaluateBus(earlier_ ? *earlier_ : bus_);
    } else {
      EvaluateIdle();
    }
  }

 private:
  struct Missed {
    FrameRef first, last;
    wire::Command command = wire::Command::NOP;
    std::uint64_t count = 0;

    void Add(const track::LogicalAccess& e) {
      if (count++ == 0) first = e.returned;
      last = e.returned;
      command = e.command;
    }
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
  /// Logical datagrams of a run that no slave counted in, while some slave was in SAFEOP or OP.
  struct Bus {
    Missed none;
    Span unanswered;       ///< where these are
    bool counted = false;  ///< another one has a working counter
    // As they were with the last of them.
    SlaveId witness = kNoSlave;  ///< in SAFEOP or OP
    bool in_op = false;
    std::optional<Span> mapped;  ///< by the active FMMUs
    std::optional<std::uint64_t> mapped_version;
  };
  /// Logical datagrams that no slave counted in, while no slave is above PREOP and the master does nothing about it.
  struct Idle {
    Missed none;         ///< since the last request or mailbox message
    bool asked = false;  ///< SAFEOP or OP was requested
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
      const bool lrw = frames.command == wire::Command::LRW;
      const bool no_lrw = lrw && features && (*features & kNoLrwBit) != 0;
      const auto found = one_buffers_.find(id);
      OneBuffer* const buffer = found == one_buffers_.end() ? nullptr : &found->second[way];
      const bool one_buffer = buffer != nullptr && buffer->manager && !buffer->counted;
      Finding finding = Found(no_lrw ? kNoLrw : one_buffer ? kOneBuffer : kNever, id, frames.first);
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
      if (lrw && MayRejectSeparateLrw(context(), id)) finding.Set("apart", arg::Flag());
      finding.Set("direction", arg::Of(way == 0 ? kOutputs : kInputs))
          .Set("command", arg::Text(wire::Name(frames.command)));
      // A drive may update its inputs at SYNC0 only.
      if (const auto mode = ModeWithoutSync0(context(), id); mode && way == 1 && model.outputs.exchanged > 0) {
        finding.Set("sync_off", arg::Flag()).Set("mode", arg::Number(*mode));
      }
      if (one_buffer) {
        finding.Set("inputs", arg::Flag(way == 1)).Set("sync_manager", arg::Number(*buffer->manager));
        if (wkc::IsSync0Off(context(), id)) finding.Set("no_sync0", arg::Flag());
        buffer->counted = true;  // nothing more to report
      }
      (void)Report(2 + way, severity, std::move(finding));
    }
  }

  /// A part in datagrams that is open, because its sync manager has one buffer.
  struct OneBuffer {
    std::optional<std::uint8_t> manager;
    Missed missed;
    bool counted = false;
  };

  /// Data that a slave did not exchange, from the first request for OP on.
  void Count(const model::ProcessCycle& cycle) {
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

  void WatchOneBuffer(const track::LogicalAccess& e) {
    const model::LogicalExpectation& expected = context().bus().Expect(e);
    const model::CounterRange range = context().bus().RangeFor(expected, e.command);
    if (range.least == range.most) return;  // nearly always
    for (const model::LogicalShare& share : expected.shares) {
      if (share.outputs_one_buffer) one_buffers_[share.slave][0].manager = share.outputs_one_buffer;
      if (share.inputs_one_buffer) one_buffers_[share.slave][1].manager = share.inputs_one_buffer;
    }
    const auto use = wkc::UseOfOneBuffer(context(), e);
    if (!use) return;
    auto& buffers = one_buffers_[use->slave];
    for (std::size_t way = 0; way < buffers.size(); ++way) {
      if (!use->ways[way].manager) continue;
      if (use->ways[way].counted) buffers[way].counted = true;
      if (!buffers[way].counted) buffers[way].missed.Add(e);
    }
  }

  void EvaluateOneBuffer(SlaveId id, const OneBuffer& buffer, bool inputs) {
    const Missed& missed = buffer.missed;
    if (buffer.counted || missed.count < kLeast || !missed.first.has_time || !missed.last.has_time) return;
    if (Elapsed(missed.first.time, missed.last.time) < kLongOneBuffer) return;
    const model::SlaveModel& model = context().slave(id);
    if ((inputs ? model.inputs : model.outputs).exchanged > 0) return;
    Finding finding = Found(kOneBuffer, id, missed.first);
    finding.confidence = Confidence::kInferred;
    finding.last = missed.last;
    finding.Set("frames", arg::Count(missed.count, "datagram"))
        .Set("command", arg::Text(wire::Name(missed.command)))
        .Set("direction", arg::Of(inputs ? kInputs : kOutputs))
        .Set("inputs", arg::Flag(inputs))
        .Set("others", arg::Flag())
        .Set("sync_manager", arg::Number(*buffer.manager));
    if (wkc::IsSync0Off(context(), id)) finding.Set("no_sync0", arg::Flag());
    (void)Report(inputs ? 6 : 5, Severity::kWarning, std::move(finding));
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

  [[nodiscard]] static bool Lasts(const Bus& bus) {
    const Missed& none = bus.none;
    if (bus.counted || none.count < kLeast || !none.first.has_time || !none.last.has_time) return false;
    return Elapsed(none.first.time, none.last.time) >= kLong;
  }

  /// Where the FMMUs are not known, which names the slave; else a finding of it, or of wkc-mismatch, reports it.
  void EvaluateBus(const Bus& bus) {
    if (!slaves_.empty()) return;
    for (const Finding& other : context().store.findings()) {
      if (other.rule == "wkc-mismatch") return;
    }
    const std::optional<Span>& mapped = bus.mapped;
    const bool elsewhere = mapped && !mapped->empty() && !mapped->Meets(bus.unanswered);
    Finding finding = Found(elsewhere ? kElsewhere : kNone, kNoSlave, bus.none.first);
    if (elsewhere) {
      finding.Set("address", arg::Hex(bus.unanswered.first, 8))
          .Set("address_last", arg::Hex(bus.unanswered.end - 1, 8))
          .Set("mapped", arg::Hex(mapped->first, 8))
          .Set("mapped_last", arg::Hex(mapped->end - 1, 8));
    }
    if (mapped && mapped->empty()) finding.Set("none_active", arg::Flag());
    finding.last = bus.none.last;
    finding.Set("frames", arg::Count(bus.none.count, "datagram"))
        .Set("command", arg::Text(wire::Name(bus.none.command)))
        .Set("last_frame", arg::Frame(bus.none.last.number))
        .Set("witness", arg::Slave(bus.witness, context().Label(bus.witness)))
        .Set("state", arg::State(static_cast<std::uint8_t>(bus.in_op ? esc::AlState::OP : esc::AlState::SAFEOP)));
    AddRelated(finding, bus.none.last.number);
    (void)Report(4, elsewhere ? Severity::kError : Severity::kWarning, std::move(finding));
  }

  void EvaluateIdle() {
    const Missed& none = idle_.none;
    if (bus_.counted || idle_.asked || none.count < kLeast || !none.first.has_time || !none.last.has_time) return;
    if (Elapsed(none.first.time, none.last.time) < kLongIdle) return;
    for (std::size_t s = 0; s < context().slave_count(); ++s) {
      const model::AlMachine& al = context().slave(static_cast<SlaveId>(s)).al;
      if (!al.SettledIn(esc::AlState::INIT) && !al.SettledIn(esc::AlState::PREOP)) return;
    }
    if (context().slave_count() == 0) return;
    constexpr SlaveId kFirst = 0;
    const bool in_preop = context().slave(kFirst).al.SettledIn(esc::AlState::PREOP);
    Finding finding = Found(kNeverStarted, kNoSlave, none.first);
    finding.last = none.last;
    finding.Set("frames", arg::Count(none.count, "datagram"))
        .Set("command", arg::Text(wire::Name(none.command)))
        .Set("last_frame", arg::Frame(none.last.number))
        .Set("witness", arg::Slave(kFirst, context().Label(kFirst)))
        .Set("state", arg::State(static_cast<std::uint8_t>(in_preop ? esc::AlState::PREOP : esc::AlState::INIT)));
    AddRelated(finding, none.last.number);
    (void)Report(7, Severity::kWarning, std::move(finding));
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
  std::map<SlaveId, Watched> slaves_;                        // those that OP was requested of, or that did not count
  std::map<SlaveId, std::array<OneBuffer, 2>> one_buffers_;  ///< outputs, inputs
  Bus bus_;                                                  ///< since the bus was started up
  Idle idle_;                                                ///< likewise
  std::optional<Bus> earlier_;                               ///< before that
  std::optional<SlaveId> witness_;                           ///< in SAFEOP or OP now
  unsigned looked_ = 0;
};

const RuleRegistration kRegistration{kInfo, MakeRule<WkcNeverRight>};

}  // namespace
}  // namespace ecaudit::wkc_never_right
