#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/sync_manager_text.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/sync/sync_model.h"
#include "decoder/base/text.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/track/events.h"
#include "decoder/track/network.h"

namespace ecaudit::fmmu_mismatch {
namespace {

constexpr FindingKind kWrongDirection{
    .name = "wrong-direction",
    .title = "FMMU {fmmu} {way} against the direction of SM{sync_manager}",
    .message = R"(The slave reached {state} in {frame}. FMMU {fmmu}, set in {fmmu_frame}, {way} {physical_start} to
{physical_end}. Sync manager {sync_manager}, set in {sync_manager_frame}, uses this memory, and the master {manager_way}
it.)",
    .next = R"(Set the type of the FMMU to {right_type}, or its address to that of a sync manager of its direction.)",
    .identity = "fmmu sync_manager type"};

constexpr FindingKind kOutside{
    .name = "outside-sync-managers",
    .title = "FMMU {fmmu} maps bytes outside the sync managers, from {first_outside} on",
    .message = R"(The slave reached {state} in {frame}. FMMU {fmmu}, set in {fmmu_frame}, {way} {physical_start} to
{physical_end}. No enabled sync manager has the bytes from {first_outside} on.[ Enabled sync managers: {enabled}.][{!enabled}
No sync manager is enabled.])",
    .next = "Give the FMMU start and length of its sync manager.",
    .identity = "fmmu first_outside"};

constexpr FindingKind kOnMailbox{
    .name = "on-mailbox",
    .title = "FMMU {fmmu} maps the mailbox (SM{sync_manager}), not process data",
    .message = R"(The slave reached {state} in {frame}. FMMU {fmmu}, set in {fmmu_frame}, {way} {physical_start} to
{physical_end}. This is memory of the mailbox: SM{sync_manager}, set in {sync_manager_frame}, has {mailbox_start} to
{mailbox_end} and mailbox mode.[ The {direction} of the slave have SM{process_manager}, from {process_start} to
{process_end}, which no active FMMU maps.])",
    .next = R"(Set the address of the FMMU to [{process_start}, with the length of
SM{process_manager}][{!process_start}that of a sync manager of process data].)",
    .identity = "fmmu sync_manager type"};

constexpr FindingKind kSharedInputs{
    .name = "shared-inputs",
    .title = "Inputs of two slaves share {shared_bits} from {logical_address}",
    .message =
        R"(Two slaves write {shared_bits} from logical address {logical_address} on in {frame}. One is {other_slave} with
its FMMU {other_fmmu} ({other_length} from {other_start}, set in {other_fmmu_frame}). The other is {own_slave} with its FMMU
{fmmu} ({length} from {start}, set in {fmmu_frame}). Only the inputs of the slave that the frame passes last remain.)",
    .next = "Give each slave its own place in the process image.",
    .identity = "logical_address"};

constexpr FindingKind kSharedOutputs{
    .name = "shared-outputs",
    .title = "Outputs of two slaves share {shared_bits} from {logical_address}[{?crossing}, but not all]",
    .message =
        R"(In {frame} two slaves take {shared_bits} from logical address {logical_address} on as outputs. One is
{other_slave} with its FMMU {other_fmmu} ({other_length} from {other_start}, set in {other_fmmu_frame}). The other is
{own_slave} with its FMMU {fmmu} ({length} from {start}, set in {fmmu_frame}). [{?crossing}Each of them also has bits that
the other has not: what is one value for the one is part of another value for the other.][{!crossing}That may be meant, if
both follow the same commands.])",
    .next =
        "[{?crossing}Give each slave its own place in the process image.][{!crossing}Check that both are to follow the "
        "same commands.]",
    .identity = "logical_address"};

constexpr FindingKind kLatchOff{
    .name = "latch-times-stand",
    .title = "Latch times are mapped, but stand still: 0x0981 is {activation}",
    .message =
        R"(FMMU {fmmu} reads the latch times {first} to {last}. From {frame} (OP) to {change_frame} the other inputs of the slave
changed {changes}, but no latch time changed. 0x0981 is {activation}[ since {write_frame}]: the unit for SYNC and latch
signals is off. Terminals with time stamps may capture nothing then.)",
    .next = R"(Write the high byte of AssignActivate to 0x0981 in PREOP: 1 for 0x0100. The ESI of the device gives it
