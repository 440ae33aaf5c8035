/// in: the objects that were read or written, and what the user knows of the drive.  out: the value of a parameter.
#pragma once

#include <cstdint>
#include <optional>

#include "decoder/base/ids.h"
#include "decoder/base/known.h"
#include "decoder/device/sync_description.h"

namespace ecaudit::model {

struct SlaveModel;

struct ParameterValue {
  std::int64_t value = 0;
  /// Inferred where only a sister family's manual states that the object holds the parameter.
  Certainty certainty = Certainty::kObserved;
  FrameNo since = 0;  ///< frame that showed it; 0: given by the user
};

/// What is known of a parameter: by SDO, else as given with --parameter. Unset where neither states it, or where the
/// family has no such parameter.
[[nodiscard]] std::optional<ParameterValue> ValueOf(const SlaveModel& slave,
                                                    const std::optional<device::DriveParameter>& parameter);

/// The cycle that object 60C2h states, ns: units times ten to the power of the index seconds. Nothing unless the master
/// wrote at least one part, and wrote or read the other one; 60C2h:1 is 1 to 255, and the exponent in 60C2h:2 is -9 to
/// -1.
[[nodiscard]] std::optional<TimeNs> InterpolationTime(const SlaveModel& slave);

}  // namespace ecaudit::model
