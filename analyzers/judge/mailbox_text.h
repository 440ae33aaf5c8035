/// Words for mailbox requests and objects, and the link from an aborted transfer to its cause.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
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

/// "from the master", "from the slave".
[[nodiscard]] std::string WhichWay(mailbox::Direction direction);
/// "a CoE", "an AoE": as the letters are spoken.
[[nodiscard]] std::string WithArticle(mailbox::Protocol protocol);
/// "the SDO request for 1018h:1", "the FoE request".
[[nodiscard]] std::string RequestText(const mailbox::RequestSummary& request);
/// "6040h:0 Control word": with the family's name for the object where it has one.
[[nodiscard]] std::string ObjectText(const mailbox::SdoTransfer& transfer, const device::DeviceDescription& family);
[[nodiscard]] Confidence ConfidenceOf(Certainty certainty);
/// Tells requests apart by protocol and object, to fold repetitions.
[[nodiscard]] std::uint64_t RequestKey(const mailbox::RequestSummary& request);
/// How long the master waited for the answer: from the request to its last look that found nothing, or to what ended
/// the waiting where the answer may have been lost on its way. Absent without time stamps, or when it never looked.
[[nodiscard]] std::optional<std::int64_t> WaitOf(const mailbox::MailboxUnanswered& event);
/// What a wait for an answer comes to.
enum class WaitVerdict : std::uint8_t {
  kUnanswered,   ///< longer than the limit, or given up by the master after half of it at the least
  kNoTime,       ///< no time stamps
  kNeverLooked,  ///< the master never looked for an answer
  kTooShort,     ///< ended early: by the capture, a reset or the next request
  kGap,          ///< frames are missing from the capture
};
/// @param capture_end  last frame of the capture where that ended the wait, else not seen()
/// @param state_asked  the slave was asked for another state behind the last look
[[nodiscard]] WaitVerdict JudgeWait(const mailbox::MailboxUnanswered& event, const FrameRef& capture_end,
                                    std::int64_t limit_ns, bool state_asked = false);
/// With the end of the capture, the limit of mailbox-no-response, and what the slave was asked for.
[[nodiscard]] WaitVerdict JudgeWait(const RuleContext& context, const mailbox::MailboxUnanswered& event);
/// Points the findings of `rule` about this slave that were reported last with `frame` to `cause`, unless they have
/// one.
void ExplainFindings(RuleContext& context, std::string_view rule, SlaveId slave, FrameNo frame, FindingIndex cause);
/// Points the sdo-abort finding of this transfer, if there is one, to `cause`.
void ExplainAbort(RuleContext& context, const mailbox::SdoTransfer& transfer, FindingIndex cause);

}  // namespace ecaudit