(Dc/OpMode). If the terminal needs none, check the signal.)"};

constexpr NoteKind kInputsChange{
    .name = "inputs-change",
    .text = R"(In {change_frame} these inputs have another value. So the slave writes them without a sync manager, as
terminals without a processor do.)"};

constexpr NoteKind kTypesSwapped{
    .name = "types-in-other-order",
    .text =
        R"(Object {object} of the slave[ (read in {read_frame})] states that SM{sync_manager} is for {stated}, but it is
used for {used}[{?by_eeprom}, also by the EEPROM]. A master that sets its FMMUs by 1C00h maps the wrong sync manager. Use
the types of the EEPROM, or correct 1C00h in the firmware of the slave.)"};

constexpr const FindingKind* kKinds[] = {&kWrongDirection, &kOutside,       &kOnMailbox,
                                         &kSharedInputs,   &kSharedOutputs, &kLatchOff};
constexpr const NoteKind* kNotes[] = {&kInputsChange, &kTypesSwapped};

constexpr Word kOutputs{"outputs", "outputs", true};
constexpr Word kInputs{"inputs", "inputs", true};

constexpr Word kWrites{"writes", "writes"};
constexpr Word kReads{"reads", "reads"};

constexpr RuleInfo kInfo{.id = "fmmu-mismatch",
                         .group = "Sync managers and FMMUs",
                         .severity = Severity::kError,
                         .title = "An FMMU does not fit its sync manager or the FMMU of another slave",
                         .needs = "the settings of FMMUs and sync managers; for two slaves also that both give inputs",
                         .source = "ESC-1, FMMU; ETG1000.4, FMMUs",
                         .kinds = kKinds,
                         .notes = kNotes,
                         .doc = R"(
## What it checks
Each active FMMU of a slave that reaches SAFEOP or OP: every byte that it maps must be in an enabled sync manager, of
inputs for an FMMU that reads, of outputs for one that writes.

Also whether FMMUs of two slaves cover the same bits of the logical process image: read FMMUs, so that both slaves write
them into the same frame, or write FMMUs, so that both take the same outputs.

Latch times (0x09B0 to 0x09CF) that an FMMU reads stand still, and the unit for SYNC and latch signals is off (0x0981).

## Why it matters
Bytes outside a sync manager have no buffers: values are torn, outputs never reach the application, inputs stay old. If
two slaves write the same bits, the last one on the bus wins, and the inputs of the other are lost. A slave that takes a
part of the outputs of another one follows commands that are not its own.

## How it is decided
The settings at the time when the slave shows the state count. A slave that refuses it is evaluated by the sync manager
rules.

- An FMMU on mailbox memory (SM0 or SM1 in mailbox mode) is reported as such if it does not fit the sync manager, or if
  no active FMMU maps the process data of its direction. A master may map the mailbox besides the process data.
- If no sync manager is enabled at all, and inputs that the FMMU reads change, the slave writes them all the same: an
  info.
- FMMUs of registers (below 0x1000 and outside every sync manager: the mailbox state 0x080D) are normal.
- Latch times count from OP on. The finding needs 8 changes of the other inputs that the same datagram reads. One change
  of a latch time shows that the slave captures.
- Inputs and outputs of one slave at the same logical address are normal.
- Write FMMUs of two slaves on the same bits are a warning if each has bits that the other has not. If one range
  contains the other, both slaves may receive one command in common: an info.
- Two slaves count when a logical access covers the bits while both are in SAFEOP or OP, with no request in flight.

## Example
samples/captures/fmmus-overlap.pcapng

## What to do
Give the FMMU start and length of its sync manager, and each slave its own place in the process image.
)"};

class FmmuMismatch final : public Rule {
 public:
  FmmuMismatch() : Rule(kInfo) {
    Subscribe<model::AlAnswered>(&FmmuMismatch::On);
    Subscribe<track::LogicalAccess>(&FmmuMismatch::On);
    Subscribe<track::CaptureGap>(&FmmuMismatch::On);
  }

