/// Words for mailbox requests and objects, and the link from an aborted transfer to its cause.
#pragma once

#include <string>

#include "analyzers/core/rule.h"
#include "decoder/device/device_description.h"
#include "decoder/mailbox/error_reply.h"
#include "decoder/mailbox/events.h"
#include "decoder/mailbox/sdo.h"

namespace ecaudit {

/// "from the master", "from the slave".
[[nodiscard]] std::string WhichWay(mailbox::Direction direction);
/// "the SDO request for 1018h:1", "the FoE request".
[[nodiscard]] std::string RequestText(const mailbox::RequestSummary& request);
/// "6040h:0 Control word": with the family's name for the object where it has one.
[[nodiscard]] std::string ObjectText(const mailbox::SdoTransfer& transfer, const device::DeviceDescription& family);
[[nodiscard]] Confidence ConfidenceOf(Certainty certainty);
/// Points the sdo-abort finding of this transfer, if there is one, to `cause`.
void ExplainAbort(RuleContext& context, const mailbox::SdoTransfer& transfer, FindingIndex cause);

}  // namespace ecaudit
