#include <algorithm>
#include <map>
#include <set>
#include <string_view>
#include <vector>

#include "analyzers/judge/refusal_predictions.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/sync_manager_text.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/model/sync_manager_demand.h"
#include "decoder/track/network.h"

namespace ecaudit::sm_overlap {
namespace {

constexpr std::string_view kTitle =
    "SM{sync_manager} and SM{other_sync_manager} share {shared_bytes} from {first_shared}";

constexpr FindingKind kOverlap{
    .name = "overlap",
    .title = kTitle,
    .message = R"(The master requests {requested} in {frame}. Sync manager {sync_manager} uses {start} to {end}
([{?three_buffers}three buffers][{!three_buffers}one buffer] of {length}, set in {set_frame}). Sync manager
{other_sync_manager} uses {other_start} to {other_end} ([{?other_three_buffers}three buffers][{!other_three_buffers}one
buffer] of {other_length}, set in {other_set_frame}). {shared_bytes} from {first_shared} on {shared_bytes?belongs|belong} to
both.)",
    .next = "Move one of them or make it shorter.",
    .identity = "sync_manager other_sync_manager first_shared"};

constexpr FindingKind kOwnLayout{
    .name = "own-layout",
    .title = kTitle,
    .message = R"(The master requests {requested} in {frame}. Sync manager {sync_manager} uses {start} to {end}
([{?three_buffers}three buffers][{!three_buffers}one buffer] of {length}, set in {set_frame}). Sync manager
{other_sync_manager} uses {other_start} to {other_end} ([{?other_three_buffers}three buffers][{!other_three_buffers}one
buffer] of {other_length}, set in {other_set_frame}). {shared_bytes} from {first_shared} on {shared_bytes?belongs|belong} to
both. Start and length are those that the slave requires, so this is its own layout. It may place the buffers elsewhere.)",
    .next = "Use shorter PDOs if process data are corrupted.",
    .identity = "sync_manager other_sync_manager first_shared"};

constexpr const FindingKind* kKinds[] = {&kOverlap, &kOwnLayout};

constexpr Word kRequestUpwards{"request-of-higher-state", "a request of a higher state from a known one"};

// A wrong range explains an overlap.
constexpr std::string_view kAfter[] = {"sm-mailbox-config", "sm-process-config"};