  void On(const model::AlAnswered& e) {
    WatchLatch(e);
    const auto state = static_cast<esc::AlState>(e.request.control.state());
    if (e.outcome == model::AlAnswered::Outcome::kRefused) return;
    if (state != esc::AlState::SAFEOP && state != esc::AlState::OP) return;
    const track::SlaveState& slave = context().network().state(e.slave);
    auto [evaluated, first] = evaluated_.emplace(e.slave, slave.mapping_version);
    if (!first && evaluated->second == slave.mapping_version) return;
    evaluated->second = slave.mapping_version;
    SyncManagers managers;
    for (std::size_t n = 0; n < managers.size(); ++n) managers[n] = SyncManagerOf(slave, n);
    for (std::size_t n = 0; n < esc::kMaxFmmus; ++n) {
      const auto fmmu = slave.fmmu(n, Certainty::kInferred);
      if (fmmu && fmmu->active() && fmmu->bit_count() != 0) EvaluatePlace(e, n, *fmmu, managers);
    }
  }

  void On(const track::LogicalAccess& e) {
    if (e.assumed || !e.returned.seen() || e.wkc == 0) return;
    if (!latches_.empty() && e.command != wire::Command::LWR) WatchLatchTimes(e);
    const track::Network& network = context().network();
    if (version_ != network.mapping_version()) FindShared(e);
    if (e.command != wire::Command::LWR) {
      for (Unmanaged& inputs : unmanaged_) WatchChange(e, inputs);
    }
    for (Shared& shared : shared_) {
      if (e.command == (shared.outputs ? wire::Command::LRD : wire::Command::LWR)) continue;
      if (!shared.reported && Covers(e, shared.bits) && Gives(shared.a.slave) && Gives(shared.b.slave)) {
        ReportShared(e, shared);
      }
    }
  }

  void On(const track::CaptureGap& e) {
    if (e.certain) last_certain_gap_ = e.frame.number;
  }

  void Finish() override { NotEvaluableWithoutReturns(); }

 private:
  using SyncManagers = std::array<std::optional<KnownSyncManager>, esc::kMaxSyncManagers>;
  static constexpr std::uint32_t kRegistersEnd = 0x1000;
  static constexpr std::uint32_t kMemoryEnd = 0x20000;  ///< after everything that an FMMU can map
  static constexpr std::size_t kMaxShared = 64;

  struct Mapped {
    SlaveId slave = kNoSlave;
    std::size_t number = 0;
    esc::Fmmu fmmu;
  };
  struct Shared {
    Mapped a, b;
    esc::BitRange bits;
    bool outputs = false;  ///< of both; else inputs
    bool reported = false;
  };

  static constexpr EscAddress kLatchTimesEnd = 0x09D0;
  static constexpr std::size_t kMaxLatches = 64;
  static constexpr std::uint64_t kLatchKey = 1;    ///< no other key is so low
  static constexpr std::uint16_t kMaxOthers = 64;  ///< bytes
  static constexpr unsigned kChangesNeeded = 8;    ///< of other inputs: some edges may be of a channel without latch

  /// Where the inputs of a slave lie in the process data.
  struct Place {
    std::uint32_t logical = 0;
    std::uint16_t bytes = 0;
  };
  /// Latch times of a slave in OP, and its other inputs.
  struct Latch {
    SlaveId slave = kNoSlave;
    FrameRef since;
    track::KnownFmmus::Unit unit;
    Place others;
    std::vector<std::uint8_t> times, other;  ///< empty: not read yet
    unsigned changes = 0;                    ///< of the other inputs
    bool done = false;
  };

  /// The slave is in OP: does an FMMU read its latch times while 0x0981 is off?
  void WatchLatch(const model::AlAnswered& e) {
    std::erase_if(latches_, [&](const Latch& latch) { return latch.slave == e.slave; });
    const bool reached = e.outcome != model::AlAnswered::Outcome::kRefused &&
                         e.request.control.state() == static_cast<std::uint8_t>(esc::AlState::OP);
    const sync::DcUnit& unit = context().sync().dc(e.slave);
    if (!reached || !unit.activation() || unit.activation()->active() || latches_.size() >= kMaxLatches) return;
    const auto& fmmus = context().network().fmmus(e.slave).active;
    const auto reads_times = [](const track::KnownFmmus::Unit& u) {
      return u.fmmu.reads() && u.fmmu.byte_aligned() && u.fmmu.physical_start >= esc::kLatchTimes &&
             u.fmmu.physical_end() <= kLatchTimesEnd;
    };
    const auto reads_memory = [](const track::KnownFmmus::Unit& u) {
      return u.fmmu.reads() && u.fmmu.physical_start >= kRegistersEnd;
    };
    const auto times = std::ranges::find_if(fmmus, reads_times);
    const auto others = std::ranges::find_if(fmmus, reads_memory);
    if (times == fmmus.end() || others == fmmus.end()) return;
    latches_.push_back({.slave = e.slave,
                        .since = e.frame,
                        .unit = *times,
                        .others = {others->fmmu.logical_start, std::min(others->fmmu.length, kMaxOthers)},
                        .times = {},
                        .other = {}});
  }

