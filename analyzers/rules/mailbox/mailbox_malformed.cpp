#include <optional>

#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/mailbox/events.h"
#include "decoder/track/network.h"

namespace ecaudit::mailbox_malformed {
namespace {

constexpr FindingKind kMalformed{
    .name = "malformed",
    .title = "Malformed mailbox message {direction}: {problem}",
    .message =
        R"(The {protocol} message {direction} in {frame} is malformed: {explanation}. Its header has length {length},
type {type} and counter {counter}.[ The mailbox has {mailbox_length}, 6 of them for the header.] [{?from_master}
[{?incomplete}The slave does not receive it.][{!incomplete}The slave can only drop the message or answer with a mailbox
error.]][{!from_master}The master cannot use the message.])",
    .next =
        R"([{?from_master}Correct the code of the master that builds the message.][{!from_master}Report this frame to the
vendor of the slave: its mailbox code is wrong.])",
    .identity = "problem direction protocol"};

constexpr FindingKind kInfoTooShort{
    .name = "sdo-information-too-short",
    .title = "Malformed SDO information response: shorter than its fixed fields",
    .message =
        R"(The SDO information response in {frame} ends before its fixed fields: the length in the mailbox header is too
small.[ Abort code {abort_code} follows the end of the message: the slave counts its error response too short.] A master
that checks the length does not get the reason.)",
    .next = "Report this frame to the vendor of the slave: its mailbox code is wrong."};

constexpr const FindingKind* kKinds[] = {&kMalformed, &kInfoTooShort};

/// Each problem in a title, and in a sentence.
struct ProblemWords {
  Word problem;
  Word explanation;
};
constexpr ProblemWords kNoHeader{{"no-header", "incomplete header"},
                                 {"no-header", "fewer than the 6 bytes of the mailbox header were transferred"}};
constexpr ProblemWords kLengthZero{{"length-zero", "length 0"}, {"length-zero", "the length field is 0"}};
constexpr ProblemWords kBeyondMailbox{{"length-beyond-mailbox", "longer than the mailbox"},
                                      {"length-beyond-mailbox", "the length field is larger than the mailbox"}};
constexpr ProblemWords kBeyondData{
    {"length-beyond-data", "bytes are missing"},
    {"length-beyond-data", "fewer bytes were transferred than the length field requires"}};
constexpr ProblemWords kReservedBit{{"reserved-bit", "reserved bit set"},
                                    {"reserved-bit", "the reserved bit after the counter is set"}};
constexpr ProblemWords kUnknownType{{"unknown-type", "reserved type number"},
                                    {"unknown-type", "the protocol type is a reserved number"}};
constexpr ProblemWords kServiceTooShort{{"service-too-short", "too short for its service"},
                                        {"service-too-short", "the length is too short for the service"}};
constexpr ProblemWords kServiceInvalid{{"service-invalid", "reserved service number"},
                                       {"service-invalid", "the service, operation or command is a reserved number"}};
constexpr ProblemWords kNotCompleted{
    {"not-completed", "last byte not accessed"},
    {"not-completed", "the last byte of the mailbox was not accessed before the next message began"}};

constexpr Word kFieldsMissing{"fixed-fields-missing", "fixed fields are missing"};
constexpr Word kMailboxSettings{"mailbox-settings", "the settings of sync managers 0 and 1", true};

constexpr RuleInfo kInfo{.id = "mailbox-malformed",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kError,
                         .history = History::kNone,
                         .title = "Lengths or fields of a mailbox message are inconsistent",
                         .needs = "the settings of sync managers 0 and 1",
                         .source = "ETG1000.4, mailbox; ETG1000.6, CoE",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
Each mailbox message:

- the length in its header against the mailbox and the bytes transferred
- the reserved bit and the type
- whether the header and the fixed fields of the protocol fit into the length and have defined values

## Why it matters
The receiver drops such a message or answers with a mailbox error. If the last byte of a message was never written, the
slave does not see the message: the sync manager hands over the mailbox only when its last byte is accessed.

## How it is decided
The bytes of the message as they were written or read decide. Not evaluated are:

- bytes cut by the snap length
- bits that the vendor manuals call reserved but that the standard defines (the counter)
- slaves whose mailbox sync managers were set before the capture: messages are then recognised by their contents, so
  malformed ones are not found
- the last byte of a message, if the capture misses packets, or if the slave gives a message before the next one begins

## Example
A request with length 0, or a request of 10 bytes whose SDO part ends after the command.

## What to do
- Message of the master: check the code that builds it. The length counts the bytes after the 6 header bytes.
- Message of the slave: report the frame to the vendor of the slave.
)"};

