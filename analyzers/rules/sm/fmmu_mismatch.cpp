#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/sync_manager_text.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/text.h"
#include "decoder/track/events.h"
#include "decoder/track/network.h"

namespace ecaudit::fmmu_mismatch {
namespace {

constexpr RuleInfo kInfo{
    .id = "fmmu-mismatch",
    .group = "Sync managers and FMMUs",
    .severity = Severity::kError,
    .title = "An FMMU does not fit its sync manager, or two slaves write the same bits of the process image",
    .needs = "the settings of FMMUs and sync managers; for two slaves also that both give inputs",
    .source = "ESC-1, FMMU; ETG1000.4, FMMUs",
    .doc = R"(
## What it checks
Each active FMMU of a slave that reaches SAFEOP or OP: every byte it maps must lie in an enabled sync manager, of inputs
for an FMMU that reads, of outputs for one that writes. And whether read FMMUs of two slaves cover the same bits of the
logical process image, so that both write them into the same frame.

## Why it matters
Bytes outside a sync manager have no buffers: values are torn, outputs never reach the application, inputs stay old. Of
two slaves that write the same bits the last on the bus wins and the other's inputs are lost.

## How it is decided
Settings as they stand when the slave shows the state; a slave that refuses it is judged by the sync manager rules.
FMMUs of registers (below 0x1000 and outside every sync manager: the mailbox state 0x080D) are normal, as are inputs
and outputs of one slave at the same logical address. Write FMMUs of two slaves on the same bits are not judged: one
command for several slaves is a way to use them. Two slaves count when a logical access covers the bits while both are
settled in SAFEOP or OP.

## Example
samples/captures/fmmus-overlap.pcapng

## What to do
Give the FMMU start and length of the sync manager it serves, and each slave its own place in the process image.
)"};

class FmmuMismatch final : public Rule {
 public:
  FmmuMismatch() : Rule(kInfo) {
    Subscribe<model::AlAnswered>(&FmmuMismatch::On);
    Subscribe<track::LogicalAccess>(&FmmuMismatch::On);
  }

  void On(const model::AlAnswered& e) {
    const auto state = static_cast<esc::AlState>(e.request.control.state());
    if (e.outcome == model::AlAnswered::Outcome::kRefused) return;
    if (state != esc::AlState::SAFEOP && state != esc::AlState::OP) return;
    const track::SlaveState& slave = context().network().state(e.slave);
    auto [judged, first] = judged_.emplace(e.slave, slave.mapping_version);
    if (!first && judged->second == slave.mapping_version) return;
    judged->second = slave.mapping_version;
    SyncManagers managers;
    for (std::size_t n = 0; n < managers.size(); ++n) managers[n] = SyncManagerOf(slave, n);
    for (std::size_t n = 0; n < esc::kMaxFmmus; ++n) {
      const auto fmmu = slave.fmmu(n, Certainty::kInferred);
      if (fmmu && fmmu->active() && fmmu->bit_count() != 0) JudgePlace(e, n, *fmmu, managers);
    }
  }

  void On(const track::LogicalAccess& e) {
    if (e.assumed || !e.returned.seen() || e.wkc == 0) return;
    const track::Network& network = context().network();
    if (version_ != network.mapping_version()) FindShared(e);
    if (e.command == wire::Command::LWR) return;
    for (Shared& shared : shared_) {
      if (!shared.told && Covers(e, shared.bits) && Gives(shared.a.slave) && Gives(shared.b.slave)) Tell(e, shared);
    }
  }

  void Finish() override { NotEvaluableWithoutReturns(); }

 private:
  using SyncManagers = std::array<std::optional<KnownSyncManager>, esc::kMaxSyncManagers>;
  static constexpr std::uint32_t kRegistersEnd = 0x1000;
  static constexpr std::uint32_t kMemoryEnd = 0x20000;  ///< behind all that an FMMU can point at
  static constexpr std::size_t kMaxShared = 64;

  struct Mapped {
    SlaveId slave = kNoSlave;
    std::size_t number = 0;
    esc::Fmmu fmmu;
  };
  struct Shared {
    Mapped a, b;
    esc::BitRange bits;
    bool told = false;
  };

