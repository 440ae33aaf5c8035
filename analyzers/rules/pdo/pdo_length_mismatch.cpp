#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "analyzers/judge/exchange_watch.h"
#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/pdo_rule.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/sync_text.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/text.h"
#include "decoder/base/time.h"
#include "decoder/pipeline.h"
#include "decoder/track/datagram_pair.h"
#include "decoder/track/events.h"
#include "decoder/track/network.h"

namespace ecaudit::pdo_length_mismatch {
namespace {

constexpr RuleInfo kInfo{.id = "pdo-length-mismatch",
                         .group = "PDO mapping",
                         .severity = Severity::kError,
                         .title = "Process data are exchanged in another length than the PDOs have",
                         .needs = "the FMMUs of the slave; for their length also its sync managers and PDOs",
                         .source = "ETG1000.6, PDO assignment; ESC-1, sync manager",
                         .doc = R"(
## What it checks
Of each slave in OP: whether its FMMUs carry as many bytes as the assigned PDOs have, and whether the logical datagrams
cover all that the FMMUs map.

## Why it matters
A sync manager hands its buffer over when the last byte was accessed. Outputs of which the last byte is missing never
reach the application, and its watchdog takes the slave out of OP; inputs that are cut are lost.

## How it is decided
FMMUs: their bits in one direction against the assigned PDOs (SDO transfers of the capture, ENI file), when the slave
reaches OP; only where sync manager and PDOs agree, so that the lengths are certain (a sync manager that disagrees is
sm-process-config). Where the PDOs are not known: FMMUs that reach into a sync manager's buffer but none its last byte.
Outputs also when the slave refuses OP with 0x001b. Datagrams: where three cycles in a row leave out a part of what an
FMMU maps although the slave is in OP; parts that come in several datagrams or frames add up. Where none covers any of
it, and nothing accesses the memory behind it, although the slave is in OP and others are exchanged for half a second or
longer, nothing of it is exchanged. Mailbox state and other registers do not count.

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
    Subscribe<track::CycleAtRest>(&PdoLengthMismatch::On);
    Subscribe<track::SlaveAccess>(&PdoLengthMismatch::On, MemoryRange{kProcessMemory, 0xFFFF});
    Subscribe<model::AlRequestJudged>(&PdoLengthMismatch::On);
    Subscribe<model::AlChangedByItself>(&PdoLengthMismatch::On);
    Subscribe<track::AlStateForgotten>(&PdoLengthMismatch::On);
    Subscribe<track::RunBegan>(&PdoLengthMismatch::On);
  }

  void On(const model::AlAnswered& e) {
    if (e.request.control.state() != static_cast<std::uint8_t>(esc::AlState::OP)) return;
    if (e.outcome == model::AlAnswered::Outcome::kRefused) {
      constexpr std::uint16_t kWatchdog = 0x001B;  // no outputs come, although they are sent
      if (e.code != kWatchdog) return;
      const FindingIndex cause = JudgeFmmus(e, device::PdoDirection::kRx);
      if (cause != kNoFinding && refused_.size() < FindingStore::kMaxFindings) {
        refused_.push_back({e.slave, e.frame.number, cause});
      }
      return;
    }
    for (const auto direction : {device::PdoDirection::kRx, device::PdoDirection::kTx}) (void)JudgeFmmus(e, direction);
    exchange_.EnteredOp(e.slave, e.frame);
  }

