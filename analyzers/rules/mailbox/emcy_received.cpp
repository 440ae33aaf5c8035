#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/refusal_reasons.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/objects/relatives.h"
#include "analyzers/words/drive_error_codes.h"
#include "decoder/base/text.h"
#include "decoder/esc/al.h"
#include "decoder/esc/sync_manager.h"
#include "decoder/mailbox/diagnosis_message.h"
#include "decoder/mailbox/emergency.h"
#include "decoder/mailbox/events.h"
#include "decoder/track/events.h"
#include "decoder/track/network.h"

namespace ecaudit::emcy_received {
namespace {

constexpr FindingKind kEmergency{
    .name = "emergency",
    .title =
        "Emergency {error_code:number}[{?meaning}: [{id} ][{?of_class}class ]"
        "[{short_meaning}][{!short_meaning}{meaning}]][: {aspect} of SM{sync_manager}]",
    .message =
        R"(The slave reports emergency error code {error_code:number}[{?meaning} ([{id} ][{?of_class}class ]{meaning})].
The error register is {error_register}[ ({register_bits})][ ({register_state})], the manufacturer data are {data}.[ So the
slave rejects the {aspect} of SM{sync_manager}[, which the master set to {actual}].][ It accepts {smallest}[ to
{largest}].][ The error category is {category}.][ The additional information has the number {number} as ASCII text.][{?source} The manual of this
family [{?id_source}names {id} ({id_source}), but ]has no row for this code: code and meaning are those of a related
family, {relative} ({source}).][{!meaning} No table has this code.])",
    .next =
        R"([{?aspect}Correct the {aspect} of SM{sync_manager}, and acknowledge the error in AL Control.][{!aspect}Find the
code in the manual of the drive, and remove the cause.])",
    .identity = "error_code"};

constexpr FindingKind kErrorFree{
    .name = "error-free",
    .title = "Emergency {error_code:number}[{?meaning}: [{id} ][{?of_class}class ]{meaning}]",
    .message = R"(The slave reports that it is free of errors again, with emergency error code
{error_code:number}[{?meaning} ([{id} ][{?of_class}class ]{meaning})]. The error register is
{error_register}[ ({register_bits})], the manufacturer data are {data}.[{?source} The manual of this family
[{?id_source}names {id} ({id_source}), but ]has no row for this code: code and meaning are those of a related family,
{relative} ({source}).][{!meaning} No table has this code.])",
    .next = "",
    .identity = "error_code"};

constexpr NoteKind kWhilePending{
    .name = "while-sdo-pending",
    .text =
        R"(It came while the SDO {service}[ of {object}] was pending (request in {request_frame}[, response in
{response_frame}]). The {service} {result}[ with {abort_code}].[{?may_explain} This emergency may be the reason.])"};

constexpr const FindingKind* kKinds[] = {&kEmergency, &kErrorFree};
constexpr const NoteKind* kNotes[] = {&kWhilePending};

// How a transfer ended in which an emergency came.
constexpr Word kSucceeded{"succeeded", "succeeded"};
constexpr Word kWasAborted{"aborted", "was aborted"};
constexpr Word kMailboxError{"mailbox-error", "ended with a mailbox error"};
constexpr Word kNotFinished{"not-finished", "was not finished"};

// What a slave rejects of a sync manager.
constexpr Word kAspects[] = {{"odd-address", "odd address"},
                             {"address", "address"},
                             {"length", "length"},
                             {"settings", "control or enable byte"}};
constexpr Word kWhyRejected[] = {{"address-rejected", "address rejected"},
                                 {"address-rejected", "address rejected"},
                                 {"length-rejected", "length rejected"},
                                 {"settings-rejected", "settings rejected"}};

// What aborts a transfer by itself is a nearer cause than an emergency.
constexpr std::string_view kAfter[] = {"sdo-abort",          "sdo-write-read-only", "sdo-wrong-size",
                                       "sdo-unknown-object", "sdo-toggle",          "al-refused"};

/// Bits of object 1001h.
constexpr Word kRegisterBits[] = {{"generic", "generic"},
                                  {"current", "current"},
                                  {"voltage", "voltage"},
                                  {"temperature", "temperature"},
                                  {"communication", "communication"},
                                  {"device-profile", "device profile"},
                                  {"reserved", "reserved"},
                                  {"manufacturer", "manufacturer"}};

