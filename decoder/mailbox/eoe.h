/// Ethernet over EtherCAT: fragments put together to Ethernet frames, and the settings of the slave's IP interface.
///
///   | type:4 port:4 | last:1 time appended:1 time requested:1 reserved:5 | fragment:6 offset:6 frame:4 | data |
///
/// Offsets count 32 bytes; in fragment 0 the field is the size of the whole frame, rounded up. All fragments but the
/// last have a multiple of 32 bytes. A time stamp of four bytes may follow the last fragment.
/// Source: ETG.1000.6 5.7; esc-reference 8.6.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "decoder/base/bytes.h"
#include "decoder/base/event_sink.h"
#include "decoder/mailbox/events.h"
#include "decoder/mailbox/message_bytes.h"

namespace ecaudit::mailbox {

inline constexpr std::size_t kEoeHeaderBytes = 4;

struct EoeHeader {
  EoeType type = EoeType::kFragment;
  std::uint8_t port = 0;  ///< 0: not specified
  bool last_fragment = false;
  bool time_appended = false;
  bool time_requested = false;
  std::uint8_t fragment = 0;  ///< 0-63
  std::uint8_t blocks = 0;    ///< offset / 32; fragment 0: size of the whole frame / 32, rounded up
  std::uint8_t frame = 0;     ///< 0-15, counts frames
  std::uint16_t result = 0;   ///< responses: the last two bytes as one number
  ByteSpan data;
  bool too_short = false;  ///< what is missing reads as 0
};

[[nodiscard]] constexpr EoeHeader ParseEoe(ByteSpan payload) {
  const auto byte0 = LittleEndian<std::uint8_t>(payload, 0);
  const auto byte1 = LittleEndian<std::uint8_t>(payload, 1);
  const auto word = LittleEndian<std::uint16_t>(payload, 2);
  EoeHeader header;
  header.type = static_cast<EoeType>(byte0 & 0x0FU);
  header.port = static_cast<std::uint8_t>(byte0 >> 4U);
  header.last_fragment = (byte1 & 0x01U) != 0;
  header.time_appended = (byte1 & 0x02U) != 0;
  header.time_requested = (byte1 & 0x04U) != 0;
  header.fragment = static_cast<std::uint8_t>(word & 0x3FU);
  header.blocks = static_cast<std::uint8_t>(word >> 6U & 0x3FU);
  header.frame = static_cast<std::uint8_t>(word >> 12U);
  header.result = word;
  header.data = Slice(payload, kEoeHeaderBytes);
  header.too_short = payload.size() < kEoeHeaderBytes;
  return header;
}

/// "no IP support" for 0x0201; "" for a result without a meaning.
[[nodiscard]] std::string_view EoeResultText(std::uint16_t result);

/// Reads the settings of a set IP request or get IP response. Fields stand at fixed places whether valid or not.
/// @param data  after the EoE header
[[nodiscard]] EoeIpParameters ParseIpParameters(ByteSpan data);

/// Names what is inside an Ethernet frame, up to the ports of TCP and UDP. What is cut or unknown stays absent.
[[nodiscard]] EthernetSummary SummariseEthernet(ByteSpan frame);

/// "IPv4", "ARP", ...; "0x88a4" style for types without a name here.
[[nodiscard]] std::string EtherTypeName(std::uint16_t ether_type);
/// "192.168.0.139" of an address with its first number in the most significant byte.
[[nodiscard]] std::string IpText(std::uint32_t address);

/// Puts the fragments of one direction together.
///
/// In:   MailboxMessage (EoE) of one direction in wire order.   Out: EoeFrame when whole or given up; EoeControl.
/// Keeps: one frame of at most kMaxFrameBytes; more is counted.
class EoeReassembler {
 public:
  static constexpr std::size_t kMaxFrameBytes = 4096;

  /// @param bytes what all slaves share for messages in the making; null: no common limit
  explicit EoeReassembler(Allowance* bytes = nullptr) : data_(kMaxFrameBytes, bytes) {}

  void OnMessage(const MailboxMessage& message, const FrameRef& request, EventSink& sink);
  /// Gives up an unfinished frame.
  void End(EventSink& sink);

 private:
  void OnFragment(const MailboxMessage& message, const EoeHeader& header, EventSink& sink);
  void Begin(const MailboxMessage& message, const EoeHeader& header);
  void GiveUp(EoeFrame::Problem problem, const EoeHeader& header, EventSink& sink);
  void Emit(EoeFrame::Problem problem, EventSink& sink);

  bool open_ = false;
  bool skipping_ = false;  ///< the rest of a frame that was given up
  std::uint8_t next_fragment_ = 0;
  std::uint8_t announced_blocks_ = 0;
  EoeFrame frame_;
  MessageBytes data_;
};

}  // namespace ecaudit::mailbox
