/// Captures of masters that there are and of many that there are not: their ways, freely combined.
#pragma once

#include <string>
#include <vector>

#include "samples/builder/master_way.h"
#include "samples/builder/scenarios/scenario.h"
#include "tests/property/wire_packets.h"

namespace ecaudit::test {

struct ZooMaster {
  std::string name;  ///< says all of its way
  samples::MasterWay way;
};

/// The named ones, and `mixed` whose habits come from any of them, the same every time.
[[nodiscard]] std::vector<ZooMaster> ZooMasters(int mixed);

/// What `story` has recorded.
[[nodiscard]] WireCapture CaptureOf(const samples::Story& story, std::string name);

}  // namespace ecaudit::test
