#include <algorithm>
#include <array>
#include <optional>
#include <set>
#include <vector>

#include "analyzers/judge/exchange_watch.h"
#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/pdo_rule.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/sync_text.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/time.h"
#include "decoder/pipeline.h"
#include "decoder/track/datagram_pair.h"
#include "decoder/track/events.h"
#include "decoder/track/network.h"

namespace ecaudit::pdo_length_mismatch {
namespace {

constexpr FindingKind kNotExchanged{
    .name = "not-exchanged",
    .title = "0 of {expected_bytes} of the {direction}[{?inputs_too} and inputs] are exchanged",
    .message =
        R"(The FMMUs of the slave, set up to {mapped_frame}, map {expected_bytes} of {direction}[{?inputs_too} and inputs]
from logical address {logical_address} on. The slave is in OP from {frame} to {last_frame} ({op_ms}), and other process data
are exchanged. No datagram covers any of these bytes. [{?outputs}The slave gets no set points.][{!outputs}The master gets no
actual values of this slave.])",
    .next = "Let the cyclic frames cover the whole process image.",
    .identity = "direction logical_address"};

constexpr FindingKind kPartExchanged{
    .name = "part-exchanged",
    .title = "Only {bytes:number} of {expected_bytes} of the {direction} are exchanged",
    .message =
        R"(FMMU {fmmu} of the slave, in OP, maps its {direction} to the logical addresses {logical_address} to
{last_address}. The {command} in {frame} covers {covered_address} to {last_covered_address}. That is {bytes:number} of
{expected_bytes}, and no other datagram of the cycle covers the rest.[{?outputs} The sync manager passes outputs on when
their last byte is written.])",
    .next = "Make the datagram as long as the process image.",
    .identity = "direction logical_address fmmu"};

constexpr FindingKind kFmmuTooShort{
    .name = "fmmu-too-short",
    .title = "FMMUs map {mapped} of the {direction}, the [{?pdo_bits}PDOs have][{!pdo_bits}sync manager has] {wanted}",
    .message =
        R"(The slave [{?refused}refused][{!refused}reached] OP in {frame}. [{?pdos}Its PDOs {pdos} have][{!pdos}It
has] {wanted} of {direction} in sync manager {sync_manager}. Its FMMUs, set up to {fmmu_frame}, map {mapped} of them.
[{?outputs}The sync manager passes outputs on when their last byte is written.][{!outputs}The rest of the inputs never reaches
the master.])",
    .next = "Give the FMMU the length of the sync manager.",
    .identity = "direction sync_manager"};

constexpr const FindingKind* kKinds[] = {&kNotExchanged, &kPartExchanged, &kFmmuTooShort};

constexpr Word kOutputs{"outputs", "outputs", true};
constexpr Word kInputs{"inputs", "inputs", true};

// Several rules may explain one finding: the first that does so wins.
constexpr std::string_view kAfter[] = {"fmmu-inactive"};

constexpr RuleInfo kInfo{.id = "pdo-length-mismatch",
                         .group = "PDO mapping",
                         .severity = Severity::kError,
                         .title = "Process data are exchanged in another length than the PDOs have",
                         .needs = "the FMMUs of the slave; for their length also its sync managers and PDOs",
                         .source = "ETG1000.6, PDO assignment; ESC-1, sync manager",
                         .kinds = kKinds,
                         .after = kAfter,
                         .doc = R"(
## What it checks
Two things of each slave in OP: whether its FMMUs carry as many bytes as the assigned PDOs have, and whether the logical
datagrams cover everything that the FMMUs map.

## Why it matters
A sync manager passes its buffer on when the last byte was accessed. Outputs without their last byte never reach the
application, and its watchdog takes the slave out of OP. Inputs that are cut are lost.

## How it is decided
FMMUs:

- When the slave reaches OP, the bits of its FMMUs in one direction are compared with the assigned PDOs (SDO transfers
  of the capture, ENI file).
- This needs a sync manager that agrees with the PDOs, so that the lengths are certain. A sync manager that disagrees is
  sm-process-config.
- If the PDOs are not known, FMMUs are reported that map a part of a sync manager's buffer, but not its last byte.
- Outputs are also checked when the slave refuses OP with 0x001b.

Datagrams:

- The finding needs three cycles in a row that leave out a part of what an FMMU maps, while the slave is in OP. Parts in
  several datagrams or frames add up.
- If no datagram covers any of it, the slave must be in OP for at least half a second, while others are exchanged. An
  access to the memory of the FMMU by position or station address counts as an exchange.
- Mailbox state and other registers do not count.

## Example
samples/captures/pdo-length-mismatch.pcapng

## What to do
Map and send the whole process data of the slave, or assign PDOs that are as short as what is needed.
)"};

