#include "analyzers/judge/coverage.h"

#include <algorithm>
#include <array>
#include <functional>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "analyzers/judge/catalogue.h"
#include "analyzers/judge/drive_knowledge.h"
#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/sync_text.h"
#include "analyzers/model/drive_parameters.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/options/options.h"
#include "analyzers/sync/sync_model.h"
#include "analyzers/words/what.h"
#include "decoder/esc/al.h"
#include "decoder/track/network.h"

namespace ecaudit {
namespace {

/// What the rules of a chapter are about, where they do not name it themselves.
constexpr std::array<std::pair<std::string_view, Subject>, 10> kChapters{
    {{"Capture", Subject::kCapture},
     {"Frame and bus", Subject::kBus},
     {"AL state machine", Subject::kAlState},
     {"Sync managers and FMMUs", Subject::kConfiguration},
     {"Mailbox and CoE", Subject::kMailbox},
     {"PDO mapping", Subject::kMapping},
     {"Drive profile (DS402)", Subject::kDrive},
     {"Synchronisation", Subject::kProcessData},
     {"Latch", Subject::kLatch},
     {"Start-up", Subject::kExpectation}}};

/// Whether there is something that a rule could look at.
struct Presence {
  NotApplicable absent = NotApplicable::kApplies;
  std::optional<Reason> unseen;  ///< there may be, and the capture does not show it; unset: it does
};

Presence Absent(NotApplicable why) {
  return {why, {}};
}

Presence Unseen(const Reason& why) {
  return {NotApplicable::kApplies, why};
}

Presence Unseen(ReasonCode code, const Word& what) {
  return Unseen(Reason::Of(code, what));
}

bool InState(const SlaveSummary& slave, esc::AlState state) {
  return slave.al_status && esc::AlWord{*slave.al_status}.state() == static_cast<std::uint8_t>(state);
}

/// True when a state was requested of it, whether it took the request or not.
bool IsAsked(const SlaveSummary& slave, const model::SlaveModel& model) {
  return model.al.requests() > 0 ||
         std::ranges::any_of(slave.al_history, [](const AlStep& step) { return step.kind == AlStep::Kind::kRequest; });
}

bool IsBelowSafeop(const SlaveSummary& slave) {
  return InState(slave, esc::AlState::INIT) || InState(slave, esc::AlState::PREOP) ||
         InState(slave, esc::AlState::BOOT);
}

bool MayExchange(const SlaveSummary& slave, const model::SlaveModel& model) {
  return model.al.operated() || !IsBelowSafeop(slave);
}

bool Exchanges(const SlaveSummary& slave) {
  return slave.rx_pdo.exchanged + slave.tx_pdo.exchanged > 0;
}

Presence OfProcessData(const SlaveSummary& slave, const RuleContext& context, const AnalysisResult& result) {
  const model::SlaveModel& model = context.slave(slave.id);
  if (Exchanges(slave)) return {};
  // Who was seen to be started had its FMMUs set before the eyes of the capture.
  const bool may_have_them =
      result.bus.cycle.cycles > 0 && slave.fmmus.empty() && !IsAsked(slave, model) && !IsBelowSafeop(slave);
  // Process data without a known owner belong to some slave, whichever was seen to be started.
  const bool without_owner = result.bus.cycle.cycles > 0 && slave.fmmus.empty() && MayExchange(slave, model) &&
                             std::ranges::none_of(result.slaves, Exchanges);
  // Where packets are missing, those may have held the request for SAFEOP and the FMMUs: what its AL state was before
  // shows nothing of the process data after them.
  const bool may_have_missed_them =
      slave.fmmus.empty() && MissesAny(context.pairing()) && (model.al.operated() || result.bus.cycle.cycles > 0);
  if (may_have_them || without_owner || may_have_missed_them) {
    return Unseen(ReasonCode::kNotInCapture, what::kProcessDataOwner);
  }
  return Absent(NotApplicable::kNoProcessData);
}

/// Intervals between its process data.
Presence OfTiming(const SlaveSummary& slave, const RuleContext& context, const AnalysisResult& result) {
  Presence data = OfProcessData(slave, context, result);
  if (data.absent != NotApplicable::kApplies || data.unseen) return data;
  sync::TimeBase base = context.sync().outputs(slave.id).rate.base();
  if (base == sync::TimeBase::kNone) base = sync::TimeBase::kCapture;
  return context.sync().Uncertainty(base) ? Presence{} : Unseen(ReasonCode::kStampsTooCoarse, what::kProcessDataTiming);
}

/// A cycle time that they can be compared with.
Presence OfCycle(const SlaveSummary& slave, const RuleContext& context, const AnalysisResult& result) {
  const model::SlaveModel& model = context.slave(slave.id);
  Presence data = OfProcessData(slave, context, result);
  if (data.absent != NotApplicable::kApplies || data.unseen) return data;
  const auto& settings = context.sync().dc(slave.id).last_active();
  const bool by_clock = settings && settings->activation.sync0();
  return by_clock || model::InterpolationTime(model) || DriveCycle(model) ? Presence{}
                                                                          : Absent(NotApplicable::kNoCycle);
}

/// What is mapped to the outputs, or to the inputs.
Presence OfDirection(const SlaveSummary& slave, bool outputs, const RuleContext& context,
                     const AnalysisResult& result) {
  const PdoSummary& pdo = outputs ? slave.rx_pdo : slave.tx_pdo;
  if (pdo.source != PdoSummary::Source::kUnknown) return {};
  const bool has_buffer = std::ranges::any_of(slave.sync_managers, [&](const SyncManagerSummary& manager) {
    return manager.enabled && !manager.mailbox && manager.ecat_writes == outputs;
  });
  if (has_buffer || pdo.exchanged > 0) return Unseen(ReasonCode::kNotInCapture, what::kMapping);
  return OfProcessData(slave, context, result);
}

Presence OfMapping(const SlaveSummary& slave, const RuleContext& context, const AnalysisResult& result) {
  Presence outputs = OfDirection(slave, true, context, result);
  const bool known =
      slave.rx_pdo.source != PdoSummary::Source::kUnknown || slave.tx_pdo.source != PdoSummary::Source::kUnknown;
  if (known || outputs.unseen) return known ? Presence{} : outputs;
  return OfDirection(slave, false, context, result);
}

Presence OfConfiguration(const SlaveSummary& slave) {
  if (!slave.sync_managers.empty() || !slave.fmmus.empty()) return {};
  if (InState(slave, esc::AlState::INIT)) return Absent(NotApplicable::kInInit);
  return Unseen(ReasonCode::kNotInCapture, what::kSyncManagersAndFmmus);
}

bool Speaks(const MailboxSummary& mailbox, std::string_view protocol) {
  return std::ranges::any_of(mailbox.by_protocol,
                             [&](const MailboxSummary::Messages& messages) { return messages.protocol == protocol; });
}

Presence OfDrive(const SlaveSummary& slave, const model::SlaveModel& model) {
  if (slave.drive || model.drives.axis(0).modes().requested()) return {};
  if (Speaks(slave.mailbox, "SoE")) return Unseen(ReasonCode::kNotFollowed, what::kSoeState);
  const std::optional<Reason> why = DriveWordsMissing(model, false);
  if (!why) return Absent(NotApplicable::kNoDrive);
  const bool is_drive = !model.profile->drive->control_word_in.empty();
  return Unseen(is_drive ? Reason::Of(ReasonCode::kNotInCapture, what::kDriveWords) : *why);
}

Presence OfClock(const SlaveSummary& slave) {
  const bool used = slave.dc && (slave.dc->reference || slave.dc->delay_ns || slave.dc->difference_reads > 0 ||
                                 slave.dc->activated.seen());
  return used ? Presence{} : Absent(NotApplicable::kClockUnused);
}

/// The capture does not show which device it is.
bool FamilyUnseen(const model::SlaveModel& model) {
  return model.profile->id == "generic" && (!model.identity.vendor_id || !model.identity.product_code);
}

Presence OfFaultBits(const SlaveSummary& slave, const model::SlaveModel& model) {
  const auto is_sign = [](const auto& row) { return row.sign != device::BitSign::kNone; };
  const auto& rows = model.profile->object_bits;
  if (std::ranges::any_of(rows, is_sign)) return {};
  const auto& drive = model.profile->drive;
  if (drive && std::ranges::any_of(drive->status_bits, is_sign)) return OfDrive(slave, model);
  return FamilyUnseen(model) && Speaks(slave.mailbox, "CoE") ? Unseen(Reason::Of(ReasonCode::kFamilyUnknown))
                                                             : Absent(NotApplicable::kNoFaultBits);
}

Presence OfLatch(const SlaveSummary& slave, const RuleContext& context, const AnalysisResult& result) {
  if (slave.latch) return {};
  if (slave.touch_probe) return Unseen(ReasonCode::kNotFollowed, what::kTouchProbe);
  const model::SlaveModel& model = context.slave(slave.id);
  if (model.latch.description() == nullptr) {
    return FamilyUnseen(model) && Exchanges(slave) ? Unseen(Reason::Of(ReasonCode::kFamilyUnknown))
                                                   : Absent(NotApplicable::kNoLatch);
  }
  // Where a mapping is not known, latch words may be among the process data: the control word among the outputs, the
  // status word and positions among the inputs.
  for (const bool outputs : {true, false}) {
    Presence mapping = OfDirection(slave, outputs, context, result);
    if (mapping.unseen) return mapping;
  }
  return Absent(NotApplicable::kLatchUnused);
}

/// Requests without an answer are counted; for others it is unknown where the answers were. Where nothing that
/// came back was captured, the rules evaluate what they can by the requests, and report that themselves.
bool AnswersUnknown(const MailboxSummary& mailbox, const AnalysisResult& result) {
  return result.capture.direction != DirectionSeen::kOutbound && mailbox.requests > 0 && mailbox.responses == 0 &&
         mailbox.unanswered == 0;
}

Presence OfMailbox(const MailboxSummary& mailbox, bool coe, const AnalysisResult& result) {
  if (mailbox.requests + mailbox.responses == 0) return Absent(NotApplicable::kMailboxUnused);
  if (coe && !Speaks(mailbox, "CoE")) return Absent(NotApplicable::kNoCoe);
  return coe && AnswersUnknown(mailbox, result) ? Unseen(ReasonCode::kNotInCapture, what::kMailboxAnswers) : Presence{};
}

Presence OfEoe(const MailboxSummary& mailbox) {
  if (mailbox.requests + mailbox.responses == 0) return Absent(NotApplicable::kMailboxUnused);
  return Speaks(mailbox, "EoE") ? Presence{} : Absent(NotApplicable::kNoEoe);
}

Presence PresenceOf(Subject subject, const SlaveSummary& slave, const RuleContext& context,
                    const AnalysisResult& result) {
  const model::SlaveModel& model = context.slave(slave.id);
  switch (subject) {
    case Subject::kEeprom:
      return context.network().state(slave.id).sii.image().KnownWords() > 0 ? Presence{}
                                                                            : Absent(NotApplicable::kEepromUnread);
    case Subject::kAlState:
      return slave.al_status ? Presence{} : Unseen(ReasonCode::kNotInCapture, what::kAlStatus);
    case Subject::kAlRequest:
      return IsAsked(slave, model) ? Presence{} : Absent(NotApplicable::kNoRequest);
    case Subject::kConfiguration:
      return OfConfiguration(slave);
    case Subject::kMailbox:
      return OfMailbox(slave.mailbox, false, result);
    case Subject::kCoe:
      return OfMailbox(slave.mailbox, true, result);
    case Subject::kEoe:
      return OfEoe(slave.mailbox);
    case Subject::kMapping:
      return OfMapping(slave, context, result);
    case Subject::kMappingWrites:
      if (model.process.seen().version() > 0) return {};
      return AnswersUnknown(slave.mailbox, result) ? Unseen(ReasonCode::kNotInCapture, what::kMailboxAnswers)
                                                   : Absent(NotApplicable::kMappingUntouched);
    case Subject::kProcessData:
      return OfProcessData(slave, context, result);
    case Subject::kTiming:
      return OfTiming(slave, context, result);
    case Subject::kCycle:
      return OfCycle(slave, context, result);
    case Subject::kDrive:
      return OfDrive(slave, model);
    case Subject::kClock:
      return OfClock(slave);
    case Subject::kLatch:
      return OfLatch(slave, context, result);
    case Subject::kFaultBits:
      return OfFaultBits(slave, model);
    case Subject::kOfChapter:
    case Subject::kCapture:
    case Subject::kBus:
    case Subject::kOtherPackets:
    case Subject::kSlave:
    case Subject::kExpectation:
      break;
  }
  return {};
}

bool IsOfWholeBus(Subject subject) {
  return subject == Subject::kCapture || subject == Subject::kBus || subject == Subject::kOtherPackets;
}

/// True for what a few packets show, which may be those that a capture misses.
bool MayBeUnseen(NotApplicable why) {
  switch (why) {
    case NotApplicable::kEepromUnread:
    case NotApplicable::kNoRequest:
    case NotApplicable::kMailboxUnused:
    case NotApplicable::kNoCoe:
    case NotApplicable::kNoEoe:
    case NotApplicable::kMappingUntouched:
    case NotApplicable::kNoProcessData:
    case NotApplicable::kNoCycle:
    case NotApplicable::kNoDrive:
    case NotApplicable::kClockUnused:
    case NotApplicable::kLatchUnused:
      return true;
    default:
      return false;
  }
}

/// True when packets are missing, or may be where the numbers of the frames skip. Where another recording or master
/// begins, it only looks like a capture gap.
bool MissesPacketsForCertain(const RuleContext& context) {
  std::uint64_t no_holes = 0;
  for (const Finding& finding : context.store.findings()) {
    if (finding.rule == "capture-spliced") no_holes += finding.count;
    if (finding.rule == "bus-second-master") ++no_holes;  // appears as late as another recording
  }
  const bus::PairingStatistics& pairing = context.pairing();
  return pairing.missed_outbound + pairing.gaps + pairing.skips > no_holes;
}

/// What was reported of one rule and slave.
struct Reported {
  std::uint64_t occasions = 0;  ///< lines about moments
  bool of_all = false;          ///< a line without a frame: it holds from the beginning to the end
  bool found = false;           ///< a finding: something was evaluated

