#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include "analyzers/judge/refusal_predictions.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/sync_manager_text.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/model/sync_manager_demand.h"
#include "decoder/base/text.h"
#include "decoder/track/network.h"

namespace ecaudit::sm_overlap {
namespace {

constexpr RuleInfo kInfo{.id = "sm-overlap",
                         .group = "Sync managers and FMMUs",
                         .severity = Severity::kError,
                         .title = "Two enabled sync managers share bytes of the slave's memory",
                         .needs = "the settings of all sync managers that the master uses",
                         .source = "ESC-1, sync manager; ETG1000.4, sync managers",
                         .doc = R"(
## What it checks
When the master requests PREOP, SAFEOP or OP upwards: whether the memory of two enabled sync managers overlaps. In
three-buffer mode a sync manager takes three times its length: start to start + 3 x length - 1.

## Why it matters
The buffers overwrite each other: process data turn up in the mailbox, inputs in the outputs. Most slaves check for it
and refuse the state.

## How it is decided
From the settings as they stand when the state is requested, so that intermediate steps of a configuration do not count.
Sync managers that are switched off or of length 0 take no memory. Where start and length of both are what the slave's
EEPROM or manual asks for and only the second and third buffer overlap, the layout is the slave's own: an info. Where
sync-manager settings are wrong otherwise, the overlap follows from that (caused_by).

## Example
samples/captures/sm-overlap.pcapng

## What to do
Take the start addresses from the EEPROM or ESI file. Where the process data grew, leave room for three buffers before
the next sync manager.
)"};

class SmOverlap final : public Rule {
 public:
  SmOverlap() : Rule(kInfo) {
    Subscribe<model::AlRequestJudged>(&SmOverlap::On);
    Subscribe<model::AlAnswered>(&SmOverlap::On);
  }

  void On(const model::AlRequestJudged& e) {
    const model::AlRequestRecord& request = e.request;
    const std::uint8_t to = request.control.state();
    if (request.verdict != model::AlVerdict::kLegal || request.from == 0 || !Upwards(request.from, to)) return;
    judged_.insert(e.slave);
    const track::SlaveState& state = context().network().state(e.slave);
    std::vector<Used> used;
    for (std::size_t n = 0; n < esc::kMaxSyncManagers; ++n) {
      const auto known = SyncManagerOf(state, n);
      if (known && known->settings.enabled() && known->settings.occupied_bytes() != 0) used.push_back({n, *known});
    }
    for (std::size_t a = 0; a < used.size(); ++a) {
      for (std::size_t b = a + 1; b < used.size(); ++b) {
        const esc::SyncManager& x = used[a].known.settings;
        const esc::SyncManager& y = used[b].known.settings;
        if (x.start < EndOf(y) && y.start < EndOf(x)) Tell(e, used[a], used[b]);
      }
    }
  }

  void On(const model::AlAnswered& e) { predictions_.On(context(), e); }

  void Finish() override {
    for (const Told& told : told_) {
      // Wrong settings of one of the two, reported for the same request, are the reason.
      const std::vector<Finding>& findings = context().store.findings();
      for (std::size_t i = 0; i < findings.size(); ++i) {
        const Finding& other = findings[i];
        if (other.rule != "sm-mailbox-config" && other.rule != "sm-process-config") continue;
        if (other.slave != findings[told.finding].slave) continue;
        if (told.request < other.first.number || told.request > other.last.number) continue;
        context().store[told.finding].caused_by = static_cast<FindingIndex>(i);
      }
    }
    SayWhereNothingWasRequested();
  }

 private:
  struct Used {
    std::size_t number = 0;
    KnownSyncManager known;
  };
  struct Told {
    FindingIndex finding = kNoFinding;
    FrameNo request = 0;
  };

  /// First byte behind its memory. Below the process memory (digital I/O at 0x0F00) there are no further buffers.
  static std::uint32_t EndOf(const esc::SyncManager& sm) {
    constexpr std::uint16_t kProcessMemory = 0x1000;
    return sm.start < kProcessMemory ? sm.end() : sm.occupied_end();
  }

  static bool Upwards(std::uint8_t from, std::uint8_t to) {
    const auto height = [](std::uint8_t state) { return state == 3 ? 2 : state; };  // BOOT beside PREOP
    return height(to) > height(from);
  }