  /// Empty: the access does not read all of it.
  static ByteSpan BytesOf(const track::LogicalAccess& e, const Place& place) {
    if (place.logical < e.address || !ecaudit::Fits(e.returned_data, place.logical - e.address, place.bytes)) return {};
    return e.returned_data.subspan(place.logical - e.address, place.bytes);
  }

  void Compare(const track::LogicalAccess& e, Latch& latch) {
    const ByteSpan times = BytesOf(e, {latch.unit.fmmu.logical_start, latch.unit.fmmu.length});
    const ByteSpan other = BytesOf(e, latch.others);
    if (times.empty() || other.empty()) return;
    if (latch.times.empty()) {
      latch.times.assign(times.begin(), times.end());
      latch.other.assign(other.begin(), other.end());
      return;
    }
    const sync::DcUnit& unit = context().sync().dc(latch.slave);
    const bool off = unit.activation() && !unit.activation()->active();
    latch.done = !off || !std::ranges::equal(times, latch.times);
    if (latch.done || std::ranges::equal(other, latch.other)) return;
    latch.other.assign(other.begin(), other.end());
    if (++latch.changes < kChangesNeeded) return;
    latch.done = true;
    if (Repeat(latch.slave, kLatchKey, e.returned) != kNoFinding) return;
    const esc::Fmmu& fmmu = latch.unit.fmmu;
    Finding finding = Found(kLatchOff, latch.slave, latch.since);
    finding.confidence = Confidence::kInferred;
    finding.Set("fmmu", arg::Number(latch.unit.number))
        .Set("first", arg::Hex(fmmu.physical_start))
        .Set("last", arg::Hex(static_cast<std::uint32_t>(fmmu.physical_end() - 1)))
        .Set("changes", arg::Count(latch.changes, "time"))
        .Set("change_frame", arg::Frame(e.returned.number))
        .Set("activation", arg::Hex(unit.activation()->raw, 2));
    if (unit.activation_changed() != 0) finding.Set("write_frame", arg::Frame(unit.activation_changed()));
    AddRelated(finding, e.returned.number);
    Report(kLatchKey, Severity::kWarning, std::move(finding));
  }

  void WatchLatchTimes(const track::LogicalAccess& e) {
    for (Latch& latch : latches_) Compare(e, latch);
    std::erase_if(latches_, [](const Latch& latch) { return latch.done; });
  }

  /// Inputs of a slave without an enabled sync manager: whether their values change.
  struct Unmanaged {
    FindingIndex finding = kNoFinding;
    std::uint32_t logical = 0;
    std::uint16_t length = 0;
    std::optional<std::uint64_t> first;  ///< of the first bytes
  };

