/// in: datagrams with logical addresses.  out: the period of the process data, by the capture's clock.
#pragma once

#include <array>
#include <cstdint>

#include "analyzers/core/analysis_result.h"
#include "decoder/track/events.h"

namespace ecaudit {

/// Measures the intervals between frames that carry the same process data. The process image that is exchanged most
/// often counts as the cycle of the bus. Constant memory; pauses of the master are part of the figures.
class CycleStatistics {
 public:
  void On(const track::LogicalAccess& access);
  /// cycles is 0 when no process data, or none with time stamps, were exchanged at least twice.
  [[nodiscard]] CycleSummary Summary() const;

 private:
  /// Intervals of one logical address.
  struct Image {
    bool used = false;
    std::uint32_t address = 0;
    wire::Command command = wire::Command::NOP;
    FrameRef last;
    std::uint64_t intervals = 0;
    double mean_ns = 0, sum_of_squares = 0, min_ns = 0, max_ns = 0;
  };
  static constexpr std::size_t kImages = 32;  ///< later ones are not measured

  std::array<Image, kImages> images_;
};

}  // namespace ecaudit
