/// in: CapturedFrame.  out: a pcapng file with comments on packets, for slices and annotated copies of captures.
///
/// One section, little endian; interfaces in the order and with the numbers of CaptureInfo::interfaces; an enhanced
/// packet block for each packet. Bytes, lengths, direction, and time stamps in the resolution of the interface stay as
/// they were. What cannot stay: stamps finer than a nanosecond (cut to nanoseconds, as everywhere in the decoder), and
/// "no stamp" (simple packet blocks), which becomes 1970-01-01, because only enhanced packet blocks hold comments.
///
/// Source: draft-ietf-opsawg-pcapng.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "decoder/capture/frame_source.h"

namespace ecaudit::capture {

class PcapngWriter {
 public:
  /// Comments are cut to this many bytes, between UTF-8 characters; an option holds 65,535.
  static constexpr std::size_t kMaxCommentBytes = 60'000;

  /// @param out  the file's bytes are appended here; take them away as often as you like. Must outlive the writer
  explicit PcapngWriter(std::string& out) : out_(out) {}

  /// Begins the file: first of all, and once.
  /// @param application  what wrote it: "ecaudit 0.1.0"
  /// @param comment      about the whole file; empty: none
  void BeginSection(std::string_view application, std::string_view comment);
  /// The next interface; before its first packet.
  void AddInterface(const Interface& interface);
  /// @param frame     its interface_index must be one of the interfaces added; a packet of another one is left out
  /// @param comments  each becomes a comment of its own
  void AddPacket(const CapturedFrame& frame, std::span<const std::string> comments);
  /// What the capturing machine dropped, where it is recorded; after the last packet.
  void AddStatistics(const std::vector<Interface>& interfaces);

 private:
  /// How the stamps of an interface count.
  struct Clock {
    std::uint8_t tsresol = 9;  ///< as in the option if_tsresol
    [[nodiscard]] std::uint64_t Ticks(TimeNs time) const;
  };
  [[nodiscard]] static Clock ClockOf(std::int64_t resolution_ns);

  void U16(std::uint16_t value);
  void U32(std::uint32_t value);
  void U64(std::uint64_t value);
  void Stamp(std::uint64_t ticks);
  void Data(ByteSpan bytes);
  void Option(std::uint16_t code, std::string_view value);
  void EndOfOptions() { U32(0); }
  /// Header of a block whose length is filled in by End().
  void Begin(std::uint32_t type);
  void End();

  std::string& out_;
  std::size_t block_ = 0;  ///< where the open block begins in out_
  std::vector<Clock> clocks_;
  TimeNs last_time_ = 0;
};

}  // namespace ecaudit::capture
