#include "analyzers/judge/common_causes.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>

#include "analyzers/judge/drive_knowledge.h"
#include "analyzers/judge/finding_store.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/sync/sync_model.h"
#include "analyzers/sync/sync_type.h"
#include "decoder/base/time.h"
#include "decoder/esc/al.h"
#include "decoder/process/pdo_mapping.h"

namespace ecaudit {
namespace {

/// The cause may begin after the effect, while that lasts (Finding::until).
constexpr TimeNs kWhileItLasts = -2;
constexpr TimeNs kSoon = 100'000'000;
constexpr TimeNs kLater = 10'000'000'000;
constexpr std::int64_t kErrorBit = 0x10;  // of AL Status
constexpr FrameNo kNearby = 100;

/// What is worth a warning only (half of a watchdog's time) has no error as its consequence.
bool IsError(const Finding& finding) {
  return finding.severity == Severity::kError;
}

/// The code of a word, or a text of the capture. Empty: the finding has no such argument.
std::string CodeOf(const Finding& finding, std::string_view name) {
  const Value* value = finding.arguments.Find(name);
  return value == nullptr ? std::string() : KeyOf(*value);
}

/// A number, an AL state, or a time in nanoseconds.
std::optional<std::int64_t> NumberOf(const Finding& finding, std::string_view name) {
  const Value* value = finding.arguments.Find(name);
  return value == nullptr ? std::nullopt : std::optional(value->number);
}

/// An AL state; 0: the finding has none of this name.
std::int64_t StateOf(const Finding& finding, std::string_view name) {
  return NumberOf(finding, name).value_or(0);
}

/// When the effect began: after the last read that showed the slave well (0: no such read is known), and not later
/// than the frame that shows it.
struct Moment {
  FrameNo look = 0;
  FrameRef shown;
};

/// The first frame that these name besides their own is the last one that showed the slave well.
bool NamesLookBefore(const Finding& finding) {
  return finding.rule == "al-unexpected-change" || finding.rule == "al-error-standing" ||
         (finding.rule == "drive-fault" && finding.arguments.Has("state_before"));
}

Moment MomentOf(const std::vector<Finding>& findings, FindingIndex effect) {
  const Finding* shows = &findings[effect];
  // A master fetches messages when it has time for them: the status word showed the fault in the next cycle.
  if (shows->rule == "emcy-received") {
    for (const Finding& fault : findings) {
      if (fault.caused_by == effect && NamesLookBefore(fault) && fault.first.number < shows->first.number)
        shows = &fault;
    }
  }
  const FrameNo begun = BegunBy(*shows);
  return {NamesLookBefore(*shows) && begun < shows->first.number ? begun : 0, shows->first};
}

/// The watchdog of the slave's outputs; of the bus: the shortest.
TimeNs WatchdogOf(const RuleContext& context, SlaveId slave) {
  if (slave != kNoSlave) return context.sync().outputs(slave).watchdog_ns;
  TimeNs least = 0;
  for (std::size_t s = 0; s < context.slave_count(); ++s) {
    const TimeNs of = context.sync().outputs(static_cast<SlaveId>(s)).watchdog_ns;
    if (of > 0 && (least == 0 || of < least)) least = of;
  }
  return least;
}

/// Frames that are lost here and there let no watchdog run out: after the read this many were lost in a row that
/// nothing came for as long as that takes.
bool StarvesBehind(FrameNo look, const Finding& lost, TimeNs watchdog) {
  const auto frames = NumberOf(lost, "in_a_row");
  const auto last = NumberOf(lost, "in_a_row_last_frame");
  const auto took = NumberOf(lost, "in_a_row_ms");
  if (!frames || !last || !took || watchdog <= 0 || static_cast<FrameNo>(*last) <= look) return false;
  // One cycle before the first of them and one after the last have to be added.
  const auto count = static_cast<double>(*frames);
  return static_cast<double>(*took) * (count + 1) / (count - 1) >= static_cast<double>(watchdog);
}

/// The effect came when `cause` had begun, and not much later than it was over. Where the cause brings its effect at
/// once, how late the master looked does not matter: it may be what was over after the last look before.
bool Follows(const RuleContext& context, SlaveId slave, const Moment& effect, const Finding& cause, TimeNs within) {
  if (effect.shown.number < BegunBy(cause)) return false;
  if (effect.shown.number <= cause.last.number) return true;
  if (within <= kSoon && effect.look != 0 && cause.last.number > effect.look &&
      (cause.rule != "frame-lost" || StarvesBehind(effect.look, cause, WatchdogOf(context, slave)))) {
    return true;
  }
  return effect.shown.has_time && cause.last.has_time && Elapsed(cause.last.time, effect.shown.time) <= within;
}

/// The drive was seen without fault before, and gave no reason.
bool GivesNoReason(const RuleContext&, const Finding& effect) {
  return !effect.arguments.Has("fault_code") && effect.arguments.Has("state_before");
}

/// The code of the drive, by the standard, is about its synchronisation controller (0x87xx).
bool NamesSyncController(const RuleContext&, const Finding& effect) {
  const auto code = NumberOf(effect, effect.rule == "drive-fault" ? "fault_code" : "error_code");
  return code && *code >> 8U == 0x87;
}

/// The drive's own word for what happened, if it gave one, is that it lost synchronisation.
bool NamesSynchronisationLoss(const RuleContext& context, const Finding& effect) {
  if (NamesSyncController(context, effect)) return true;
  if (effect.rule == "drive-fault") return GivesNoReason(context, effect);
  const auto& names = context.slave(effect.slave).profile->sync.lost_faults;
  return std::ranges::find(names, CodeOf(effect, "id")) != names.end();
}

/// Mailbox error codes of ETG1000.6 that speak of how a message is built: syntax, header, size.
bool NamesMalformedMessage(const RuleContext&, const Finding& effect) {
  const auto detail = NumberOf(effect, "detail");
  return detail && (*detail == 1 || *detail == 5 || *detail == 6 || *detail == 8);
}

/// The drive took its torque away, which it may.
bool IsWarning(const RuleContext&, const Finding& effect) {
  return effect.severity == Severity::kWarning;
}

bool Single(const RuleContext&, const Finding& effect) {
  return effect.count == 1;
}

/// The slave's own code speaks of synchronisation: 0x001A, 0x002C to 0x0036.
bool NamesSynchronisation(const RuleContext&, const Finding& effect) {
  const auto code = NumberOf(effect, "al_status_code");
  return !code || esc::SpeaksOfSynchronisation(*code);  // none was read
}

/// Both are about one frame.
bool SameFrame(const Finding& effect, const Finding& cause) {
  return effect.first.number == cause.first.number;
}

/// Index of the object that it is about; 0: none.
std::int64_t IndexOf(const Finding& finding) {
  return NumberOf(finding, "object").value_or(0) >> 9U;
}

/// Both are about one object.
bool SameObject(const Finding& effect, const Finding& cause) {
  const std::int64_t index = IndexOf(effect);
  return index != 0 && index == IndexOf(cause);
}

/// Emergencies of ETG.1000.6 for a transition that failed: 0xA000, 0xA001.
bool NamesFailedTransition(const RuleContext&, const Finding& effect) {
  const auto code = NumberOf(effect, "error_code");
  return code == 0xA000 || code == 0xA001;
}

/// The drive refused to have the number of entries of that object set to 0.
bool CountRefused(const Finding& effect, const Finding& cause) {
  return NumberOf(cause, "subindex") == 0 && NumberOf(cause, "index") == NumberOf(effect, "index") &&
         CodeOf(cause, "service") == "download";
}

bool NamesSynchronisationByCode(const RuleContext& context, const Finding& effect) {
  return effect.arguments.Has("al_status_code") && NamesSynchronisation(context, effect);
}

bool NamesSynchronisationOrWatchdog(const RuleContext& context, const Finding& effect) {
  return NumberOf(effect, "al_status_code") == esc::al_code::kWatchdog || NamesSynchronisationByCode(context, effect);
}

/// A download to what sync manager 2 (1C12h, 1600h-17FFh) or 3 (1C13h, 1A00h-1BFFh) carries; 0: to something else.
std::int64_t ManagerOfDownload(const Finding& abort) {
  const auto index = static_cast<std::uint16_t>(NumberOf(abort, "index").value_or(0));
  if (CodeOf(abort, "service") != "download" || abort.severity != Severity::kError) return 0;
  if (index == process::kRxAssignment || process::IsRxMapping(index)) return 2;
  return index == process::kTxAssignment || process::IsTxMapping(index) ? 3 : 0;
}

/// The slave's process data are not those that the master wanted: it refused them before.
bool MappingRefused(const Finding& effect, const Finding& cause) {
  const std::int64_t manager = ManagerOfDownload(cause);
  return manager != 0 && NumberOf(effect, "sync_manager").value_or(manager) == manager;
}

/// The slave refused an entry of a PDO or of an assignment before: then the number of entries does not fit. Or it
/// refuses the whole object for one reason.
bool SameListRefused(const Finding& effect, const Finding& cause) {
  const std::int64_t manager = ManagerOfDownload(effect);
  if (manager == 0 || ManagerOfDownload(cause) != manager || NumberOf(effect, "index") != NumberOf(cause, "index"))
    return false;
  if (cause.first.number >= effect.first.number) return false;
  constexpr std::array<std::int64_t, 4> kOfObject{0x06010000, 0x06010002, 0x06010003, 0x08000022};
  const auto code = NumberOf(effect, "abort_code");
  const bool of_object = code && std::ranges::find(kOfObject, *code) != kOfObject.end();
  return NumberOf(effect, "subindex") == 0 || (of_object && code == NumberOf(cause, "abort_code"));
}

/// The slave rejects CoE, by which its process data would be configured.
bool CoeRejected(const Finding&, const Finding& cause) {
  constexpr std::int64_t kUnsupportedProtocol = 2;
  return NumberOf(cause, "detail") == kUnsupportedProtocol && CodeOf(cause, "protocol") == "CoE";
}

/// Every one of the effect's frames is one of the cause's.
bool WithinItsFrames(const Finding& effect, const Finding& cause) {
  return cause.first.number <= effect.first.number && effect.last.number <= cause.last.number;
}

/// The effect began between the cause's first and last frame.
bool BeginsWithin(const Finding& effect, const Finding& cause) {
  return cause.first.number <= effect.first.number && effect.first.number <= cause.last.number;
}

/// The slave sends messages that are not well formed.
bool FromSlave(const Finding&, const Finding& cause) {
  return CodeOf(cause, "direction") == "in";
}

/// The message that is not well formed was read as this reply.
bool IsItself(const Finding& effect, const Finding& cause) {
  return FromSlave(effect, cause) && WithinItsFrames(effect, cause);
}

/// The slave counted invalid frames while frames were lost.
bool CountedMeanwhile(const Finding& effect, const Finding& cause) {
  if (!cause.arguments.Has("counted")) return false;
  return BegunBy(cause) <= effect.last.number && effect.first.number <= cause.last.number;
}

/// The slave counted that a link was lost, and no damaged frame.
bool IsOnlyLostLink(const RuleContext&, const Finding& effect) {
  const bool damaged = effect.arguments.Has("invalid_frames_after") || effect.arguments.Has("receive_errors_after") ||
                       effect.arguments.Has("forwarded_errors_after");
  return (effect.arguments.Has("lost_links_after") && !damaged) || effect.kind->name == "link-lost";
}

/// The slaves left between the two reads of the effect.
bool LiesBetweenReads(const Finding& effect, const Finding& cause) {
  const auto since = NumberOf(effect, "since_frame");
  return since && static_cast<FrameNo>(*since) <= cause.first.number && cause.kind->name == "fewer";
}

/// The AL status code is one of `codes`.
bool HasCode(const Finding& effect, std::initializer_list<esc::al_code::Code> codes) {
  const auto code = NumberOf(effect, "al_status_code");
  return code && std::ranges::find(codes, *code) != codes.end();
}

/// The slave's own code speaks of process data: their sync managers, length or mapping.
bool IsAboutProcessData(const Finding& finding) {
  using namespace esc::al_code;
  return HasCode(finding, {kSyncManagers, kOutputs, kInputs, kNeedsInit, kInputMapping, kOutputMapping});
}
bool NamesProcessData(const RuleContext&, const Finding& effect) {
  return IsAboutProcessData(effect);
}

/// The code is about the exchange of process data or the settings for it.
bool IsAboutExchange(const Finding& finding) {
  using namespace esc::al_code;
  return IsAboutProcessData(finding) || HasCode(finding, {kNoInputs, kNoOutputs, kWatchdog, kNoInputsAndOutputs});
}
bool NamesExchange(const RuleContext&, const Finding& effect) {
  return IsAboutExchange(effect);
}

/// The code is about the synchronisation mode or its cycle.
bool NamesSyncSettings(const RuleContext&, const Finding& effect) {
  using namespace esc::al_code;
  return HasCode(effect, {kInconsistent, kFreeRun, kSyncMode, kSyncSettings, kSyncCycle, kSync0Cycle});
}

bool IsErrorOfDownload(const Finding& cause) {
  return CodeOf(cause, "service") == "download" && cause.severity == Severity::kError;
}

/// The slave refused a synchronisation mode or cycle: 1C32h, 1C33h, 60C2h.
bool SyncSettingRefused(const Finding&, const Finding& cause) {
  const auto index = NumberOf(cause, "index");
  return IsErrorOfDownload(cause) &&
         (index == sync::kSyncObjects[0] || index == sync::kSyncObjects[1] || index == 0x60C2);
}

/// The detected modules are not the configured ones.
bool NamesModules(const RuleContext&, const Finding& effect) {
  return NumberOf(effect, "al_status_code") == 0x0070;
}

/// The slave refused the list of configured modules.
bool ModuleListRefused(const Finding&, const Finding& cause) {
  return IsErrorOfDownload(cause) && NumberOf(cause, "index") == 0xF030;
}

/// Which of both is one of the bus: none, the cause, the effect, both. Causes of the bus fold what happened now and
/// then: a part of it has to lie between the last look before the effect and the effect, unless it goes on until it
/// ends (kGoesOn, kBothGoesOn).
enum class Bus : std::uint8_t { kNo, kYes, kGoesOn, kEffect, kBoth, kBothGoesOn };

constexpr bool EffectIsOfBus(Bus bus) {
  return bus == Bus::kEffect || bus == Bus::kBoth || bus == Bus::kBothGoesOn;
}
constexpr bool HappensNowAndThen(Bus bus) {
  return bus == Bus::kYes || bus == Bus::kBoth;
}

bool TouchesLookBefore(const RuleContext& context, const Moment& effect, const Finding& cause) {
  // A message is no look: what came soon before it counts.
  if (effect.look == 0) return Follows(context, kNoSlave, effect, cause, kSoon);
  const auto between = [&](FrameNo frame) { return frame >= effect.look && frame <= effect.shown.number; };
  return between(cause.first.number) || between(cause.last.number) ||
         std::ranges::any_of(cause.related_frames, between);
}

/// The process data watchdog ran out.
bool NamesWatchdog(const RuleContext&, const Finding& effect) {
  return NumberOf(effect, "al_status_code") == esc::al_code::kWatchdog;
}

/// The master did not read the code, and the slave dropped as it does where the watchdog runs out.
bool MayBeWatchdog(const RuleContext& context, const Finding& effect) {
  if (effect.arguments.Has("al_status_code")) return NamesWatchdog(context, effect);
  constexpr std::int64_t kInOp = 8;
  constexpr std::int64_t kSafeopWithError = 0x14;
  return StateOf(effect, "al_status_before") == kInOp && StateOf(effect, "al_status") == kSafeopWithError;
}

/// It was found before the effect, not only begun.
bool Precedes(const Finding& effect, const Finding& cause) {
  return cause.first.number <= effect.first.number;
}

/// A slave set the error bit: broadcasts do not show the code.
bool ShowsError(const RuleContext&, const Finding& effect) {
  return (NumberOf(effect, "al_status_of_all").value_or(0) & kErrorBit) != 0;
}

bool OfProcessData(const RuleContext&, const Finding& effect) {
  return effect.arguments.Has("logical_address");
}

/// Outputs that are never complete make the slave drop all of them: its watchdog runs out.
bool IsAboutOutputs(const Finding&, const Finding& cause) {
  return CodeOf(cause, "direction") == "outputs";
}

bool LostInARow(const Finding&, const Finding& cause) {
  return cause.arguments.Has("in_a_row");
}

/// It did not answer at its address between the read before and the read that shows the change.
bool WasAway(const Finding& effect, const Finding& cause) {
  return cause.arguments.Has("station_address") && NumberOf(cause, "working_counter") == 0 &&
         cause.first.number > BegunBy(effect) && cause.last.number < effect.first.number;
}

/// The master did not look: it asks for the next state although the slave still stands where it refused the one before.
bool GoesOnFromRefusal(const Finding& effect, const Finding& cause) {
  constexpr auto kPreop = static_cast<std::int64_t>(esc::AlState::PREOP);
  constexpr auto kSafeop = static_cast<std::int64_t>(esc::AlState::SAFEOP);
  constexpr auto kOperational = static_cast<std::int64_t>(esc::AlState::OP);
  const std::int64_t refused = StateOf(cause, "requested");
  const std::int64_t next = refused == kPreop ? kSafeop : refused == kSafeop ? kOperational : 0;
  return next != 0 && StateOf(effect, "requested") == next &&
         StateOf(effect, "state") == StateOf(cause, "state_before") && effect.first.number > cause.first.number;
}

/// One begins while the other lasts.
bool Overlaps(const Finding& effect, const Finding& cause) {
  return effect.axis == cause.axis && cause.first.number <= effect.last.number &&
         effect.first.number <= cause.last.number + kNearby;
}

/// A fault that a motion or its command may bring: the drive gives no reason, or one that speaks of it.
bool IsFaultOfMotion(const RuleContext& context, const Finding& effect) {
  const auto code = NumberOf(effect, "fault_code");
  if (!code) return effect.arguments.Has("state_before");
  return MayComeOfCommand(*context.slave(effect.slave).profile, *code);
}

/// The drive gives no reason for its fault, or a code of the manufacturer that has no known meaning.
bool IsFaultWithoutMeaning(const RuleContext& context, const Finding& effect) {
  const auto code = NumberOf(effect, "fault_code");
  return !code || IsUnexplained(*context.slave(effect.slave).profile, *code);
}

/// The same, and the drive was seen without it before.
bool IsNewFaultWithoutMeaning(const RuleContext& context, const Finding& effect) {
  return effect.arguments.Has("state_before") && IsFaultWithoutMeaning(context, effect);
}

/// Frames came on the wrong side of SYNC0 again and again.
bool FollowsIrregularFrames(const Finding& effect, const Finding& cause) {
  return cause.kind != nullptr && cause.kind->name == "irregular" && Precedes(effect, cause);
}

/// A part of the outputs is never written.
bool LacksOutputs(const Finding&, const Finding& cause) {
  return cause.kind != nullptr && cause.kind->name == "part-not-mapped";
}

/// It stands still in a mode with a set point for each cycle, which some drives take at SYNC0 only.
bool StandsStillInSync(const RuleContext&, const Finding& effect) {
  return effect.arguments.Has("cyclic");
}

/// An emergency of such a fault.
bool IsEmergencyOfMotion(const RuleContext& context, const Finding& effect) {
  const auto code = NumberOf(effect, "error_code");
  return code && MayComeOfCommand(*context.slave(effect.slave).profile, *code);
}

/// Both are of one axis.
bool PrecedesOnAxis(const Finding& effect, const Finding& cause) {
  return effect.axis == cause.axis && Precedes(effect, cause);
}

/// The drive left Operation enabled when its mode changed.
bool IsModeNotAccepted(const Finding& effect, const Finding& cause) {
  return cause.kind != nullptr && cause.kind->name == "leaves-enabled" && BegunBy(cause) <= effect.first.number;
}

/// The drive left Operation enabled when its mode changed: perhaps for the target that it found in the new mode.
bool LeavesEnabled(const RuleContext&, const Finding& effect) {
  return effect.kind != nullptr && effect.kind->name == "leaves-enabled";
}

/// A drive that is not ready, without the supply of its motor for example, shows no mode.
bool NotReady(const Finding& effect, const Finding& cause) {
  return cause.kind != nullptr && cause.kind->name == "not-ready" && Overlaps(effect, cause);
}

/// Process data that never arrive hinder OP, no state before it.
bool RequestsOp(const RuleContext&, const Finding& effect) {
  return StateOf(effect, "requested") == static_cast<std::int64_t>(esc::AlState::OP);
}

/// The master gave up a transfer of that slave because its frame came back late: what it read of the mapping is not
/// all.
bool TransferGivenUp(const Finding& effect, const Finding& cause) {
  return NumberOf(cause, "slave_of_mailbox") == static_cast<std::int64_t>(effect.slave);
}

/// Without the fault there would be nothing to reset.
bool NeedsFault(const RuleContext&, const Finding& effect) {
  return effect.kind != nullptr && (effect.kind->name == "fault-stays" || effect.kind->name == "reset-missing");
}

/// The drive was in Fault when the capture shows it first, and leaves it no more.
bool IsFaultThatStays(const RuleContext&, const Finding& effect) {
  return effect.kind != nullptr && effect.kind->name == "already-in-fault" && effect.until == Finding::kCaptureEnds;
}

/// The reset of that axis has no edge: that is what the master can correct.
bool IsResetWithoutEdge(const Finding& effect, const Finding& cause) {
  return effect.axis == cause.axis && cause.kind != nullptr && cause.kind->name == "reset-without-edge";
}

/// `effect` follows from `cause` of the same slave, or of the bus.
struct Law {
  std::string_view effect, cause;
  TimeNs within = 0;  ///< after the cause's last frame; < 0: however long after it began, or kWhileItLasts
  bool (*holds)(const RuleContext&, const Finding& effect) = nullptr;  ///< further condition on the effect
  Bus of_bus = Bus::kNo;
  bool (*fits)(const Finding& effect, const Finding& cause) = nullptr;  ///< condition on both
  bool by_warning = false;                                              ///< a warning may cause an error
};

/// The slave gave a code, and no setting explains it.
bool HasNoReason(const RuleContext&, const Finding& effect) {
  return !effect.arguments.Has("reason");
}

/// No slave has the station address: another master gave the slave its own.
bool NamesNoSlave(const RuleContext&, const Finding& effect) {
  return effect.kind != nullptr && effect.kind->name == "no-slave";
}

/// The slave whose time the others take does not answer.
bool IsReferenceAway(const RuleContext&, const Finding& effect) {
  return effect.kind != nullptr && effect.kind->name == "reference-away";
}

/// SYNC0 is off.
bool MissesSync0(const RuleContext&, const Finding& effect) {
  constexpr std::array<std::string_view, 3> kOff{"sync-off", "sync-unseen", "sync-never-set"};
  return std::ranges::find(kOff, CodeOf(effect, "reason")) != kOff.end();
}

/// The master wrote to the SYNC unit, but to a station address that no slave has.
bool IsSyncUnitOfNoSlave(const Finding&, const Finding& cause) {
  constexpr std::int64_t kFirst = 0x0980, kLast = 0x09AF;
  const auto written = NumberOf(cause, "written_register");
  return written && *written >= kFirst && *written <= kLast;
}

/// The slave refused a parameter that the master wrote (SoE) before this request of SAFEOP or OP.
bool ParameterRefused(const Finding& effect, const Finding& cause) {
  constexpr auto kSafeop = static_cast<std::int64_t>(esc::AlState::SAFEOP);
  return IsError(cause) && Precedes(effect, cause) && StateOf(effect, "requested") >= kSafeop;
}

/// By SDO the drive shows something else than in the process data: `object` is 6041h of the first axis, or another one
/// at the same place of its axis. What the effect is about was read at a wrong place, or is old.
bool ShowsOther(const Finding& effect, const Finding& cause, std::int64_t object) {
  constexpr std::int64_t kFirst = 0x6000, kStep = 0x800;
  if (cause.kind == nullptr || cause.kind->name != "object-differs") return false;
  const std::int64_t place = IndexOf(cause) - kFirst;
  return place >= 0 && place % kStep == object - kFirst && place / kStep == effect.axis;
}
bool ShowsOtherStatus(const Finding& effect, const Finding& cause) {
  return ShowsOther(effect, cause, 0x6041);
}
bool ShowsOtherActualValue(const Finding& effect, const Finding& cause) {
  return ShowsOther(effect, cause, 0x6064) || ShowsOther(effect, cause, 0x606C) || ShowsOther(effect, cause, 0x6077);
}

/// The drive went back to Switch on disabled by itself, and the master went on with its sequence.
bool FollowsDrop(const Finding& effect, const Finding& cause) {
  return effect.axis == cause.axis && cause.kind != nullptr && cause.kind->name == "drops-back" &&
         Precedes(effect, cause);
}

/// No slave was brought to SAFEOP.
bool IsNeverStarted(const RuleContext&, const Finding& effect) {
  return effect.kind != nullptr && effect.kind->name == "never-started";
}

/// Many masters do not go on with a slave that refuses a download.
bool IsRefusedDownload(const Finding& effect, const Finding& cause) {
  return IsErrorOfDownload(cause) && Precedes(effect, cause);
}

/// Slaves may take outputs in OP only: what does not count in SAFEOP, after a refusal of OP whose code names something
/// else than process data, follows from that.
bool IsRefusedOp(const Finding& effect, const Finding& cause) {
  constexpr auto kOperational = static_cast<std::int64_t>(esc::AlState::OP);
  const bool outputs = CodeOf(effect, "direction") == "outputs" && effect.arguments.Has("request_frame");
  if (!outputs || effect.kind->name != "never-counted" || StateOf(cause, "requested") != kOperational) return false;
  const auto code = NumberOf(cause, "al_status_code");
  return code && *code > esc::al_code::kUnspecified && !IsAboutExchange(cause);
}

/// SYNC0 is on, and the slave shows a type without it.
bool IsTypeWithoutSync0(const Finding&, const Finding& cause) {
  constexpr std::int64_t kSync0 = 0x02;
  return cause.kind != nullptr && cause.kind->name == "type" &&
         (NumberOf(cause, "activation").value_or(0) & kSync0) != 0;
}

/// The outputs that the watchdog misses are the ones that never counted.
bool CountsNoOutputs(const Finding&, const Finding& cause) {
  return CodeOf(cause, "direction") != "inputs";
}

/// A motor terminal that showed no error before.
bool IsNewTerminalError(const RuleContext&, const Finding& effect) {
  return effect.kind != nullptr && effect.kind->name == "error" && effect.arguments.Has("began");
}

/// Nearest first: of several causes the first row that fits counts.
constexpr std::array kLaws{
    Law{"sync-lost", "sync-cycle-mismatch", -1, nullptr},
    Law{"sync-window-violation", "sync-cycle-mismatch", -1, nullptr},
    Law{"sync-rate-deviation", "sync-cycle-mismatch", -1, nullptr},
    Law{"sync-op-before-sync", "sync-cycle-mismatch", -1},
    Law{"sync-lost", "sync-watchdog-margin", 0},
    Law{"sync-window-violation", "sync-lost", 0, Single},
    Law{"sync-window-violation", "sync-switched-off", kLater, nullptr, Bus::kNo, Precedes},
    Law{"sync-difference-large", "sync-switched-off", kLater, nullptr, Bus::kNo, Precedes},
    Law{"emcy-received", "sync-lost", kSoon, NamesSynchronisationLoss},
    Law{"drive-fault", "sync-lost", kSoon, NamesSynchronisationLoss},
    Law{"drive-fault", "sync-watchdog-margin", kSoon, GivesNoReason},
    Law{"emcy-received", "sync-watchdog-margin", kSoon, NamesSynchronisationLoss},
    Law{"drive-motor-terminal", "sync-watchdog-margin", kSoon, IsNewTerminalError},
    Law{"drive-motor-terminal", "sync-lost", kSoon, IsNewTerminalError},
    Law{"drive-motor-terminal", "al-unexpected-change", kSoon, IsNewTerminalError},
    Law{"drive-motor-terminal", "frame-lost", kSoon, IsNewTerminalError, Bus::kYes},
    Law{"emcy-received", "sync-switched-off", kLater, NamesSynchronisationLoss, Bus::kNo, Precedes},
    Law{"drive-fault", "sync-switched-off", kSoon, NamesSynchronisationLoss, Bus::kNo, Precedes},
    Law{"emcy-received", "sync-cycle-mismatch", -1, NamesSynchronisationLoss, Bus::kNo, nullptr, true},
    Law{"emcy-received", "sync-window-violation", kLater, NamesSynchronisationLoss, Bus::kNo, Precedes, true},
    Law{"emcy-received", "sync-rate-deviation", kLater, NamesSynchronisationLoss, Bus::kNo, Precedes, true},
    Law{"emcy-received", "frame-lost", kSoon, NamesSynchronisationLoss, Bus::kYes},
    Law{"drive-fault", "frame-lost", kSoon, GivesNoReason, Bus::kYes},
    Law{"drive-fault", "wkc-one-buffer", kSoon, GivesNoReason, Bus::kNo, nullptr, true},
    Law{"emcy-received", "wkc-one-buffer", kSoon, NamesSynchronisationLoss, Bus::kNo, nullptr, true},
    Law{"al-unexpected-change", "wkc-one-buffer", kSoon, NamesSynchronisationOrWatchdog, Bus::kNo, nullptr, true},
    Law{"drive-fault", "sync-cycle-mismatch", -1, NamesSyncController, Bus::kNo, nullptr, true},
    Law{"drive-fault", "sync-window-violation", kLater, NamesSyncController, Bus::kNo, Precedes, true},
    Law{"drive-fault", "sync-rate-deviation", kLater, NamesSyncController, Bus::kNo, Precedes, true},
    Law{"al-refused", "sync-start-in-past", kLater, NamesSynchronisationByCode},
    Law{"al-refused", "sync-cycle-mismatch", -1, NamesSynchronisationByCode},
    Law{"al-refused", "sync-cycle-unsupported", -1, NamesSynchronisationByCode},
    Law{"al-unexpected-change", "sync-cycle-mismatch", -1, NamesSynchronisationByCode, Bus::kNo, nullptr, true},
    Law{"al-unexpected-change", "sync-switched-off", kLater, NamesSynchronisation, Bus::kNo, Precedes},
    Law{"al-unexpected-change", "sync-watchdog-margin", kSoon, MayBeWatchdog},
    Law{"al-unexpected-change", "sync-lost", kSoon, NamesSynchronisationOrWatchdog},
    Law{"al-unexpected-change", "sync-window-violation", kLater, NamesSynchronisationByCode, Bus::kNo, Precedes, true},
    Law{"al-unexpected-change", "sync-difference-large", kLater, NamesSynchronisationByCode, Bus::kNo, Precedes, true},
    Law{"al-unexpected-change", "sync-drift-uncompensated", kLater, NamesSynchronisationByCode, Bus::kGoesOn, Precedes,
        true},
    Law{"al-unexpected-change", "sync-type-mismatch", kLater, NamesSynchronisationByCode, Bus::kNo, Precedes, true},
    Law{"al-unexpected-change", "sync-rate-deviation", kLater, NamesSynchronisationByCode, Bus::kNo, Precedes, true},
    Law{"al-unexpected-change", "sync-watchdog-margin", 0, nullptr, Bus::kEffect},
    Law{"al-unexpected-change", "frame-lost", kSoon, NamesWatchdog, Bus::kYes},
    Law{"al-unexpected-change", "frame-lost", kSoon, ShowsError, Bus::kBoth, LostInARow},
    Law{"frame-lost", "bus-link-errors", -1, nullptr, Bus::kEffect, CountedMeanwhile, true},
    Law{"frame-lost", "bus-no-answer", -1, nullptr, Bus::kBoth, WithinItsFrames},
    Law{"wkc-mismatch", "pdo-length-mismatch", kSoon, OfProcessData, Bus::kNo, IsAboutOutputs},
    Law{"mailbox-counter", "bus-duplicate-address", -1, nullptr, Bus::kNo, WithinItsFrames},
    Law{"mailbox-malformed", "bus-duplicate-address", -1, nullptr, Bus::kNo, WithinItsFrames},
    Law{"mailbox-no-response", "bus-duplicate-address", -1, nullptr, Bus::kNo, WithinItsFrames},
    Law{"sdo-unexpected-response", "bus-duplicate-address", -1, nullptr, Bus::kNo, WithinItsFrames},
    Law{"al-refused", "bus-duplicate-address", kLater, NamesProcessData, Bus::kNo, Precedes},
    Law{"sm-overlap", "bus-duplicate-address", kLater, nullptr, Bus::kNo, Precedes},
    Law{"sm-process-config", "bus-duplicate-address", kLater, nullptr, Bus::kNo, Precedes},
    Law{"sm-mailbox-config", "bus-duplicate-address", kLater, nullptr, Bus::kNo, Precedes},
    Law{"al-unexpected-change", "wkc-mismatch", -1, NamesSynchronisationOrWatchdog, Bus::kNo, WasAway},
    Law{"al-error-standing", "bus-slave-count-changed", -1, nullptr, Bus::kYes},
    Law{"bus-link-errors", "bus-slave-count-changed", -1, IsOnlyLostLink, Bus::kGoesOn, LiesBetweenReads},
    Law{"sync-drift-uncompensated", "bus-slave-count-changed", kSoon, IsReferenceAway, Bus::kBoth},
    Law{"sync-drift-uncompensated", "wkc-mismatch", kSoon, IsReferenceAway, Bus::kBoth},
    Law{"sync-drift-uncompensated", "wkc-mismatch", kSoon, IsReferenceAway, Bus::kEffect},
    Law{"al-illegal-transition", "al-refused", kLater, nullptr, Bus::kNo, GoesOnFromRefusal},
    Law{"mailbox-error-reply", "mailbox-malformed", kLater, NamesMalformedMessage},
    Law{"mailbox-error-reply", "mailbox-malformed", -1, nullptr, Bus::kNo, IsItself},
    Law{"al-refused", "mailbox-malformed", kLater, NamesProcessData, Bus::kNo, FromSlave},
    Law{"drive-fault", "al-unexpected-change", kSoon, GivesNoReason},
    Law{"drive-illegal-state-change", "al-unexpected-change", kSoon, IsWarning},
    Law{"drive-illegal-state-change", "sync-watchdog-margin", kSoon, IsWarning},
    Law{"drive-illegal-state-change", "emcy-received", kSoon, IsWarning},
    Law{"fmmu-inactive", "fmmu-mismatch", -1},
    Law{"mailbox-no-response", "mailbox-counter", -1, nullptr, Bus::kNo, SameFrame, true},
    Law{"mailbox-no-response", "mailbox-not-active", -1, nullptr, Bus::kNo, SameFrame},
    Law{"foe-error", "mailbox-no-response", -1, nullptr, Bus::kNo, SameFrame},
    Law{"emcy-received", "al-refused", kSoon, NamesFailedTransition},
    Law{"al-refused", "bus-second-master", -1, HasNoReason, Bus::kGoesOn, BeginsWithin},
    Law{"al-unexpected-change", "bus-second-master", -1, HasNoReason, Bus::kGoesOn, BeginsWithin},
    Law{"al-illegal-transition", "bus-second-master", -1, nullptr, Bus::kGoesOn, BeginsWithin},
    Law{"wkc-mismatch", "bus-second-master", -1, NamesNoSlave, Bus::kBothGoesOn, BeginsWithin},
    Law{"al-refused", "wkc-mismatch", -1, MissesSync0, Bus::kGoesOn, IsSyncUnitOfNoSlave, true},
    Law{"al-refused", "wkc-never-right", -1, NamesWatchdog},
    Law{"al-unexpected-change", "wkc-never-right", -1, NamesWatchdog},
    Law{"al-timeout", "wkc-never-right", -1, RequestsOp},
    Law{"wkc-never-right", "al-refused", -1, nullptr, Bus::kNo, IsRefusedOp},
    Law{"sync-watchdog-margin", "wkc-never-right", -1, nullptr, Bus::kNo, CountsNoOutputs},
    Law{"wkc-never-right", "sdo-abort", -1, IsNeverStarted, Bus::kEffect, IsRefusedDownload},
    Law{"wkc-never-right", "fmmu-mismatch", -1},
    Law{"wkc-never-right", "sm-process-config", -1},
    Law{"drive-not-enabled", "pdo-object-type", kWhileItLasts, nullptr, Bus::kNo, ShowsOtherStatus, true},
    Law{"drive-no-reaction", "pdo-object-type", kWhileItLasts, nullptr, Bus::kNo, ShowsOtherStatus, true},
    Law{"drive-fault", "pdo-object-type", kWhileItLasts, nullptr, Bus::kNo, ShowsOtherStatus, true},
    Law{"drive-illegal-status", "pdo-object-type", kWhileItLasts, nullptr, Bus::kNo, ShowsOtherStatus, true},
    Law{"drive-not-following", "pdo-object-type", kWhileItLasts, nullptr, Bus::kNo, ShowsOtherActualValue, true},
    Law{"drive-no-reaction", "drive-not-enabled", -1, nullptr, Bus::kNo, Overlaps},
    Law{"drive-fault", "drive-not-enabled", kWhileItLasts, IsFaultThatStays, Bus::kNo, IsResetWithoutEdge, true},
    Law{"drive-not-enabled", "drive-fault", -1, NeedsFault, Bus::kNo, Overlaps},
    Law{"drive-illegal-command", "drive-not-enabled", -1, nullptr, Bus::kNo, FollowsDrop},
    Law{"drive-not-enabled", "drive-illegal-command", -1, nullptr, Bus::kNo, Overlaps},
    Law{"drive-mode-not-shown", "pdo-object-type", -1},
    Law{"drive-mode-not-shown", "drive-not-enabled", -1, nullptr, Bus::kNo, NotReady},
    Law{"drive-mode-not-shown", "drive-not-commanded", -1, nullptr, Bus::kNo, Overlaps},
    Law{"drive-mode-not-shown", "drive-setpoint-jump", kSoon, LeavesEnabled, Bus::kNo, PrecedesOnAxis},
    Law{"drive-not-commanded", "pdo-object-type", -1},
    Law{"drive-not-following", "drive-not-commanded", -1, nullptr, Bus::kNo, Overlaps},
    Law{"drive-not-following", "sync-type-mismatch", kWhileItLasts, StandsStillInSync, Bus::kNo, IsTypeWithoutSync0,
        true},
    Law{"drive-not-following", "sync-start-in-past", -1, StandsStillInSync},
    Law{"drive-not-following", "sync-not-activated", -1, StandsStillInSync},
    Law{"drive-not-following", "sync-switched-off", -1, StandsStillInSync, Bus::kNo, Precedes},
    Law{"drive-not-following", "drive-setpoint-jump", kSoon, nullptr, Bus::kNo, PrecedesOnAxis},
    Law{"drive-fault", "drive-mode-not-shown", kSoon, IsFaultOfMotion, Bus::kNo, IsModeNotAccepted, true},
    Law{"drive-fault", "drive-setpoint-jump", kSoon, IsFaultOfMotion, Bus::kNo, PrecedesOnAxis, true},
    Law{"drive-fault", "drive-not-following", kSoon, IsFaultOfMotion, Bus::kNo, PrecedesOnAxis, true},
    Law{"drive-fault", "sync-window-violation", kLater, IsNewFaultWithoutMeaning, Bus::kNo, FollowsIrregularFrames,
        true},
    Law{"emcy-received", "sync-not-activated", -1, NamesSyncController, Bus::kNo, Precedes, true},
    Law{"drive-fault", "sync-not-activated", -1, NamesSyncController, Bus::kNo, Precedes, true},
    // Soon after OP: a drive that ran for longer needs no SYNC0.
    Law{"drive-fault", "sync-not-activated", kLater, IsNewFaultWithoutMeaning, Bus::kNo, Precedes, true},
    Law{"drive-fault", "fmmu-inactive", kWhileItLasts, IsFaultWithoutMeaning, Bus::kNo, LacksOutputs, true},
    Law{"drive-illegal-state-change", "drive-mode-not-shown", kSoon, nullptr, Bus::kNo, IsModeNotAccepted},
    Law{"emcy-received", "drive-mode-not-shown", kSoon, IsEmergencyOfMotion, Bus::kNo, IsModeNotAccepted, true},
    Law{"emcy-received", "drive-setpoint-jump", kSoon, IsEmergencyOfMotion, Bus::kNo, Precedes, true},
    Law{"emcy-received", "drive-not-following", kSoon, IsEmergencyOfMotion, Bus::kNo, Precedes, true},
    Law{"pdo-assign-order", "pdo-assign-state", kLater, nullptr, Bus::kNo, SameObject},
    Law{"sm-process-config", "sdo-abort", kLater, nullptr, Bus::kNo, MappingRefused},
    Law{"al-refused", "sdo-abort", kLater, NamesProcessData, Bus::kNo, MappingRefused},
    Law{"sdo-abort", "sdo-abort", -1, nullptr, Bus::kNo, SameListRefused},
    Law{"al-refused", "mailbox-error-reply", kLater, NamesProcessData, Bus::kNo, CoeRejected},
    Law{"al-refused", "fmmu-mismatch", -1, NamesExchange},
    Law{"al-unexpected-change", "fmmu-mismatch", -1, NamesExchange},
    Law{"al-refused", "sdo-abort", kLater, NamesSyncSettings, Bus::kNo, SyncSettingRefused},
    Law{"al-refused", "sdo-abort", kLater, NamesModules, Bus::kNo, ModuleListRefused},
    Law{"al-refused", "mailbox-service-error", kLater, HasNoReason, Bus::kNo, ParameterRefused},
    Law{"pdo-assign-order", "sdo-abort", kLater, nullptr, Bus::kNo, CountRefused},
    Law{"sm-process-config", "frame-repeated", kSoon, nullptr, Bus::kYes, TransferGivenUp, true},
    Law{"pdo-length-mismatch", "frame-repeated", kSoon, nullptr, Bus::kYes, TransferGivenUp, true},
    Law{"sdo-incomplete", "frame-repeated", kSoon, nullptr, Bus::kYes, TransferGivenUp, true},
};

/// The cause lies where the law looks for it.
bool IsWhose(Bus bus, const Finding& effect, const Finding& cause) {
  if (bus == Bus::kEffect) return cause.slave != kNoSlave;
  return cause.slave == (bus == Bus::kNo ? effect.slave : kNoSlave);  // kBoth: that of the bus
}

/// True when `index` is `from`, or one of the causes of that one.
bool LeadsTo(const std::vector<Finding>& findings, FindingIndex from, FindingIndex index) {
  for (std::size_t steps = 0; from != kNoFinding && steps <= findings.size(); ++steps) {
    if (from == index) return true;
    from = findings[from].caused_by;
  }
  return false;
}

}  // namespace

std::vector<std::pair<std::string_view, std::string_view>> CommonCauses() {
  std::vector<std::pair<std::string_view, std::string_view>> laws;
  for (const Law& law : kLaws) {
    const std::pair pair(law.effect, law.cause);
    if (std::ranges::find(laws, pair) == laws.end()) laws.push_back(pair);  // of a slave, of the bus
  }
  return laws;
}

void JoinConsequences(RuleContext& context) {
  std::vector<Finding>& findings = context.store.findings();
  for (const Law& law : kLaws) {
    for (FindingIndex e = 0; e < findings.size(); ++e) {
      Finding& effect = findings[e];
      if (effect.rule != law.effect || effect.caused_by != kNoFinding) continue;
      if ((effect.slave == kNoSlave) != EffectIsOfBus(law.of_bus)) continue;
      if (law.holds != nullptr && !law.holds(context, effect)) continue;
      const Moment moment = MomentOf(findings, e);
      FindingIndex best = kNoFinding;
      for (FindingIndex c = 0; c < findings.size(); ++c) {
        const Finding& cause = findings[c];
        if (cause.rule != law.cause || !IsWhose(law.of_bus, effect, cause)) continue;
        if (HappensNowAndThen(law.of_bus) && !TouchesLookBefore(context, moment, cause)) continue;
        const bool weaker = cause.severity == Severity::kWarning && IsError(effect) && !law.by_warning;
        if (cause.severity == Severity::kInfo || weaker) continue;
        // What began after the effect did not bring it.
        const FrameNo over =
            law.within == kWhileItLasts ? std::max(effect.until, effect.last.number) : effect.first.number;
        if (law.within < 0 && BegunBy(cause) > over) continue;
        if (law.within >= 0 && !Follows(context, effect.slave, moment, cause, law.within)) continue;
        if (law.fits != nullptr && !law.fits(effect, cause)) continue;
        if (LeadsTo(findings, c, e)) continue;
        // The last one that had begun before the effect.
        if (best == kNoFinding || BegunBy(cause) > BegunBy(findings[best])) best = c;
      }
      effect.caused_by = best;
    }
  }
}

}  // namespace ecaudit
