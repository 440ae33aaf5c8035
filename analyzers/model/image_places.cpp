#include "analyzers/model/image_places.h"

#include <algorithm>
#include <optional>
#include <string>

#include "decoder/base/text.h"
#include "decoder/esc/fmmu.h"

namespace ecaudit::model {
namespace {

using device::PdoDirection;

constexpr EscAddress kFirstDataAddress = 0x0F00;  // below are registers; 0x0F00 digital outputs, 0x1000 process memory
constexpr std::size_t kMaxPieces = 256;           // of one slave in an ENI; a slave has at most as many sync managers

bool InMailbox(const track::KnownFmmus& known, const esc::Fmmu& fmmu) {
  for (std::size_t n = 0; n < known.managers.size(); ++n) {
    const auto& manager = known.managers[n];
    if (manager && manager->enabled() && esc::IsMailbox(n, *manager) &&
        manager->Touches(fmmu.physical_start, fmmu.length)) {
      return true;
    }
  }
  return false;
}

/// First bit of a sync manager's buffer in ESC memory. Where its registers are not known, the lowest address that the
/// FMMUs reach, provided that all signals lie in one buffer.
std::optional<std::uint64_t> BufferStart(const track::KnownFmmus& known, const ProcessLayout& layout, std::uint8_t n,
                                         const std::vector<esc::Fmmu>& fmmus) {
  if (n < known.managers.size() && known.managers[n]) return std::uint64_t{known.managers[n]->start} * 8;
  const bool one_buffer = std::all_of(layout.signals.begin(), layout.signals.end(),
                                      [n](const Signal& signal) { return signal.sync_manager == n; });
  if (!one_buffer || fmmus.empty()) return std::nullopt;
  std::uint64_t lowest = ~std::uint64_t{0};
  for (const esc::Fmmu& fmmu : fmmus) lowest = std::min(lowest, fmmu.physical_bits().first);
  return lowest;
}

/// Bits of a signal that lie one after the other in the logical address space.
struct LogicalPiece {
  std::uint32_t in_signal = 0;
  esc::BitRange logical;
};

/// Where the FMMUs map a signal, in its order; empty unless all of its bits are mapped.
std::vector<LogicalPiece> PiecesOf(const std::vector<esc::Fmmu>& fmmus, std::uint64_t physical, std::uint32_t bits) {
  std::vector<LogicalPiece> pieces;
  for (std::uint32_t done = 0; done < bits;) {
    const std::uint64_t at = physical + done;
    esc::BitRange longest;
    for (const esc::Fmmu& fmmu : fmmus) {
      const auto logical = fmmu.ToLogicalBit(at);
      if (!logical) continue;
      const std::uint64_t count = std::min<std::uint64_t>(bits - done, fmmu.physical_bits().end() - at);
      if (count > longest.count) longest = {*logical, count};
    }
    if (longest.empty()) return {};
    if (!pieces.empty() && pieces.back().logical.end() == longest.first) {
      pieces.back().logical.count += longest.count;
    } else {
      pieces.push_back({done, longest});
    }
    done += static_cast<std::uint32_t>(longest.count);
  }
  return pieces;
}

/// What a datagram has of a signal. Without pieces: nothing.
SplitSignal InDatagram(const std::vector<LogicalPiece>& pieces, const esc::BitRange& datagram, std::uint16_t bits) {
  SplitSignal signal;
  signal.bits = bits;
  std::uint64_t here = 0;
  std::uint64_t end = 0;
  for (const LogicalPiece& piece : pieces) {
    end = std::max(end, piece.logical.end());
    const esc::BitRange common = esc::Intersect(piece.logical, datagram);
    if (common.empty()) continue;
    here += common.count;
    signal.pieces.push_back({static_cast<std::uint32_t>(piece.in_signal + (common.first - piece.logical.first)),
                             static_cast<std::uint32_t>(common.first - datagram.first),
                             static_cast<std::uint32_t>(common.count)});
  }
  if (here == bits) return signal;
  const bool last = end > datagram.first && end <= datagram.end();
  signal.role = last ? SplitSignal::Role::kLast : SplitSignal::Role::kEarlier;
  return signal;
}

ImagePart::Place PlaceOf(const ProcessLayout& layout, std::size_t signal, std::uint64_t bit) {
  const Signal& of = layout.signals[signal];
  return {std::uint32_t{of.index} << 8U | of.subindex, static_cast<std::uint16_t>(signal), of.bits,
          static_cast<std::uint32_t>(bit)};
}

void AddPlace(ImagePart& part, std::size_t signal, std::uint64_t bit) {
  part.places.push_back(PlaceOf(*part.layout, signal, bit));
}

void SumUp(ImagePart& part) {
  std::sort(part.runs.begin(), part.runs.end(),
            [](const BitRun& a, const BitRun& b) { return a.in_buffer < b.in_buffer; });
  for (const BitRun& run : part.runs) part.bits += run.bits;
}

/// Where the FMMUs map memory of the slave into a datagram.
void AddRuns(ImagePart& part, const std::vector<esc::Fmmu>& fmmus, std::uint32_t address, std::uint16_t length) {
  const std::uint64_t datagram = std::uint64_t{address} * 8;
  std::uint64_t lowest = ~std::uint64_t{0};
  for (const esc::Fmmu& fmmu : fmmus) lowest = std::min(lowest, fmmu.physical_bits().first);
  for (const esc::Fmmu& fmmu : fmmus) {
    const esc::BitRange here = fmmu.Overlap(address, length);
    const auto physical = fmmu.ToPhysicalBit(here.first);
    if (here.empty() || !physical) continue;
    part.runs.push_back({static_cast<std::uint32_t>(*physical - lowest),
                         static_cast<std::uint32_t>(here.first - datagram), static_cast<std::uint32_t>(here.count)});
  }
}

/// Puts the signals of a known layout where the FMMUs map them.
/// @param split gets those that do not lie in one piece
/// @return the places that need no other datagram
std::vector<ImagePart::Place> PlaceMapped(ImagePart& part, SplitSignals& split, const track::KnownFmmus& known,
                                          const std::vector<esc::Fmmu>& fmmus, std::uint32_t address,
                                          std::uint16_t length) {
  const esc::BitRange datagram{std::uint64_t{address} * 8, std::uint64_t{length} * 8};
  std::vector<ImagePart::Place> alone;
  bool cut = false;
  for (std::size_t i = 0; i < part.layout->signals.size(); ++i) {
    const Signal& signal = part.layout->signals[i];
    const auto start = BufferStart(known, *part.layout, signal.sync_manager, fmmus);
    if (signal.gap() || signal.bits == 0 || !start) continue;
    SplitSignal here = InDatagram(PiecesOf(fmmus, *start + signal.bit_offset, signal.bits), datagram, signal.bits);
    if (here.pieces.empty()) continue;
    const bool whole = here.role == SplitSignal::Role::kWhole;
    if (whole && here.pieces.size() == 1) {
      AddPlace(part, i, here.pieces[0].in_datagram);
      alone.push_back(part.places.back());
      continue;
    }
    cut = cut || !whole;
    if (!whole && signal.bits > SplitSignal::kMaxJoinedBits) continue;
    here.number = static_cast<std::uint16_t>(i);
    const SplitSignal& added = split.Add(std::move(here));
    if (added.role == SplitSignal::Role::kEarlier) continue;
    AddPlace(part, i, added.bit);
    if (whole) alone.push_back(part.places.back());
  }
  if (part.places.empty()) {
    part.reason = cut ? "no entry lies in this datagram as a whole"
                      : "the FMMUs map other memory than the sync managers of the PDOs";
  }
  return alone;
}

/// The sync managers of a layout, as they come.
std::vector<std::uint8_t> ManagersOf(const ProcessLayout& layout) {
  std::vector<std::uint8_t> managers;
  for (const Signal& signal : layout.signals) {
    if (std::find(managers.begin(), managers.end(), signal.sync_manager) == managers.end()) {
      managers.push_back(signal.sync_manager);
    }
  }
  return managers;
}

/// Puts the signals of a known layout where the ENI has them. The pieces are the buffers of the sync managers, or one
/// piece is all of them together.
/// @param bits of all pieces  @param begin, end bits of the process image that the datagram carries
void PlaceInPieces(ImagePart& part, const std::vector<device::EniImagePart>& pieces, std::uint64_t bits,
                   std::uint64_t begin, std::uint64_t end) {
  const std::vector<std::uint8_t> managers = ManagersOf(*part.layout);
  if (pieces.size() != 1 && pieces.size() != managers.size()) {
    part.reason = "the ENI has " + Count(pieces.size(), "piece") + " of process data for " +
                  Count(managers.size(), "sync manager");
    return;
  }
  if (part.layout->bits > bits) {
    part.reason = "the PDOs fill " + Count(part.layout->bits, "bit") + ", but the ENI's process image has " +
                  std::to_string(bits);
    return;
  }
  std::uint64_t in_all = 0;
  for (std::size_t i = 0; i < part.layout->signals.size(); ++i) {
    const Signal& signal = part.layout->signals[i];
    const auto manager = std::find(managers.begin(), managers.end(), signal.sync_manager) - managers.begin();
    const device::EniImagePart& piece = pieces[pieces.size() == 1 ? 0 : static_cast<std::size_t>(manager)];
    const std::uint64_t bit = piece.bit_start + (pieces.size() == 1 ? in_all : signal.bit_offset);
    in_all += signal.bits;
    if (!signal.gap() && signal.bits != 0 && bit >= begin && bit + signal.bits <= end) AddPlace(part, i, bit - begin);
  }
}

}  // namespace

std::vector<esc::Fmmu> DataFmmus(const track::KnownFmmus& known, PdoDirection direction, const LogicalKind& kind) {
  std::vector<esc::Fmmu> found;
  const bool touched = std::any_of(known.active.begin(), known.active.end(), [&](const auto& unit) {
    return !unit.fmmu.Overlap(kind.address, kind.length).empty();
  });
  if (!touched) return found;
  for (const auto& [number, fmmu] : known.active) {
    if (fmmu.bit_count() == 0 || fmmu.physical_start < kFirstDataAddress) continue;
    if (!(direction == PdoDirection::kRx ? fmmu.writes() : fmmu.reads()) || InMailbox(known, fmmu)) continue;
    found.push_back(fmmu);
  }
  return found;
}

SplitPlaces PlaceByFmmus(ImagePart& part, const track::KnownFmmus& known, const std::vector<esc::Fmmu>& fmmus,
                         const LogicalKind& kind) {
  SplitPlaces split{SplitSignals(kind.length), {}};
  AddRuns(part, fmmus, kind.address, kind.length);
  if (part.runs.empty()) return split;
  SumUp(part);
  if (part.layout->known()) split.alone = PlaceMapped(part, split.signals, known, fmmus, kind.address, kind.length);
  return split;
}

void PlaceByEni(ImagePart& part, const device::EniSlave& eni, std::uint32_t offset, std::uint16_t length) {
  const std::vector<device::EniImagePart>& pieces = part.direction == PdoDirection::kRx ? eni.outputs : eni.inputs;
  const std::uint64_t begin = std::uint64_t{offset} * 8;
  const std::uint64_t end = begin + std::uint64_t{length} * 8;
  std::uint64_t before = 0;
  for (const device::EniImagePart& piece : pieces) {
    const bool here = piece.bit_start >= begin && std::uint64_t{piece.bit_start} + piece.bit_length <= end;
    if (here && part.runs.size() < kMaxPieces) {
      part.runs.push_back(
          {static_cast<std::uint32_t>(before), static_cast<std::uint32_t>(piece.bit_start - begin), piece.bit_length});
    }
    before += piece.bit_length;
  }
  if (part.runs.empty()) return;
  SumUp(part);
  if (part.layout->known()) PlaceInPieces(part, pieces, before, begin, end);
}

void PlaceInBuffer(ImagePart& part, std::size_t n, const esc::SyncManager& manager, EscAddress address,
                   std::uint16_t length) {
  const std::uint64_t datagram = std::uint64_t{address} * 8;
  const std::uint64_t buffer = std::uint64_t{manager.start} * 8;
  const esc::BitRange here =
      esc::Intersect({datagram, std::uint64_t{length} * 8}, {buffer, std::uint64_t{manager.length} * 8});
  part.runs.push_back({static_cast<std::uint32_t>(here.first - buffer),
                       static_cast<std::uint32_t>(here.first - datagram), static_cast<std::uint32_t>(here.count)});
  SumUp(part);
  if (!part.layout->known()) return;
  for (std::size_t i = 0; i < part.layout->signals.size(); ++i) {
    const Signal& signal = part.layout->signals[i];
    const std::uint64_t bit = buffer + signal.bit_offset;
    if (signal.sync_manager != n || signal.gap() || signal.bits == 0 || bit < here.first ||
        bit + signal.bits > here.end()) {
      continue;
    }
    AddPlace(part, i, bit - datagram);
  }
  if (part.places.empty()) part.reason = "no PDO is assigned to sync manager " + std::to_string(n);
}

}  // namespace ecaudit::model
