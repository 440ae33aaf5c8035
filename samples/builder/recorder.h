/// What the capturing machine writes: packets in order of time, and the look of the file.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "decoder/base/ids.h"
#include "samples/builder/capture_writer.h"
#include "samples/builder/frame_builder.h"

namespace ecaudit::samples {

/// Stands for a packet until the file is finished and its frame number known.
using PacketId = std::size_t;

enum class FileFormat : std::uint8_t { kPcapNg, kPcapMicro, kPcapNano };

struct CaptureStyle {
  FileFormat format = FileFormat::kPcapNg;
  ByteOrder byte_order = ByteOrder::kLittle;
  bool outbound = true;  ///< which copies are written
  bool returned = true;
  std::uint8_t resolution = 9;          ///< pcapng: stamps in 10^-resolution seconds
  std::optional<TimeNs> coarse_step{};  ///< stamps rounded down to this; both copies of a frame carry the same one
  std::uint32_t snap_length = 0;
  std::size_t cut_file_by = 0;  ///< bytes missing at the end of the file
  std::size_t drops_every = 0;  ///< the recorder leaves out every so many-th packet; 0: none
  bool two_interfaces = false;  ///< a tap: outbound on interface 0, returned on interface 1
  std::string comment{};
};

class Recorder {
 public:
  CaptureStyle style{};
  Encapsulation around{};  ///< of frames encoded from now on
  TimeNs clock_ahead = 0;  ///< of packets recorded from now on: their stamps are so much later

  PacketId Frame(const EtherCatFrame& frame, TimeNs time, bool returned);
  /// The returned copy with the stamp of the outbound one, where the style asks for it.
  PacketId Raw(Bytes bytes, TimeNs time, bool returned = false);
  void CommentOn(PacketId packet, std::string text) { packets_.at(packet).comment = std::move(text); }
  /// Bytes of a packet recorded before, to damage them.
  [[nodiscard]] Bytes& bytes(PacketId packet) { return packets_.at(packet).bytes; }
  /// Stops and starts writing packets; those in between are not in the file.
  void Pause() { paused_ = true; }
  void Resume() { paused_ = false; }

  /// The file.
  [[nodiscard]] Bytes Encode() const;
  /// Frame number as Wireshark counts; 0 when that packet is not in the file.
  [[nodiscard]] FrameNo Number(PacketId packet) const;
  [[nodiscard]] std::size_t written() const { return Order().size(); }
  /// Packets recorded so far, written or not; their ids count from 0.
  [[nodiscard]] std::size_t recorded() const { return packets_.size(); }

  /// The next piece of the file, for captures that are longer than memory: what was recorded since the last call, which
  /// is then forgotten; the first piece begins with the file header. Not to be mixed with the functions above.
  [[nodiscard]] Bytes Flush();

 private:
  struct Recorded {
    Bytes bytes{};
    TimeNs time = 0;
    TimeNs clock_ahead = 0;
    bool returned = false;
    bool hidden = false;
    std::string comment{};
    std::uint16_t link_type = 1;
  };
  [[nodiscard]] std::vector<PacketId> Order() const;
  [[nodiscard]] WrittenCapture Written() const;

  std::vector<Recorded> packets_;
  bool paused_ = false;
  bool begun_ = false;
};

}  // namespace ecaudit::samples
