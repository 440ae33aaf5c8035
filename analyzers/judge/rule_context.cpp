#include "analyzers/judge/rule_context.h"

#include "analyzers/collect/explanations.h"
#include "analyzers/model/bus_model.h"
#include "analyzers/observation.h"
#include "decoder/base/text.h"

namespace ecaudit {

RuleContext::RuleContext(FindingStore& to_store, const Observation& observation, const capture::FrameSource& source,
                         const AnalysisOptions& options, Explanations& explanations)
    : store(to_store),
      observation_(observation),
      bus_(observation.model()),
      sync_(*observation.sync()),
      progress_(*observation.progress()),
      source_(source),
      options_(options),
      explanations_(explanations) {}

const model::SlaveModel& RuleContext::slave(SlaveId id) const {
  return bus_.slave(id);
}

std::size_t RuleContext::slave_count() const {
  return bus_.size();
}

const track::Network& RuleContext::network() const {
  return bus_.network();
}

const PipelineStatistics& RuleContext::statistics() const {
  return observation_.pipeline().statistics();
}

const bus::PairingStatistics& RuleContext::pairing() const {
  return observation_.pipeline().pairing();
}

void RuleContext::ExplainRequest(SlaveId slave, FrameNo request, FindingIndex finding) {
  explanations_.Add(slave, request, finding);
}

FindingIndex RuleContext::ExplanationOf(SlaveId slave, FrameNo request) const {
  return explanations_.Of(slave, request);
}

std::vector<FindingIndex> RuleContext::ExplanationsOf(SlaveId slave, FrameNo request) const {
  return explanations_.AllOf(slave, request);
}

void RuleContext::BlameMapping(SlaveId slave, device::PdoDirection direction, FindingIndex finding) {
  explanations_.BlameMapping(slave, direction, finding);
}

FindingIndex RuleContext::MappingFault(SlaveId slave, device::PdoDirection direction) const {
  return explanations_.MappingFault(slave, direction);
}

std::string RuleContext::Label(SlaveId slave) const {
  const bus::SlaveAddress& address = network().slaves()[slave];
  const SlavePos* position = address.position.if_known();
  const StationAddress* station = address.station.if_known();
  if (position != nullptr) return names().Of(*position, station != nullptr ? Hex(*station) : std::string());
  return station != nullptr ? "slave " + Hex(*station) : "slave";
}

std::int64_t RuleContext::Limit(std::string_view name, std::int64_t otherwise) const {
  const auto found = options_.limits.find(name);
  return found == options_.limits.end() ? otherwise : found->second;
}

}  // namespace ecaudit