class PdoLengthMismatch final : public Rule {
 public:
  PdoLengthMismatch() : Rule(kInfo) {
    Subscribe<model::AlAnswered>(&PdoLengthMismatch::On);
    Subscribe<track::LogicalAccess>(&PdoLengthMismatch::On);
    Subscribe<track::SlaveAccess>(&PdoLengthMismatch::On, MemoryRange{kProcessMemory, 0xFFFF});
    Subscribe<model::AlRequestJudged>(&PdoLengthMismatch::On);
    Subscribe<model::AlChangedByItself>(&PdoLengthMismatch::On);
    Subscribe<track::AlStateForgotten>(&PdoLengthMismatch::On);
    Subscribe<track::RunBegan>(&PdoLengthMismatch::On);
  }

  void On(const model::AlAnswered& e) {
    if (e.request.control.state() != static_cast<std::uint8_t>(esc::AlState::OP)) return;
    if (e.outcome == model::AlAnswered::Outcome::kRefused) {
      // Outputs do not arrive, although the master sends them.
      if (e.code != esc::al_code::kWatchdog) return;
      const FindingIndex cause = EvaluateFmmus(e, device::PdoDirection::kRx);
      if (cause != kNoFinding && refused_.size() < FindingStore::kMaxFindings) {
        refused_.push_back({e.slave, e.frame.number, cause});
      }
      return;
    }
    for (const auto direction : {device::PdoDirection::kRx, device::PdoDirection::kTx})
      (void)EvaluateFmmus(e, direction);
    exchange_.EnteredOp(e.slave, e.frame);
  }

  void On(const track::SlaveAccess& e) { exchange_.On(e); }
  void On(const model::AlRequestJudged& e) {
    if (e.request.control.state() != static_cast<std::uint8_t>(esc::AlState::OP)) EvaluateExchange(e.slave);
  }
  void On(const model::AlChangedByItself& e) { EvaluateExchange(e.slave); }
  void On(const track::AlStateForgotten& e) { (void)exchange_.Leaves(e.slave); }
  void On(const track::RunBegan& e) {
    const bool initialised = e.reason == track::RunBegan::Reason::kInitialised;
    for (std::size_t s = 0; s < context().slave_count() && initialised; ++s) EvaluateExchange(static_cast<SlaveId>(s));
    exchange_.Forget();
  }

  void On(const track::LogicalAccess& e) {
    const track::Network& network = context().network();
    exchange_.On(e, network);
    if (e.assumed || !e.returned.seen() || e.wkc == 0) return;
    if (version_ != network.mapping_version()) {
      version_ = network.mapping_version();
      FindMapped();
      cache_ = {};
    }
    Cached& cached = cache_[(std::uint64_t{e.address} * 31U + e.length) % cache_.size()];
    if (!cached.used || cached.address != e.address || cached.length != e.length || cached.command != e.command) {
      cached = {true, e.command, e.address, e.length, PartsOf(e)};
    }
    for (const std::size_t part : cached.parts) Follow(e, mapped_[part]);
  }

  void Finish() override {
    for (std::size_t s = 0; s < context().slave_count(); ++s) {
      const auto id = static_cast<SlaveId>(s);
      if (context().slave(id).al.SettledIn(esc::AlState::OP)) EvaluateExchange(id);
    }
    for (const Refused& r : refused_) NameCause(context(), "al-refused", r.slave, r.frame, r.cause);
    if (NotEvaluableWithoutReturns()) return;
    for (const SlaveId slave : unknown_) NotEvaluable(slave, ReasonCode::kNotInCapture, what::kMapping);
    if (version_ && mapped_.empty()) NotEvaluable(kNoSlave, ReasonCode::kNotInCapture, what::kFmmusOfAll);
  }

