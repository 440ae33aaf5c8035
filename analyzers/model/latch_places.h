/// in: parts of the process image.  out: where in them the latch words and the positions lie.
///
/// keeps: the last few parts that came; nothing while none did.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "decoder/device/latch_description.h"

namespace ecaudit::model {

struct ImagePart;
struct ProcessCycle;

/// More edges than any family has.
inline constexpr std::size_t kMaxLatchEdges = 16;

/// What of an ImagePart matters to latches.
struct LatchPart {
  struct Where {
    std::uint32_t bit = 0;
    std::uint16_t bits = 0;  ///< 0: not here
  };
  std::uint64_t serial = 0;
  bool used = false;
  bool unknown_layout = false;
  bool incomplete = false;  ///< see ImagePart
  Where control, status, probe;
  std::array<Where, kMaxLatchEdges> positions{};
  bool any_position = false;
  bool stray_position = false;  ///< a latch position whose edge the manual does not state

  /// Once it came, it changes nothing until another part of the same direction came.
  [[nodiscard]] bool idle() const {
    return !unknown_layout && !incomplete && control.bits == 0 && status.bits == 0 && probe.bits == 0 &&
           !any_position && !stray_position;
  }
};

class LatchPlaces {
 public:
  /// @param edges of the family that are followed so far; positions of others are not looked for
  const LatchPart& Of(const ImagePart& part, const device::LatchDescription& latch, std::size_t edges);
  /// What Of() returned last for this direction, if it was of the part with this serial: nearly always.
  [[nodiscard]] const LatchPart* Last(std::uint64_t serial, bool inputs) const {
    const LatchPart* last = last_[inputs ? 1 : 0];
    return last != nullptr && last->serial == serial ? last : nullptr;
  }
  void Forget() {
    parts_.clear();
    next_ = 0;
    last_ = {};
  }

  static constexpr std::uint16_t kTouchProbeFunction = 0x60B8;

  /// The object holds the position of this edge.
  [[nodiscard]] static bool Holds(const device::LatchEdge& edge, std::uint16_t index, std::uint8_t subindex);
  /// A position object of which this family's manual does not state whose position it holds.
  [[nodiscard]] static bool IsStray(const device::LatchDescription& latch, std::uint16_t index);
  /// The position that the inputs hold beside a status word which acknowledges the selector of `edge`: in the object
  /// that the manual names for this edge, or in the only latch position among them where the manual names no edge for
  /// it.
  [[nodiscard]] static std::optional<std::int64_t> Supplied(const device::LatchDescription& latch,
                                                            const device::LatchEdge& edge, const ProcessCycle& cycle);

 private:
  static constexpr std::size_t kParts = 8;

  LatchPart& Learn(const ImagePart& from, const device::LatchDescription& latch, std::size_t edges);

  std::vector<LatchPart> parts_;  ///< kParts, once there is one
  std::size_t next_ = 0;
  std::array<const LatchPart*, 2> last_{};  ///< outputs, inputs
};

}  // namespace ecaudit::model