constexpr RuleInfo kInfo{.id = "emcy-received",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kError,
                         .history = History::kNone,
                         .subject = Subject::kCoe,
                         .title = "The slave sends an emergency message",
                         .needs = "the messages in the mailbox of the slave",
                         .source = "ETG1000.6, emergency; CIA301, emergency error codes; MKD, 5.1",
                         .kinds = kKinds,
                         .notes = kNotes,
                         .after = kAfter,
                         .doc = R"(
## What it checks
CoE emergency messages: a fault or a warning of the drive began or ended.

## Why it matters
The drive itself reports what is wrong, often before the status word or the AL state shows it.

## How it is decided
Every emergency is reported. Emergencies with the same error code and error register count as repetitions.

- A fault is an error.
- A warning of the drive (n-codes) is a warning.
- "Error free" (0x0000) is an info.

The meaning comes from the family's table of codes. If its manual has none, it comes from a related family of the same
vendor, and the finding is inferred. Otherwise it comes from the classes of the standard. These do not distinguish
faults and warnings: such an emergency is an error.

0xA000 and 0xA001 report a state change that failed. Their manufacturer data name the sync manager and what the slave
rejects of it: the address, the length, or the control and enable bytes. The refusal of the state has this as its reason
if the settings show none, and if what the master set is not within what the slave accepts. A message of the diagnosis
history (10F3h) with the same data counts as well.

By the standard 0xA000 is PREOP to SAFEOP, 0xA001 is SAFEOP to OP. Some makers use 0xA001 for SAFEOP to PREOP. If the
master requested other states in the capture, and not this one, the finding names a failed state change only.

Emergencies between an SDO request and its response belong together:

- The finding states whether the SDO transfer succeeded.
- The first emergency is taken as the cause of the others.
- If the slave aborts the transfer because of its state (0x08000020 to 0x08000022) and no other rule explains that, the
  first emergency may be the reason: sdo-abort names it as its cause, and is inferred.

## Example
samples/captures/emergency.pcapng: code 0x7305 with error register 0x01 and manufacturer data 11 22 33 44 55.

## What to do
Find the code in the drive's manual, by the drive's own number (F..., n...) if it has one, and remove the cause.
)"};

class EmcyReceived final : public Rule {
 public:
  EmcyReceived() : Rule(kInfo) {
    Subscribe<mailbox::Emergency>(&EmcyReceived::On);
    Subscribe<mailbox::SdoTransfer>(&EmcyReceived::On);
    Subscribe<track::AlRequest>(&EmcyReceived::On);
  }

  void On(const track::AlRequest& e) { requested_[e.slave].Add(e.control.state()); }

  void On(const mailbox::Emergency& e) {
    if (e.data.too_short) return;  // mailbox-malformed
    const std::uint64_t key = static_cast<std::uint64_t>(e.data.error_code) << 8U | e.data.error_register;
    if (const FindingIndex known = Repeat(e.slave, key, e.frame); known != kNoFinding) {
      Remember(e, known);
      return;
    }
    events::EmergencyInfo known = events::FindEmergency(context().slave(e.slave).profile, e.data.error_code);
    bool exact = known.code != nullptr && known.code->code == known.code->last_code;
    const bool transition = IsFailedTransition(e.data.error_code) && exact && known.code->id.empty();
    if (transition && OthersRequested(e)) {
      known = events::FindEmergency(context().slave(e.slave).profile, kAnyTransition);
      exact = false;
    }
    const Severity severity = SeverityOf(e.data.error_code, known.code);
    Finding finding = Found(severity == Severity::kInfo ? kErrorFree : kEmergency, e.slave, e.frame);
    finding.confidence = known.inferred ? Confidence::kInferred : Confidence::kObserved;
    finding.Set("error_code", arg::Code(e.data.error_code));
    const bool is_drive = context().slave(e.slave).drives.seen();
    const std::string_view standard = is_drive && !exact ? DriveErrorText(e.data.error_code) : std::string_view();
    if (!standard.empty()) {
      finding.Set("meaning", arg::Text(standard));
    } else if (known.code != nullptr) {
      if (!known.code->id.empty()) finding.Set("id", arg::Text(known.code->id));
      finding.Set("meaning", arg::Text(known.code->text)).Set("of_class", arg::Flag(!exact));
      if (known.code->text.size() > kTitleBytes) {
        finding.Set("short_meaning", arg::Text(Shortened(known.code->text, kTitleBytes - 4)));
      }
      if (known.inferred && known.from != nullptr) {
        finding.Set("source", arg::Text(known.code->source)).Set("relative", arg::Text(known.from->title));
      }
      const std::string_view own = SourceOf(context().slave(e.slave).profile->sync, known.code->id);
      if (known.inferred && !own.empty()) finding.Set("id_source", arg::Text(own));
    }
    finding.Set("error_register", arg::Hex(e.data.error_register, 2));
    if (transition) {
      SetState(e.data.error_register, finding);
      SetTransition(e.slave, e.data, finding.arguments);
    } else if (std::vector<Value> bits = BitsOf(e.data.error_register); !bits.empty()) {
      finding.Set("register_bits", arg::List(std::move(bits)));
    }
    finding.Set("data", arg::Bytes(e.data.data));
    if (context().slave(e.slave).profile->emergency && context().slave(e.slave).profile->emergency->category) {
      finding.Set("category", arg::Hex(e.data.data[0], 2));
      if (const std::string number = mailbox::NumberText(e.data); !number.empty()) {
        finding.Set("number", arg::Text(number));
      }
    }
    if (known.code != nullptr) finding.reference = ReferenceTo(known.code->source);
    const bool names_setting = finding.arguments.Has("aspect");
    const FindingIndex index = Report(key, severity, std::move(finding));
    if (names_setting && index != kNoFinding) {
      transitions_.push_back({e.slave, e.frame.number, 0, context().store[index].arguments});
    }
    Remember(e, index);
  }