  void WatchChange(const track::LogicalAccess& e, Unmanaged& inputs) {
    if (inputs.finding == kNoFinding || e.address > inputs.logical) return;
    const std::size_t at = inputs.logical - e.address;
    if (!ecaudit::Fits(e.returned_data, at, inputs.length)) return;
    const auto value = [&](ByteSpan data) {
      std::uint64_t number = 0;
      for (std::size_t i = 0; i < std::min<std::size_t>(inputs.length, sizeof number); ++i) {
        number = number << 8U | data[at + i];
      }
      return number;
    };
    const std::uint64_t now = value(e.returned_data);
    // What the master sent there remains if no slave writes it.
    const bool sent_so =
        e.command == wire::Command::LRW && ecaudit::Fits(e.sent_data, at, inputs.length) && value(e.sent_data) == now;
    if (sent_so) return;
    if (!inputs.first) inputs.first = now;
    if (*inputs.first == now) return;
    Finding& finding = context().store[inputs.finding];
    finding.Add(kInputsChange, {{"change_frame", arg::Frame(e.returned.number)}});
    AddRelated(finding, e.returned.number);
    context().store.Regrade(inputs.finding, Severity::kInfo);
    inputs.finding = kNoFinding;
  }

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
  /// SM0 or SM1 in mailbox mode whose memory the FMMU maps. A slave without higher sync managers may use them for
  /// process data.
  static std::optional<std::size_t> MailboxOf(const esc::Fmmu& fmmu, const SyncManagers& managers) {
    const bool others = std::any_of(managers.begin() + 2, managers.end(), [](const auto& manager) {
      return manager && manager->settings.enabled() && manager->settings.length != 0;
    });
    for (std::size_t n = 0; others && n < 2; ++n) {
      if (!managers[n] || !managers[n]->settings.enabled() || !managers[n]->settings.mailbox()) continue;
      if (Touches(fmmu, managers[n]->settings)) return n;
    }
    return std::nullopt;
  }
  static bool Touches(const esc::Fmmu& fmmu, const esc::SyncManager& sm) {
    return fmmu.physical_start < sm.end() && fmmu.physical_end() > sm.start;
  }
  /// The first sync manager of process data in the direction of the FMMU that no active FMMU maps.
  static std::optional<std::size_t> UnmappedOf(const esc::Fmmu& fmmu, const SyncManagers& managers,
                                               const track::KnownFmmus& fmmus) {
    for (std::size_t n = 2; n < managers.size(); ++n) {
      if (!managers[n] || !managers[n]->settings.enabled() || managers[n]->settings.length == 0) continue;
      const esc::SyncManager& sm = managers[n]->settings;
      if (fmmu.writes() ? !sm.ecat_writes() : !sm.ecat_reads()) continue;
      const bool mapped = std::ranges::any_of(fmmus.active, [&](const auto& other) {
        return Touches(other.fmmu, sm) && (fmmu.writes() ? other.fmmu.writes() : other.fmmu.reads());
      });
      if (!mapped) return n;
    }
    return std::nullopt;
  }
  static bool Fits(const esc::SyncManager& sm, const esc::Fmmu& fmmu) {
    if (fmmu.reads() && fmmu.writes()) return true;
    return fmmu.writes() ? sm.ecat_writes() : sm.ecat_reads();
  }

  void EvaluatePlace(const model::AlAnswered& e, std::size_t n, const esc::Fmmu& fmmu, const SyncManagers& managers) {
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
    const std::optional<std::size_t> mailbox = MailboxOf(fmmu, managers);
    const track::KnownFmmus& fmmus = context().network().fmmus(e.slave);
    const std::optional<std::size_t> unmapped = mailbox ? UnmappedOf(fmmu, managers, fmmus) : std::nullopt;
    if (!outside && !against && unmapped) {
      if (!fmmus.all) return NotEvaluable(e.slave, ReasonCode::kNotInCapture, what::kFmmus, e.frame.number);
      against = mailbox;
    }
    if (!outside && !against) return;
    // The FMMU may map one whose settings are not in the capture.
    const bool all_known =
        std::all_of(managers.begin(), managers.begin() + 4, [](const auto& m) { return m.has_value(); });
    if (!against && NeedsNoManager(e.slave, fmmu)) return;
    FrameNo learned = context().network().state(e.slave).fmmu_since[n];
    if (against) {
      // Only these two matter, and a master that waits for the answer of the slave writes nothing in between.
      learned = std::min(learned, managers[*against]->since);
    } else {
      for (const auto& manager : managers) {
        if (manager) learned = std::min(learned, manager->since);
      }
    }
    const bool likely_whole = against && !MissesPackets(context().pairing());
    const bool misses =
        likely_whole ? last_certain_gap_ > learned : context().network().MissesBetween(learned, e.frame.number);
    if (misses) return NotEvaluable(e.slave, ReasonCode::kCaptureGap, what::kSyncManagersAndFmmus, e.frame.number);
    if (!against && !all_known) {
      NotEvaluable(e.slave, ReasonCode::kNotInCapture, what::kSyncManagers, e.frame.number);
      return;
    }
    const std::uint64_t key = std::uint64_t{fmmu.physical_start} << 40U | std::uint64_t{fmmu.length} << 24U |
                              std::uint64_t{fmmu.type} << 16U | (against ? 0x80U : 0U) | n;
    if (Repeat(e.slave, key, e.frame) != kNoFinding) return;
    Finding finding = mailbox && (!against || against == mailbox)
                          ? DescribeMailbox(e, n, fmmu, {*mailbox, unmapped}, managers)
                          : DescribePlace(e, n, fmmu, outside, against, managers);
    // The master may have set them in a silence, or where its numbers skip.
    if (!likely_whole && context().network().MayMissBetween(learned, e.frame.number)) {
      finding.confidence = Confidence::kInferred;
    }
    const bool any_enabled = finding.arguments.Has("enabled");
    const FindingIndex index = Report(key, std::move(finding));
    const bool whole_bytes = fmmu.logical_start_bit == 0 && fmmu.physical_start_bit == 0;
    if (index != kNoFinding && outside && !against && !any_enabled && fmmu.reads() && whole_bytes &&
        unmanaged_.size() < kMaxShared) {
      unmanaged_.push_back({index, fmmu.logical_start, fmmu.length, {}});
    }
  }

