/// Slaves in a line behind one port of the master, and what can go wrong on the cable.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "decoder/base/ids.h"
#include "samples/builder/frame_builder.h"
#include "samples/builder/simulated_slave.h"

namespace ecaudit::samples {

inline constexpr TimeNs kByteTime = 80;  // 100 Mbit/s

/// Small irregularities of a computer, the same in every run: a linear congruential generator.
class Jitter {
 public:
  explicit Jitter(std::uint32_t seed) : state_(seed) {}
  /// 0 to `limit` - 1 nanoseconds.
  TimeNs Next(TimeNs limit) {
    state_ = state_ * 1'664'525U + 1'013'904'223U;
    return static_cast<TimeNs>(state_ >> 8U) % limit;
  }

 private:
  std::uint32_t state_;
};

class SimulatedBus {
 public:
  explicit SimulatedBus(TimeNs power_on) : power_on_(power_on) {}

  /// Adds a slave at the end of the line; the reference stays valid.
  SimulatedSlave& Add(SlaveDescription description);
  [[nodiscard]] SimulatedSlave& slave(std::size_t position) { return *slaves_.at(position); }
  [[nodiscard]] std::size_t size() const { return slaves_.size(); }

  /// Only the first `count` slaves can be reached from now on; the port behind them loses its link.
  void BreakBehind(std::size_t count);
  void Heal();
  /// A slave on a branch of its own can be reached no more, those behind it still can.
  void Unplug(std::size_t position) { unplugged_ = position; }
  /// A slave joins the line there, switched on at `power_on`; those behind it move.
  SimulatedSlave& Insert(std::size_t position, SlaveDescription description, TimeNs power_on);
  /// The slave there leaves the line; those behind it close up.
  void Remove(std::size_t position);

  struct Result {
    EtherCatFrame frame;
    TimeNs at = 0;  ///< when the master has it
  };
  /// Lets a frame pass all reachable slaves and come back.
  Result Pass(EtherCatFrame frame, TimeNs sent);
  /// Lets the slaves work up to `now` without a frame.
  void Advance(TimeNs now);

 private:
  void UpdateLinks();

  TimeNs power_on_;
  std::vector<std::unique_ptr<SimulatedSlave>> slaves_;
  std::size_t reachable_ = 0;
  std::optional<std::size_t> unplugged_;
  Jitter jitter_{0x5EED};
};

}  // namespace ecaudit::samples
