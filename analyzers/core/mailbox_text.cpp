#include "analyzers/core/mailbox_text.h"

#include "decoder/base/text.h"

namespace ecaudit {

std::string WhichWay(mailbox::Direction direction) {
  return direction == mailbox::Direction::kOut ? "from the master" : "from the slave";
}

std::string RequestText(const mailbox::RequestSummary& request) {
  if (request.protocol == mailbox::Protocol::kCoE && request.index) {
    return "the SDO request for " + ObjectName(*request.index, request.subindex ? *request.subindex : -1);
  }
  return "the " + Name(request.protocol) + " request";
}

std::string ObjectText(const mailbox::SdoTransfer& transfer, const device::DeviceDescription& family) {
  std::string out = ObjectName(transfer.index, transfer.complete_access ? -1 : transfer.subindex);
  if (transfer.complete_access) out += " (complete access)";
  const std::string_view name = family.object_name(transfer.index, transfer.subindex);
  if (!name.empty()) out += " " + std::string(name);
  return out;
}

Confidence ConfidenceOf(Certainty certainty) {
  return certainty == Certainty::kObserved ? Confidence::kObserved : Confidence::kInferred;
}

void ExplainAbort(RuleContext& context, const mailbox::SdoTransfer& transfer, FindingIndex cause) {
  if (cause == kNoFinding || transfer.outcome != mailbox::SdoOutcome::kAborted) return;
  const FrameRef& frame = transfer.last.seen() ? transfer.last : transfer.request;
  for (Finding& finding : context.store.findings()) {
    if (finding.rule == "sdo-abort" && finding.slave == transfer.slave && finding.first.number <= frame.number &&
        finding.last.number >= frame.number && finding.caused_by == kNoFinding) {
      finding.caused_by = cause;
    }
  }
}

}  // namespace ecaudit
