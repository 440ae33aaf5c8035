/// in: nothing.  out: CapturedFrame, one packet of a capture at a time.
///
/// FrameSource is the outside world of the decoder: a file (capture_reader.h), several files, or a test's frames.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "decoder/base/bytes.h"
#include "decoder/base/ids.h"

namespace ecaudit::capture {

/// Link types that are decoded; numbers as in libpcap's DLT_/LINKTYPE_ list.
enum class LinkType : std::uint16_t {
  kEthernet = 1,
  kLinuxCooked = 113,
  kNetAnalyzer = 240,             ///< Hilscher netANALYZER: four bytes before each frame
  kNetAnalyzerTransparent = 241,  ///< ... and the preamble
  kLinuxCooked2 = 276,
};

/// Direction that the capture file itself records (pcapng epb_flags, Linux cooked packet type); relative to the
/// capturing machine, so it is evidence for outbound/returned and no proof.
enum class PacketFlag : std::uint8_t { kNone, kInbound, kOutbound };

/// One packet. `bytes` stays valid until the next call of FrameSource::Next().
struct CapturedFrame {
  FrameNo number = 0;                 ///< as Wireshark counts
  TimeNs time = 0;                    ///< ns since 1970 UTC; 0 unless has_time
  bool has_time = false;              ///< false where the file has no stamp for it (simple packet blocks)
  std::uint16_t link_type = 1;        ///< a LinkType, or any other number, which is then not decoded
  std::uint16_t interface_index = 0;  ///< pcapng interface, counted over all sections; 0 for pcap
  PacketFlag flag = PacketFlag::kNone;
  bool damaged = false;        ///< the capture marks it: its frame check sequence, or its form on the wire, is wrong
  std::uint8_t fcs_bytes = 0;  ///< at the end on the wire: the frame check sequence, no part of the frame's contents
  std::uint32_t original_length = 0;  ///< on the wire; more than bytes.size() when cut by the snap length
  ByteSpan bytes;

  [[nodiscard]] FrameRef ref() const { return {number, time, has_time}; }
  /// The same packet without its frame check sequence; as much of that as was captured is left out.
  [[nodiscard]] CapturedFrame WithoutFcs() const {
    CapturedFrame frame = *this;
    frame.original_length -= std::min<std::uint32_t>(original_length, fcs_bytes);
    if (bytes.size() > frame.original_length) frame.bytes = bytes.first(frame.original_length);
    frame.fcs_bytes = 0;
    return frame;
  }
};

struct Interface {
  std::string name;  ///< empty when the file gives none
  std::uint16_t link_type = 1;
  std::uint32_t snap_length = 0;      ///< 0: unlimited
  std::int64_t resolution_ns = 1000;  ///< step of its time stamps; 1 where finer than a nanosecond
  std::uint32_t section = 0;          ///< of a pcapng file that describes it, from 0: another recording after the first
  std::optional<std::uint64_t> dropped;  ///< by the capturing machine (interface statistics), if recorded
};

/// Where and why reading had to stop.
struct Damage {
  std::string message;       ///< "file ends inside packet 812", without a full stop
  std::uint64_t offset = 0;  ///< byte offset in the (decompressed) file, where known
  FrameNo after_frame = 0;   ///< last packet that was read
};

struct Comment {
  FrameNo frame = 0;  ///< 0: of the whole file
  std::string text;
};

/// The clock of an interface was found to be apart from that of another one, and its stamps were moved.
struct ClockShift {
  std::uint16_t interface = 0;  ///< whose stamps were moved
  std::uint16_t reference = 0;  ///< the interface that it was compared with
  std::int64_t ahead_ns = 0;    ///< how much later its clock was at the beginning; negative: earlier
  std::size_t pairs = 0;        ///< frames that show it
  bool renumbered = false;      ///< packets were put into the order of the wire, and numbered in it
};

/// What is known of the file; grows while it is read, final after the last frame.
struct CaptureInfo {
  std::string path;
  std::string format;  ///< "pcap", "pcapng", with "+gzip" or "+zstd" after it when compressed
  std::vector<Interface> interfaces;
  std::optional<Damage> damage;
  std::vector<Comment> comments;  ///< at most 1,000, later ones are left out
  std::uint64_t packets = 0;
  std::uint64_t name_bytes_left_out = 0;  ///< of interface names beyond kNameBytes
  std::optional<ClockShift> clock_shift;
  std::uint64_t unread_blocks = 0;  ///< of types that are not known, with what looks like an EtherCAT frame in them

  /// What the names of all interfaces may take; an interface whose name has no room goes without.
  static constexpr std::size_t kNameBytes = std::size_t{2} << 20U;
  /// A count of dropped packets above it is no count.
  static constexpr std::uint64_t kMostDropped = std::uint64_t{1} << 40U;

  /// Packets that the capturing machine dropped, by its own count.
  [[nodiscard]] std::uint64_t dropped() const {
    std::uint64_t sum = 0;
    for (const Interface& interface : interfaces) sum += std::min(interface.dropped.value_or(0), kMostDropped);
    return sum;
  }
};

enum class ReadStatus : std::uint8_t {
  kFrame,    ///< `frame` is filled
  kEnd,      ///< no more packets
  kDamaged,  ///< the file is damaged here: info().damage names the place; no more packets will come
};

class FrameSource {
 public:
  FrameSource() = default;
  FrameSource(const FrameSource&) = delete;
  FrameSource& operator=(const FrameSource&) = delete;
  virtual ~FrameSource() = default;

  /// Reads the next packet into `frame`, whose bytes stay valid until the next call.
  [[nodiscard]] virtual ReadStatus Next(CapturedFrame& frame) noexcept = 0;
  [[nodiscard]] virtual const CaptureInfo& info() const noexcept = 0;
  /// Bytes of the file consumed so far and its size, for progress; 0 when unknown.
  [[nodiscard]] virtual std::uint64_t bytes_read() const noexcept { return 0; }
  [[nodiscard]] virtual std::uint64_t bytes_total() const noexcept { return 0; }
};

}  // namespace ecaudit::capture
