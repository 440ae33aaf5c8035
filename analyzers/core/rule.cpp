#include "analyzers/core/rule.h"

#include <algorithm>

#include "analyzers/model/bus_model.h"
#include "decoder/base/text.h"

namespace ecaudit {
namespace {

struct Entry {
  const RuleInfo* info;
  RuleRegistration::Factory factory;
};

/// Filled before main() by the registrations, read-only afterwards. A function, so that it exists when they run.
std::vector<Entry>& Entries() {
  static std::vector<Entry> entries;
  return entries;
}

std::vector<Entry> SortedEntries() {
  std::vector<Entry> entries = Entries();
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) { return a.info->id < b.info->id; });
  return entries;
}

}  // namespace

RuleRegistration::RuleRegistration(const RuleInfo& info, Factory factory) {
  Entries().push_back({&info, factory});
}

std::vector<std::unique_ptr<Rule>> MakeAllRules() {
  std::vector<std::unique_ptr<Rule>> rules;
  for (const Entry& entry : SortedEntries()) rules.push_back(entry.factory());
  return rules;
}

const std::vector<const RuleInfo*>& RuleCatalogue() {
  static const std::vector<const RuleInfo*> catalogue = [] {
    std::vector<const RuleInfo*> infos;
    for (const Entry& entry : SortedEntries()) infos.push_back(entry.info);
    return infos;
  }();
  return catalogue;
}

const RuleInfo* FindRule(std::string_view id) {
  for (const RuleInfo* info : RuleCatalogue()) {
    if (info->id == id) return info;
  }
  return nullptr;
}

bool Rule::SaidNothingReturned() {
  const bus::PairingStatistics& pairing = context_->pipeline->pairing();
  if (pairing.outbound == 0 || pairing.returned > 0) return false;
  NotEvaluable(kNoSlave, "no returned frames in the capture");
  return true;
}

bool Rule::SaidNothingSent() {
  const bus::PairingStatistics& pairing = context_->pipeline->pairing();
  if (pairing.returned == 0 || pairing.outbound > 0) return false;
  NotEvaluable(kNoSlave, "no outbound frames in the capture");
  return true;
}

void Rule::NotEvaluableWhere(const std::function<bool(const model::SlaveModel&)>& applies, const std::string& reason) {
  NotEvaluableFor([&](const model::SlaveModel& slave) { return applies(slave) ? reason : std::string(); });
}

void Rule::NotEvaluableFor(const std::function<std::string(const model::SlaveModel&)>& reason_of) {
  for (std::size_t id = 0; id < context_->bus.size(); ++id) {
    const auto slave = static_cast<SlaveId>(id);
    std::string reason = reason_of(context_->bus.slave(slave));
    if (!reason.empty()) NotEvaluable(slave, std::move(reason));
  }
}

void Rule::SayWhereRequestsAreNotFollowed() {
  if (SaidNothingReturned()) return;
  NotEvaluableWhere([](const model::SlaveModel& s) { return s.al.requests() > 0 && s.al.reads_after_request() == 0; },
                    "AL Status was not read after a request");
}

void RuleContext::ExplainRequest(SlaveId slave, FrameNo request, FindingIndex finding) {
  if (finding == kNoFinding) return;
  explanations_[next_explanation_++ % explanations_.size()] = {slave, request, finding};
}

FindingIndex RuleContext::ExplanationOf(SlaveId slave, FrameNo request) const {
  for (std::size_t back = 1; back <= explanations_.size() && back <= next_explanation_; ++back) {
    const Explanation& e = explanations_[(next_explanation_ - back) % explanations_.size()];
    if (e.slave == slave && e.request == request) return e.finding;
  }
  return kNoFinding;
}

void RuleContext::BlameMapping(SlaveId slave, device::PdoDirection direction, FindingIndex finding) {
  mapping_faults_[{slave, direction}] = finding;
}

FindingIndex RuleContext::MappingFault(SlaveId slave, device::PdoDirection direction) const {
  const auto found = mapping_faults_.find({slave, direction});
  return found == mapping_faults_.end() ? kNoFinding : found->second;
}

std::string RuleContext::Label(SlaveId slave) const {
  const bus::SlaveAddress& address = bus.network().slaves()[slave];
  const SlavePos* position = address.position.if_known();
  const StationAddress* station = address.station.if_known();
  std::string out = "slave";
  if (position != nullptr) out += ' ' + std::to_string(*position);
  if (station != nullptr) out += position != nullptr ? " (" + Hex(*station) + ")" : ' ' + Hex(*station);
  return out;
}

std::int64_t RuleContext::Limit(std::string_view name, std::int64_t otherwise) const {
  const auto found = options.limits.find(name);
  return found == options.limits.end() ? otherwise : found->second;
}

Evidence Number(std::string name, std::int64_t value) {
  return {std::move(name), value, Evidence::Notation::kDecimal};
}
Evidence HexNumber(std::string name, std::uint64_t value) {
  return {std::move(name), static_cast<std::int64_t>(value), Evidence::Notation::kHex};
}
Evidence Text(std::string name, std::string value) {
  return {std::move(name), std::move(value), Evidence::Notation::kDecimal};
}
Evidence Real(std::string name, double value) {
  return {std::move(name), value, Evidence::Notation::kDecimal};
}

}  // namespace ecaudit