class MailboxMalformed final : public Rule {
 public:
  MailboxMalformed() : Rule(kInfo) {
    Subscribe<mailbox::MailboxMessage>(&MailboxMalformed::On);
    Subscribe<mailbox::SdoInfo>(&MailboxMalformed::On);
  }

  void On(const mailbox::MailboxMessage& m) {
    if (m.window_inferred) {
      NotEvaluable(m.slave, ReasonCode::kNotInCapture, kMailboxSettings, m.frame().number);
    }
    if (m.problem == mailbox::Problem::kNone || m.repeated) return;
    if (m.problem == mailbox::Problem::kNotCompleted && MissesAny(context().pairing())) {
      return NotEvaluable(m.slave, ReasonCode::kMissesPackets, m.frame().number);
    }
    const std::uint64_t key = static_cast<std::uint64_t>(m.problem) | static_cast<std::uint64_t>(m.direction) << 8U |
                              static_cast<std::uint64_t>(m.header.protocol) << 16U;
    if (Repeat(m.slave, key, m.frame()) != kNoFinding) return;
    Finding finding = Found(kMalformed, m.slave, m.frame());
    finding.confidence = m.window_inferred ? Confidence::kInferred : Confidence::kObserved;
    const ProblemWords& words = WordsFor(m.problem);
    finding.Set("problem", arg::Of(words.problem))
        .Set("explanation", arg::Of(words.explanation))
        .Set("direction", DirectionValue(m.direction))
        .Set("protocol", ProtocolValue(m.header.protocol))
        .Set("length", arg::Number(m.header.length))
        .Set("type", arg::Number(static_cast<int>(m.header.protocol)))
        .Set("counter", arg::Number(m.header.counter))
        .Set("from_master", arg::Flag(m.direction == mailbox::Direction::kOut))
        .Set("incomplete", arg::Flag(&words == &kNotCompleted));
    if (const std::optional<std::uint16_t> length = LengthOf(m)) {
      finding.Set("mailbox_length", arg::Count(*length, "byte"));
    }
    AddRelated(finding, m.first.number == finding.first.number ? 0 : m.first.number);
    Report(key, std::move(finding));
  }

  void On(const mailbox::SdoInfo& info) {
    if (!info.malformed || !info.response.seen()) return;
    constexpr std::uint64_t kKey = 1ULL << 32U;
    if (Repeat(info.slave, kKey, info.response) != kNoFinding) return;
    Finding finding = Found(kInfoTooShort, info.slave, info.response);
    finding.Set("problem", arg::Of(kFieldsMissing));
    if (info.abort_code != 0) {
      finding.Set("abort_code", arg::Code(info.abort_code, mailbox::AbortCodeText(info.abort_code), 8));
    }
    AddRelated(finding, info.request.number);
    Report(kKey, std::move(finding));
  }

 private:
  static const ProblemWords& WordsFor(mailbox::Problem problem) {
    switch (problem) {
      case mailbox::Problem::kNone:
      case mailbox::Problem::kNoHeader:
        break;
      case mailbox::Problem::kLengthZero:
        return kLengthZero;
      case mailbox::Problem::kLengthBeyondMailbox:
        return kBeyondMailbox;
      case mailbox::Problem::kLengthBeyondData:
        return kBeyondData;
      case mailbox::Problem::kReservedBit:
        return kReservedBit;
      case mailbox::Problem::kUnknownType:
        return kUnknownType;
      case mailbox::Problem::kServiceTooShort:
        return kServiceTooShort;
      case mailbox::Problem::kServiceInvalid:
        return kServiceInvalid;
      case mailbox::Problem::kNotCompleted:
        return kNotCompleted;
    }
    return kNoHeader;
  }

  [[nodiscard]] std::optional<std::uint16_t> LengthOf(const mailbox::MailboxMessage& m) const {
    const std::size_t number = m.direction == mailbox::Direction::kOut ? 0 : 1;
    const auto sm = context().network().state(m.slave).sync_manager(number, Certainty::kInferred);
    if (m.window_inferred || !sm || !sm->mailbox()) return std::nullopt;
    return sm->length;
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<MailboxMalformed>};

}  // namespace
}  // namespace ecaudit::mailbox_malformed