  void Add(const Reported& other) {
    occasions += other.occasions;
    of_all = of_all || other.of_all;
    found = found || other.found;
  }
};

/// All that was reported, by rule and slave. Flat: thousands of slaves have many of them.
class AllReported {
 public:
  struct Entry {
    const char* rule = nullptr;  ///< id of the catalogue, of which there is one copy
    SlaveId slave = kNoSlave;
    Reported reported;

    [[nodiscard]] auto Key() const { return std::pair(rule, slave); }
  };

  void Add(std::string_view rule, SlaveId slave, const Reported& reported) {
    const RuleInfo* info = FindRule(rule);
    if (info == nullptr) return;
    if (entries_.size() >= most_) {
      Close();
      most_ = std::max(most_, 2 * entries_.size());
    }
    entries_.push_back({info->id.data(), slave, reported});
  }
  /// Before the first question: one entry for each rule and slave.
  void Close() {
    std::ranges::sort(entries_, [](const Entry& a, const Entry& b) { return Less(a.Key(), b.Key()); });
    std::size_t kept = 0;
    for (std::size_t i = 0; i < entries_.size(); ++i) {
      if (kept > 0 && entries_[kept - 1].Key() == entries_[i].Key()) {
        entries_[kept - 1].reported.Add(entries_[i].reported);
      } else {
        entries_[kept++] = entries_[i];
      }
    }
    entries_.resize(kept);
  }
  [[nodiscard]] std::span<const Entry> Of(const RuleInfo& rule) const {
    const auto from = LowerBound({rule.id.data(), SlaveId{0}});
    auto to = from;
    while (to != entries_.end() && to->rule == rule.id.data()) ++to;
    return {from, to};
  }
  [[nodiscard]] Reported Of(const RuleInfo& rule, SlaveId slave) const {
    const auto at = LowerBound({rule.id.data(), slave});
    return at != entries_.end() && at->Key() == std::pair(rule.id.data(), slave) ? at->reported : Reported{};
  }