  /// By the EEPROM some process data need no sync manager: it is virtual, or switched off from the start.
  [[nodiscard]] bool NeedsNoManager(SlaveId slave, const esc::Fmmu& fmmu) const {
    constexpr std::uint8_t kEnable = 0x01, kVirtual = 0x04;
    constexpr std::uint8_t kProcessOut = 3, kProcessIn = 4;  // types
    const auto sii = esc::ParseSii(context().network().state(slave).sii.image());
    return std::ranges::any_of(sii.sync_managers, [&](const esc::SiiSyncManager& sm) {
      const bool off = (sm.enable & kEnable) == 0 && sm.start == fmmu.physical_start &&
                       sm.type == (fmmu.writes() ? kProcessOut : kProcessIn);
      return (sm.enable & kVirtual) != 0 || off;
    });
  }

  Finding DescribePlace(const model::AlAnswered& e, std::size_t n, const esc::Fmmu& fmmu,
                        std::optional<std::uint32_t> outside, std::optional<std::size_t> against,
                        const SyncManagers& managers) const {
    const FrameNo since = context().network().state(e.slave).fmmu_since[n];
    Finding finding = Found(against ? kWrongDirection : kOutside, e.slave, e.frame);
    finding.Set("state", arg::State(e.request.control.state()))
        .Set("fmmu", arg::Number(static_cast<std::int64_t>(n)))
        .Set("fmmu_frame", arg::Frame(since))
        .Set("way", arg::Of(fmmu.writes() ? kWrites : kReads))
        .Set("physical_start", arg::Hex(fmmu.physical_start))
        .Set("physical_end", arg::Hex(fmmu.physical_end() - 1))
        .Set("length", arg::Number(fmmu.length))
        .Set("type", arg::Number(fmmu.type));
    AddRelated(finding, since);
    if (against) {
      const KnownSyncManager& manager = *managers[*against];
      const bool writes = manager.settings.ecat_writes();
      finding.Set("sync_manager", arg::Number(static_cast<std::int64_t>(*against)))
          .Set("sync_manager_frame", arg::Frame(manager.since))
          .Set("manager_way", arg::Of(writes ? kWrites : kReads))
          .Set("right_type", writes ? arg::Number(2, "write") : arg::Number(1, "read"));
      AddRelated(finding, manager.since);
      AddTypesSwapped(finding, e.slave, static_cast<std::uint8_t>(*against), writes);
    } else {
      finding.Set("first_outside", arg::Hex(*outside));
      std::vector<Value> enabled;
      for (std::size_t m = 0; m < managers.size(); ++m) {
        if (!managers[m] || !managers[m]->settings.enabled() || managers[m]->settings.length == 0) continue;
        const esc::SyncManager& sm = managers[m]->settings;
        enabled.push_back(arg::Text("SM" + std::to_string(m) + " " + Hex(sm.start) + "-" + Hex(sm.end() - 1)));
      }
      if (!enabled.empty()) finding.Set("enabled", arg::List(std::move(enabled)));
    }
    return finding;
  }

  struct OnMailbox {
    std::size_t mailbox = 0;
    std::optional<std::size_t> unmapped;  ///< process data of the same direction without an FMMU
  };

