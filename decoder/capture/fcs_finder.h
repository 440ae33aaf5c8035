/// in: packets of one interface.  out: how many of their last bytes are the frame check sequence (FCS) of Ethernet.
///
/// The file may declare it, for the interface or for a packet. Cards that hand over the FCS of received frames (rx-fcs)
/// declare nothing, and frames that the same machine sends have none: there each frame is checked.
#pragma once

#include <cstdint>

#include "decoder/capture/frame_source.h"

namespace ecaudit::capture {

class FcsFinder {
 public:
  static constexpr std::uint8_t kBytes = 4;

  /// The file declares an FCS for the interface. Files state its length in bytes, 16-bit words or bits; Ethernet has
  /// only one length.
  void Declare(unsigned length) {
    if (length != 0) state_ = State::kDeclared;
  }
  /// @param declared  the file declares it for this packet
  [[nodiscard]] std::uint8_t In(const CapturedFrame& frame, bool declared = false) noexcept {
    if (state_ == State::kNone && !declared) return 0;
    return Examine(frame, declared);
  }

 private:
  enum class State : std::uint8_t {
    kUnknown,   ///< the first frames are checked
    kNone,      ///< none of them had one
    kSome,      ///< one of them had one: all are checked
    kDeclared,  ///< by the file
  };
  static constexpr std::uint8_t kProbes = 32;

  [[nodiscard]] std::uint8_t Examine(const CapturedFrame& frame, bool declared) noexcept;

  State state_ = State::kUnknown;
  std::uint8_t probes_left_ = kProbes;
};

}  // namespace ecaudit::capture