 private:
  using KeyOfEntry = std::pair<const char*, SlaveId>;
  static bool Less(const KeyOfEntry& a, const KeyOfEntry& b) {
    return a.first != b.first ? std::less<const char*>()(a.first, b.first) : a.second < b.second;
  }
  [[nodiscard]] std::vector<Entry>::const_iterator LowerBound(const KeyOfEntry& key) const {
    return std::lower_bound(entries_.begin(), entries_.end(), key,
                            [](const Entry& entry, const KeyOfEntry& wanted) { return Less(entry.Key(), wanted); });
  }

  std::vector<Entry> entries_;
  std::size_t most_ = 4096;  ///< before those of one rule and slave are joined
};

class Evaluator {
 public:
  Evaluator(RuleContext& context, const AnalysisResult& result) : context_(context), result_(result) {
    context.store.VisitNotEvaluable(
        [this](std::string_view rule, SlaveId slave, FrameNo first_frame, std::uint64_t occasions) {
          const bool of_all = first_frame == 0;
          reported_.Add(rule, slave, {of_all ? 0 : occasions, of_all, false});
        });
    for (const Finding& finding : context.store.findings()) {
      reported_.Add(finding.rule, finding.slave, {0, false, true});
    }
    reported_.Close();
    misses_packets_ = MissesPacketsForCertain(context);
  }

