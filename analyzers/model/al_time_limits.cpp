#include "analyzers/model/al_time_limits.h"

#include <cstdint>
#include <optional>
#include <string_view>

namespace ecaudit::model {

AlTimeLimits::AlTimeLimits(const AnalysisOptions& options) {
  const auto own = [&](std::string_view name, std::int64_t& value) {
    const auto found = options.limits.find(name);
    if (found != options.limits.end()) value = found->second;
    return found != options.limits.end();
  };
  own_preop_ = own("al-timeout.preop", usual_.to_preop_ns);
  own_op_ = own("al-timeout.safeop-op", usual_.to_safeop_or_op_ns);
  own_down_ = own("al-timeout.down", usual_.downwards_ns);
}

AlTimeouts AlTimeLimits::For(const device::StateTimeouts& esi, const device::StateTimeouts& eni) const {
  AlTimeouts timeouts = usual_;
  const auto take = [](bool own, const std::optional<TimeNs>& stated, std::int64_t& limit) {
    if (!own && stated.value_or(0) > 0) limit = *stated;
  };
  for (const device::StateTimeouts* stated : {&esi, &eni}) {
    take(own_preop_, stated->preop, timeouts.to_preop_ns);
    take(own_op_, stated->safeop_op, timeouts.to_safeop_or_op_ns);
    take(own_down_, stated->back_to_init, timeouts.downwards_ns);
  }
  return timeouts;
}

}  // namespace ecaudit::model