 private:
  static constexpr std::uint32_t kProcessMemory = 0x0F00;  // below are registers
  static constexpr std::uint32_t kCyclesInARow = 3;

  /// What one FMMU maps, in bytes of the logical address space, and how much of it the last cycles covered.
  struct Mapped {
    SlaveId slave = kNoSlave;
    std::size_t number = 0;
    bool outputs = false;
    std::uint64_t begin = 0, end = 0;
    std::uint64_t from = 0, to = 0;  ///< covered in this cycle
    std::uint32_t incomplete = 0;    ///< cycles in a row
  };
  struct Cached {
    bool used = false;
    wire::Command command = wire::Command::NOP;
    std::uint32_t address = 0;
    std::uint16_t length = 0;
    std::vector<std::size_t> parts;  ///< indices into mapped_ of what the datagram covers only in part
  };

  /// The slave leaves OP, or the capture ends in it.
  void EvaluateExchange(SlaveId slave) {
    const std::optional<Unexchanged> e = exchange_.Leaves(slave);
    if (!e) return;
    if (MissesPackets(context().pairing()) || context().statistics().cut_frames > 0) {
      NotEvaluable(slave, ReasonCode::kMissesPackets, what::kProcessFrames, e->until.number);
      return;
    }
    constexpr std::uint64_t kNothing = 1ULL << 62U;
    if (Repeat(slave, kNothing, e->since) != kNoFinding) return;
    const bool outputs = e->output_bytes > 0;
    Finding finding = Found(kNotExchanged, slave, e->since);
    finding.last = e->until;
    AddRelated(finding, e->mapped);
    finding.Set("direction", arg::Of(outputs ? kOutputs : kInputs))
        .Set("outputs", arg::Flag(outputs))
        .Set("inputs_too", arg::Flag(outputs && e->input_bytes > 0))
        .Set("bytes", arg::Count(0, "byte"))
        .Set("expected_bytes", arg::Count(e->output_bytes + e->input_bytes, "byte"))
        .Set("logical_address", arg::Hex(e->address, 8))
        .Set("mapped_frame", arg::Frame(e->mapped))
        .Set("op_ms", arg::Ms(Elapsed(e->since.time, e->until.time)));
    Report(kNothing, std::move(finding));
  }

  void FindMapped() {
    mapped_.clear();
    const track::Network& network = context().network();
    for (std::size_t s = 0; s < network.slaves().size(); ++s) {
      const auto id = static_cast<SlaveId>(s);
      if (network.slaves()[id].replaced) continue;
      for (const auto& [number, fmmu] : network.fmmus(id).active) {
        if (fmmu.bit_count() == 0 || fmmu.physical_start < kProcessMemory) continue;
        if (!fmmu.reads() && !fmmu.writes()) continue;
        const esc::BitRange bits = fmmu.logical_bits();
        mapped_.push_back({id, number, fmmu.writes(), bits.first / 8, (bits.end() + 7) / 8, 0, 0, 0});
      }
    }
  }

  [[nodiscard]] std::vector<std::size_t> PartsOf(const track::LogicalAccess& e) const {
    std::vector<std::size_t> parts;
    const std::uint64_t begin = e.address;
    const std::uint64_t end = begin + e.length;
    for (std::size_t i = 0; i < mapped_.size(); ++i) {
      const Mapped& m = mapped_[i];
      const bool carried = m.outputs ? e.command != wire::Command::LRD : e.command != wire::Command::LWR;
      if (carried && begin < m.end && end > m.begin && (begin > m.begin || end < m.end)) parts.push_back(i);
    }
    return parts;
  }