  /// One chain: the request, the emergencies before its response, and what became of it.
  void On(const mailbox::SdoTransfer& t) {
    ReadDiagnosis(t);
    if (!t.request.seen() || !t.last.seen()) return;
    FindingIndex first = kNoFinding;
    for (std::size_t i = 0; i < recent_.size(); ++i) {
      const Recent& came = recent_[(next_ + i) % recent_.size()];  // oldest first
      if (came.finding == kNoFinding || came.slave != t.slave) continue;
      if (came.frame <= t.request.number || came.frame >= t.last.number) continue;
      Finding& finding = context().store[came.finding];
      if (!finding.Has(kWhilePending)) {
        finding.Add(kWhilePending, NoteOf(t, first == kNoFinding));
        AddRelated(finding, t.request.number);
        AddRelated(finding, t.last.number);
      }
      if (first == kNoFinding) {
        first = came.finding;
      } else if (came.finding > first && finding.caused_by == kNoFinding) {
        finding.caused_by = first;
      }
    }
    if (first != kNoFinding && MayExplain(t)) {
      aborts_.push_back({t.slave, t.last.number, first});
      if (aborts_.size() > kMostAborts) aborts_.erase(aborts_.begin());
    }
  }

  void Finish() override {
    for (const Recent& abort : aborts_) {
      ExplainFindings(context(), "sdo-abort", abort.slave, abort.frame, abort.finding, Confidence::kInferred);
    }
    for (const Rejection& rejection : transitions_) ExplainRefusal(rejection);
    (void)NotEvaluableWithoutReturns();
  }

 private:
  static constexpr std::uint16_t kToSafeop = 0xA000, kToOp = 0xA001, kAnyTransition = 0xA0FF;
  static bool IsFailedTransition(std::uint16_t code) { return code == kToSafeop || code == kToOp; }

  /// The master requested states of this slave, and not the one that the code of the standard is about.
  [[nodiscard]] bool OthersRequested(const mailbox::Emergency& e) const {
    const auto requested = requested_.find(e.slave);
    if (requested == requested_.end()) return false;
    const esc::AlState state = e.data.error_code == kToOp ? esc::AlState::OP : esc::AlState::SAFEOP;
    return !requested->second.contains(static_cast<std::uint8_t>(state));
  }

  /// What the slave rejects, by an emergency or by a message of its diagnosis history.
  struct Rejection {
    SlaveId slave = kNoSlave;
    FrameNo frame = 0;          ///< the frame that shows it to the master
    std::uint8_t subindex = 0;  ///< of 10F3h; 0: it is an emergency
    Arguments arguments;
  };

  /// A message of the diagnosis history with the data of such an emergency. It may be older than the refusal, so it
  /// counts only if what the master set is still not what the slave accepts.
  void ReadDiagnosis(const mailbox::SdoTransfer& t) {
    if (t.complete_access || t.data_gap || t.outcome != mailbox::SdoOutcome::kCompleted || !t.last.seen()) return;
    if (transitions_.size() >= kMostRejections || t.service != mailbox::SdoService::kUpload ||
        !mailbox::IsDiagnosisMessage(t.index, t.subindex))
      return;
    const auto emergency = mailbox::ParseDiagnosisMessage(t.data).emergency();
    if (!emergency || !IsFailedTransition(emergency->error_code)) return;
    Rejection rejection{t.slave, t.last.number, t.subindex, {}};
    rejection.arguments.Set("error_code", arg::Code(emergency->error_code));
    SetTransition(t.slave, *emergency, rejection.arguments);
    if (rejection.arguments.Has("actual") && rejection.arguments.Has("smallest")) {
      transitions_.push_back(std::move(rejection));
    }
  }

