/// What the report shows of the latches of one drive: plain data.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "decoder/base/ids.h"

namespace ecaudit {

/// One capture of one edge; see model::LatchCapture for the frames.
struct LatchCaptureSummary {
  std::string edge;
  FrameRef armed, valid, selected, acknowledged, read, disarmed, rearmed;
  std::string read_by;                   ///< "mapped object", "selector", "SDO"; empty: not read
  std::optional<std::int64_t> position;  ///< where the object that holds it is documented, in drive units
};

struct LatchEdgeSummary {
  std::string name;
  std::uint64_t armed = 0;
  std::uint64_t valid = 0;
  std::uint64_t read = 0;
  std::uint64_t lost = 0;
};

/// A digital input as bits 12 to 15 of the status word show it.
struct LatchInputSummary {
  std::uint8_t number = 0;  ///< from 1
  bool state = false;       ///< in the last status word
  std::uint64_t changes = 0;
};

struct LatchSummary {
  std::optional<std::uint16_t> control;  ///< last control word
  std::optional<std::uint16_t> status;   ///< last status word
  bool control_by_sdo = false;
  bool status_by_sdo = false;
  std::vector<LatchInputSummary> inputs;
  std::vector<LatchEdgeSummary> edges;  ///< all that the family has
  std::vector<LatchCaptureSummary> captures;
  std::uint64_t captures_left_out = 0;
  std::uint64_t misuses = 0;
};

}  // namespace ecaudit