  Finding DescribeMailbox(const model::AlAnswered& e, std::size_t n, const esc::Fmmu& fmmu, const OnMailbox& on,
                          const SyncManagers& managers) const {
    const FrameNo since = context().network().state(e.slave).fmmu_since[n];
    const KnownSyncManager& mailbox = *managers[on.mailbox];
    Finding finding = Found(kOnMailbox, e.slave, e.frame);
    finding.Set("state", arg::State(e.request.control.state()))
        .Set("fmmu", arg::Number(static_cast<std::int64_t>(n)))
        .Set("fmmu_frame", arg::Frame(since))
        .Set("way", arg::Of(fmmu.writes() ? kWrites : kReads))
        .Set("direction", arg::Of(fmmu.writes() ? kOutputs : kInputs))
        .Set("physical_start", arg::Hex(fmmu.physical_start))
        .Set("physical_end", arg::Hex(fmmu.physical_end() - 1))
        .Set("length", arg::Number(fmmu.length))
        .Set("type", arg::Number(fmmu.type))
        .Set("sync_manager", arg::Number(static_cast<std::int64_t>(on.mailbox)))
        .Set("sync_manager_frame", arg::Frame(mailbox.since))
        .Set("mailbox_start", arg::Hex(mailbox.settings.start))
        .Set("mailbox_end", arg::Hex(mailbox.settings.end() - 1));
    AddRelated(finding, since);
    AddRelated(finding, mailbox.since);
    if (on.unmapped) {
      const KnownSyncManager& process = *managers[*on.unmapped];
      finding.Set("process_manager", arg::Number(static_cast<std::int64_t>(*on.unmapped)))
          .Set("process_start", arg::Hex(process.settings.start))
          .Set("process_end", arg::Hex(process.settings.end() - 1));
      AddRelated(finding, process.since);
    }
    return finding;
  }

  /// 1C00h lists the types of the sync managers in another order than they are used.
  void AddTypesSwapped(Finding& finding, SlaveId slave, std::uint8_t manager, bool writes) const {
    constexpr std::uint16_t kTypes = 0x1C00;
    constexpr std::uint8_t kProcessOut = 3, kProcessIn = 4;
    const auto subindex = static_cast<std::uint8_t>(manager + 1);
    const model::ObjectValue* type = context().slave(slave).objects.Find(kTypes, subindex);
    if (type == nullptr || type->raw != (writes ? kProcessIn : kProcessOut)) return;
    const auto sii = esc::ParseSii(context().network().state(slave).sii.image());
    const bool by_eeprom =
        manager < sii.sync_managers.size() && sii.sync_managers[manager].type == (writes ? kProcessOut : kProcessIn);
    finding.Add(kTypesSwapped, {{"object", arg::Object(kTypes, subindex)},
                                {"sync_manager", arg::Number(manager)},
                                {"stated", arg::Of(writes ? kInputs : kOutputs)},
                                {"used", arg::Of(writes ? kOutputs : kInputs)},
                                {"by_eeprom", arg::Flag(by_eeprom)},
                                {"read_frame", arg::Frame(type->since)}});
  }

