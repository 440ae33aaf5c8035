/// in: working counters of datagrams whose expectation is not known.  out: drops below what the counter was before.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "analyzers/model/logical_expectation.h"
#include "decoder/track/events.h"

namespace ecaudit::wkc {

/// The same for all datagrams with the same command, address and length.
[[nodiscard]] std::uint64_t KeyOf(const track::LogicalAccess& access);
/// ... and the same working counter.
[[nodiscard]] constexpr std::uint64_t KeyOf(std::uint64_t datagram, std::uint16_t wkc) {
  return datagram ^ static_cast<std::uint64_t>(wkc) << 48U;
}

/// A value below the one before.
struct Drop {
  std::uint64_t key = 0;
  std::uint16_t before = 0, wkc = 0;
  std::uint32_t times = 0;  ///< frames that showed `before`
  std::uint64_t count = 0;  ///< frames that show `wkc`
  FrameNo since = 0;        ///< the first that showed `before`
  FrameRef first, last;     ///< that show `wkc`
};

class CounterHabits {
 public:
  /// Exactly the slaves with known FMMUs counted. So other FMMUs map nothing here, until the next request or set-up.
  [[nodiscard]] bool WasRight(const track::LogicalAccess& access, std::uint64_t mapping_version) const;
  /// They have counted for a while, so the counter is that of the slaves.
  [[nodiscard]] bool HeldAtLeast(const track::LogicalAccess& access, std::uint16_t least) const;

  /// The FMMUs are not all known: what the counter was is the expectation.
  /// @param range  what the known ones count
  [[nodiscard]] std::optional<Drop> Follow(const track::LogicalAccess& access, const model::CounterRange& range,
                                           std::uint64_t mapping_version);
  /// The AL states of some slaves are not known, so they may count. All of them did for long, and no request came
  /// since.
  [[nodiscard]] std::optional<Drop> FollowAll(const track::LogicalAccess& access,
                                              const model::LogicalExpectation& expected, std::uint16_t most);
  /// A change of states or of the mapping ends the habit.
  void Forget() { *this = {}; }

 private:
  /// Working counters of one kind of datagram.
  struct Habit {
    std::uint64_t key = 0;
    std::uint16_t wkc = 0;
    std::uint32_t times = 0;
    FrameNo since = 0;
    std::optional<std::uint64_t> right_for;  ///< version of the mappings with which the known ones explained it
  };
  [[nodiscard]] const Habit* HabitOf(const track::LogicalAccess& access) const;
  void FollowEarly(const track::LogicalAccess& access, Habit& habit);
  [[nodiscard]] std::optional<Drop> SettleEarly(const track::LogicalAccess& access, Habit& habit);

  std::array<Habit, 32> habits_{};
  std::array<Drop, 32> early_{};  ///< not settled yet
};

}  // namespace ecaudit::wkc
