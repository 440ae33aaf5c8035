#include "analyzers/judge/exchange_watch.h"

#include <algorithm>
#include <utility>

#include "decoder/base/time.h"
#include "decoder/esc/sync_manager.h"

namespace ecaudit {
namespace {

constexpr std::uint32_t kProcessMemory = 0x0F00;  // lower addresses are registers
/// A slow task exchanges its process data more often.
constexpr TimeNs kLong = 500'000'000;

bool MapsMailbox(const track::KnownFmmus& known, const esc::Fmmu& fmmu) {
  for (std::size_t n = 0; n < esc::kMaxSyncManagers; ++n) {
    const auto& manager = known.managers[n];
    if (manager && esc::IsMailbox(n, *manager) && manager->Touches(fmmu.physical_start, fmmu.length)) return true;
  }
  return false;
}

}  // namespace

void ExchangeWatch::FindMapped(const track::LogicalAccess& access, const track::Network& network) {
  version_ = network.mapping_version();
  mapped_since_ = access.frame();
  known_ = {};
  const std::vector<Mapped> before = std::exchange(mapped_, {});
  for (std::size_t s = 0; s < network.slaves().size(); ++s) {
    const auto id = static_cast<SlaveId>(s);
    if (network.slaves()[id].replaced) continue;
    const track::KnownFmmus& known = network.fmmus(id);
    for (const auto& [number, fmmu] : known.active) {
      if (fmmu.bit_count() == 0 || fmmu.physical_start < kProcessMemory) continue;
      if ((!fmmu.reads() && !fmmu.writes()) || MapsMailbox(known, fmmu)) continue;
      const esc::BitRange bits = fmmu.logical_bits();
      Mapped& now = mapped_.emplace_back(Mapped{id, fmmu.writes(), bits.first / 8, (bits.end() + 7) / 8,
                                                MemoryRange::Of(fmmu.physical_start, fmmu.length),
                                                network.state(id).fmmu_since[number], false});
      // That the FMMUs of another slave changed does not undo what was exchanged.
      const auto first = std::ranges::lower_bound(before, id, {}, &Mapped::slave);
      const auto end = std::ranges::upper_bound(before, id, {}, &Mapped::slave);
      now.touched = std::any_of(first, end, [&](const Mapped& m) {
        return m.touched && m.outputs == now.outputs && m.begin == now.begin && m.end == now.end && m.set == now.set;
      });
    }
  }
}

void ExchangeWatch::Mark(const track::LogicalAccess& access) {
  const std::uint64_t begin = access.address;
  const std::uint64_t end = begin + access.length;
  for (Mapped& m : mapped_) {
    const bool carried = m.outputs ? access.command != wire::Command::LRD : access.command != wire::Command::LWR;
    m.touched = m.touched || (carried && begin < m.end && end > m.begin);
  }
}

void ExchangeWatch::On(const track::SlaveAccess& access) {
  for (Mapped& m : mapped_) m.touched = m.touched || (m.slave == access.slave && m.memory.Meets(access.range()));
}

void ExchangeWatch::EnteredOp(SlaveId slave, const FrameRef& frame) {
  if (slave >= op_since_.size()) op_since_.resize(std::size_t{slave} + 1);
  op_since_[slave] = frame;
}

std::optional<Unexchanged> ExchangeWatch::Leaves(SlaveId slave) {
  if (slave >= op_since_.size() || !op_since_[slave].seen()) return std::nullopt;
  Unexchanged found;
  const FrameRef in_op = op_since_[slave];
  op_since_[slave] = {};
  found.since = in_op.number > mapped_since_.number ? in_op : mapped_since_;
  found.until = last_;
  if (!found.since.has_time || !found.until.has_time || found.until.number <= found.since.number) return std::nullopt;
  if (Elapsed(found.since.time, found.until.time) < kLong) return std::nullopt;
  for (const Mapped& m : mapped_) {
    if (m.slave != slave || m.touched) continue;
    const bool first = found.output_bytes + found.input_bytes == 0;
    found.address = first ? m.begin : std::min(found.address, m.begin);
    (m.outputs ? found.output_bytes : found.input_bytes) += m.end - m.begin;
    found.mapped = std::max(found.mapped, m.set);
  }
  return found.output_bytes + found.input_bytes > 0 ? std::optional(found) : std::nullopt;
}

}  // namespace ecaudit
