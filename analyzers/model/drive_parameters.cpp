#include "analyzers/model/drive_parameters.h"

#include "analyzers/model/slave_model.h"
#include "decoder/base/text.h"

namespace ecaudit::model {

std::optional<ParameterValue> ValueOf(const SlaveModel& slave, const std::optional<device::DriveParameter>& parameter) {
  if (!parameter) return std::nullopt;
  if (parameter->object) {
    if (const ObjectValue* seen = slave.objects.Find(parameter->object->index, parameter->object->subindex)) {
      const bool inferred = parameter->object_inferred || seen->certainty == Certainty::kInferred;
      return ParameterValue{static_cast<std::int64_t>(seen->raw),
                            inferred ? Certainty::kInferred : Certainty::kObserved, seen->since};
    }
  }
  const auto given = slave.given.find(parameter->keyword);
  if (given == slave.given.end()) return std::nullopt;
  return ParameterValue{given->second, Certainty::kObserved, 0};
}

std::optional<TimeNs> InterpolationTime(const SlaveModel& slave) {
  constexpr std::uint16_t kInterpolationTime = 0x60C2;
  const ObjectValue* units = slave.objects.Find(kInterpolationTime, 1);
  const ObjectValue* index = slave.objects.Find(kInterpolationTime, 2);
  if (units == nullptr || index == nullptr || (!units->written && !index->written) || units->raw == 0) {
    return std::nullopt;
  }
  const std::int64_t power = index->as_signed();
  if (power < -9 || power > -1 || units->raw > 255) return std::nullopt;
  TimeNs unit = 1'000'000'000;
  for (std::int64_t i = power; i < 0; ++i) unit /= 10;
  return static_cast<TimeNs>(units->raw) * unit;
}

}  // namespace ecaudit::model
