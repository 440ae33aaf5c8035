/// in: accesses to DL status and the receive times of one slave.  out: the port at which frames enter it.
///
/// A frame that the master sends has to enter at port 0: it is processed there, and goes on at ports 3, 1 and 2. With
/// the cable in another socket, the slave processes the frame only when it returns from the slaves at port 0.
/// Source: ESC-1, frame processing order; ESC-2, DL status (0x0110), receive times (0x0900).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "decoder/base/ids.h"
#include "decoder/track/access.h"

namespace ecaudit::model {

/// Frames pass at this port: communication is established, and the loop is open.
[[nodiscard]] constexpr bool FramesPass(std::uint16_t dl_status, std::size_t port) {
  const unsigned bits = dl_status >> (8 + 2 * port);
  return (bits & 2U) != 0 && (bits & 1U) == 0;
}

class EntryPort {
 public:
  static constexpr std::size_t kPorts = 4;
  /// Cables and slaves take microseconds. What is longer is an old stamp of a port at which the frame did not come.
  static constexpr std::int64_t kLongestWayNs = 1'000'000;

  /// Evidence that frames enter at another port than 0.
  struct Evidence {
    std::uint8_t port = 0;
    FrameRef status;                       ///< read of DL status
    FrameRef times;                        ///< read of the receive times; not seen: port 0 has no link
    std::optional<std::int64_t> ahead_ns;  ///< how much earlier than at port 0 the frame came
  };

  void On(const track::SlaveAccess& access);
  /// After a capture gap the bus may be wired in another way.
  void Forget() { *this = {}; }

  /// DL status with most ports open: masters close ports while they scan. Unset: both bytes were not read yet.
  [[nodiscard]] const std::optional<std::uint16_t>& status() const { return status_; }
  [[nodiscard]] const FrameRef& status_frame() const { return status_frame_; }
  [[nodiscard]] unsigned open_ports() const { return open_; }
  /// Receive times of port 0 and another port were read that are of one frame, and both ports are open.
  [[nodiscard]] bool compared() const;
  /// @return evidence that frames enter at another port than 0; nothing: there is none, or the reads do not show the
  /// port
  [[nodiscard]] std::optional<Evidence> evidence() const;

 private:
  struct Time {
    std::uint32_t ns = 0;
    std::uint64_t latch = 0;
    FrameRef frame;
  };
  void OnRead(const track::SlaveAccess& access);
  /// @return ns from the frame at port 0 to the same frame at `port`, negative if `port` was first; nothing: the stamps
  ///         are not of one frame, or no frame passes at one of the ports
  [[nodiscard]] std::optional<std::int64_t> After(std::size_t port) const;

  std::optional<std::uint16_t> status_;
  FrameRef status_frame_;
  unsigned open_ = 0;
  std::uint64_t latches_ = 0;
  std::array<std::optional<Time>, kPorts> times_;
};

}  // namespace ecaudit::model