  /// The error register is the state. 3 and 4 are SAFEOP and OP for some makers, BOOT and SAFEOP for others.
  static void SetState(std::uint8_t state, Finding& finding) {
    if (state == static_cast<std::uint8_t>(esc::AlState::INIT) ||
        state == static_cast<std::uint8_t>(esc::AlState::PREOP)) {
      finding.Set("register_state", arg::State(state));
    }
  }

  void SetTransition(SlaveId slave, const mailbox::EmergencyData& emergency, Arguments& arguments) const {
    using Aspect = mailbox::TransitionDiagnosis::Aspect;
    const auto diagnosis = mailbox::ParseTransition(emergency);
    if (!diagnosis) return;
    const bool length = diagnosis->aspect == Aspect::kLength;
    const bool address = diagnosis->aspect == Aspect::kAddress || diagnosis->aspect == Aspect::kOddAddress;
    std::optional<std::uint16_t> actual;
    if (length || address) {
      const auto base = esc::SyncManagerAddress(diagnosis->sync_manager);
      actual = context().network().state(slave).registers.Value<std::uint16_t>(
          static_cast<EscAddress>(length ? base + 2 : base), Certainty::kObserved);
    }
    const auto value = [&](std::uint16_t v) { return length ? arg::Count(v, "byte") : arg::Hex(v); };
    if (diagnosis->accepted) {
      const auto [low, high] = *diagnosis->accepted;
      // The data of this maker mean something else: the slave has what it accepts.
      if (diagnosis->aspect != Aspect::kOddAddress && actual && *actual >= low && *actual <= high) return;
      arguments.Set("smallest", value(low));
      if (high != low) arguments.Set("largest", value(high));
    }
    arguments.Set("aspect", arg::Of(kAspects[static_cast<std::size_t>(diagnosis->aspect)]))
        .Set("sync_manager", arg::Number(diagnosis->sync_manager));
    if (actual) arguments.Set("actual", value(*actual));
  }

  /// The refusal that it is about has the setting as its reason, if nothing else shows one.
  void ExplainRefusal(const Rejection& rejection) const {
    const bool to_op = rejection.arguments.Find("error_code")->number == kToOp;
    const auto wanted = static_cast<std::int64_t>(to_op ? esc::AlState::OP : esc::AlState::SAFEOP);
    Finding* refusal = nullptr;
    for (Finding& finding : context().store.findings()) {
      if (finding.rule != "al-refused" || finding.slave != rejection.slave) continue;
      const Value* requested = finding.arguments.Find("requested");
      const Value* request = finding.arguments.Find("request_frame");
      if (requested == nullptr || requested->number != wanted || request == nullptr) continue;
      if (static_cast<FrameNo>(request->number) < rejection.frame) refusal = &finding;
    }
    if (refusal == nullptr || refusal->caused_by != kNoFinding || refusal->arguments.Has("reason")) return;
    Arguments note{{"emergency_frame", arg::Frame(rejection.frame)}};
    if (rejection.subindex != 0) note.Set("object", arg::Object(mailbox::kDiagnosisHistory, rejection.subindex));
    for (const std::string_view name : {"error_code", "aspect", "sync_manager", "actual", "smallest", "largest"}) {
      if (const Value* value = rejection.arguments.Find(name); value != nullptr) note.Set(name, *value);
    }
    const Word& why = kWhyRejected[AspectOf(rejection.arguments)];
    refusal->Set("reason", arg::Of(why)).Set("reason_value", arg::Text(SettingText(rejection.arguments)));
    refusal->Add(refusal::kEmergency, std::move(note));
    AddRelated(*refusal, rejection.frame);
  }

