#include "analyzers/judge/rule.h"

#include <algorithm>
#include <random>
#include <set>
#include <string_view>
#include <utility>

#include "analyzers/judge/catalogue.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/what.h"
#include "decoder/bus/pairing.h"

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

/// Asked for when all are registered.
const std::vector<Entry>& SortedEntries() {
  static const std::vector<Entry> sorted = [] {
    std::vector<Entry> entries = Entries();
    std::ranges::sort(entries, [](const Entry& a, const Entry& b) { return a.info->id < b.info->id; });
    return entries;
  }();
  return sorted;
}

}  // namespace

RuleRegistration::RuleRegistration(const RuleInfo& info, Factory factory) {
  Entries().push_back({&info, factory});
}

std::vector<std::unique_ptr<Rule>> MakeAllRules(std::uint32_t shuffle) {
  std::vector<const Entry*> left;
  for (const Entry& entry : SortedEntries()) left.push_back(&entry);
  if (shuffle != 0) std::shuffle(left.begin(), left.end(), std::mt19937(shuffle));
  std::vector<std::unique_ptr<Rule>> rules;
  std::set<std::string_view> made;
  while (!left.empty()) {
    // The first that waits for none of the others. Where rules wait for each other in a circle (a test forbids it),
    // any.
    auto next = std::ranges::find_if(left, [&](const Entry* entry) {
      return std::ranges::none_of(entry->info->after, [&](std::string_view earlier) {
        return !made.contains(earlier) && FindRule(earlier) != nullptr;
      });
    });
    if (next == left.end()) next = left.begin();
    rules.push_back((*next)->factory());
    made.insert((*next)->info->id);
    left.erase(next);
  }
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

void Rule::Attach(RuleContext& context, EventBus& bus) {
  context_ = &context;
  for (const EventBus::Subscription& subscription : subscriptions_) bus.Add(subscription);
}

FindingIndex Rule::Repeat(SlaveId slave, std::uint64_t key, const FrameRef& frame) {
  return context_->store.Repeat(info_, slave, key, frame);
}

FindingIndex Rule::Report(std::uint64_t key, Finding finding) {
  return context_->store.Add(info_, key, std::move(finding));
}

FindingIndex Rule::Report(std::uint64_t key, Severity severity, Finding finding) {
  return context_->store.Add(info_, key, severity, std::move(finding));
}

void Rule::NotEvaluable(SlaveId slave, Reason reason, FrameNo frame) {
  context_->store.AddNotEvaluable(info_, slave, std::move(reason), frame);
}

bool Rule::NotEvaluableWithoutReturns() {
  const bus::PairingStatistics& pairing = context_->pairing();
  if (pairing.outbound == 0 || pairing.returned > pairing.other_end) return false;
  NotEvaluable(kNoSlave, ReasonCode::kNoReturnedFrames);
  return true;
}

bool Rule::NotEvaluableWithoutSent() {
  const bus::PairingStatistics& pairing = context_->pairing();
  if (pairing.returned == 0 || pairing.outbound > 0) return false;
  NotEvaluable(kNoSlave, ReasonCode::kNoOutboundFrames);
  return true;
}

const model::SlaveModel* Rule::SlaveOrNull(SlaveId id) const {
  return id < context_->slave_count() ? &context_->slave(id) : nullptr;
}

void Rule::NotEvaluableWhereRequestsAreNotFollowed() {
  if (NotEvaluableWithoutReturns()) return;
  NotEvaluableWhere([](const model::SlaveModel& s) { return s.al.requests() > 0 && s.al.reads_after_request() == 0; },
                    Reason::Of(ReasonCode::kNotRead, what::kAlStatusAfter));
}

}  // namespace ecaudit
