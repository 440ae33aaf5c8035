/// in: one part of the process image of a slave.  out: which of its objects are those of a CiA 402 axis at other
/// indices.
///
/// Modular devices (ETG.5001) have the objects of channel n at 7000h + 10h x n (outputs) and 6000h + 10h x n (inputs).
/// A servo terminal (module profile 742) has the control word, status word and set points of CiA 402 there, at
/// subindices of one object. A channel counts as one by the types of its entries, if neither their names (SDO
/// information, ESI) nor the profile number in 1000h contradict.
/// Source: ETG.5001, module profile numbers; CIA402, object dictionary.
#pragma once

#include <cstdint>
#include <vector>

namespace ecaudit::model {

struct ImagePart;
struct SlaveModel;

class TerminalObjects {
 public:
  explicit TerminalObjects(const ImagePart& part);

  /// @param object  index << 8 | subindex, as in ImagePart::Place
  /// @return the object of CiA 402 that it is, of the axis that it belongs to; `object` itself where it is none
  [[nodiscard]] std::uint32_t InCia402(std::uint32_t object, std::uint16_t bits) const;
  [[nodiscard]] bool empty() const { return channels_.empty(); }
  /// The control word of an axis (0, 1, ...) as the slave has it: index << 8 | subindex; 0: the axis is at 6040h.
  [[nodiscard]] static std::uint32_t ControlWordOf(const SlaveModel& slave, std::uint8_t axis);

 private:
  std::vector<std::uint8_t> channels_;  ///< those with an axis, in their order; empty for nearly all slaves
};

}  // namespace ecaudit::model