  RuleCoverage Of(const RuleInfo& rule) {
    RuleCoverage out{rule.id, rule.group, {}};
    const Subject subject = SubjectOf(rule);
    const bool whole = IsOfWholeBus(subject);
    if (whole || result_.slaves.empty()) {
      out.slaves.push_back(OfBus(rule, subject));
      AddMissing(rule, subject, out.slaves.back());
      return out;
    }
    out.slaves.reserve(result_.slaves.size());
    for (const SlaveSummary& slave : result_.slaves) {
      out.slaves.push_back(OfSlave(rule, subject, slave));
      AddMissing(rule, subject, out.slaves.back());
    }
    return out;
  }

 private:
  [[nodiscard]] FrameNo FirstMissing() const {
    const bus::PairingStatistics& pairing = context_.pairing();
    return pairing.gaps > 0 || pairing.skips == 0 ? pairing.first_gap.number : pairing.first_skip.number;
  }
  /// What the packets held that the capture misses, or what was cut off, no rule has seen. Those about the file saw
  /// that it is missing.
  void AddMissing(const RuleInfo& rule, Subject subject, SlaveCoverage& out) {
    if (subject == Subject::kCapture) return;
    const PipelineStatistics& read = context_.statistics();
    if (read.cut_frames > 0) AddMissing(rule, ReasonCode::kSnapLength, read.first_cut.number, out);
    if (misses_packets_) AddMissing(rule, ReasonCode::kMissesPackets, FirstMissing(), out);
    // What a rule itself reports counts more.
    const bool no_answers = result_.capture.direction == DirectionSeen::kOutbound;
    if (no_answers && out.coverage == Coverage::kJudged && !Get(rule, out.slave).found)
      AddMissing(rule, ReasonCode::kNoReturnedFrames, read.first.number, out);
  }
  void AddMissing(const RuleInfo& rule, ReasonCode unseen, FrameNo first, SlaveCoverage& out) {
    if (out.coverage == Coverage::kNotApplicable && MayBeUnseen(out.why)) {
      out.coverage = Coverage::kNotJudged;
      out.why = NotApplicable::kApplies;
      context_.store.AddNotEvaluable(rule, out.slave, Reason::Of(unseen), 0);
      return;
    }
    if (out.coverage != Coverage::kJudged) return;
    out.coverage = Coverage::kPartly;
    context_.store.AddNotEvaluable(rule, out.slave, Reason::Of(unseen), first);
  }