  /// Updates mapped_ for slaves that changed.
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
        const bool takes_part = fmmu.reads() || fmmu.writes();
        if (takes_part && process_memory && fmmu.bit_count() != 0) fresh.push_back({id, number, fmmu});
      }
    }
    version_ = network.mapping_version();
    std::erase_if(mapped_, [&](const Mapped& m) { return again[m.slave]; });
    const auto by_place = [](const Mapped& a, const Mapped& b) {
      return std::tuple(a.fmmu.logical_bits().first, a.slave, a.number) <
             std::tuple(b.fmmu.logical_bits().first, b.slave, b.number);
    };
    std::ranges::sort(fresh, by_place);
    const auto middle = static_cast<std::ptrdiff_t>(mapped_.size());
    mapped_.insert(mapped_.end(), fresh.begin(), fresh.end());
    std::inplace_merge(mapped_.begin(), mapped_.begin() + middle, mapped_.end(), by_place);
    return known;
  }

  /// Pairs of slaves whose FMMUs of process memory share bits in one direction.
  void FindShared(const track::LogicalAccess& e) {
    const std::vector<Shared> before = std::move(shared_);
    shared_.clear();
    if (!ReadMapped()) NotEvaluable(kNoSlave, ReasonCode::kNotInCapture, what::kFmmusOfAll, e.frame().number);
    FindShared(before, false);
    FindShared(before, true);
  }
  void FindShared(const std::vector<Shared>& before, bool outputs) {
    const std::vector<Mapped>& all = mapped_;
    const std::size_t most = shared_.size() + kMaxShared;
    for (std::size_t i = 0; i < all.size(); ++i) {
      if (HasOutputs(all[i]) != outputs) continue;
      for (std::size_t k = i + 1; k < all.size() && shared_.size() < most; ++k) {
        if (all[k].fmmu.logical_bits().first >= all[i].fmmu.logical_bits().end()) break;
        if (all[k].slave == all[i].slave || HasOutputs(all[k]) != outputs) continue;
        // The one that was set later overlaps the other.
        const bool in_order = Since(all[i]) <= Since(all[k]);
        Shared shared{all[in_order ? i : k], all[in_order ? k : i],
                      esc::Intersect(all[i].fmmu.logical_bits(), all[k].fmmu.logical_bits()), outputs};
        shared.reported = std::ranges::any_of(before, [&](const Shared& old) {
          return old.reported && old.a.slave == shared.a.slave && old.b.slave == shared.b.slave &&
                 old.bits == shared.bits && old.outputs == outputs;
        });
        shared_.push_back(shared);
      }
    }
  }

  /// What it gives back as well counts as inputs.
  static bool HasOutputs(const Mapped& m) { return !m.fmmu.reads(); }
  /// Each of both has bits that the other has not.
  static bool Cross(const Shared& shared) {
    return shared.bits != shared.a.fmmu.logical_bits() && shared.bits != shared.b.fmmu.logical_bits();
  }

  /// Frame that set it.
  [[nodiscard]] FrameNo Since(const Mapped& m) const { return context().network().state(m.slave).fmmu_since[m.number]; }

  void ReportShared(const track::LogicalAccess& e, Shared& shared) {
    shared.reported = true;
    const std::uint64_t key =
        1ULL << 63U | (shared.outputs ? 1ULL << 62U : 0) | shared.bits.first << 16U | shared.a.slave;
    if (Repeat(shared.b.slave, key, e.frame()) != kNoFinding) return;
    const Mapped& own = shared.b;
    const Mapped& other = shared.a;
    const bool crossing = Cross(shared);
    Finding finding = Found(shared.outputs ? kSharedOutputs : kSharedInputs, own.slave, e.frame());
    if (shared.outputs) finding.Set("crossing", arg::Flag(crossing));
    finding.Set("logical_address", arg::Hex(shared.bits.first / 8, 8))
        .Set("shared_bits", arg::Count(shared.bits.count, "bit"))
        .Set("other_slave", arg::Slave(other.slave, context().Label(other.slave)))
        .Set("other_fmmu", arg::Number(static_cast<std::int64_t>(other.number)))
        .Set("other_length", arg::Count(other.fmmu.length, "byte"))
        .Set("other_start", arg::Hex(other.fmmu.logical_start, 8))
        .Set("other_fmmu_frame", arg::Frame(Since(other)))
        .Set("own_slave", arg::Slave(own.slave, context().Label(own.slave)))
        .Set("fmmu", arg::Number(static_cast<std::int64_t>(own.number)))
        .Set("length", arg::Count(own.fmmu.length, "byte"))
        .Set("start", arg::Hex(own.fmmu.logical_start, 8))
        .Set("fmmu_frame", arg::Frame(Since(own)));
    AddRelated(finding, Since(shared.a));
    AddRelated(finding, Since(shared.b));
    const Severity of_outputs = crossing ? Severity::kWarning : Severity::kInfo;
    Report(key, shared.outputs ? of_outputs : kInfo.severity, std::move(finding));
  }

  static constexpr std::uint32_t kDigitalInputs = 0x0F00;  // below are registers

  FrameNo last_certain_gap_ = 0;
  std::map<SlaveId, std::uint32_t> evaluated_;  // mapping version
  std::optional<std::uint64_t> version_;        ///< of the mapping that mapped_ and shared_ were made from
  std::vector<Mapped> mapped_;                  ///< FMMUs of process data, by their first logical bit
  std::vector<Shared> shared_;
  std::vector<Latch> latches_;
  std::vector<Unmanaged> unmanaged_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<FmmuMismatch>};

}  // namespace
}  // namespace ecaudit::fmmu_mismatch
