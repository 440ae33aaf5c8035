/// A capture in memory, and the EtherCAT frames of it to be rewritten.
///
/// Which two packets are copies of one frame is worked out here from keys and order alone, not by the decoder's
/// pairing: a law about numbering must not rest on what it tests.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "decoder/capture/frame_source.h"
#include "tests/support/memory_source.h"

namespace ecaudit::test {

struct WireCapture {
  std::string name;
  capture::CaptureInfo info;
  std::vector<Packet> packets;
  bool cut = false;      ///< by the snap length, in part
  bool has_esl = false;  ///< a probe's record stands behind or before frames
  bool has_udp = false;
};

[[nodiscard]] std::optional<WireCapture> LoadCapture(const std::filesystem::path& path);

/// Where the EtherCAT part lies in a packet.
struct EtherCatPart {
  std::size_t header = 0;              ///< offset of the EtherCAT header
  std::vector<std::size_t> datagrams;  ///< offsets; the last one is where they end
  bool plain = false;                  ///< EtherType 0x88A4 right behind the MAC addresses
  bool cyclic = false;                 ///< holds process data
  bool has_time = false;               ///< carries the system time 0x0910
  [[nodiscard]] std::size_t count() const { return datagrams.size() - 1; }
  [[nodiscard]] std::size_t end() const { return datagrams.back(); }
};

/// Nothing where it is no EtherCAT frame that slaves can read.
[[nodiscard]] std::optional<EtherCatPart> FindEtherCat(const Packet& packet);

inline constexpr std::uint32_t kNoFrame = 0xFFFFFFFF;

/// Packets, and for each the frame that it is a copy of. Copies of one frame have the same number: outbound and
/// returned ones, and what a master repeats under the same index after a time-out.
struct NumberedPackets {
  std::vector<Packet> packets;
  std::vector<std::uint32_t> frames;  ///< kNoFrame: no EtherCAT frame
  bool all_known = true;              ///< false: some came back so damaged that only their index tells what they were
};

[[nodiscard]] NumberedPackets NumberFrames(const std::vector<Packet>& packets);

}  // namespace ecaudit::test
