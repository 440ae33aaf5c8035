/// A mailbox message in words.
#pragma once

#include <string>

#include "decoder/mailbox/diagnosis_message.h"
#include "decoder/mailbox/events.h"

namespace ecaudit::cli {

/// Name of the service inside the protocol: "SDO request", "write request", "fragment"; "" where there is none or the
/// message is too short.
[[nodiscard]] std::string ServiceName(const mailbox::MailboxMessage& message);
/// "CoE SDO request: upload 1018h:1", "FoE write request: \"ECATFW__\"", "mailbox error: the service is not supported".
/// Printable text.
/// @param texts  of diagnosis messages (10F3h) of the slave; null: none
[[nodiscard]] std::string DescribeMessage(const mailbox::MailboxMessage& message,
                                          const mailbox::DiagnosisTexts* texts = nullptr);
/// "SDO upload 1018h:1", "FoE read request": a request that is answered, or waits for its answer.
[[nodiscard]] std::string DescribeRequest(const mailbox::RequestSummary& request);

}  // namespace ecaudit::cli
