#include "analyzers/collect/summary.h"

#include <algorithm>
#include <optional>
#include <set>
#include <tuple>

#include "analyzers/collect/event_collector.h"
#include "analyzers/collect/latch_collector.h"
#include "analyzers/model/bus_model.h"
#include "analyzers/sync/sync_model.h"
#include "decoder/esc/sii.h"

namespace ecaudit {
namespace {

/// The clock of one slave among those of the bus.
void AddSettled(BusDcSummary& bus, SlaveId slave, const std::optional<DcSummary>& dc) {
  if (!dc || !dc->difference_above.seen()) return;
  if (!dc->settled.seen()) {
    ++bus.unsettled_clocks;
    return;
  }
  ++bus.settled_clocks;
  if (dc->settled.number <= bus.settled.number) return;
  bus.settled = dc->settled;
  bus.settled_last = slave;
}

CaptureSummary SummariseCapture(const capture::FrameSource& source, const Pipeline& pipeline) {
  const PipelineStatistics& read = pipeline.statistics();
  const bus::PairingStatistics& pairing = pipeline.pairing();
  CaptureSummary summary;
  summary.file = source.info();
  summary.packets = read.packets;
  summary.ethercat_frames = read.ethercat_frames;
  summary.datagrams = read.datagrams;
  summary.outbound_frames = pairing.outbound;
  summary.returned_frames = pairing.returned;
  summary.frames = pairing.frames();
  summary.padded_frames = read.padded_frames;
  if (read.first.has_time) summary.duration_ns = read.elapsed_ns;
  summary.foreign_frames = pairing.foreign;
  summary.other_end_frames = pairing.other_end;
  summary.other_packets = read.other_packets;
  summary.malformed_frames = read.malformed_frames;
  summary.cut_frames = read.cut_frames;
  summary.crc_error_frames = read.crc_error_frames;
  const std::uint64_t others =
      read.other_link + read.cut_before_type + summary.file.unread_blocks + summary.file.dropped();
  summary.may_be_ethercat = read.ethercat_frames + others;
  summary.unusable = others + read.crc_error_frames + pairing.foreign_ignored();
  summary.origin = read.origin;
  summary.first = read.first;
  summary.last = read.last;
  const bool returned = pairing.returned > pairing.other_end;
  if (pairing.outbound > 0 && returned) {
    summary.direction = DirectionSeen::kBoth;
  } else if (pairing.outbound > 0) {
    summary.direction = DirectionSeen::kOutbound;
  } else if (returned) {
    summary.direction = DirectionSeen::kReturned;
  }
  // A few stamps have some large number in common by chance.
  constexpr std::uint64_t kEnoughStamps = 10;
  if (read.packets > kEnoughStamps) summary.timestamps.resolution_ns = read.time_step_ns;
  summary.timestamps.backwards = read.backwards;
  summary.timestamps.identical_pairs = pairing.identical_stamps;
  summary.timestamps.pairs = pairing.paired;
  summary.timestamps.without = read.without_time;
  summary.complete = !read.stopped && !summary.file.damage && !read.overworked.seen();
  return summary;
}

/// Of a slave of which nothing shows where it is.
constexpr SlavePos kNoPlace = 0xFFFF;

/// Slaves whose position the capture does not show get the free ones, by ascending station address.
void NumberSlaves(std::vector<SlaveSummary>& slaves) {
  std::ranges::sort(slaves, [](const SlaveSummary& a, const SlaveSummary& b) {
    const auto place = [](const SlaveSummary& s) {
      return s.position_inferred ? s.station_address.value_or(0) : std::uint16_t{s.position};
    };
    return std::tuple(a.position_inferred, place(a), a.id) < std::tuple(b.position_inferred, place(b), b.id);
  });
  std::set<SlavePos> taken;
  for (const SlaveSummary& slave : slaves) {
    if (!slave.position_inferred) taken.insert(slave.position);
  }
  // Where slaves have joined, their order shows the places of the others.
  for (SlaveSummary& slave : slaves) {
    if (slave.position_inferred && slave.position != kNoPlace && !taken.insert(slave.position).second) {
      slave.position = kNoPlace;
    }
  }
  SlavePos next = 0;
  for (SlaveSummary& slave : slaves) {
    if (slave.position != kNoPlace) continue;
    while (taken.contains(next)) ++next;
    slave.position = next++;
  }
  // Two at one position: the one that was seen there first. (No stable sort, which takes half as much memory again.)
  std::ranges::sort(slaves, [](const SlaveSummary& a, const SlaveSummary& b) {
    return std::tuple(a.position, a.position_inferred, a.id) < std::tuple(b.position, b.position_inferred, b.id);
  });
}

void SummariseSyncManagers(const track::SlaveState& state, SlaveSummary& summary) {
  for (std::size_t n = 0; n < esc::kMaxSyncManagers; ++n) {
    const auto manager = state.sync_manager(n, Certainty::kInferred);
    if (!manager || (manager->length == 0 && !manager->enabled())) continue;
    SyncManagerSummary& out = summary.sync_managers.emplace_back();
    out.number = static_cast<std::uint8_t>(n);
    out.start = manager->start;
    out.length = manager->length;
    out.control = manager->control;
    out.mailbox = manager->mailbox();
    out.ecat_writes = manager->ecat_writes();
    out.enabled = manager->enabled();
    out.inferred = !state.sync_manager(n, Certainty::kObserved);
    out.since = state.sync_manager_since[n];
  }
  for (std::size_t n = 0; n < esc::kMaxFmmus; ++n) {
    const auto fmmu = state.fmmu(n, Certainty::kInferred);
    if (!fmmu || (fmmu->length == 0 && !fmmu->active())) continue;
    FmmuSummary& out = summary.fmmus.emplace_back();
    out.number = static_cast<std::uint8_t>(n);
    out.logical_start = fmmu->logical_start;
    out.length = fmmu->length;
    out.logical_start_bit = fmmu->logical_start_bit;
    out.logical_stop_bit = fmmu->logical_stop_bit;
    out.physical_start = fmmu->physical_start;
    out.physical_start_bit = fmmu->physical_start_bit;
    out.reads = fmmu->reads();
    out.writes = fmmu->writes();
    out.active = fmmu->active();
    out.inferred = !state.fmmu(n, Certainty::kObserved);
    out.since = state.fmmu_since[n];
  }
}

PdoSummary SummarisePdo(const model::ProcessLayout& layout, const model::ProcessTraffic& traffic) {
  PdoSummary summary;
  summary.exchanged = traffic.exchanged;
  summary.first = traffic.first.number;
  summary.last = traffic.last.number;
  switch (layout.source) {
    case model::LayoutSource::kUnknown:
      break;
    case model::LayoutSource::kObserved:
      summary.source = PdoSummary::Source::kObserved;
      break;
    case model::LayoutSource::kDefault:
      summary.source = PdoSummary::Source::kDefault;
      break;
    case model::LayoutSource::kEni:
      summary.source = PdoSummary::Source::kEni;
      break;
  }
  summary.reason = layout.reason;
  summary.pdos = layout.pdos;
  summary.since = layout.since;
  if (layout.known()) summary.bytes = layout.bytes();
  summary.objects.reserve(layout.signals.size());
  for (const model::Signal& signal : layout.signals) {
    summary.objects.push_back({signal.pdo, signal.index, signal.subindex, signal.bits, signal.bit_offset,
                               signal.sync_manager, signal.name, signal.name_inferred, signal.variable});
  }
  return summary;
}

SlaveSummary SummariseSlave(SlaveId id, const model::BusModel& model) {
  const track::Network& network = model.network();
  const bus::SlaveAddress& address = network.slaves()[id];
  const model::SlaveModel& slave = model.slave(id);
  SlaveSummary summary;
  summary.id = id;
  summary.position_inferred = address.position.if_observed() == nullptr;
  summary.position = address.position.value_or(kNoPlace);
  if (const StationAddress* station = address.station.if_known()) summary.station_address = *station;
  if (const StationAddress* alias = address.alias.if_known()) summary.alias = *alias;
  summary.identity.vendor_id = slave.identity.vendor_id;
  summary.identity.product_code = slave.identity.product_code;
  summary.identity.revision = slave.identity.revision;
  summary.identity.serial = slave.identity.serial;
  summary.identity.since = slave.identity.frame.number;
  // The name in the project is clearer to people than the product name of the maker.
  const esc::SiiImage& image = network.state(id).sii.image();
  if (slave.eni != nullptr) summary.name = slave.name;
  if (summary.name.empty() && image.KnownWords() > 0) summary.name = std::string(esc::ParseSii(image).Name());
  if (summary.name.empty()) summary.name = slave.name;
  summary.profile = slave.profile->id;
  summary.profile_source = slave.profile_source;
  SummariseSyncManagers(network.state(id), summary);
  summary.rx_pdo = SummarisePdo(slave.process.rx(), slave.outputs);
  summary.tx_pdo = SummarisePdo(slave.process.tx(), slave.inputs);
  summary.latch = SummariseLatch(slave.latch);
  summary.touch_probe = SummariseLatch(slave.touch_probe);
  summary.events = SummariseEvents(model, id);
  return summary;
}

}  // namespace

AnalysisResult Summarise(const capture::FrameSource& source, const Observation& observation) {
  const Pipeline& pipeline = observation.pipeline();
  const model::BusModel& model = observation.model();
  const sync::SyncModel& sync = *observation.sync();
  AnalysisResult result;
  result.capture = SummariseCapture(source, pipeline);
  if (const std::uint16_t* count = pipeline.network().slave_count().if_known()) result.bus.slave_count = *count;
  if (const auto& shown = model.al().shown()) {
    result.bus.al = BusAlSummary{shown->status.raw, shown->first, shown->last, shown->polls};
  }
  result.bus.events = SummariseEventField(model.signalled().field());
  result.bus.lost_frames = pipeline.pairing().lost;
  result.bus.duplicated_frames = pipeline.pairing().duplicated;
  result.bus.unanswered_at_end = pipeline.pairing().in_flight;
  result.bus.cycle = sync.SummariseCycle();
  result.bus.dc = sync.SummariseBus();
  result.slaves.reserve(model.size());
  for (std::size_t s = 0; s < model.size(); ++s) {
    const auto id = static_cast<SlaveId>(s);
    if (model.network().slaves()[id].replaced) continue;
    result.slaves.push_back(SummariseSlave(id, model));
    result.slaves.back().dc = sync.Summarise(id);
    AddSettled(result.bus.dc, id, result.slaves.back().dc);
  }
  NumberSlaves(result.slaves);
  return result;
}

}  // namespace ecaudit
