/// Knowledge with three values. Unknown is the start value of everything and never an error.
#pragma once

#include <utility>

#include "decoder/base/ids.h"

namespace ecaudit {

enum class Certainty : std::uint8_t {
  kUnknown,   ///< nothing seen yet, or forgotten
  kInferred,  ///< follows from other observations
  kObserved,  ///< the bytes were seen and the working counter shows the slave gave or took them
};

template <typename T>
class Known {
 public:
  Known() = default;

  static Known Observed(T value, FrameNo since) { return Known(std::move(value), Certainty::kObserved, since); }
  static Known Inferred(T value, FrameNo since) { return Known(std::move(value), Certainty::kInferred, since); }

  [[nodiscard]] Certainty certainty() const { return certainty_; }
  /// Null unless the value was seen on the wire.
  [[nodiscard]] const T* if_observed() const { return certainty_ == Certainty::kObserved ? &value_ : nullptr; }
  /// Null only when unknown.
  [[nodiscard]] const T* if_known() const { return certainty_ == Certainty::kUnknown ? nullptr : &value_; }
  [[nodiscard]] T value_or(T other) const { return certainty_ == Certainty::kUnknown ? other : value_; }
  /// The frame that taught us, or that made us forget; 0 when nothing ever did.
  [[nodiscard]] FrameNo since() const { return since_; }

  void Forget(FrameNo why) {
    certainty_ = Certainty::kUnknown;
    since_ = why;
  }

 private:
  Known(T value, Certainty certainty, FrameNo since) : value_(std::move(value)), certainty_(certainty), since_(since) {}

  T value_{};
  Certainty certainty_ = Certainty::kUnknown;
  FrameNo since_ = 0;
};

}  // namespace ecaudit