  void On(const track::SlaveAccess& e) { exchange_.On(e); }
  void On(const model::AlRequestJudged& e) {
    if (e.request.control.state() != static_cast<std::uint8_t>(esc::AlState::OP)) JudgeExchange(e.slave);
  }
  void On(const model::AlChangedByItself& e) { JudgeExchange(e.slave); }
  void On(const track::AlStateForgotten& e) { (void)exchange_.Leaves(e.slave); }
  void On(const track::RunBegan& e) {
    const bool asked = e.reason == track::RunBegan::Reason::kInitialised;
    for (std::size_t s = 0; s < context().slave_count() && asked; ++s) JudgeExchange(static_cast<SlaveId>(s));
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

  /// Where several datagrams share an FMMU their order tells.
  void On(const track::CycleAtRest& asked) {
    for (std::size_t i = 0; i < asked.datagrams.size(); ++i) {
      const track::DatagramPair d(asked.transaction, i);
      if (wire::IsLogical(d.command()) && !PartsOf(track::Network::LogicalAccessOf(d)).empty())
        asked.each_wanted = true;
    }
  }

  void Finish() override {
    for (std::size_t s = 0; s < context().slave_count(); ++s) {
      const auto id = static_cast<SlaveId>(s);
      if (context().slave(id).al.SettledIn(esc::AlState::OP)) JudgeExchange(id);
    }
    for (const Refused& r : refused_) NameCause(context(), "al-refused", r.slave, r.frame, r.cause);
    if (NotEvaluableWithoutReturns()) return;
    for (const SlaveId slave : unknown_) NotEvaluable(slave, "what PDOs are assigned and mapped is not known");
    if (version_ && mapped_.empty()) NotEvaluable(kNoSlave, "no FMMU was set in the capture");
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
  void JudgeExchange(SlaveId slave) {
    const std::optional<Unexchanged> e = exchange_.Leaves(slave);
    if (!e) return;
    if (MissesPackets(context().pairing()) || context().statistics().cut_frames > 0) {
      NotEvaluable(slave, "datagrams with the rest of the process data may lie in what the capture misses",
                   e->until.number);
      return;
    }
    constexpr std::uint64_t kNothing = 1ULL << 62U;
    if (Repeat(slave, kNothing, e->since) != kNoFinding) return;
    const std::string what = e->output_bytes == 0 ? "inputs" : e->input_bytes == 0 ? "outputs" : "outputs and inputs";
    const std::string bytes = Count(e->output_bytes + e->input_bytes, "byte");
    Finding finding;
    finding.slave = slave;
    finding.first = e->since;
    finding.last = e->until;
    AddRelated(finding, e->mapped);
    finding.title = "0 of " + bytes + " of the " + what + " are exchanged";
    finding.message = "The FMMUs of the slave, set up to frame " + std::to_string(e->mapped) + ", map " + bytes +
                      " of " + what + " to the logical addresses from " + Hex(e->address, 8) +
                      " on, and it is in OP from frame " + std::to_string(e->since.number) + " to frame " +
                      std::to_string(e->until.number) + ", " + Duration(Elapsed(e->since.time, e->until.time)) +
                      ", while other process data are exchanged; but no datagram covers any of it. " +
                      (e->output_bytes > 0 ? "It gets no set points. " : "Its actual values reach nobody. ") +
                      "Let the cyclic frames cover the whole process image.";
    finding.evidence = {Number("bytes", 0),
                        Number("expected_bytes", static_cast<std::int64_t>(e->output_bytes + e->input_bytes)),
                        HexNumber("logical_address", e->address)};
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
    const std::string what = m.outputs ? "outputs" : "inputs";
    const std::string covered = std::to_string(to - from) + " of " + Count(m.end - m.begin, "byte");
    Finding finding;
    finding.slave = m.slave;
    finding.first = e.frame();
    finding.title = "Only " + covered + " of the " + what + " are exchanged";
    finding.message = "FMMU " + std::to_string(m.number) + " of the slave, in OP, maps its " + what +
                      " to the logical addresses " + Hex(m.begin, 8) + " to " + Hex(m.end - 1, 8) + ", but the " +
                      std::string(wire::Name(e.command)) + " in frame " + std::to_string(e.frame().number) +
                      " covers " + Hex(from, 8) + " to " + Hex(to - 1, 8) + ", " + covered +
                      ", and nothing in the cycle covers the rest. " +
                      (m.outputs ? "The sync manager hands outputs over when their last byte is written. " : "") +
                      "Make the datagram as long as the process image.";
    finding.evidence.push_back(Number("bytes", static_cast<std::int64_t>(to - from)));
    finding.evidence.push_back(Number("expected_bytes", static_cast<std::int64_t>(m.end - m.begin)));
    finding.evidence.push_back(HexNumber("logical_address", m.begin));
    AddRelated(finding, context().network().state(m.slave).fmmu_since[m.number]);
    Report(key, std::move(finding));
  }

  /// How much of a sync manager's buffer the FMMUs of one direction map.
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
  FindingIndex JudgeFmmus(const model::AlAnswered& e, device::PdoDirection direction) {
    const model::ProcessLayout& layout = context().slave(e.slave).process.Layout(direction);
    const bool given = layout.source == model::LayoutSource::kObserved || layout.source == model::LayoutSource::kEni;
    if (!given || !layout.known()) {
      unknown_.insert(e.slave);
      return JudgeBuffers(e, direction);
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
      const FindingIndex index = TellFmmu(e, direction, &layout, number, reach, wanted);
      if (!reach.last_byte) found = index;
    }
    return found;
  }

  /// The PDOs are not known; the sync managers are, and hand over what they hold when their last byte is accessed.
  FindingIndex JudgeBuffers(const model::AlAnswered& e, device::PdoDirection direction) {
    const track::SlaveState& state = context().network().state(e.slave);
    FindingIndex found = kNoFinding;
    for (std::size_t n = 0; n < esc::kMaxSyncManagers; ++n) {
      const auto manager = state.sync_manager(n, Certainty::kInferred);
      if (!manager || !manager->enabled() || !manager->buffered() || manager->length == 0) continue;
      if (manager->start < kProcessMemory) continue;
      if (manager->ecat_writes() != (direction == device::PdoDirection::kRx)) continue;
      const Reach reach = ReachOf(state, *manager, direction);
      if (reach.bits == 0 || reach.last_byte) continue;
      found = TellFmmu(e, direction, nullptr, static_cast<std::uint8_t>(n), reach, std::uint64_t{manager->length} * 8);
    }
    return found;
  }

  /// @param layout  null: the PDOs are not known, `wanted` is the size of the sync manager
  FindingIndex TellFmmu(const model::AlAnswered& e, device::PdoDirection direction, const model::ProcessLayout* layout,
                        std::uint8_t manager, const Reach& reach, std::uint64_t wanted) {
    const std::uint64_t key = std::uint64_t{manager} << 48U | reach.bits << 24U | wanted;
    if (const FindingIndex index = Repeat(e.slave, key, e.frame); index != kNoFinding) return index;
    std::string pdos;
    if (layout != nullptr) {
      for (const std::uint16_t pdo : layout->pdos) pdos += ObjectName(pdo) + ", ";
    }
    const std::string what = direction == device::PdoDirection::kRx ? "outputs" : "inputs";
    const auto text = [](std::uint64_t n) { return n % 8 == 0 ? Count(n / 8, "byte") : Count(n, "bit"); };
    const bool refused = e.outcome == model::AlAnswered::Outcome::kRefused;
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.frame;
    finding.title = "FMMUs map " + text(reach.bits) + " of the " + what + ", the " +
                    (layout != nullptr ? "PDOs have " : "sync manager has ") + text(wanted);
    finding.message = std::string("The slave ") + (refused ? "refused" : "reached") + " OP in frame " +
                      std::to_string(e.frame.number) + " with " + text(wanted) + " of " + what + " (" + pdos +
                      "sync manager " + std::to_string(manager) + "), but its FMMUs, set up to frame " +
                      std::to_string(reach.since) + ", map only " + text(reach.bits) + " of them. " +
                      (direction == device::PdoDirection::kRx
                           ? "The sync manager hands outputs over when their last byte is written. "
                           : "The rest of the inputs never reaches the master. ") +
                      "Give the FMMU the length of the sync manager.";
    finding.evidence.push_back(Number("mapped_bits", static_cast<std::int64_t>(reach.bits)));
    finding.evidence.push_back(
        Number(layout != nullptr ? "pdo_bits" : "sync_manager_bits", static_cast<std::int64_t>(wanted)));
    finding.evidence.push_back(Number("sync_manager", manager));
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
