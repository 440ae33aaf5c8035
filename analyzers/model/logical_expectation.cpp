#include "analyzers/model/logical_expectation.h"

#include "analyzers/model/slave_model.h"
#include "decoder/base/wrapping.h"

namespace ecaudit::model {
namespace {

/// FMMUs that an ESC has: register 0x0004 where it was read, else all sixteen (writes to missing ones do not stick, but
/// masters that blank them write zeros, which map nothing).
std::size_t FmmuCount(const track::SlaveState& state) {
  const auto count = state.registers.Value<std::uint8_t>(0x0004);
  return count && *count <= esc::kMaxFmmus ? *count : esc::kMaxFmmus;
}

/// The sync manager that an FMMU leads to, as far as it is known.
std::optional<std::uint8_t> ManagerBehind(const track::SlaveState& state, const esc::Fmmu& fmmu) {
  for (std::uint8_t number = 0; number < esc::kMaxSyncManagers; ++number) {
    const auto manager = state.sync_manager(number, Certainty::kInferred);
    if (!manager || manager->length == 0) continue;
    if (fmmu.physical_start >= manager->start && fmmu.physical_start - manager->start < manager->length) return number;
  }
  return std::nullopt;
}

/// An ESC refuses access to the buffer of a sync manager of the other direction (esc-reference 2.2): nobody counts.
bool IsRefused(const track::SlaveState& state, std::optional<std::uint8_t> manager, bool write) {
  if (!manager) return false;
  const auto settings = state.sync_manager(*manager, Certainty::kInferred);
  return settings && settings->enabled() && settings->ecat_writes() != write;
}

LogicalExpectation Compute(const track::Network& network, wire::Command command, std::uint32_t address,
                           std::uint16_t length) {
  LogicalExpectation result;
  result.mapping_known = network.slaves().size() > 0;
  const std::uint16_t* count = network.slave_count().if_known();
  if (count == nullptr || *count > network.slaves().size()) result.mapping_known = false;
  for (std::size_t s = 0; s < network.slaves().size(); ++s) {
    const auto id = static_cast<SlaveId>(s);
    if (network.slaves()[id].replaced) continue;
    const track::KnownFmmus& fmmus = network.fmmus(id);
    // The FMMUs that were never touched since the capture began could map something; a master that configures
    // a slave clears them first or uses them from 0 on.
    if (!fmmus.any && FmmuCount(network.state(id)) != 0) result.mapping_known = false;
    LogicalShare share;
    share.slave = id;
    const track::SlaveState& state = network.state(id);
    for (const auto& [number, fmmu] : fmmus.active) {
      const esc::BitRange overlap = fmmu.Overlap(address, length);
      if (overlap.empty()) continue;
      const std::optional<std::uint8_t> manager = ManagerBehind(state, fmmu);
      if (fmmu.reads() && command != wire::Command::LWR && !IsRefused(state, manager, false)) {
        const bool mailbox = manager && state.sync_manager(*manager, Certainty::kInferred)->mailbox();
        share.mailbox_only = mailbox && (share.mailbox_only || !share.inputs);
        if (!mailbox || share.mailbox_only) share.input_manager = manager;
        share.inputs = true;
        // Registers are mapped, too (the mailbox state): only process memory tells a slave by its data.
        const std::uint64_t first = (overlap.first + 7) / 8 - address;
        const std::uint64_t end = overlap.end() / 8 - address;
        if (fmmu.physical_start >= 0x0F00 && end > first && end - first > share.input_bytes) {
          share.input_offset = static_cast<std::uint16_t>(first);
          share.input_bytes = static_cast<std::uint16_t>(end - first);
        }
      }
      if (fmmu.writes() && command != wire::Command::LRD && !IsRefused(state, manager, true)) {
        share.outputs = true;
        share.output_manager = manager;
      }
    }
    if (!share.inputs && !share.outputs) continue;
    result.shares.push_back(share);
    if (share.inputs) ++result.inputs;
    result.fills_bytes = result.fills_bytes || share.input_bytes != 0;
    if (share.outputs) ++result.outputs;
    result.full = static_cast<std::uint16_t>(result.full + WorthOf(share, command));
  }
  return result;
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

const LogicalExpectation& LogicalExpectations::Look(const track::Network& network, wire::Command command,
                                                    std::uint32_t address, std::uint16_t length) {
  if (version_ != network.mapping_version()) {
    for (Entry& entry : entries_) entry.used = false;
    version_ = network.mapping_version();
  }
  const std::size_t hash =
      (WrappingProduct(address, 2654435761U) >> 16U) + length * 7U + static_cast<std::size_t>(command);
  Entry& entry = entries_[hash % kEntries];
  if (!entry.used || entry.command != command || entry.address != address || entry.length != length) {
    entry.expectation = Compute(network, command, address, length);
    entry.command = command;
    entry.address = address;
    entry.length = length;
    entry.used = true;
  }
  last_ = &entry;
  return entry.expectation;
}

CounterRange RangeOf(const LogicalExpectation& expectation, wire::Command command,
                     const std::deque<SlaveModel>& slaves) {
  CounterRange range;
  for (const LogicalShare& share : expectation.shares) {
    const std::uint16_t worth = WorthOf(share, command);
    range.most = static_cast<std::uint16_t>(range.most + worth);
    if (!slaves[share.slave].al.SettledIn(esc::AlState::OP)) continue;
    LogicalShare certain = share;
    certain.inputs = share.inputs && !share.mailbox_only;
    range.least = static_cast<std::uint16_t>(range.least + WorthOf(certain, command));
  }
  return range;
}

}  // namespace ecaudit::model