  static bool Covers(const track::LogicalAccess& e, const esc::BitRange& bits) {
    return !esc::Intersect(bits, {std::uint64_t{e.address} * 8, std::uint64_t{e.length} * 8}).empty();
  }
  [[nodiscard]] bool Gives(SlaveId slave) const {
    const model::AlMachine& al = context().slave(slave).al;
    return al.SettledIn(esc::AlState::SAFEOP) || al.SettledIn(esc::AlState::OP);
  }

  /// The enabled sync manager that has the byte: one that fits the FMMU before any other.
  static std::optional<std::size_t> ManagerOf(std::uint32_t byte, const SyncManagers& managers, const esc::Fmmu& fmmu) {
    std::optional<std::size_t> found;
    for (std::size_t n = 0; n < managers.size(); ++n) {
      if (!managers[n] || !managers[n]->settings.enabled()) continue;
      const esc::SyncManager& sm = managers[n]->settings;
      if (byte < sm.start || byte >= sm.end()) continue;
      if (Fits(sm, fmmu)) return n;
      found = n;
    }
    return found;
  }
  /// The next byte that may lie in other sync managers than `byte`.
  static std::uint32_t NextEdge(std::uint32_t byte, const SyncManagers& managers) {
    std::uint32_t next = byte < kRegistersEnd ? kRegistersEnd : kMemoryEnd;
    for (const auto& manager : managers) {
      if (!manager) continue;
      for (const std::uint32_t edge : {std::uint32_t{manager->settings.start}, manager->settings.end()}) {
        if (edge > byte) next = std::min(next, edge);
      }
    }
    return next;
  }
  static bool Fits(const esc::SyncManager& sm, const esc::Fmmu& fmmu) {
    if (fmmu.reads() && fmmu.writes()) return true;
    return fmmu.writes() ? sm.ecat_writes() : sm.ecat_reads();
  }

  void JudgePlace(const model::AlAnswered& e, std::size_t n, const esc::Fmmu& fmmu, const SyncManagers& managers) {
    if (!fmmu.reads() && !fmmu.writes()) return;
    std::optional<std::uint32_t> outside;  // first byte without a sync manager
    std::optional<std::size_t> against;    // sync manager of the other direction
    for (std::uint32_t byte = fmmu.physical_start; byte < fmmu.physical_end(); byte = NextEdge(byte, managers)) {
      const auto manager = ManagerOf(byte, managers, fmmu);
      if (!manager) {
        if (byte >= kRegistersEnd && !outside) outside = byte;
      } else if (!Fits(managers[*manager]->settings, fmmu)) {
        against = manager;
      }
    }
    if (!outside && !against) return;
    // One whose settings are not in the capture may be where the FMMU points.
    const bool all_known =
        std::all_of(managers.begin(), managers.begin() + 4, [](const auto& m) { return m.has_value(); });
    if (!against && HasVirtualManagers(e.slave)) return;
    FrameNo learned = context().network().state(e.slave).fmmu_since[n];
    for (const auto& manager : managers) {
      if (manager) learned = std::min(learned, manager->since);
    }
    if (context().network().MayMissBetween(learned, e.frame.number)) {
      NotEvaluable(e.slave, ReasonCode::kCaptureGap, what::kHistory, e.frame.number);
      return;
    }
    if (!against && !all_known) {
      NotEvaluable(e.slave, "an FMMU is active, but not all sync managers were set in the capture", e.frame.number);
      return;
    }
    const std::uint64_t key = std::uint64_t{fmmu.physical_start} << 40U | std::uint64_t{fmmu.length} << 24U |
                              std::uint64_t{fmmu.type} << 16U | (against ? 0x80U : 0U) | n;
    if (Repeat(e.slave, key, e.frame) != kNoFinding) return;
    Report(key, DescribePlace(e, n, fmmu, outside, against, managers));
  }

