/// in: process data of stepper and DC motor terminals.  out: what keeps the motor of a channel from moving.
///
/// Modular devices (ETG.5001) have the motor of channel n in 7000h + 10h x n and 6000h + 10h x n, as single bits:
/// Enable and Reset, Ready to enable, Ready, Error, Moving. That a channel is a motor is known by the names of the
/// entries (SDO information, ESI), by the profile number in 1000h (703 stepper, 733 DC motor), or by its velocity at
/// subindex 21h. Source: ETG.5001, module profile numbers.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "analyzers/model/process_image.h"
#include "analyzers/progress/lasting.h"

namespace ecaudit::progress {

enum class MotorRole : std::uint8_t {
  kEnable,
  kReset,
  kPosition,
  kVelocity,
  kReadyToEnable,
  kReady,
  kWarning,
  kError,
  kMovingPositive,
  kMovingNegative,
};
inline constexpr std::size_t kMotorRoles = 10;

enum class MotorFact : std::uint8_t {
  kEnableMissing,     ///< a set point, and Enable stays 0
  kNotReadyToEnable,  ///< Enable is 1, Ready to enable 0
  kNotReady,          ///< Enable and Ready to enable are 1, Ready stays 0
  kError,             ///< Error is 1
  kStandsStill,       ///< Ready is 1, a velocity is set, and Moving stays 0
};

struct MotorRecord {
  MotorFact fact = MotorFact::kError;
  std::uint8_t channel = 0;
  FrameRef since, frame, last;
  TimeNs lasted = 0;
  std::uint64_t count = 1;
  std::int64_t set_point = 0;
  bool velocity = false;      ///< what the set point is
  bool reset_stands = false;  ///< kError: Reset was 1 all the time
  bool began = false;         ///< kError: it was 0 up to `since`
  bool by_shape = false;      ///< that the channel is a motor is known by its entries only
};

/// Where the entries of motors lie in one part of the process image; empty for nearly all parts.
class MotorPlaces {
 public:
  struct Place {
    std::uint8_t channel = 0;
    MotorRole role = MotorRole::kEnable;
    std::uint16_t bits = 0;
    std::uint32_t bit = 0;
    bool by_shape = false;
  };
  explicit MotorPlaces(const model::ImagePart& part);
  [[nodiscard]] bool empty() const { return places_.empty(); }
  [[nodiscard]] const std::vector<Place>& places() const { return places_; }

 private:
  std::vector<Place> places_;  ///< by channel
};

/// The motor of one channel.
class MotorWatch {
 public:
  explicit MotorWatch(std::uint8_t channel) : channel_(channel) {}

  [[nodiscard]] std::uint8_t channel() const { return channel_; }
  void Take(MotorRole role, std::int64_t value, bool by_shape) {
    values_[static_cast<std::size_t>(role)] = value;
    by_shape_ = by_shape;
  }
  /// All values of one direction of a frame are taken.
  void Step(const FrameRef& frame);
  void Forget();
  [[nodiscard]] const std::vector<MotorRecord>& records() const { return records_; }

  // Of the ladder.
  [[nodiscard]] const FrameRef& ready_since() const { return ready_since_; }  ///< of the last time
  [[nodiscard]] const FrameRef& ready_lost() const { return ready_lost_; }    ///< seen(): it is not ready any more
  [[nodiscard]] const FrameRef& commanded() const { return commanded_; }      ///< first set point of a ready motor
  [[nodiscard]] const FrameRef& moved() const { return moved_; }              ///< last frame that shows a motion
  [[nodiscard]] const FrameRef& first_moved() const { return first_moved_; }
  [[nodiscard]] const FrameRef& without_error() const { return without_error_; }  ///< seen(): Error is 0 since then

 private:
  [[nodiscard]] const std::optional<std::int64_t>& Value(MotorRole role) const {
    return values_[static_cast<std::size_t>(role)];
  }
  [[nodiscard]] bool Is(MotorRole role, bool set) const { return Value(role) && (*Value(role) != 0) == set; }
  void Report(MotorFact fact, bool holds, TimeNs limit, const FrameRef& frame);

  std::uint8_t channel_;
  bool by_shape_ = false;
  std::array<std::optional<std::int64_t>, kMotorRoles> values_;
  std::optional<std::int64_t> last_position_;
  std::uint32_t position_changes_ = 0;
  bool was_enabled_ = false;
  bool reset_low_ = false;   ///< Reset was 0 while the error at hand stood
  bool error_low_ = false;   ///< Error was 0 in the frame before
  FrameNo error_began_ = 0;  ///< Error rose here
  FrameRef ready_since_, ready_lost_, commanded_, first_moved_, moved_, without_error_;
  std::array<Lasting, 5> lasting_;
  std::vector<MotorRecord> records_;
};

}  // namespace ecaudit::progress