  [[nodiscard]] bool Excluded(const RuleInfo& rule, Subject subject, SlaveCoverage& out) const {
    if (context_.store.IsOff(rule)) out.why = NotApplicable::kSwitchedOff;
    if (subject == Subject::kExpectation && context_.options().expectation == nullptr) {
      out.why = NotApplicable::kNoExpectation;
    }
    if (out.why == NotApplicable::kApplies) return false;
    out.coverage = Coverage::kNotApplicable;
    return true;
  }

  SlaveCoverage OfBus(const RuleInfo& rule, Subject subject) {
    SlaveCoverage out;
    if (Excluded(rule, subject, out)) return out;
    // A line about one slave only is one about a part of the bus.
    Reported reported;
    for (const AllReported::Entry& entry : reported_.Of(rule)) {
      const bool of_bus = entry.slave == kNoSlave;
      reported.of_all = reported.of_all || (entry.reported.of_all && of_bus);
      reported.occasions += entry.reported.occasions + (entry.reported.of_all && !of_bus ? 1 : 0);
      reported.found = reported.found || entry.reported.found;
    }
    Presence presence;
    if (subject != Subject::kCapture && NoFrames()) {
      presence = Unseen(Reason::Of(ReasonCode::kNoEtherCat));
    } else if (subject == Subject::kOtherPackets && result_.capture.other_packets == 0) {
      presence = Absent(NotApplicable::kNoOtherPackets);
    } else if (!IsOfWholeBus(subject)) {
      presence = Unseen(Reason::Of(ReasonCode::kNoSlave));
    }
    Decide(rule, reported, presence, out);
    return out;
  }