  /// The EEPROM says that some process data need no sync manager.
  [[nodiscard]] bool HasVirtualManagers(SlaveId slave) const {
    constexpr std::uint8_t kVirtual = 0x04;
    const auto sii = esc::ParseSii(context().network().state(slave).sii.image());
    return std::any_of(sii.sync_managers.begin(), sii.sync_managers.end(),
                       [](const esc::SiiSyncManager& sm) { return (sm.enable & kVirtual) != 0; });
  }

  Finding DescribePlace(const model::AlAnswered& e, std::size_t n, const esc::Fmmu& fmmu,
                        std::optional<std::uint32_t> outside, std::optional<std::size_t> against,
                        const SyncManagers& managers) const {
    const FrameNo since = context().network().state(e.slave).fmmu_since[n];
    const std::string way = fmmu.writes() ? "writes" : "reads";
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.frame;
    finding.message = "The slave reached " + esc::StateName(e.request.control.state()) + " in frame " +
                      std::to_string(e.frame.number) + " with FMMU " + std::to_string(n) + ", set in frame " +
                      std::to_string(since) + ", which " + way + " " + Hex(fmmu.physical_start) + " to " +
                      Hex(fmmu.physical_end() - 1) + ". ";
    if (against) {
      const KnownSyncManager& manager = *managers[*against];
      finding.title =
          "FMMU " + std::to_string(n) + " " + way + " against the direction of SM" + std::to_string(*against);
      finding.message += "There lies sync manager " + std::to_string(*against) + ", set in frame " +
                         std::to_string(manager.since) + ", that the master " +
                         (manager.settings.ecat_writes() ? "writes" : "reads") + ". Set the type of the FMMU to " +
                         (manager.settings.ecat_writes() ? "2 (write)" : "1 (read)") +
                         ", or its address to that of a " + "sync manager of its direction.";
      finding.evidence.push_back(Number("sync_manager", static_cast<std::int64_t>(*against)));
      AddRelated(finding, since);
      AddRelated(finding, manager.since);
    } else {
      finding.title =
          "FMMU " + std::to_string(n) + " maps bytes outside the sync managers, from " + Hex(*outside) + " on";
      finding.message += "From " + Hex(*outside) + " on no enabled sync manager covers it; enabled are: ";
      std::string list;
      for (std::size_t m = 0; m < managers.size(); ++m) {
        if (!managers[m] || !managers[m]->settings.enabled() || managers[m]->settings.length == 0) continue;
        const esc::SyncManager& sm = managers[m]->settings;
        list += (list.empty() ? "SM" : ", SM") + std::to_string(m) + " " + Hex(sm.start) + " to " + Hex(sm.end() - 1);
      }
      finding.message += (list.empty() ? "none" : list) + ". Give the FMMU start and length of its sync manager.";
      finding.evidence.push_back(HexNumber("first_outside", *outside));
      AddRelated(finding, since);
    }
    finding.evidence.push_back(Number("fmmu", static_cast<std::int64_t>(n)));
    finding.evidence.push_back(HexNumber("physical_start", fmmu.physical_start));
    finding.evidence.push_back(Number("length", fmmu.length));
    finding.evidence.push_back(Number("type", fmmu.type));
    return finding;
  }

  /// Renews mapped_ where slaves changed.
  /// @return whether the FMMUs of all slaves are known
  bool ReadMapped() {
    const track::Network& network = context().network();
    bool known = network.slaves().size() != 0;
    std::vector<bool> again(network.slaves().size());
    std::vector<Mapped> fresh;
    for (std::size_t s = 0; s < network.slaves().size(); ++s) {
      const auto id = static_cast<SlaveId>(s);
      again[s] = network.slaves()[id].replaced;
      if (again[s]) continue;
      if (!network.fmmus(id).all) known = false;
      if (version_ && network.mapping_changed(id) <= *version_) continue;
      again[s] = true;
      for (const auto& [number, fmmu] : network.fmmus(id).active) {
        const bool process_memory = fmmu.physical_start >= kDigitalInputs;
        if (fmmu.reads() && process_memory && fmmu.bit_count() != 0) fresh.push_back({id, number, fmmu});
      }
    }
    version_ = network.mapping_version();
    std::erase_if(mapped_, [&](const Mapped& m) { return again[m.slave]; });
    const auto by_place = [](const Mapped& a, const Mapped& b) {
      return std::tuple(a.fmmu.logical_bits().first, a.slave, a.number) <
             std::tuple(b.fmmu.logical_bits().first, b.slave, b.number);
    };
    std::sort(fresh.begin(), fresh.end(), by_place);
    const auto middle = static_cast<std::ptrdiff_t>(mapped_.size());
    mapped_.insert(mapped_.end(), fresh.begin(), fresh.end());
    std::inplace_merge(mapped_.begin(), mapped_.begin() + middle, mapped_.end(), by_place);
    return known;
  }

