/// Values of findings for mailbox requests and objects, and the link from an aborted transfer to its cause.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/device/device_description.h"
#include "decoder/mailbox/error_reply.h"
#include "decoder/mailbox/events.h"
#include "decoder/mailbox/sdo.h"

namespace ecaudit {

/// How long a slave may take to answer a mailbox request, ns; configurable as "mailbox-no-response".
inline constexpr std::int64_t kMailboxAnswerLimit = 1'000'000'000;

/// "CoE"
[[nodiscard]] Value ProtocolValue(mailbox::Protocol protocol);
/// "from the master"; code "out" or "in".
[[nodiscard]] Value DirectionValue(mailbox::Direction direction);
/// "the master"; code "master" or "slave".
[[nodiscard]] Value SenderValue(mailbox::Direction direction);
/// "download", "upload"; "transfer" where neither is known.
[[nodiscard]] Value ServiceValue(mailbox::SdoService service);
/// How a transfer ended.
[[nodiscard]] Value OutcomeValue(mailbox::SdoOutcome outcome);
/// The bit of a protocol in word 0x1C of an EEPROM; 0: it has none.
[[nodiscard]] std::uint16_t SiiProtocolOf(mailbox::Protocol protocol);
/// Sets {protocol}, and {object} of an SDO request, for templates like
/// "the [SDO request for {object}][{!object}{protocol} request]".
void SetRequest(Arguments& arguments, const mailbox::RequestSummary& request);
/// Sets {object} with the family's name for it, {index}, {subindex} and {complete_access}, where the object is known.
void SetObject(Finding& finding, const mailbox::SdoTransfer& transfer, const device::DeviceDescription& family);
[[nodiscard]] Confidence ConfidenceOf(Certainty certainty);
/// Distinguishes requests by protocol and object, to fold repetitions.
[[nodiscard]] std::uint64_t RequestKey(const mailbox::RequestSummary& request);
/// How long the master waited for the answer: from the request, or the part that came, to its last poll that found
/// nothing, or to the end of the wait if the answer may have been lost on its way. Absent without time stamps, or if
/// the master never polled.
[[nodiscard]] std::optional<std::int64_t> WaitOf(const mailbox::MailboxUnanswered& event);
/// The result of a wait for an answer.
enum class WaitVerdict : std::uint8_t {
  kUnanswered,   ///< longer than the limit, or given up by the master after at least half of it
  kNoTime,       ///< no time stamps
  kNeverPolled,  ///< the master never read the mailbox or its status
  kTooShort,     ///< ended early: by the capture, a reset or the next request
  kGap,          ///< frames are missing from the capture
};
/// @param capture_end  last frame of the capture where that ended the wait, else not seen()
/// @param state_requested  the master requested another state after the last poll
[[nodiscard]] WaitVerdict EvaluateWait(const mailbox::MailboxUnanswered& event, const FrameRef& capture_end,
                                       std::int64_t limit_ns, bool state_requested = false);
/// With the end of the capture, the limit of mailbox-no-response, and the state requests to the slave.
[[nodiscard]] WaitVerdict EvaluateWait(const RuleContext& context, const mailbox::MailboxUnanswered& event);
/// Points the findings of `rule` about this slave that were reported last with `frame` to `cause`, unless they have
/// one. With an inferred `confidence` the findings are inferred, too.
void ExplainFindings(RuleContext& context, std::string_view rule, SlaveId slave, FrameNo frame, FindingIndex cause,
                     Confidence confidence = Confidence::kObserved);
/// Points the sdo-abort finding of this transfer, if there is one, to `cause`.
void ExplainAbort(RuleContext& context, const mailbox::SdoTransfer& transfer, FindingIndex cause);

}  // namespace ecaudit
