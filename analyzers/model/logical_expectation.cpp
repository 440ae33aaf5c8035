#include "analyzers/model/logical_expectation.h"

#include <utility>

#include "analyzers/model/slave_model.h"

namespace ecaudit::model {
namespace {

/// The sync manager that an FMMU leads to, as far as it is known.
std::optional<std::uint8_t> ManagerBehind(const track::KnownFmmus& known, const esc::Fmmu& fmmu) {
  for (std::uint8_t number = 0; number < esc::kMaxSyncManagers; ++number) {
    const auto& manager = known.managers[number];
    if (!manager || manager->length == 0) continue;
    if (fmmu.physical_start >= manager->start && fmmu.physical_start - manager->start < manager->length) return number;
  }
  return std::nullopt;
}

/// An ESC refuses access to the buffer of a sync manager of the other direction (esc-reference 2.2): no slave counts.
bool IsRefused(const track::KnownFmmus& known, std::optional<std::uint8_t> manager, bool write) {
  if (!manager) return false;
  const auto& settings = known.managers[*manager];
  return settings && settings->enabled() && settings->ecat_writes() != write;
}

bool IsOneBuffer(const track::KnownFmmus& known, std::optional<std::uint8_t> manager) {
  return manager && known.managers[*manager]->enabled() && esc::IsOneBuffer(*manager, *known.managers[*manager]);
}

/// The part of one slave; neither inputs nor outputs: none.
LogicalShare ShareOf(SlaveId id, const track::KnownFmmus& known, const LogicalKind& kind) {
  LogicalShare share;
  share.slave = id;
  for (const auto& [number, fmmu] : known.active) {
    const esc::BitRange overlap = fmmu.Overlap(kind.address, kind.length);
    if (overlap.empty()) continue;
    const std::optional<std::uint8_t> manager = ManagerBehind(known, fmmu);
    if (fmmu.reads() && kind.command != wire::Command::LWR && !IsRefused(known, manager, false)) {
      const bool mailbox = manager && esc::IsMailbox(*manager, *known.managers[*manager]);
      if (IsOneBuffer(known, manager)) share.inputs_one_buffer = manager;
      share.mailbox_only = mailbox && (share.mailbox_only || !share.inputs);
      if (!mailbox || share.mailbox_only) share.input_manager = manager;
      share.inputs = true;
      // Registers are mapped, too (the mailbox state): only process memory identifies a slave by its data.
      const std::uint64_t first = (overlap.first + 7) / 8 - kind.address;
      const std::uint64_t end = overlap.end() / 8 - kind.address;
      if (fmmu.physical_start >= 0x0F00 && end > first && end - first > share.input_bytes) {
        share.input_offset = static_cast<std::uint16_t>(first);
        share.input_bytes = static_cast<std::uint16_t>(end - first);
      }
    }
    if (fmmu.writes() && kind.command != wire::Command::LRD && !IsRefused(known, manager, true)) {
      if (IsOneBuffer(known, manager)) share.outputs_one_buffer = manager;
      share.outputs = true;
      share.output_manager = manager;
    }
  }
  return share;
}

/// What follows from all shares.
void SumUp(LogicalExpectation& expectation, wire::Command command) {
  expectation.full = expectation.inputs = expectation.outputs = 0;
  expectation.fills_bytes = false;
  expectation.range_of = 0;
  for (const LogicalShare& share : expectation.shares) {
    if (share.inputs) ++expectation.inputs;
    if (share.outputs) ++expectation.outputs;
    expectation.fills_bytes = expectation.fills_bytes || share.input_bytes != 0;
    expectation.full = static_cast<std::uint16_t>(expectation.full + WorthOf(share, command));
  }
}

}  // namespace

std::uint16_t WorthOf(const LogicalShare& share, wire::Command command) {
  switch (command) {
    case wire::Command::LRD:
      return share.inputs ? 1 : 0;
    case wire::Command::LWR:
      return share.outputs ? 1 : 0;
    default:
      return static_cast<std::uint16_t>((share.inputs ? 1 : 0) + (share.outputs ? 2 : 0));
  }
}

const LogicalExpectation& LogicalExpectations::Look(const track::Network& network, const LogicalKind& kind) {
  Entry* entry = entries_.Find(kind);
  if (entry == nullptr) {
    entry = &entries_.Take(kind);
    entry->version = 0;
    entry->expectation.shares.clear();
    MakeRoom(*entry);
  }
  if (entry->version == 0 || entry->version != network.mapping_version()) Renew(*entry, network, kind);
  last_kind_ = kind;
  last_ = entry;
  return entry->expectation;
}

void LogicalExpectations::MakeRoom(const Entry& kept) {
  std::size_t shares = 0;
  entries_.ForEachValue([&](const Entry& entry) { shares += entry.expectation.shares.capacity(); });
  if (shares > kMaxShares) entries_.KeepOnly(kept);
}

void LogicalExpectations::Renew(Entry& entry, const track::Network& network, const LogicalKind& kind) {
  LogicalExpectation& expectation = entry.expectation;
  const std::uint16_t* count = network.slave_count().if_known();
  const bool all_met = count != nullptr && *count <= network.slaves().size();
  const bool all_count = all_met || (count != nullptr && network.unmet_map_nothing());
  expectation.mapping_known = expectation.complete = network.slaves().size() > 0 && all_count;
  std::vector<LogicalShare> shares;  // by slave, as those before
  auto before = expectation.shares.cbegin();
  for (std::size_t s = 0; s < network.slaves().size(); ++s) {
    const auto id = static_cast<SlaveId>(s);
    const bool had_one = before != expectation.shares.cend() && before->slave == id;
    const LogicalShare* kept = had_one ? &*before++ : nullptr;
    if (network.slaves()[id].replaced) continue;
    const track::KnownFmmus& known = network.fmmus(id);
    if (!known.any && network.state(id).fmmu_count() != 0) expectation.mapping_known = false;
    if (!known.all) expectation.complete = false;
    if (network.mapping_changed(id) <= entry.version) {
      if (kept != nullptr) shares.push_back(*kept);
      continue;
    }
    const LogicalShare share = ShareOf(id, known, kind);
    if (share.inputs || share.outputs) shares.push_back(share);
    work_ += known.active.size() + 1;
  }
  work_ += network.slaves().size() / kLooksPerSlave;
  expectation.shares = std::move(shares);
  entry.version = network.mapping_version();
  SumUp(expectation, kind.command);
}

CounterRange RangeOf(const LogicalExpectation& expectation, wire::Command command,
                     const std::deque<SlaveModel>& slaves) {
  CounterRange range;
  for (const LogicalShare& share : expectation.shares) {
    const std::uint16_t worth = WorthOf(share, command);
    range.most = static_cast<std::uint16_t>(range.most + worth);
    if (!slaves[share.slave].al.SettledIn(esc::AlState::OP)) continue;
    LogicalShare certain = share;
    certain.inputs = share.inputs && !share.mailbox_only && !share.inputs_one_buffer;
    certain.outputs = share.outputs && !share.outputs_one_buffer;
    range.least = static_cast<std::uint16_t>(range.least + WorthOf(certain, command));
  }
  return range;
}

}  // namespace ecaudit::model