constexpr RuleInfo kInfo{.id = "sm-overlap",
                         .group = "Sync managers and FMMUs",
                         .severity = Severity::kError,
                         .title = "Two enabled sync managers share bytes of the slave's memory",
                         .needs = "the settings of all sync managers that the master uses",
                         .source = "ESC-1, sync manager; ETG1000.4, sync managers",
                         .kinds = kKinds,
                         .after = kAfter,
                         .doc = R"(
## What it checks
When the master requests PREOP, SAFEOP or OP upwards: whether the memory of two enabled sync managers overlaps. In
three-buffer mode a sync manager uses three times its length: start to start + 3 x length - 1.

## Why it matters
The buffers overwrite each other: process data appear in the mailbox, inputs in the outputs. Most slaves check this and
refuse the state.

## How it is decided
The settings at the time of the request count, so that intermediate steps of a configuration do not.

- Sync managers that are switched off or of length 0 use no memory.
- If start and length of both are those of the slave's EEPROM or manual, and only the second and third buffer overlap,
  the layout is the slave's own: an info.
- If other settings of the two sync managers are wrong, the overlap follows from that (caused_by).

## Example
samples/captures/sm-overlap.pcapng

## What to do
Use the start addresses of the EEPROM or ESI file. If the process data became longer, leave room for three buffers
before the next sync manager.
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
    evaluated_.insert(e.slave);
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
        if (x.start < EndOf(y) && y.start < EndOf(x)) ReportOverlap(e, used[a], used[b]);
      }
    }
  }

  void On(const model::AlAnswered& e) { predictions_.On(context(), e); }

  void Finish() override {
    // Wrong settings of one of the two, reported for the same request, are the reason.
    const std::vector<Finding>& findings = context().store.findings();
    std::vector<FindingIndex> wrong;
    for (std::size_t i = 0; i < findings.size(); ++i) {
      const Finding& other = findings[i];
      if (other.rule == "sm-mailbox-config" || other.rule == "sm-process-config") {
        wrong.push_back(static_cast<FindingIndex>(i));
      }
    }
    for (const auto& [finding, request] : reported_) {
      for (const FindingIndex cause : wrong) {
        const Finding& other = findings[cause];
        if (other.slave != findings[finding].slave) continue;
        if (request < other.first.number || request > other.last.number) continue;
        context().store[finding].caused_by = cause;
      }
    }
    AddWhereNothingWasRequested();
  }

 private:
  struct Used {
    std::size_t number = 0;
    KnownSyncManager known;
  };

  /// The byte following its memory. Below the process memory (digital I/O at 0x0F00) there are no further buffers.
  static std::uint32_t EndOf(const esc::SyncManager& sm) {
    constexpr std::uint16_t kProcessMemory = 0x1000;
    return sm.start < kProcessMemory ? sm.end() : sm.occupied_end();
  }

  static bool Upwards(std::uint8_t from, std::uint8_t to) {
    const auto height = [](std::uint8_t state) { return state == 3 ? 2 : state; };  // BOOT beside PREOP
    return height(to) > height(from);
  }

  /// Both have the settings that the slave requires, and overlap only in the second and third buffers.
  [[nodiscard]] bool SlavesOwnLayout(SlaveId slave, const Used& a, const Used& b) const {
    const esc::SyncManager& x = a.known.settings;
    const esc::SyncManager& y = b.known.settings;
    if (x.start < y.end() && y.start < x.end()) return false;
    const auto sii = esc::ParseSii(context().network().state(slave).sii.image());
    const device::DeviceDescription& family = *context().slave(slave).profile;
    const auto mailboxes = model::MailboxDemands(family, sii);
    const auto process = model::ProcessDemands(family, sii);
    const auto as_required = [&](const Used& used) {
      for (const auto* demands : {&mailboxes, &process}) {
        for (const model::SyncManagerDemand& demand : demands->list) {
          if (demand.number == used.number) return model::FaultsOf(used.known.settings, demand).empty();
        }
      }
      return false;
    };
    return as_required(a) && as_required(b);
  }

  void ReportOverlap(const model::AlRequestJudged& e, const Used& a, const Used& b) {
    const std::uint64_t key =
        KeyOfBoth(SettingsKey(a.number, a.known.settings), SettingsKey(b.number, b.known.settings));
    FindingIndex index = Repeat(e.slave, key, e.request.frame);
    if (index == kNoFinding) {
      const bool own = SlavesOwnLayout(e.slave, a, b);
      index = Report(key, own ? Severity::kInfo : Severity::kError, Describe(e, a, b, own));
      if (index != kNoFinding) reported_.try_emplace(index, e.request.frame.number);
    }
    // Wrong settings that were reported before are the nearer cause.
    if (context().ExplanationOf(e.slave, e.request.frame.number) == kNoFinding) {
      predictions_.Add(context(), e.slave, e.request.frame.number, index);
    }
  }

  static Finding Describe(const model::AlRequestJudged& e, const Used& a, const Used& b, bool own) {
    const esc::SyncManager& x = a.known.settings;
    const esc::SyncManager& y = b.known.settings;
    const std::uint32_t first = std::max<std::uint32_t>(x.start, y.start);
    const std::uint32_t end = std::min(EndOf(x), EndOf(y));
    Finding finding = Found(own ? kOwnLayout : kOverlap, e.slave, e.request.frame);
    finding.Set("sync_manager", arg::Number(static_cast<std::int64_t>(a.number)))
        .Set("other_sync_manager", arg::Number(static_cast<std::int64_t>(b.number)))
        .Set("first_shared", arg::Hex(first))
        .Set("shared_bytes", arg::Count(end - first, "byte"))
        .Set("requested", arg::State(e.request.control.state()))
        .Set("start", arg::Hex(x.start))
        .Set("end", arg::Hex(EndOf(x) - 1))
        .Set("three_buffers", arg::Flag(EndOf(x) != x.end()))
        .Set("length", arg::Count(x.length, "byte"))
        .Set("set_frame", arg::Frame(a.known.since))
        .Set("other_start", arg::Hex(y.start))
        .Set("other_end", arg::Hex(EndOf(y) - 1))
        .Set("other_three_buffers", arg::Flag(EndOf(y) != y.end()))
        .Set("other_length", arg::Count(y.length, "byte"))
        .Set("other_set_frame", arg::Frame(b.known.since));
    AddRelated(finding, a.known.since);
    AddRelated(finding, b.known.since);
    if (!a.known.observed || !b.known.observed || e.request.assumed) finding.confidence = Confidence::kInferred;
    return finding;
  }

  /// In a mid-run capture slaves are in operation, and their sync managers were never seen.
  void AddWhereNothingWasRequested() {
    for (std::size_t s = 0; s < context().slave_count(); ++s) {
      const auto id = static_cast<SlaveId>(s);
      const model::AlMachine& al = context().slave(id).al;
      const bool in_operation =
          al.SettledIn(esc::AlState::PREOP) || al.SettledIn(esc::AlState::SAFEOP) || al.SettledIn(esc::AlState::OP);
      if (!in_operation || evaluated_.contains(id)) continue;
      NotEvaluable(id, ReasonCode::kNotInCapture, kRequestUpwards);
    }
  }

  RefusalPredictions predictions_;
  std::map<FindingIndex, FrameNo> reported_;  // with the first request
  std::set<SlaveId> evaluated_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<SmOverlap>};

}  // namespace
}  // namespace ecaudit::sm_overlap
