/// File access over EtherCAT: its messages, and transfers put together from them.
///
///   | operation 1 | reserved 1 | password, packet number or error code 4 | file name, data or error text |
///   busy: | operation 1 | reserved 1 | done 2 | entire 2 | text |
///
/// Source: ETG.1000.6 5.9; esc-reference 8.5.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "decoder/base/bytes.h"
#include "decoder/base/event_sink.h"
#include "decoder/mailbox/events.h"

namespace ecaudit::mailbox {

inline constexpr std::size_t kFoeHeaderBytes = 6;

enum class FoeOperation : std::uint8_t {
  kReadRequest = 1,
  kWriteRequest = 2,
  kData = 3,
  kAcknowledge = 4,
  kError = 5,
  kBusy = 6,
};

/// "read request"; "operation 7" for a reserved number.
[[nodiscard]] std::string Name(FoeOperation operation);

struct FoeMessage {
  FoeOperation operation = FoeOperation::kData;
  std::uint32_t parameter = 0;  ///< read, write: password; data, acknowledge: packet number; error: error code
  std::uint16_t done = 0;       ///< busy: of `entire`
  std::uint16_t entire = 0;
  ByteSpan data;           ///< file name, file contents, or text
  bool too_short = false;  ///< what is missing reads as 0
};

[[nodiscard]] constexpr FoeMessage ParseFoe(ByteSpan payload) {
  FoeMessage message;
  message.operation = static_cast<FoeOperation>(LittleEndian<std::uint8_t>(payload, 0));
  message.too_short = payload.size() < kFoeHeaderBytes;
  message.data = Slice(payload, kFoeHeaderBytes);
  if (message.operation == FoeOperation::kBusy) {
    message.done = LittleEndian<std::uint16_t>(payload, 2);
    message.entire = LittleEndian<std::uint16_t>(payload, 4);
  } else {
    message.parameter = LittleEndian<std::uint32_t>(payload, 2);
  }
  return message;
}

/// Meaning of an FoE error code, "" when it has none. Codes without the leading 0x8000, as older devices send them, are
/// read alike.
[[nodiscard]] std::string_view FoeErrorText(std::uint32_t code);

/// Follows the file transfers of one slave.
///
/// In:   MailboxMessage (FoE) of both directions in wire order, repeated ones left out.
/// Out:  FoeTransfer when it completes, fails or is given up. File contents are counted, not kept.
/// Edges: the last packet is the one that does not fill the mailbox; where the mailbox length is not known, one
///   shorter than the packet before.
class FoeTracker {
 public:
  static constexpr std::size_t kMaxNameBytes = 256;

  explicit FoeTracker(SlaveId slave) : slave_(slave) {}

  /// Lengths of the mailboxes; 0 when unknown.
  void SetMailboxLengths(std::uint16_t out, std::uint16_t in) {
    out_length_ = out;
    in_length_ = in;
  }
  void OnMessage(const MailboxMessage& message, EventSink& sink);
  /// The slave answered with a mailbox error reply.
  void OnMailboxError(std::uint16_t detail, const FrameRef& frame, EventSink& sink);
  /// A mailbox read sent in this frame never returned: it may have taken an acknowledge or data with it.
  void OnReadLost(FrameNo sent) { answer_lost_ = answer_lost_ || (open_ && sent > transfer_.last.number); }
  /// It was overtaken, and may return still; and it did.
  void OnReadDoubtful(FrameNo sent) { doubtful_read_ = sent; }
  void OnReadBack(FrameNo sent) {
    if (sent == doubtful_read_) doubtful_read_ = 0;
  }
  /// Ends an open transfer.
  void End(TransferEnd why, EventSink& sink);

  [[nodiscard]] bool open() const { return open_; }

 private:
  void Begin(const MailboxMessage& message, const FoeMessage& foe, EventSink& sink);
  void OnData(const MailboxMessage& message, const FoeMessage& foe);
  void OnAcknowledge(const MailboxMessage& message, const FoeMessage& foe, EventSink& sink);
  [[nodiscard]] std::uint16_t LengthOf(Direction direction) const {
    return direction == Direction::kOut ? out_length_ : in_length_;
  }
  [[nodiscard]] bool FillsMailbox(const MailboxMessage& message, std::size_t data_bytes) const;
  void Close(FoeTransfer::Outcome outcome, EventSink& sink);

  SlaveId slave_;
  std::uint16_t out_length_ = 0;
  std::uint16_t in_length_ = 0;
  bool open_ = false;
  bool assumed_ = false;
  bool answered_ = false;
  bool answer_lost_ = false;  ///< since the last message
  FrameNo doubtful_read_ = 0;
  bool last_packet_ = false;   ///< the current packet is the last one
  bool may_be_last_ = false;   ///< ... or not: the size of the mailbox is not known, and it is the first one
  bool may_be_whole_ = false;  ///< ... and it was acknowledged
  std::uint32_t packet_ = 0;   ///< number of the latest data packet
  std::uint32_t longest_ = 0;  ///< bytes of the longest packet so far
  FoeTransfer transfer_;
  std::string name_;
  std::string error_text_;
};

}  // namespace ecaudit::mailbox
