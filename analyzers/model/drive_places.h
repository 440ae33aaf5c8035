/// in: parts of the process image.  out: where in them the objects of one axis' state machine lie.
///
/// keeps: the last few parts that came; nothing while none did.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "decoder/base/bytes.h"
#include "decoder/device/drive_profile.h"

namespace ecaudit::model {

struct ImagePart;

inline constexpr std::uint16_t kModesOfOperation = 0x6060;
inline constexpr std::uint16_t kModesDisplay = 0x6061;

/// Where the objects of the state machine lie in one kind of datagram.
struct DrivePart {
  std::uint64_t serial = 0;  ///< of the part; 0: unused
  bool known = false;        ///< at least one object is mapped
  std::uint8_t axes = 0;     ///< whose control or status word is, a bit each
  std::uint8_t controls = 0;
  std::array<std::uint32_t, 4> control{};                             ///< first bits of 16
  std::optional<std::uint32_t> status, mode, mode_shown, error_code;  ///< first bits of 16, 8, 8, 16
  std::uint16_t error_object = 0;  ///< which object error_code is, in the first axis' numbers
  std::size_t bytes = 0;           ///< of data that reach over all of them; kNone: some begins within a byte

  static constexpr std::size_t kNone = ~std::size_t{0};
  /// Each begins with a byte, and lies within the data: nearly always.
  [[nodiscard]] bool LieIn(ByteSpan data) const { return bytes <= data.size(); }
};

class DrivePlaces {
 public:
  explicit DrivePlaces(std::uint8_t axis) : axis_(axis) {}

  /// The family defines which objects hold the reason of a fault.
  void SetFamily(const device::DriveProfile* drive);
  /// SetFamily() gave a drive.
  const DrivePart& Of(const ImagePart& part);
  /// What Of() returned last for this direction, if it was of the part with this serial: nearly always.
  [[nodiscard]] const DrivePart* Last(std::uint64_t serial, bool inputs) const {
    const DrivePart* last = last_[inputs ? 1 : 0];
    return last != nullptr && last->serial == serial ? last : nullptr;
  }
  /// What the object is called in the first axis' numbers; 0: it is another axis'.
  [[nodiscard]] std::uint16_t InFirstAxis(std::uint16_t index) const;

 private:
  static constexpr std::size_t kParts = 4;

  /// The mapped object holds the present error code.
  /// @param object  index and subindex, as in ImagePart::Place
  [[nodiscard]] bool MapsErrorCode(std::uint32_t object, std::uint16_t bits) const;

  std::uint8_t axis_;
  const device::DriveProfile* drive_ = nullptr;
  std::vector<DrivePart> parts_;  // empty until it is needed: most slaves are no drives
  std::size_t next_ = 0;
  std::array<const DrivePart*, 2> last_{};  ///< outputs, inputs
};

}  // namespace ecaudit::model