  /// A datagram covers a part: it goes on where the last one ended, or begins a new cycle.
  void Follow(const track::LogicalAccess& e, Mapped& m) {
    const std::uint64_t from = std::max<std::uint64_t>(e.address, m.begin);
    const std::uint64_t to = std::min<std::uint64_t>(std::uint64_t{e.address} + e.length, m.end);
    if (m.to != 0 && from > m.from && from <= m.to && to > m.to) {
      m.to = to;
      if (m.from == m.begin && m.to == m.end) m.incomplete = 0;
      return;
    }
    if (m.to != 0 && to < m.to && to >= m.from && from < m.from) {
      m.from = from;
      if (m.from == m.begin && m.to == m.end) m.incomplete = 0;
      return;
    }
    const bool complete = m.to != 0 && m.from == m.begin && m.to == m.end;
    m.incomplete = m.to != 0 && !complete ? m.incomplete + 1 : 0;
    m.from = from;
    m.to = to;
    if (m.incomplete < kCyclesInARow || !context().slave(m.slave).al.SettledIn(esc::AlState::OP)) return;
    const std::uint64_t key = 1ULL << 63U | m.begin << 20U | (m.end - m.begin) << 5U | m.number;
    if (Repeat(m.slave, key, e.frame()) != kNoFinding) return;
    Finding finding = Found(kPartExchanged, m.slave, e.frame());
    finding.Set("direction", arg::Of(m.outputs ? kOutputs : kInputs))
        .Set("outputs", arg::Flag(m.outputs))
        .Set("bytes", arg::Count(to - from, "byte"))
        .Set("expected_bytes", arg::Count(m.end - m.begin, "byte"))
        .Set("logical_address", arg::Hex(m.begin, 8))
        .Set("last_address", arg::Hex(m.end - 1, 8))
        .Set("fmmu", arg::Number(static_cast<std::int64_t>(m.number)))
        .Set("command", arg::Text(wire::Name(e.command)))
        .Set("covered_address", arg::Hex(from, 8))
        .Set("last_covered_address", arg::Hex(to - 1, 8));
    AddRelated(finding, context().network().state(m.slave).fmmu_since[m.number]);
    Report(key, std::move(finding));
  }

  /// The part of a sync manager's buffer that the FMMUs of one direction map.
  struct Reach {
    std::uint64_t bits = 0;
    bool last_byte = false;
    FrameNo since = 0;
  };

  static Reach ReachOf(const track::SlaveState& state, const esc::SyncManager& manager,
                       device::PdoDirection direction) {
    const std::uint64_t start = std::uint64_t{manager.start} * 8;
    const std::uint64_t size = std::uint64_t{manager.length} * 8;
    Reach reach;
    for (std::size_t n = 0; n < esc::kMaxFmmus; ++n) {
      const auto fmmu = state.fmmu(n, Certainty::kInferred);
      if (!fmmu || !fmmu->active()) continue;
      if (!(direction == device::PdoDirection::kRx ? fmmu->writes() : fmmu->reads())) continue;
      const esc::BitRange mapped = fmmu->physical_bits();
      reach.bits += esc::Intersect(mapped, {start, size}).count;
      reach.last_byte = reach.last_byte || !esc::Intersect(mapped, {start + size - 8, 8}).empty();
      reach.since = std::max(reach.since, state.fmmu_since[n]);
    }
    return reach;
  }

  /// @return what it found, for outputs of which the last byte is missing
  FindingIndex EvaluateFmmus(const model::AlAnswered& e, device::PdoDirection direction) {
    const model::ProcessLayout& layout = context().slave(e.slave).process.Layout(direction);
    const bool given = layout.source == model::LayoutSource::kObserved || layout.source == model::LayoutSource::kEni;
    if (!given || !layout.known()) {
      unknown_.insert(e.slave);
      return EvaluateBuffers(e, direction);
    }
    if (layout.signals.empty()) return kNoFinding;
    const track::SlaveState& state = context().network().state(e.slave);
    std::set<std::uint8_t> managers;
    for (const model::Signal& signal : layout.signals) managers.insert(signal.sync_manager);
    FindingIndex found = kNoFinding;
    for (const std::uint8_t number : managers) {
      const auto manager = state.sync_manager(number, Certainty::kInferred);
      if (!manager || !manager->enabled() || manager->length != layout.bytes_of(number)) continue;
      std::uint64_t wanted = 0;
      for (const model::Signal& signal : layout.signals) {
        if (signal.sync_manager == number) wanted += signal.bits;
      }
      const Reach reach = ReachOf(state, *manager, direction);
      // Without FMMUs the master reads and writes the buffers by their address.
      if (reach.bits == 0 || reach.bits >= wanted) continue;
      const FindingIndex index = ReportFmmu(e, direction, &layout, number, reach, wanted);
      if (!reach.last_byte) found = index;
    }
    return found;
  }

