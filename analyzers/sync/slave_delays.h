/// in: accesses to delay registers (0x0928).  out: the delay of each slave.
///
/// keeps: the registers' values, for they are asked for of all slaves in every cycle.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "analyzers/model/bus_model.h"
#include "decoder/esc/register_addresses.h"

namespace ecaudit::sync {

class SlaveDelays {
 public:
  /// @param bus must outlive this
  explicit SlaveDelays(const model::BusModel& bus) : bus_(bus) {}

  /// A delay register may have changed.
  void Touched() { ++version_; }
  /// What follows is asked at one moment: slaves may be others than before, or have come back after a power cycle.
  void Look() {
    const std::uint64_t mappings = bus_.network().mapping_version();
    if (std::exchange(mappings_, mappings) != mappings) ++version_;
  }
  /// ns; 0 where it is not known.
  [[nodiscard]] std::int64_t Of(SlaveId id) {
    if (id < delays_.size() && delays_[id].version == version_) return delays_[id].ns;
    return id == kNoSlave ? 0 : Read(id);
  }

 private:
  struct Delay {
    std::uint32_t ns = 0;
    std::uint64_t version = 0;  // that it was read at
  };

  [[gnu::noinline]] std::int64_t Read(SlaveId id) {
    if (id >= delays_.size()) delays_.resize(std::size_t{id} + 1);
    delays_[id] = {bus_.network().state(id).registers.Value<std::uint32_t>(esc::kSystemTimeDelay).value_or(0),
                   version_};
    return delays_[id].ns;
  }

  const model::BusModel& bus_;
  std::vector<Delay> delays_;
  std::uint64_t version_ = 1;
  std::uint64_t mappings_ = 0;  // the network's version of them at the last look
};

}  // namespace ecaudit::sync