  SlaveCoverage OfSlave(const RuleInfo& rule, Subject subject, const SlaveSummary& slave) {
    SlaveCoverage out;
    out.slave = slave.id;
    if (Excluded(rule, subject, out)) {
      // Only what would apply counts as switched off.
      const NotApplicable absent = PresenceOf(subject, slave, context_, result_).absent;
      if (out.why == NotApplicable::kSwitchedOff && absent != NotApplicable::kApplies) out.why = absent;
      return out;
    }
    Reported reported = Get(rule, slave.id);
    const Reported bus = Get(rule, kNoSlave);
    reported.of_all = reported.of_all || bus.of_all;
    reported.occasions += bus.occasions;
    const model::SlaveModel& model = context_.slave(slave.id);
    // None of its requests could be evaluated.
    if (subject == Subject::kAlRequest && reported.occasions > 0 && reported.occasions >= model.al.requests()) {
      reported.of_all = true;
    }
    Presence presence = PresenceOf(subject, slave, context_, result_);
    const bool present = presence.absent == NotApplicable::kApplies && !presence.unseen;
    if (present && rule.of_family && FamilyUnseen(model)) presence = Unseen(Reason::Of(ReasonCode::kFamilyUnknown));
    Decide(rule, reported, presence, out);
    return out;
  }

  [[nodiscard]] Reported Get(const RuleInfo& rule, SlaveId slave) const { return reported_.Of(rule, slave); }

