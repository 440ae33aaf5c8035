#include "analyzers/model/process_image.h"

#include <algorithm>
#include <cstring>
#include <iterator>
#include <span>

#include "decoder/base/text.h"
#include "decoder/base/wrapping.h"
#include "decoder/esc/bit_copy.h"

namespace ecaudit::model {
namespace {

using device::PdoDirection;

constexpr EscAddress kFirstDataAddress = 0x0F00;  // below are registers; 0x0F00 digital outputs, 0x1000 process memory
constexpr EscAddress kProcessMemory = 0x1000;
constexpr std::size_t kMaxPieces = 256;  // of one slave in an ENI; a slave has at most as many sync managers

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

/// The active FMMUs of one direction that map process data.
std::vector<esc::Fmmu> DataFmmus(const track::KnownFmmus& known, PdoDirection direction) {
  std::vector<esc::Fmmu> found;
  for (const auto& [number, fmmu] : known.active) {
    if (fmmu.bit_count() == 0 || fmmu.physical_start < kFirstDataAddress) continue;
    if (!(direction == PdoDirection::kRx ? fmmu.writes() : fmmu.reads()) || InMailbox(known, fmmu)) continue;
    found.push_back(fmmu);
  }
  return found;
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

/// Marks outputs that share a byte of the datagram with inputs.
void MarkCovered(std::vector<ImagePart>& parts, std::size_t length) {
  std::vector<std::uint8_t> inputs(length);
  const auto bytes = [&](const BitRun& run) {
    const std::size_t begin = std::min<std::size_t>(run.in_datagram / 8, length);
    const std::size_t end = (std::uint64_t{run.in_datagram} + run.bits + 7) / 8;
    return std::span(inputs).subspan(begin, std::min(end, length) - begin);
  };
  for (const ImagePart& part : parts) {
    if (part.direction != PdoDirection::kTx) continue;
    for (const BitRun& run : part.runs) std::ranges::fill(bytes(run), std::uint8_t{1});
  }
  for (ImagePart& part : parts) {
    if (part.direction != PdoDirection::kRx) continue;
    part.covered = std::any_of(part.runs.begin(), part.runs.end(), [&](const BitRun& run) {
      const auto here = bytes(run);
      return !here.empty() && std::memchr(here.data(), 1, here.size()) != nullptr;
    });
  }
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

/// The last command of the ENI that is such a datagram; null: none.
const device::EniCyclicCommand* FindCyclic(const device::EniConfig& eni, wire::Command command, std::uint32_t address,
                                           std::uint16_t length) {
  const device::EniCyclicCommand* found = nullptr;
  for (const device::EniCyclicTask& task : eni.cyclic) {
    for (const device::EniCyclicFrame& frame : task.frames) {
      for (const device::EniCyclicCommand& candidate : frame.commands) {
        if (candidate.command == command && candidate.logical == address && candidate.data_length == length) {
          found = &candidate;
        }
      }
    }
  }
  return found;
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
void PlaceByEni(ImagePart& part, const std::vector<device::EniImagePart>& pieces, std::uint64_t bits,
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

std::uint64_t ExtractAnyBits(ByteSpan data, std::uint64_t bit, unsigned count) {
  if (count == 0 || count > 64 || bit + count > std::uint64_t{data.size()} * 8) return 0;
  const std::size_t first = static_cast<std::size_t>(bit / 8);
  const unsigned shift = static_cast<unsigned>(bit % 8);
  const std::size_t bytes = (shift + count + 7) / 8;
  std::uint64_t value = UnsignedOf(data.subspan(first, bytes)) >> shift;
  if (bytes > 8) value |= std::uint64_t{data[first + 8]} << (64 - shift);
  return count == 64 ? value : value & ((std::uint64_t{1} << count) - 1);
}

const ImagePart::Place* ImagePart::Find(std::uint16_t index, std::uint8_t subindex) const {
  const std::uint32_t object = std::uint32_t{index} << 8U | subindex;
  for (const Place& place : places) {
    if (place.object == object) return &place;
  }
  return nullptr;
}

std::optional<std::uint64_t> ProcessCycle::Value(const ImagePart::Place& place) const {
  if (!has_data() || place.bits > 64) return std::nullopt;
  return ExtractBits(data, place.bit, place.bits);
}

std::optional<std::uint64_t> ProcessCycle::Value(std::uint16_t index, std::uint8_t subindex) const {
  const ImagePart::Place* place = part.Find(index, subindex);
  return place == nullptr ? std::nullopt : Value(*place);
}

void ProcessCycle::AppendRaw(std::vector<std::uint8_t>& out) const {
  if (!has_data()) return;
  const std::size_t begin = out.size();
  out.resize(begin + (part.bits + 7) / 8);
  std::uint64_t to = std::uint64_t{begin} * 8;
  for (const BitRun& run : part.runs) {
    if (!esc::CopyBits(data, run.in_datagram, out, to, run.bits)) return;
    to += run.bits;
  }
}

void ProcessImage::OnLayoutChanged(SlaveId slave) {
  if (layout_changed_.size() <= slave) layout_changed_.resize(std::size_t{slave} + 1);
  layout_changed_[slave] = ++layout_changes_;
}

bool ProcessImage::ChangedSince(const Version& version, SlaveId slave) const {
  return network_.mapping_changed(slave) > version.mapping ||
         (slave < layout_changed_.size() && layout_changed_[slave] > version.layouts);
}

ProcessImage::Entry& ProcessImage::Find(const LogicalKind& kind, bool& found) {
  if (version_ != version()) {
    fragments_.Clear();
    version_ = version();
  }
  Entry* entry = entries_.Find(kind);
  found = entry != nullptr;
  if (!found) {
    entry = &entries_.Take(kind);
    entry->kind = kind;
    Clear(*entry);
  }
  return *entry;
}

void ProcessImage::Clear(Entry& entry) {
  entry.version = version_;
  entry.parts.clear();
  entry.splits.clear();
  entry.eni = {};
}

void ProcessImage::AddSlave(Entry& entry, SlaveId slave) {
  if (network_.slaves()[slave].replaced) return;
  if (entry.kind.command != wire::Command::LRD) AddMapped(entry, slave, PdoDirection::kRx);
  if (entry.kind.command != wire::Command::LWR) AddMapped(entry, slave, PdoDirection::kTx);
}

/// Thousands of slaves may have data in each of many datagrams: those of the others are built again when they come.
void ProcessImage::MakeRoom(const Entry& kept) {
  std::size_t parts = 0;
  entries_.ForEachValue([&](const Entry& entry) { parts += entry.parts.capacity(); });
  if (parts > kMaxParts) entries_.KeepOnly(kept);
}

void ProcessImage::BuildLogical(Entry& entry) {
  MakeRoom(entry);
  work_ += slaves_.size() / kLooksPerSlave;
  for (std::size_t s = 0; s < slaves_.size(); ++s) AddSlave(entry, static_cast<SlaveId>(s));
  if (eni_ != nullptr) AddByEni(entry);
  FindCovered(entry);
}

/// Builds the parts of the changed slaves again; what the units of the others learned stays.
void ProcessImage::RefreshLogical(Entry& entry) {
  if (eni_ != nullptr) {
    Clear(entry);
    return BuildLogical(entry);
  }
  Entry fresh;
  fresh.kind = entry.kind;
  work_ += (slaves_.size() + entry.parts.size()) / kLooksPerSlave;
  for (std::size_t s = 0; s < slaves_.size(); ++s) {
    const auto id = static_cast<SlaveId>(s);
    if (!ChangedSince(entry.version, id) && !network_.slaves()[id].replaced) continue;
    fresh.parts.clear();
    fresh.splits.clear();
    AddSlave(fresh, id);
    Replace(entry, id, fresh);
  }
  entry.version = version_;
  FindCovered(entry);
}

/// Puts the parts of one slave in `fresh` into the place of those in `entry`.
void ProcessImage::Replace(Entry& entry, SlaveId slave, Entry& fresh) {
  std::vector<ImagePart>& parts = entry.parts;
  const auto first =
      std::partition_point(parts.begin(), parts.end(), [&](const ImagePart& p) { return p.slave < slave; });
  const auto end = std::partition_point(first, parts.end(), [&](const ImagePart& p) { return p.slave == slave; });
  const auto begin = static_cast<std::size_t>(first - parts.begin());
  const auto count = static_cast<std::size_t>(end - first);
  std::erase_if(entry.splits, [&](const Split& s) { return s.part >= begin && s.part < begin + count; });
  for (Split& split : entry.splits) {
    if (split.part >= begin + count) split.part = split.part - count + fresh.parts.size();
  }
  for (Split& split : fresh.splits) {
    split.part += begin;
    entry.splits.push_back(std::move(split));
  }
  if (fresh.parts.size() == count) {
    std::move(fresh.parts.begin(), fresh.parts.end(), first);
  } else {
    const auto at = parts.erase(first, end);
    parts.insert(at, std::make_move_iterator(fresh.parts.begin()), std::make_move_iterator(fresh.parts.end()));
  }
}

void ProcessImage::FindCovered(Entry& entry) {
  MarkCovered(entry.parts, entry.kind.length);
  for (Split& split : entry.splits) split.alone.covered = entry.parts[split.part].covered;
}

void ProcessImage::Add(Entry& entry, ImagePart part) {
  part.serial = ++parts_made_;
  work_ += kMakingPart;
  entry.parts.push_back(std::move(part));
}

void ProcessImage::AddMapped(Entry& entry, SlaveId slave, PdoDirection direction) {
  const track::KnownFmmus& known = network_.fmmus(slave);
  const bool touched = std::any_of(known.active.begin(), known.active.end(), [&](const auto& unit) {
    return !unit.fmmu.Overlap(entry.kind.address, entry.kind.length).empty();
  });
  if (!touched) return;
  const std::vector<esc::Fmmu> fmmus = DataFmmus(known, direction);
  if (fmmus.empty()) return;
  ImagePart part;
  part.slave = slave;
  part.model = &slaves_[slave];
  part.direction = direction;
  part.layout = &part.model->process.Layout(direction);

  AddRuns(part, fmmus, entry.kind.address, entry.kind.length);
  if (part.runs.empty()) return;
  SumUp(part);

  SplitSignals split(entry.kind.length);
  std::vector<ImagePart::Place> alone;
  if (part.layout->known()) alone = PlaceMapped(part, split, known, fmmus, entry.kind.address, entry.kind.length);
  Add(entry, std::move(part));
  if (split.empty()) return;
  ImagePart without = entry.parts.back();
  without.serial = ++parts_made_;
  without.places = std::move(alone);
  without.incomplete = true;
  entry.splits.push_back({entry.parts.size() - 1, std::move(without), std::move(split)});
}

const SlaveModel& ProcessImage::UnmetSlave(std::size_t number) {
  if (unmet_.size() <= number) unmet_.resize(number + 1);
  Unmet& unmet = unmet_[number];
  if (unmet.model == nullptr) {
    unmet.state = std::make_unique<track::SlaveState>();
    unmet.model = std::make_unique<SlaveModel>(kNoSlave, *unmet.state, unmet_limits_, no_events_);
    const device::EniSlave& eni = eni_->slaves[number];
    bus::SlaveAddress address;
    if (const auto position = eni.position()) address.position = Known<SlavePos>::Inferred(*position, 0);
    if (eni.station_address) address.station = Known<StationAddress>::Inferred(*eni.station_address, 0);
    choice_.Choose(address, {}, *unmet.model);
    unmet.model->eni = &eni;
    unmet.model->process.SetFamily(*unmet.model->profile);
    unmet.model->process.SetEni(&eni, eni_);
  }
  return *unmet.model;
}

void ProcessImage::AddByEni(Entry& entry) {
  const device::EniCyclicCommand* command =
      FindCyclic(*eni_, entry.kind.command, entry.kind.address, entry.kind.length);
  if (command == nullptr) return;
  for (std::size_t number = 0; number < eni_->slaves.size(); ++number) {
    if (command->output_offset && entry.kind.command != wire::Command::LRD) {
      AddByEni(entry, number, PdoDirection::kRx, *command->output_offset);
    }
    if (command->input_offset && entry.kind.command != wire::Command::LWR) {
      AddByEni(entry, number, PdoDirection::kTx, *command->input_offset);
    }
  }
  if (entry.eni.any) entry.eni.counter = command->expected_wkc;
}

/// The slave with this number in the ENI; one that is met counts.
/// @return false: what was really written to it counts, not the ENI
bool ProcessImage::FindModel(ImagePart& part, std::size_t number) {
  for (std::size_t s = 0; s < slaves_.size(); ++s) {
    const auto id = static_cast<SlaveId>(s);
    if (slaves_[s].eni != &eni_->slaves[number] || network_.slaves()[id].replaced) continue;
    if (network_.fmmus(id).any) return false;
    part.slave = id;
    part.model = &slaves_[s];
  }
  if (part.model == nullptr) part.model = &UnmetSlave(number);
  return true;
}

void ProcessImage::AddByEni(Entry& entry, std::size_t number, PdoDirection direction, std::uint32_t image_offset) {
  const device::EniSlave& eni = eni_->slaves[number];
  const std::vector<device::EniImagePart>& pieces = direction == PdoDirection::kRx ? eni.outputs : eni.inputs;
  if (pieces.empty()) return;
  ImagePart part;
  part.direction = direction;
  part.by_eni = true;
  if (!FindModel(part, number)) return;
  part.layout = &part.model->process.Layout(direction);

  const std::uint64_t begin = std::uint64_t{image_offset} * 8;
  const std::uint64_t end = begin + std::uint64_t{entry.kind.length} * 8;
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
  if (part.layout->known()) PlaceByEni(part, pieces, before, begin, end);
  entry.eni.any = true;
  ++(direction == PdoDirection::kTx ? entry.eni.inputs : entry.eni.outputs);
  Add(entry, std::move(part));
}

void ProcessImage::BuildDirect(Entry& entry, SlaveId slave, EscAddress address) {
  const track::KnownFmmus& known = network_.fmmus(slave);
  for (std::size_t n = 0; n < esc::kMaxSyncManagers; ++n) {
    const auto& manager = known.managers[n];
    if (!manager || !manager->enabled() || !esc::IsProcessData(n, *manager) || manager->start < kProcessMemory ||
        !manager->Touches(address, entry.kind.length)) {
      continue;
    }
    const bool outputs = manager->ecat_writes();
    if (!(outputs ? wire::Writes(entry.kind.command) : wire::Reads(entry.kind.command))) continue;
    ImagePart part;
    part.slave = slave;
    part.model = &slaves_[slave];
    part.direction = outputs ? PdoDirection::kRx : PdoDirection::kTx;
    part.layout = &part.model->process.Layout(part.direction);
    const std::uint64_t datagram = std::uint64_t{address} * 8;
    const std::uint64_t buffer = std::uint64_t{manager->start} * 8;
    const esc::BitRange here =
        esc::Intersect({datagram, std::uint64_t{entry.kind.length} * 8}, {buffer, std::uint64_t{manager->length} * 8});
    part.runs.push_back({static_cast<std::uint32_t>(here.first - buffer),
                         static_cast<std::uint32_t>(here.first - datagram), static_cast<std::uint32_t>(here.count)});
    SumUp(part);
    if (part.layout->known()) {
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
    Add(entry, std::move(part));
  }
}

/// Hands the cycle over with the signals put together that do not lie in one piece.
void ProcessImage::Deliver(Entry& entry, std::size_t part, ProcessCycle& cycle, ProcessSink& sink) {
  const auto split =
      std::find_if(entry.splits.begin(), entry.splits.end(), [part](const Split& s) { return s.part == part; });
  if (split == entry.splits.end() || !cycle.has_data()) return sink.On(cycle);
  bool whole = true;
  const Sighting where{cycle.part.slave, cycle.part.direction, cycle.sent, cycle.returned, cycle.exchange};
  cycle.data = split->signals.Gather(cycle.data, where, fragments_, whole);
  if (whole) return sink.On(cycle);
  if (split->alone.places.empty()) {
    cycle.data = {};
    return sink.On(cycle);
  }
  sink.On(ProcessCycle{split->alone, cycle.exchange, cycle.sent, cycle.returned, cycle.command, cycle.data});
}

bool ProcessImage::Read(const track::LogicalAccess& access, const LogicalExpectation& expectation, ProcessSink& sink) {
  bool found = false;
  Entry& entry = Find({access.command, access.address, access.length}, found);
  if (!found) {
    BuildLogical(entry);
  } else if (entry.version != version_) {
    RefreshLogical(entry);
  }
  if (entry.parts.empty()) return false;
  work_ += entry.parts.size();
  const ExchangeOfAll counted = CountExchange(access, expectation, entry.eni, network_, slaves_);
  const bool lost = !access.returned.seen() && !access.assumed;
  const bool given = counted.inputs == Exchange::kYes || counted.inputs == Exchange::kInferred;
  const ByteSpan inputs = given ? access.returned_data : ByteSpan();
  for (std::size_t n = 0; n < entry.parts.size(); ++n) {
    const ImagePart& part = entry.parts[n];
    const bool is_input = part.direction == PdoDirection::kTx;
    const ByteSpan data = is_input             ? inputs
                          : access.sent.seen() ? access.sent_data
                          : part.covered       ? ByteSpan()
                                               : access.returned_data;
    ProcessCycle cycle{
        part, is_input ? counted.inputs : counted.outputs, access.sent, access.returned, access.command, data, lost};
    if (entry.splits.empty()) {
      sink.On(cycle);
    } else {
      Deliver(entry, n, cycle, sink);
    }
  }
  return !entry.parts.empty();
}

bool ProcessImage::Read(const track::SlaveAccess& access, ProcessSink& sink) {
  const std::size_t length = std::max(access.written.size(), access.read.size());
  if (access.address < kProcessMemory || access.broadcast || length == 0 || access.slave >= slaves_.size())
    return false;
  bool found = false;
  const std::uint32_t key = std::uint32_t{access.slave} << 16U | access.address;
  Entry& entry = Find({access.command, key, static_cast<std::uint16_t>(length)}, found);
  if (found && ChangedSince(entry.version, access.slave)) {
    Clear(entry);
    found = false;
  }
  entry.version = version_;
  if (!found) BuildDirect(entry, access.slave, access.address);
  for (const ImagePart& part : entry.parts) {
    ProcessCycle cycle{part, Exchange::kUnknown, access.sent, access.returned, access.command, {}};
    switch (access.acceptance) {
      case track::Acceptance::kAccepted:
        cycle.exchange = Exchange::kYes;
        break;
      case track::Acceptance::kRefused:
        cycle.exchange = Exchange::kNo;
        break;
      case track::Acceptance::kAssumed:
        cycle.exchange = Exchange::kInferred;
        break;
      case track::Acceptance::kUnknown:
        break;
    }
    if (part.direction == PdoDirection::kRx) {
      cycle.data = access.written;
    } else if (access.acceptance == track::Acceptance::kAccepted) {
      cycle.data = access.read;
    }
    sink.On(cycle);
  }
  return !entry.parts.empty();
}

}  // namespace ecaudit::model