  /// Both as the slave wants them, and apart but for the second and third buffers.
  [[nodiscard]] bool SlavesOwnLayout(SlaveId slave, const Used& a, const Used& b) const {
    const esc::SyncManager& x = a.known.settings;
    const esc::SyncManager& y = b.known.settings;
    if (x.start < y.end() && y.start < x.end()) return false;
    const auto sii = esc::ParseSii(context().network().state(slave).sii.image());
    const device::DeviceDescription& family = *context().slave(slave).profile;
    const auto mailboxes = model::MailboxDemands(family, sii);
    const auto process = model::ProcessDemands(family, sii);
    const auto as_wanted = [&](const Used& used) {
      for (const auto* demands : {&mailboxes, &process}) {
        for (const model::SyncManagerDemand& demand : demands->list) {
          if (demand.number == used.number) return model::FaultsOf(used.known.settings, demand).empty();
        }
      }
      return false;
    };
    return as_wanted(a) && as_wanted(b);
  }

  void Tell(const model::AlRequestJudged& e, const Used& a, const Used& b) {
    const std::uint64_t key =
        KeyOfBoth(SettingsKey(a.number, a.known.settings), SettingsKey(b.number, b.known.settings));
    FindingIndex index = Repeat(e.slave, key, e.request.frame);
    if (index == kNoFinding) {
      const bool own = SlavesOwnLayout(e.slave, a, b);
      index = Report(key, own ? Severity::kInfo : Severity::kError, Describe(e, a, b, own));
      if (index != kNoFinding) told_.push_back({index, e.request.frame.number});
    }
    // Wrong settings that were named before are the nearer cause.
    if (context().ExplanationOf(e.slave, e.request.frame.number) == kNoFinding) {
      predictions_.Add(context(), e.slave, e.request.frame.number, index);
    }
  }

  Finding Describe(const model::AlRequestJudged& e, const Used& a, const Used& b, bool own) const {
    const esc::SyncManager& x = a.known.settings;
    const esc::SyncManager& y = b.known.settings;
    const auto area = [](const Used& used) {
      const esc::SyncManager& sm = used.known.settings;
      const bool three = EndOf(sm) != sm.end();
      return "sync manager " + std::to_string(used.number) + " takes " + Hex(sm.start) + " to " + Hex(EndOf(sm) - 1) +
             " (" + (three ? "three buffers of " : "one buffer of ") + Count(sm.length, "byte") + ", set in frame " +
             std::to_string(used.known.since) + ")";
    };
    const std::uint32_t first = std::max<std::uint32_t>(x.start, y.start);
    const std::uint32_t end = std::min(EndOf(x), EndOf(y));
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.request.frame;
    finding.title = "SM" + std::to_string(a.number) + " and SM" + std::to_string(b.number) + " share " +
                    Count(end - first, "byte") + " from " + Hex(first);
    finding.message = "When the master requests " + esc::StateName(e.request.control.state()) + " in frame " +
                      std::to_string(e.request.frame.number) + ", " + area(a) + " and " + area(b) + ". " +
                      Count(end - first, "byte") + " from " + Hex(first) + " on belong to both. ";
    finding.message += own ? "Start and length are what the slave itself asks for, so this is its own layout; it may "
                             "place the buffers otherwise. If process data are corrupted, use shorter PDOs."
                           : "Move one of them or make it shorter.";
    finding.evidence.push_back(Number("sync_manager", static_cast<std::int64_t>(a.number)));
    finding.evidence.push_back(Number("other_sync_manager", static_cast<std::int64_t>(b.number)));
    finding.evidence.push_back(HexNumber("first_shared", first));
    finding.evidence.push_back(Number("shared_bytes", end - first));
    AddRelated(finding, a.known.since);
    AddRelated(finding, b.known.since);
    if (!a.known.observed || !b.known.observed || e.request.assumed) finding.confidence = Confidence::kInferred;
    return finding;
  }

  /// A capture that begins in operation shows slaves at work whose sync managers were never seen.
  void SayWhereNothingWasRequested() {
    for (std::size_t s = 0; s < context().slave_count(); ++s) {
      const auto id = static_cast<SlaveId>(s);
      const model::AlMachine& al = context().slave(id).al;
      const bool at_work =
          al.SettledIn(esc::AlState::PREOP) || al.SettledIn(esc::AlState::SAFEOP) || al.SettledIn(esc::AlState::OP);
      if (!at_work || judged_.contains(id)) continue;

      NotEvaluable(id, "no request of a higher state from a known one is in the capture");
    }
  }

  RefusalPredictions predictions_;
  std::vector<Told> told_;
  std::set<SlaveId> judged_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<SmOverlap>};

}  // namespace
}  // namespace ecaudit::sm_overlap