  void Decide(const RuleInfo& rule, const Reported& reported, const Presence& presence, SlaveCoverage& out) {
    const bool nothing_to_see = presence.unseen || presence.absent != NotApplicable::kApplies;
    if (reported.found) {
      out.coverage = reported.of_all || reported.occasions > 0 ? Coverage::kPartly : Coverage::kJudged;
    } else if (reported.of_all || (reported.occasions > 0 && nothing_to_see)) {
      out.coverage = Coverage::kNotJudged;
    } else if (reported.occasions > 0) {
      out.coverage = Coverage::kPartly;
    } else if (presence.absent != NotApplicable::kApplies) {
      out.coverage = Coverage::kNotApplicable;
      out.why = presence.absent;
    } else if (presence.unseen) {
      out.coverage = Coverage::kNotJudged;
      context_.store.AddNotEvaluable(rule, out.slave, *presence.unseen, 0);
    }
  }

  [[nodiscard]] bool NoFrames() const { return result_.capture.ethercat_frames == 0; }

  RuleContext& context_;
  const AnalysisResult& result_;
  AllReported reported_;
  bool misses_packets_ = false;
};

}  // namespace

Subject SubjectOf(const RuleInfo& rule) {
  if (rule.subject != Subject::kOfChapter) return rule.subject;
  for (const auto& [chapter, subject] : kChapters) {
    if (chapter == rule.group) return subject;
  }
  return Subject::kSlave;
}

std::vector<RuleCoverage> CoverageOf(RuleContext& context, const AnalysisResult& result) {
  std::vector<RuleCoverage> out;
  Evaluator evaluator(context, result);
  for (const RuleInfo* rule : RuleCatalogue()) out.push_back(evaluator.Of(*rule));
  return out;
}

namespace {

/// True for a drive, as far as seen, and for what may be one: it gave inputs of an unknown layout, and supports CoE.
bool MayBeDrive(const SlaveSummary& slave, const RuleContext& context) {
  if (OfDrive(slave, context.slave(slave.id)).absent == NotApplicable::kApplies) return true;
  return Speaks(slave.mailbox, "CoE") && slave.tx_pdo.exchanged > 0 &&
         slave.tx_pdo.source == PdoSummary::Source::kUnknown;
}

/// True for a drive in OP whose process data are hidden after a capture gap, while the master still exchanges some.
/// That its AL state is known shows nothing of them: a drive that stands in Fault stays in OP.
bool DriveOutOfSight(const SlaveSummary& slave, const RuleContext& context, const AnalysisResult& result) {
  // FMMUs that were set are listed, active or not: there are none where they are forgotten, or were never seen.
  return InState(slave, esc::AlState::OP) && slave.fmmus.empty() && result.bus.cycle.cycles > 0 &&
         MayBeDrive(slave, context) && MissesPacketsForCertain(context);
}

}  // namespace

std::optional<Reason> WhyNotEvaluated(const SlaveSummary& slave, const RuleContext& context,
                                      const AnalysisResult& result) {
  static constexpr Word kStateAndData{"al-state-and-process-data", "its AL state and its process data", true};
  static constexpr Word kValidState{"valid-al-state", "a valid AL state at the end"};
  static constexpr Word kDriveData{"drive-process-data", "the process data of the drive in OP", true};
  if (result.capture.direction == DirectionSeen::kOutbound) return Reason::Of(ReasonCode::kNoReturnedFrames);
  if (slave.al_status && !esc::IsAlState(esc::AlWord{*slave.al_status}.state())) {
    return Reason::Of(ReasonCode::kNotInCapture, kValidState);
  }
  // A capture gap made worthless what was known of it, and nothing after the gap shows the slave.
  const bool out_of_sight = MissesAny(context.pairing()) && context.slave(slave.id).al.possible().empty();
  if (out_of_sight && OfProcessData(slave, context, result).unseen) {
    return Reason::Of(ReasonCode::kCaptureGap, kStateAndData);
  }
  // A fault of the drive would not be seen.
  if (DriveOutOfSight(slave, context, result)) return Reason::Of(ReasonCode::kCaptureGap, kDriveData);
  if (slave.al_status || Exchanges(slave)) return std::nullopt;
  return Reason::Of(ReasonCode::kNotInCapture, kStateAndData);
}

}  // namespace ecaudit