  /// The PDOs are not known, but the sync managers are. They pass their buffer on when its last byte is accessed.
  FindingIndex EvaluateBuffers(const model::AlAnswered& e, device::PdoDirection direction) {
    const track::SlaveState& state = context().network().state(e.slave);
    FindingIndex found = kNoFinding;
    for (std::size_t n = 0; n < esc::kMaxSyncManagers; ++n) {
      const auto manager = state.sync_manager(n, Certainty::kInferred);
      if (!manager || !manager->enabled() || !esc::IsProcessData(n, *manager) || manager->length == 0) continue;
      if (manager->start < kProcessMemory) continue;
      if (manager->ecat_writes() != (direction == device::PdoDirection::kRx)) continue;
      const Reach reach = ReachOf(state, *manager, direction);
      if (reach.bits == 0 || reach.last_byte) continue;
      found =
          ReportFmmu(e, direction, nullptr, static_cast<std::uint8_t>(n), reach, std::uint64_t{manager->length} * 8);
    }
    return found;
  }

  /// @param layout  null: the PDOs are not known, `wanted` is the size of the sync manager
  FindingIndex ReportFmmu(const model::AlAnswered& e, device::PdoDirection direction,
                          const model::ProcessLayout* layout, std::uint8_t manager, const Reach& reach,
                          std::uint64_t wanted) {
    const std::uint64_t key = std::uint64_t{manager} << 48U | reach.bits << 24U | wanted;
    if (const FindingIndex index = Repeat(e.slave, key, e.frame); index != kNoFinding) return index;
    const bool outputs = direction == device::PdoDirection::kRx;
    const auto length = [](std::uint64_t bits) {
      return bits % 8 == 0 ? arg::Count(bits / 8, "byte") : arg::Count(bits, "bit");
    };
    Finding finding = Found(kFmmuTooShort, e.slave, e.frame);
    finding.Set("direction", arg::Of(outputs ? kOutputs : kInputs))
        .Set("outputs", arg::Flag(outputs))
        .Set("refused", arg::Flag(e.outcome == model::AlAnswered::Outcome::kRefused))
        .Set("mapped_bits", arg::Number(static_cast<std::int64_t>(reach.bits)))
        .Set(layout != nullptr ? "pdo_bits" : "sync_manager_bits", arg::Number(static_cast<std::int64_t>(wanted)))
        .Set("sync_manager", arg::Number(manager))
        .Set("mapped", length(reach.bits))
        .Set("wanted", length(wanted))
        .Set("fmmu_frame", arg::Frame(reach.since));
    if (layout != nullptr) finding.Set("pdos", PdosValue(layout->pdos));
    AddRelated(finding, reach.since);
    if (layout != nullptr) AddRelated(finding, layout->since);
    if (layout != nullptr && layout->assumed) finding.confidence = Confidence::kInferred;
    return Report(key, std::move(finding));
  }

  struct Refused {
    SlaveId slave = kNoSlave;
    FrameNo frame = 0;
    FindingIndex cause = kNoFinding;
  };

  std::optional<std::uint64_t> version_;
  std::vector<Mapped> mapped_;
  std::array<Cached, 16> cache_;
  std::set<SlaveId> unknown_;
  std::vector<Refused> refused_;
  ExchangeWatch exchange_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<PdoLengthMismatch>};

}  // namespace
}  // namespace ecaudit::pdo_length_mismatch
