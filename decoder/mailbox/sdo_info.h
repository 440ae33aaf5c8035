/// SDO information service: what a drive reports about its own object dictionary.
///
///   | opcode:7 incomplete:1 | reserved 1 | fragments left 2 | request, answer or abort code |
///
/// Source: ETG.1000.6 5.6.3; esc-reference 8.4.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "decoder/base/bytes.h"
#include "decoder/base/event_sink.h"
#include "decoder/mailbox/events.h"
#include "decoder/mailbox/message_bytes.h"

namespace ecaudit::mailbox {

inline constexpr std::size_t kSdoInfoHeaderBytes = 4;

enum class SdoInfoOpcode : std::uint8_t {
  kListRequest = 1,
  kListResponse = 2,
  kObjectRequest = 3,
  kObjectResponse = 4,
  kEntryRequest = 5,
  kEntryResponse = 6,
  kError = 7,
};

/// "object list request"; "opcode 8" for a reserved number.
[[nodiscard]] std::string Name(SdoInfoOpcode opcode);
/// "all objects"; "list 6" for a reserved number.
[[nodiscard]] std::string ListTypeName(std::uint16_t list_type);
/// Access word of an entry description: "ro", "wo", "rw" with the states in brackets where they differ, and "rxpdo",
/// "txpdo", "backup", "settings": "rw (write PREOP) txpdo".
[[nodiscard]] std::string AccessText(std::uint16_t access);

struct SdoInfoHeader {
  SdoInfoOpcode opcode = SdoInfoOpcode::kError;
  bool incomplete = false;
  std::uint16_t fragments_left = 0;
  ByteSpan data;
  bool too_short = false;  ///< what is missing reads as 0
};

/// @param service  bytes after the CoE header
[[nodiscard]] constexpr SdoInfoHeader ParseSdoInfo(ByteSpan service) {
  const auto first = LittleEndian<std::uint8_t>(service, 0);
  return {static_cast<SdoInfoOpcode>(first & 0x7FU), (first & 0x80U) != 0, LittleEndian<std::uint16_t>(service, 2),
          Slice(service, kSdoInfoHeaderBytes), service.size() < kSdoInfoHeaderBytes};
}

/// Puts the answers of one slave together.
///
/// In:   MailboxMessage (CoE, SDO information) of both directions in wire order, repeated ones left out.
/// Out:  SdoInfo for each request, when answered or given up; also for answers whose request was not captured.
/// Keeps: one answer of at most kMaxBytes.
class SdoInfoTracker {
 public:
  static constexpr std::size_t kMaxBytes = 0x20002;  ///< list type and all 65,536 indices

  /// @param bytes what all slaves share for messages in the making; null: no common limit
  explicit SdoInfoTracker(SlaveId slave, Allowance* bytes = nullptr) : slave_(slave), data_(kMaxBytes, bytes) {}

  void OnMessage(const MailboxMessage& message, EventSink& sink);
  void OnMailboxError(std::uint16_t detail, const FrameRef& frame, EventSink& sink);
  void End(TransferEnd why, EventSink& sink);

  [[nodiscard]] bool open() const { return open_; }

 private:
  void OnRequest(const MailboxMessage& message, const SdoInfoHeader& header, EventSink& sink);
  void OnResponse(const MailboxMessage& message, const SdoInfoHeader& header, EventSink& sink);
  void DecodeList();
  void DecodeObject();
  void DecodeEntry();
  void Close(SdoInfo::Outcome outcome, EventSink& sink);

  SlaveId slave_;
  bool open_ = false;
  bool assumed_ = false;
  std::uint16_t fragments_left_ = 0;
  SdoInfo info_;
  MessageBytes data_;
  std::vector<std::uint16_t> indices_;
};

}  // namespace ecaudit::mailbox
