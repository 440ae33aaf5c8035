#include "analyzers/model/image_parts.h"

#include <algorithm>
#include <cstring>
#include <iterator>
#include <span>

#include "analyzers/model/image_places.h"
#include "decoder/esc/register_map.h"

namespace ecaudit::model {
namespace {

using device::PdoDirection;

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

}  // namespace

void DatagramParts::Clear() {
  parts.clear();
  splits.clear();
  eni = {};
}

void DatagramParts::Replace(SlaveId slave, DatagramParts& fresh) {
  const auto first =
      std::partition_point(parts.begin(), parts.end(), [&](const ImagePart& p) { return p.slave < slave; });
  const auto end = std::partition_point(first, parts.end(), [&](const ImagePart& p) { return p.slave == slave; });
  const auto begin = static_cast<std::size_t>(first - parts.begin());
  const auto count = static_cast<std::size_t>(end - first);
  std::erase_if(splits, [&](const Split& s) { return s.part >= begin && s.part < begin + count; });
  for (Split& split : splits) {
    if (split.part >= begin + count) split.part = split.part - count + fresh.parts.size();
  }
  for (Split& split : fresh.splits) {
    split.part += begin;
    splits.push_back(std::move(split));
  }
  if (fresh.parts.size() == count) {
    std::move(fresh.parts.begin(), fresh.parts.end(), first);
  } else {
    const auto at = parts.erase(first, end);
    parts.insert(at, std::make_move_iterator(fresh.parts.begin()), std::make_move_iterator(fresh.parts.end()));
  }
}

void DatagramParts::FindCovered() {
  MarkCovered(parts, kind.length);
  for (Split& split : splits) split.alone.covered = parts[split.part].covered;
}

void ImageParts::OnLayoutChanged(SlaveId slave) {
  if (layout_changed_.size() <= slave) layout_changed_.resize(std::size_t{slave} + 1);
  layout_changed_[slave] = ++layout_changes_;
}

bool ImageParts::ChangedSince(const PlacesVersion& version, SlaveId slave) const {
  return network_.mapping_changed(slave) > version.mapping ||
         (slave < layout_changed_.size() && layout_changed_[slave] > version.layouts);
}

DatagramParts& ImageParts::Find(const LogicalKind& kind, bool& found) {
  if (version_ != version()) {
    moved_ = true;
    version_ = version();
  }
  DatagramParts* datagram = kinds_.Find(kind);
  found = datagram != nullptr;
  if (found) return *datagram;
  datagram = &kinds_.Take(kind);
  datagram->kind = kind;
  datagram->version = version_;
  datagram->Clear();
  return *datagram;
}

DatagramParts& ImageParts::OfLogical(const LogicalKind& kind) {
  bool found = false;
  DatagramParts& datagram = Find(kind, found);
  if (!found) {
    Build(datagram);
  } else if (datagram.version != version_) {
    Refresh(datagram);
  }
  work_ += datagram.parts.size();
  return datagram;
}

DatagramParts& ImageParts::OfMemory(const track::SlaveAccess& access, std::uint16_t length) {
  bool found = false;
  const std::uint32_t key = std::uint32_t{access.slave} << 16U | access.address;
  DatagramParts& datagram = Find({access.command, key, length}, found);
  if (!found || ChangedSince(datagram.version, access.slave)) {
    datagram.Clear();
    AddMemory(datagram, access.slave, access.address);
  }
  datagram.version = version_;
  return datagram;
}

/// Thousands of slaves may have data in each of many datagrams: those of the others are built again when they come.
void ImageParts::MakeRoom(const DatagramParts& kept) {
  std::size_t parts = 0;
  kinds_.ForEachValue([&](const DatagramParts& datagram) { parts += datagram.parts.capacity(); });
  if (parts > kMaxParts) kinds_.KeepOnly(kept);
}

void ImageParts::Build(DatagramParts& datagram) {
  MakeRoom(datagram);
  work_ += slaves_.size() / kLooksPerSlave;
  for (std::size_t s = 0; s < slaves_.size(); ++s) AddSlave(datagram, static_cast<SlaveId>(s));
  if (eni_ != nullptr) AddByEni(datagram);
  datagram.FindCovered();
}

/// Builds the parts of the changed slaves again; what the units of the others learned stays.
void ImageParts::Refresh(DatagramParts& datagram) {
  if (eni_ != nullptr) {
    datagram.version = version_;
    datagram.Clear();
    return Build(datagram);
  }
  DatagramParts fresh;
  fresh.kind = datagram.kind;
  work_ += (slaves_.size() + datagram.parts.size()) / kLooksPerSlave;
  for (std::size_t s = 0; s < slaves_.size(); ++s) {
    const auto id = static_cast<SlaveId>(s);
    if (!ChangedSince(datagram.version, id) && !network_.slaves()[id].replaced) continue;
    fresh.parts.clear();
    fresh.splits.clear();
    AddSlave(fresh, id);
    datagram.Replace(id, fresh);
  }
  datagram.version = version_;
  datagram.FindCovered();
}

void ImageParts::AddSlave(DatagramParts& datagram, SlaveId slave) {
  if (network_.slaves()[slave].replaced) return;
  if (datagram.kind.command != wire::Command::LRD) AddMapped(datagram, slave, PdoDirection::kRx);
  if (datagram.kind.command != wire::Command::LWR) AddMapped(datagram, slave, PdoDirection::kTx);
}

void ImageParts::Add(DatagramParts& datagram, ImagePart part) {
  part.serial = ++parts_made_;
  work_ += kMakingPart;
  datagram.parts.push_back(std::move(part));
}

ImagePart ImageParts::PartOf(SlaveId slave, PdoDirection direction) const {
  ImagePart part;
  part.slave = slave;
  part.model = &slaves_[slave];
  part.direction = direction;
  part.layout = &part.model->process.Layout(direction);
  return part;
}

void ImageParts::AddMapped(DatagramParts& datagram, SlaveId slave, PdoDirection direction) {
  const track::KnownFmmus& known = network_.fmmus(slave);
  const std::vector<esc::Fmmu> fmmus = DataFmmus(known, direction, datagram.kind);
  if (fmmus.empty()) return;
  ImagePart part = PartOf(slave, direction);
  SplitPlaces split = PlaceByFmmus(part, known, fmmus, datagram.kind);
  if (part.runs.empty()) return;
  Add(datagram, std::move(part));
  if (split.signals.empty()) return;
  ImagePart without = datagram.parts.back();
  without.serial = ++parts_made_;
  without.places = std::move(split.alone);
  without.incomplete = true;
  datagram.splits.push_back({datagram.parts.size() - 1, std::move(without), std::move(split.signals)});
}

void ImageParts::AddMemory(DatagramParts& datagram, SlaveId slave, EscAddress address) {
  const track::KnownFmmus& known = network_.fmmus(slave);
  for (std::size_t n = 0; n < esc::kMaxSyncManagers; ++n) {
    const auto& manager = known.managers[n];
    if (!manager || !manager->enabled() || !esc::IsProcessData(n, *manager) || manager->start < esc::kProcessRam ||
        !manager->Touches(address, datagram.kind.length)) {
      continue;
    }
    const bool outputs = manager->ecat_writes();
    if (!(outputs ? wire::Writes(datagram.kind.command) : wire::Reads(datagram.kind.command))) continue;
    ImagePart part = PartOf(slave, outputs ? PdoDirection::kRx : PdoDirection::kTx);
    PlaceInBuffer(part, n, *manager, address, datagram.kind.length);
    Add(datagram, std::move(part));
  }
}

void ImageParts::AddByEni(DatagramParts& datagram) {
  const device::EniCyclicCommand* command =
      FindCyclic(*eni_, datagram.kind.command, datagram.kind.address, datagram.kind.length);
  if (command == nullptr) return;
  for (std::size_t number = 0; number < eni_->slaves.size(); ++number) {
    if (command->output_offset && datagram.kind.command != wire::Command::LRD) {
      AddByEni(datagram, number, PdoDirection::kRx, *command->output_offset);
    }
    if (command->input_offset && datagram.kind.command != wire::Command::LWR) {
      AddByEni(datagram, number, PdoDirection::kTx, *command->input_offset);
    }
  }
  if (datagram.eni.any) datagram.eni.counter = command->expected_wkc;
}

/// The slave with this number in the ENI; one that is met counts.
/// @return false: what was really written to it counts, not the ENI
bool ImageParts::FindModel(ImagePart& part, std::size_t number) {
  for (std::size_t s = 0; s < slaves_.size(); ++s) {
    const auto id = static_cast<SlaveId>(s);
    if (slaves_[s].eni != &eni_->slaves[number] || network_.slaves()[id].replaced) continue;
    if (network_.fmmus(id).any) return false;
    part.slave = id;
    part.model = &slaves_[s];
  }
  if (part.model == nullptr) part.model = &eni_slaves_.Of(number);
  return true;
}

void ImageParts::AddByEni(DatagramParts& datagram, std::size_t number, PdoDirection direction, std::uint32_t offset) {
  const device::EniSlave& eni = eni_->slaves[number];
  if ((direction == PdoDirection::kRx ? eni.outputs : eni.inputs).empty()) return;
  ImagePart part;
  part.direction = direction;
  part.by_eni = true;
  if (!FindModel(part, number)) return;
  part.layout = &part.model->process.Layout(direction);
  PlaceByEni(part, eni, offset, datagram.kind.length);
  if (part.runs.empty()) return;
  datagram.eni.any = true;
  ++(direction == PdoDirection::kTx ? datagram.eni.inputs : datagram.eni.outputs);
  Add(datagram, std::move(part));
}

}  // namespace ecaudit::model
