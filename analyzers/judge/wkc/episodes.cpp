#include "analyzers/judge/wkc/episodes.h"

#include <algorithm>
#include <utility>

#include "analyzers/judge/shared_notes.h"
#include "analyzers/judge/wkc/causes.h"
#include "analyzers/judge/wkc/expected_shares.h"
#include "analyzers/judge/wkc/kinds.h"
#include "analyzers/judge/wkc/thresholds.h"
#include "analyzers/model/bus_model.h"
#include "decoder/track/network.h"

namespace ecaudit::wkc {
namespace {

constexpr std::size_t kMaxEpisodes = 32;

void AddHint(Finding& finding, const Episode& episode) {
  if (!episode.hint) return;
  finding.notes.push_back(*episode.hint);
  const NoteKind* kind = episode.hint->kind;
  if (kind == &kMoreCounted) finding.Set("more_counted", arg::Flag());
  if (kind != &kOutputsMissing && kind != &kInputsMissing) return;
  finding.Set(kind == &kOutputsMissing ? "outputs_of" : "inputs_of", *episode.hint->arguments.Find("slave"));
  if (const Value* manager = episode.hint->arguments.Find("sync_manager")) finding.Set("sync_manager", *manager);
}

void AddSeveralMissing(const RuleContext& context, Finding& finding, const NoteKind& note,
                       const std::vector<SlaveId>& slaves) {
  std::vector<Value> labels;
  for (const SlaveId slave : slaves) labels.push_back(SlaveValue(context, slave));
  Value list = arg::List(std::move(labels));
  finding.Add(note, {{"slaves", list}});
  finding.Set("missing", std::move(list));
}

/// The only slave whose inputs returned unchanged.
SlaveId OnlySilent(const Episode& episode) {
  SlaveId missing = kNoSlave;
  std::size_t silent = 0;
  for (const Episode::Watched& w : episode.slaves) {
    if (w.refreshed != 0) continue;
    ++silent;
    missing = w.slave;
  }
  return episode.frames >= threshold::kSilentFrames && silent == 1 ? missing : kNoSlave;
}

/// The slaves after the place where the bus ends since about then, if exactly their shares are missing. A slave that
/// still delivers inputs has not left, whatever its position.
std::vector<SlaveId> SlavesThatLeft(const RuleContext& context, const Episode& episode) {
  const Finding& own = context.store[episode.finding];
  for (const Finding& f : context.store.findings()) {
    if (f.rule != "bus-slave-count-changed" || Distance(f, own) > threshold::kAtOnceFrames) continue;
    const std::optional<std::int64_t> end = SlavesNow(f);
    if (!end || IsOfABranch(f)) continue;
    int worth = 0;
    std::vector<SlaveId> left;
    for (const Episode::Watched& w : episode.slaves) {
      const SlavePos* position = context.network().slaves()[w.slave].position.if_known();
      if (position == nullptr || *position < *end || w.refreshed != 0) continue;
      worth += w.worth;
      left.push_back(w.slave);
    }
    if (worth == episode.missing) return left;
  }
  return {};
}

/// Several slaves that stopped answering at about that time, if exactly their shares are missing.
std::vector<SlaveId> SlavesAway(const RuleContext& context, const Episode& episode) {
  const Finding& own = context.store[episode.finding];
  int worth = 0;
  std::vector<SlaveId> away;
  for (const Finding& f : context.store.findings()) {
    if (!IsAway(f) || f.first.number > own.last.number + threshold::kLaterFrames) continue;
    if (f.last.number < own.first.number) continue;
    for (const Episode::Watched& w : episode.slaves) {
      if (w.slave != f.slave) continue;
      worth += w.worth;
      away.push_back(w.slave);
    }
  }
  return worth == episode.missing ? away : std::vector<SlaveId>{};
}

void NameMissingOf(RuleContext& context, const Episode& episode) {
  if (episode.finding == kNoFinding) return;
  Finding& finding = context.store[episode.finding];
  const std::vector<SlaveId> left = SlavesThatLeft(context, episode);
  if (left.size() > 1) return AddSeveralMissing(context, finding, kLeftTheBus, left);
  const std::vector<SlaveId> away = SlavesAway(context, episode);
  if (away.size() > 1) return AddSeveralMissing(context, finding, kAllAway, away);
  AddHint(finding, episode);
  SlaveId missing = episode.only_candidate;
  const auto name = [&](SlaveId slave, const NoteKind& note) {
    missing = slave;
    finding.Add(note, {{"slave", SlaveValue(context, slave)}});
  };
  if (missing != kNoSlave) {
    // Its share alone fits.
  } else if (const SlaveId silent = OnlySilent(episode); silent != kNoSlave) {
    name(silent, kInputsNotRefreshed);
    finding.confidence = Confidence::kInferred;
  } else if (away.size() == 1) {
    name(away.front(), kOneAway);
  } else if (left.size() == 1) {
    name(left.front(), kOneLeft);
  } else {
    return;
  }
  finding.slave = missing;
  finding.Set("missing", SlaveValue(context, missing));
}

}  // namespace

Episode* Episodes::Find(std::uint64_t key) {
  const auto episode = std::ranges::find(episodes_, key, &Episode::key);
  return episode == episodes_.end() ? nullptr : &*episode;
}

void Episodes::Watch(std::uint64_t key, const model::LogicalExpectation& expected, const track::LogicalAccess& access) {
  Episode* episode = Find(key);
  if (episode == nullptr) {
    if (episodes_.size() >= kMaxEpisodes) return;
    episode = &episodes_.emplace_back();
    episode->key = key;
    for (const model::LogicalShare& share : expected.shares) {
      episode->slaves.push_back({share.slave, 0, model::WorthOf(share, access.command)});
    }
  }
  if (access.sent_data.empty() || episode->slaves.size() != expected.shares.size()) return;
  // In a capture downstream of slaves, the sent frame has their inputs already.
  if (access.sent_wkc != 0) return;
  ++episode->frames;
  for (std::size_t i = 0; i < expected.shares.size(); ++i) {
    const model::LogicalShare& share = expected.shares[i];
    const ByteSpan sent = Slice(access.sent_data, share.input_offset, share.input_bytes);
    const ByteSpan returned = Slice(access.returned_data, share.input_offset, share.input_bytes);
    if (!std::ranges::equal(sent, returned)) ++episode->slaves[i].refreshed;
  }
}

void Episodes::NameMissing(RuleContext& context) const {
  for (const Episode& episode : episodes_) NameMissingOf(context, episode);
}

void Episodes::AddWhoLeftItsState(RuleContext& context, Finding& own, Finding& cause) const {
  const auto several = std::ranges::find_if(own.notes, [](const Note& note) { return note.kind == &kSeveralFit; });
  if (cause.rule != "al-unexpected-change" || cause.slave == kNoSlave || several == own.notes.end()) return;
  for (const Episode& episode : episodes_) {
    if (episode.finding == kNoFinding || &context.store[episode.finding] != &own) continue;
    const bool fits = std::ranges::any_of(episode.slaves, [&](const Episode::Watched& w) {
      return w.slave == cause.slave && w.worth >= episode.missing;
    });
    if (!fits) continue;
    several->kind = &kFitsSlaveThatLeftState;
    several->arguments.Set("slave", SlaveValue(context, cause.slave));
    if (own.first.number < cause.first.number) {
      cause.Add(kWorkingCounterMissing, {{"since", arg::Frame(own.first.number)}});
      AddRelated(cause, own.first.number);
    }
    return;
  }
}

}  // namespace ecaudit::wkc
