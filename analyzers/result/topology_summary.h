/// Which slave is plugged into which, as far as the capture shows: plain data for the writers.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "decoder/base/ids.h"

namespace ecaudit {

/// What the error counters of one port were seen to gain between two reads.
struct PortErrors {
  std::uint64_t invalid_frames = 0;    ///< 0x0300, 0x0302, ...
  std::uint64_t receive_errors = 0;    ///< 0x0301, 0x0303, ...
  std::uint64_t forwarded_errors = 0;  ///< 0x0308 ...: made before the slave
  std::uint64_t lost_links = 0;        ///< 0x0310 ...

  [[nodiscard]] bool any() const { return invalid_frames + receive_errors + forwarded_errors + lost_links > 0; }
};

/// The link of a port came or went between two reads of DL status.
struct LinkChange {
  FrameRef before;  ///< last read that showed the other
  FrameRef frame;
  bool link = false;
};

struct PortSummary {
  std::optional<bool> link;           ///< physical link; as in the read that showed most ports open
  std::optional<bool> communication;  ///< frames pass; likewise
  PortErrors errors;
  FrameRef errors_before, errors_frame;  ///< the reads between which the counters rose first
  std::vector<LinkChange> changes;       ///< bounded
};

struct TopologyNode {
  SlaveId slave = kNoSlave;
  SlavePos position = 0;
  std::array<PortSummary, 4> ports;
  std::uint64_t dl_status_reads = 0;
  FrameNo dl_status_frame = 0;  ///< the read that showed most ports open
  std::uint64_t counter_reads = 0;
  std::uint64_t processing_errors = 0;  ///< gained by 0x030C

  /// What the frame comes from: another node (place in TopologySummary::nodes), or the master.
  enum class Above : std::uint8_t { kUnknown, kMaster, kSlave };
  Above above = Above::kUnknown;
  std::size_t parent = 0;                   ///< where `above` is kSlave
  std::optional<std::uint8_t> parent_port;  ///< unset: of the master, or not known
  /// Frames enter here and not at port 0: its cables are swapped. Slaves at its port 0 come before it in the order of
  /// positions.
  std::optional<std::uint8_t> entry_port;
  std::optional<std::int64_t> delay_ns;     ///< from the slave above, as the master wrote it (0x0928)
  std::optional<std::int64_t> measured_ns;  ///< from the slave above, by the receive times of the ports
};

struct TopologySummary {
  std::vector<TopologyNode> nodes;  ///< by position

  /// DL status of some slave was read.
  [[nodiscard]] bool known() const {
    for (const TopologyNode& node : nodes) {
      if (node.dl_status_frame != 0) return true;
    }
    return false;
  }
};

}  // namespace ecaudit
