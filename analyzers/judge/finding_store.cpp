#include "analyzers/judge/finding_store.h"

#include <algorithm>
#include <utility>

#include "analyzers/result/every_slave.h"

namespace ecaudit {
namespace {

const Reason& MoreThanListed() {
  static constexpr Word kSlavesOrReasons{"slaves-or-reasons", "slaves or reasons", true};
  static const Reason reason = Reason::Of(ReasonCode::kListFull, kSlavesOrReasons);
  return reason;
}

}  // namespace

bool FindingStore::IsOff(const RuleInfo& rule) const {
  const auto setting = settings_.find(rule.id);
  return setting != settings_.end() && setting->second.off;
}

FindingIndex FindingStore::Repeat(const RuleInfo& rule, SlaveId slave, std::uint64_t key, const FrameRef& frame) {
  const auto found = by_key_.find(Key{&rule, slave, key});
  if (found == by_key_.end()) return kNoFinding;
  Finding& finding = findings_[found->second];
  ++finding.count;
  finding.last = frame;
  return found->second;
}

FindingIndex FindingStore::Add(const RuleInfo& rule, std::uint64_t key, Finding finding) {
  return Add(rule, key, rule.severity, std::move(finding));
}

FindingIndex FindingStore::CountOn(FindingIndex index, const Finding& finding) {
  Finding& folded = findings_[index];
  ++folded.count;
  folded.last = finding.first;
  return index;
}

FindingIndex FindingStore::Add(const RuleInfo& rule, std::uint64_t key, Severity severity, Finding finding) {
  if (IsOff(rule)) return kNoFinding;
  const auto setting = settings_.find(rule.id);
  const bool chosen = setting != settings_.end();
  finding.severity = chosen ? setting->second.severity : severity;
  finding.severity_is_lowered = finding.severity < severity;
  Listed& of_slave = per_slave_[{&rule, finding.slave, finding.severity}];
  Listed& of_rule = per_rule_[{&rule, finding.severity}];
  std::size_t& listed = by_severity_[static_cast<std::size_t>(finding.severity)];
  const bool full = listed >= kMaxFindings;
  if (full && of_slave.number > 0) {
    ++findings_left_out_;
    return CountOn(of_slave.last, finding);
  }
  if (of_slave.number >= kMaxPerRuleAndSlave) {
    ++counted_on_slave_;
    return CountOn(of_slave.last, finding);
  }
  if (listed >= kMaxWithFirstOnes && of_rule.number > 0) {
    ++findings_left_out_;
    return CountOn(of_rule.last, finding);
  }
  finding.rule = rule.id;
  if (!finding.last.seen()) finding.last = finding.first;
  if (finding.reference.document.empty()) finding.reference = ReferenceTo(rule.source);
  const auto index = static_cast<FindingIndex>(findings_.size());
  by_key_[Key{&rule, finding.slave, key}] = index;
  ++of_slave.number;
  ++of_rule.number;
  ++listed;
  of_slave.last = of_rule.last = index;
  finding.arguments.ShrinkToFit();  // kept to the end, and most are complete
  findings_.push_back(std::move(finding));
  return index;
}

void FindingStore::Regrade(FindingIndex index, Severity severity) {
  Finding& finding = findings_[index];
  if (settings_.find(finding.rule) == settings_.end()) finding.severity = severity;
  finding.severity_is_lowered = finding.severity < severity;
}

FindingStore::Group& FindingStore::GroupOf(std::string_view rule, const Reason& reason) {
  auto& reasons = group_of_[rule];
  auto found = reasons.find(reason);
  if (found == reasons.end() && reasons.size() >= kMaxReasons) {
    if (!(reason == MoreThanListed())) return GroupOf(rule, MoreThanListed());
  }
  if (found == reasons.end()) {
    found = reasons.emplace(reason, groups_.size()).first;
    groups_.push_back({rule, reason, {}});
  }
  return groups_[found->second];
}

void FindingStore::AddNotEvaluable(const RuleInfo& rule, SlaveId slave, const Reason& reason, FrameNo frame) {
  if (IsOff(rule)) return;
  const auto find = [](Group& group, SlaveId of) {
    // Nearly always in the order of the slaves, or about the last one again.
    const bool behind = group.places.empty() || group.places.back().slave < of;
    return behind ? group.places.end() : std::ranges::lower_bound(group.places, of, {}, &Place::slave);
  };
  Group* group = &GroupOf(rule.id, reason);
  auto place = find(*group, slave);
  bool listed = place != group->places.end() && place->slave == slave;
  // Beyond the limit one entry for each rule stands for the rest: what is not listed must not look evaluated.
  if (!listed && lines_ >= kMaxNotEvaluable) {
    slave = kNoSlave;
    group = &GroupOf(rule.id, MoreThanListed());
    place = find(*group, slave);
    listed = place != group->places.end() && place->slave == slave;
    ++lines_left_out_;
  }
  if (listed) {
    ++place->occasions;
    if (frame == 0) place->first_frame = 0;  // it holds for the whole capture after all
    return;
  }
  group->places.insert(place, {slave, static_cast<std::uint32_t>(lines_), frame, 1});
  ++lines_;
}

void FindingStore::Replace(SlaveId slave, SlaveId successor) {
  for (Finding& finding : findings_) {
    if (finding.slave == slave) finding.slave = successor;
  }
  for (Group& group : groups_) {
    std::erase_if(group.places, [&](const Place& place) { return place.slave == slave; });
  }
}

namespace {

struct Ordered {
  std::uint32_t order = 0;
  NotEvaluable line;
};

std::vector<NotEvaluable> InOrder(std::vector<Ordered> lines) {
  std::ranges::sort(lines, {}, &Ordered::order);
  std::vector<NotEvaluable> out;
  out.reserve(lines.size());
  for (Ordered& line : lines) out.push_back(std::move(line.line));
  return out;
}

}  // namespace

std::vector<NotEvaluable> FindingStore::not_evaluable() const {
  if (folded_) return *folded_;
  std::vector<Ordered> lines;
  lines.reserve(lines_);
  for (const Group& group : groups_) {
    for (const Place& place : group.places) {
      lines.push_back({place.order, {group.rule, place.slave, group.reason, place.first_frame, place.occasions}});
    }
  }
  return InOrder(std::move(lines));
}

void FindingStore::FoldNotEvaluable(std::size_t slaves) {
  // Folded first, and only then cut: what holds for every slave is one line, however many slaves there are.
  std::vector<Ordered> lines;
  struct Single {
    const Group* group;
    std::size_t count;
  };
  std::vector<Single> single;
  std::size_t listed = 0;
  const auto as_one = [&](const Group& group, SlaveId slave, std::uint64_t not_named) {
    Ordered all{0, {group.rule, slave, group.reason, 0, 0, not_named}};
    bool first = true;
    for (const Place& place : group.places) {
      if (place.slave == kNoSlave) continue;
      if (first || place.order < all.order) all.order = place.order;
      if (first || place.first_frame < all.line.first_frame) all.line.first_frame = place.first_frame;
      all.line.occasions += place.occasions;
      first = false;
    }
    lines.push_back(std::move(all));
  };
  for (const Group& group : groups_) {
    std::size_t of_slaves = group.places.size();
    for (const Place& place : group.places) {
      if (place.slave != kNoSlave) continue;
      --of_slaves;
      lines.push_back({place.order, {group.rule, kNoSlave, group.reason, place.first_frame, place.occasions}});
    }
    if (of_slaves == 0) continue;
    if (slaves >= 2 && of_slaves >= slaves) {
      as_one(group, kEverySlave, 0);
    } else {
      single.push_back({&group, of_slaves});
      listed += of_slaves;
    }
  }
  std::ranges::stable_sort(single, [](const Single& a, const Single& b) { return a.count > b.count; });
  for (const Single& part : single) {
    if (listed + lines.size() > kMaxListed && part.count > 1) {
      as_one(*part.group, kNoSlave, part.count);
      listed -= part.count;
      lines_left_out_ += part.count;
      continue;
    }
    for (const Place& place : part.group->places) {
      if (place.slave == kNoSlave) continue;
      lines.push_back(
          {place.order, {part.group->rule, place.slave, part.group->reason, place.first_frame, place.occasions}});
      --listed;
    }
  }
  folded_ = InOrder(std::move(lines));
  CutListed();
}

/// Reasons without end, each for one slave: what is not listed must not look evaluated, so its rule still has a line.
void FindingStore::CutListed() {
  std::vector<NotEvaluable>& lines = *folded_;
  if (lines.size() <= kMaxListed) return;
  std::map<std::string_view, NotEvaluable> rest;
  for (std::size_t i = kMaxListed; i < lines.size(); ++i) {
    const NotEvaluable& line = lines[i];
    NotEvaluable& of_rule =
        rest.try_emplace(line.rule, NotEvaluable{line.rule, kNoSlave, MoreThanListed(), line.first_frame, 0})
            .first->second;
    of_rule.first_frame = std::min(of_rule.first_frame, line.first_frame);
    of_rule.occasions += line.occasions;
    ++lines_left_out_;
  }
  lines.resize(kMaxListed);
  for (auto& [rule, line] : rest) lines.push_back(std::move(line));
}

void AddRelated(Finding& finding, FrameNo frame) {
  if (frame == 0 || finding.related_frames.size() >= FindingStore::kMaxRelatedFrames) return;
  if (std::ranges::find(finding.related_frames, frame) != finding.related_frames.end()) {
    return;
  }
  finding.related_frames.push_back(frame);
}

}  // namespace ecaudit