  /// Pairs of slaves whose read FMMUs of process memory share bits.
  void FindShared(const track::LogicalAccess& e) {
    const std::vector<Shared> before = std::move(shared_);
    shared_.clear();
    if (!ReadMapped()) NotEvaluable(kNoSlave, "the FMMUs of all slaves are not in the capture", e.frame().number);
    const std::vector<Mapped>& all = mapped_;
    for (std::size_t i = 0; i < all.size(); ++i) {
      for (std::size_t k = i + 1; k < all.size() && shared_.size() < kMaxShared; ++k) {
        if (all[k].fmmu.logical_bits().first >= all[i].fmmu.logical_bits().end()) break;
        if (all[k].slave == all[i].slave) continue;
        // The one that was set later takes the place of the other.
        const bool in_order = Since(all[i]) <= Since(all[k]);
        Shared shared{all[in_order ? i : k], all[in_order ? k : i],
                      esc::Intersect(all[i].fmmu.logical_bits(), all[k].fmmu.logical_bits())};
        shared.told = std::any_of(before.begin(), before.end(), [&](const Shared& old) {
          return old.told && old.a.slave == shared.a.slave && old.b.slave == shared.b.slave && old.bits == shared.bits;
        });
        shared_.push_back(shared);
      }
    }
  }

  /// Frame that set it.
  [[nodiscard]] FrameNo Since(const Mapped& m) const { return context().network().state(m.slave).fmmu_since[m.number]; }

  void Tell(const track::LogicalAccess& e, Shared& shared) {
    shared.told = true;
    const std::uint64_t key = 1ULL << 63U | shared.bits.first << 16U | shared.a.slave;
    if (Repeat(shared.b.slave, key, e.frame()) != kNoFinding) return;
    const auto text = [&](const Mapped& m) {
      return context().Label(m.slave) + " by its FMMU " + std::to_string(m.number) + " (" +
             Count(m.fmmu.length, "byte") + " from " + Hex(m.fmmu.logical_start, 8) + ", set in frame " +
             std::to_string(Since(m)) + ")";
    };
    Finding finding;
    finding.slave = shared.b.slave;
    finding.first = e.frame();
    const std::string place =
        Count(shared.bits.count, "bit") + " from logical address " + Hex(shared.bits.first / 8, 8);
    finding.title = "Inputs of two slaves at the same place: " + place;
    finding.message =
        "In frame " + std::to_string(e.frame().number) + " " + place + " on are written by " + text(shared.a) +
        " and by " + text(shared.b) +
        ". Of both only the inputs of the one that the frame passes last are left. Give each slave its own "
        "place in the process image.";
    finding.evidence.push_back(HexNumber("logical_address", shared.bits.first / 8));
    finding.evidence.push_back(Number("shared_bits", static_cast<std::int64_t>(shared.bits.count)));
    finding.evidence.push_back(Text("other_slave", context().Label(shared.a.slave)));
    AddRelated(finding, Since(shared.a));
    AddRelated(finding, Since(shared.b));
    Report(key, std::move(finding));
  }

  static constexpr std::uint32_t kDigitalInputs = 0x0F00;  // below are registers

  std::map<SlaveId, std::uint32_t> judged_;  // mapping version
  std::optional<std::uint64_t> version_;     ///< of the mapping that mapped_ and shared_ were made from
  std::vector<Mapped> mapped_;               ///< FMMUs that give process data, by their first logical bit
  std::vector<Shared> shared_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<FmmuMismatch>};

}  // namespace
}  // namespace ecaudit::fmmu_mismatch