  /// "SM2", for a length also what it is and should be: "SM2: 40, not 42".
  static std::string SettingText(const Arguments& arguments) {
    std::string text = "SM" + std::to_string(arguments.Find("sync_manager")->number);
    const Value* actual = arguments.Find("actual");
    const Value* smallest = arguments.Find("smallest");
    if (&kWhyRejected[AspectOf(arguments)] != &kWhyRejected[kLength] || actual == nullptr || smallest == nullptr) {
      return text;
    }
    text += ": " + std::to_string(actual->number) + ", not " + std::to_string(smallest->number);
    if (const Value* largest = arguments.Find("largest")) text += " to " + std::to_string(largest->number);
    return text;
  }
  static constexpr std::size_t kLength = static_cast<std::size_t>(mailbox::TransitionDiagnosis::Aspect::kLength);
  static std::size_t AspectOf(const Arguments& arguments) {
    const Word* word = arguments.Find("aspect")->word;
    const auto* at = std::find_if(std::begin(kAspects), std::end(kAspects), [&](const Word& w) { return &w == word; });
    return static_cast<std::size_t>(at - std::begin(kAspects));
  }

  /// Room for the meaning in a title.
  static constexpr std::size_t kTitleBytes = 46;
  static constexpr std::size_t kMostAborts = 64;
  static constexpr std::size_t kMostRejections = 256;

  struct Recent {
    SlaveId slave = kNoSlave;
    FrameNo frame = 0;
    FindingIndex finding = kNoFinding;
  };

  void Remember(const mailbox::Emergency& e, FindingIndex finding) {
    recent_[next_++ % recent_.size()] = {e.slave, e.frame.number, finding};
  }

  /// Only codes about the state of the device can have the event as their reason that the emergency reports.
  [[nodiscard]] static bool MayExplain(const mailbox::SdoTransfer& t) {
    constexpr std::uint32_t kNotTransferred = 0x08000020, kDeviceState = 0x08000022;
    return t.outcome == mailbox::SdoOutcome::kAborted && t.aborted_by == mailbox::Direction::kIn &&
           t.abort_code >= kNotTransferred && t.abort_code <= kDeviceState;
  }

  /// @param first  of those that came in this transfer
  [[nodiscard]] static Arguments NoteOf(const mailbox::SdoTransfer& t, bool first) {
    Arguments note{{"service", ServiceValue(t.service)}, {"request_frame", arg::Frame(t.request.number)}};
    if (t.has_object) note.Set("object", arg::Object(t.index, t.complete_access ? -1 : t.subindex));
    if (t.response.seen()) note.Set("response_frame", arg::Frame(t.response.number));
    switch (t.outcome) {
      case mailbox::SdoOutcome::kCompleted:
        note.Set("result", arg::Of(kSucceeded));
        break;
      case mailbox::SdoOutcome::kAborted:
        note.Set("result", arg::Of(kWasAborted))
            .Set("abort_code", arg::Code(t.abort_code, mailbox::AbortCodeText(t.abort_code), 8))
            .Set("may_explain", arg::Flag(first && MayExplain(t)));
        break;
      case mailbox::SdoOutcome::kMailboxError:
        note.Set("result", arg::Of(kMailboxError));
        break;
      default:
        note.Set("result", arg::Of(kNotFinished));
        break;
    }
    return note;
  }

  static Severity SeverityOf(std::uint16_t code, const device::EmergencyCode* known) {
    if (code == 0) return Severity::kInfo;
    if (known == nullptr) return Severity::kError;
    switch (known->kind) {
      case device::EmergencyKind::kNone:
        return Severity::kInfo;
      case device::EmergencyKind::kWarning:
        return Severity::kWarning;
      case device::EmergencyKind::kFault:
        break;
    }
    return Severity::kError;
  }

  /// Where the family's own manual names this number of a drive, though it has no table of codes; empty: nowhere.
  static std::string_view SourceOf(const device::SyncDescription& sync, const std::string& id) {
    for (const auto* numbers : {&sync.lost_faults, &sync.lost_warnings}) {
      if (std::find(numbers->begin(), numbers->end(), id) == numbers->end()) continue;
      return sync.lost_after_missing.source.empty() ? sync.lost_after_jitter.source : sync.lost_after_missing.source;
    }
    return {};
  }

  static std::vector<Value> BitsOf(std::uint8_t error_register) {
    std::vector<Value> bits;
    for (unsigned bit = 0; bit < 8; ++bit) {
      if ((error_register >> bit & 1U) != 0) bits.push_back(arg::Of(kRegisterBits[bit]));
    }
    return bits;
  }

  std::array<Recent, 32> recent_{};  // the newest
  std::size_t next_ = 0;
  std::vector<Recent> aborts_;  // what an emergency explains
  std::vector<Rejection> transitions_;
  std::map<SlaveId, model::StateSet> requested_;  ///< AL states that the master requested
};

const RuleRegistration kRegistration{kInfo, MakeRule<EmcyReceived>};

}  // namespace
}  // namespace ecaudit::emcy_received
