/// in: SDO transfers of one slave.  out: the messages of its diagnosis history (10F3h) that the master read.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "decoder/base/ids.h"
#include "decoder/mailbox/diagnosis_message.h"
#include "decoder/mailbox/events.h"

namespace ecaudit::model {

/// One message, as it was read first.
struct DiagnosisEntry {
  std::uint8_t subindex = 0;
  mailbox::DiagnosisMessage message;
  std::vector<std::uint8_t> bytes;
  FrameRef request;  ///< of the upload; not seen(): it is not in the capture
  FrameRef read;
  /// The same subindex was read before with other contents: the slave stored the message after that read. 0: it may
  /// have stored it at any time before `request`.
  FrameNo stored_after = 0;
};

class DiagnosisHistory {
 public:
  /// Later messages are not kept, so that a capture cannot exhaust memory.
  static constexpr std::size_t kMaxMessages = 64;
  static constexpr std::size_t kMaxBytes = 256;

  /// Takes a completed upload of one message; others change nothing.
  void Apply(const mailbox::SdoTransfer& transfer);
  /// In the order in which they were read.
  [[nodiscard]] const std::vector<DiagnosisEntry>& messages() const { return messages_; }

 private:
  std::vector<DiagnosisEntry> messages_;
};

}  // namespace ecaudit::model
