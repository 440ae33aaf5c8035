/// in: the inputs of one slave, cycle by cycle.  out: since when their bits have their value.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <vector>

#include "decoder/base/bytes.h"
#include "decoder/base/ids.h"
#include "decoder/base/time.h"

namespace ecaudit::model {

/// Keeps which bits changed in two windows of time, one after the other, and not when each of them did: that costs a
/// comparison of bytes for each cycle.
class SteadyInputs {
 public:
  void Forget() {
    bytes_.clear();
    begin_ = before_ = FrameRef{};
    frames_ = {};
  }
  /// The next cycle. @param bytes of all inputs  @param frame that brought them, with a time stamp
  void Take(ByteSpan bytes, const FrameRef& frame) {
    if (bytes_.size() != bytes.size()) return Begin(bytes, frame);
    ++frames_[0];
    Change(bytes);
    if (Elapsed(begin_.time, frame.time) >= kWindowNs) BeginWindow(frame);
  }
  /// The last inputs; empty: none are known.
  [[nodiscard]] ByteSpan bytes() const { return bytes_; }
  /// A frame since which these bits of the inputs have their value, one window or two ago. Not seen: they changed since
  /// then, or the inputs are not known for so long, or in fewer frames than `least`.
  [[nodiscard]] FrameRef SteadySince(std::size_t bit, std::size_t bits, std::uint32_t least) const {
    if (!before_.seen() || frames_[0] + frames_[1] < least || bit + bits > 8 * bytes_.size()) return {};
    for (std::size_t i = bit; i < bit + bits; ++i) {
      if (((changed_[0][i / 8] | changed_[1][i / 8]) >> (i % 8) & 1) != 0) return {};
    }
    return before_;
  }

 private:
  static constexpr std::int64_t kWindowNs = 200'000'000;

  [[gnu::noinline]] void Begin(ByteSpan bytes, const FrameRef& frame) {
    bytes_.assign(bytes.begin(), bytes.end());
    for (std::vector<std::uint8_t>& changed : changed_) changed.assign(bytes.size(), 0);
    begin_ = frame;
    before_ = FrameRef{};
    frames_ = {1, 0};
  }
  [[gnu::noinline]] void BeginWindow(const FrameRef& frame) {
    std::swap(changed_[0], changed_[1]);
    changed_[0].assign(bytes_.size(), 0);
    frames_ = {1, frames_[0] - 1};  // this frame begins the next window
    before_ = begin_;
    begin_ = frame;
  }

  /// Inputs of axes that move change in every cycle: eight bytes at a time, the last eight also where some of them were
  /// taken before.
  void Change(ByteSpan bytes) {
    constexpr std::size_t kStep = sizeof(std::uint64_t);
    const std::uint8_t* const from = bytes.data();
    std::uint8_t* const known = bytes_.data();
    std::uint8_t* const changed = changed_[0].data();
    if (bytes.size() < kStep) {
      for (std::size_t i = 0; i < bytes.size(); ++i) Change<std::uint8_t>(from + i, known + i, changed + i);
      return;
    }
    const std::size_t last = bytes.size() - kStep;
    for (std::size_t i = 0; i < last; i += kStep) Change<std::uint64_t>(from + i, known + i, changed + i);
    Change<std::uint64_t>(from + last, known + last, changed + last);
  }
  template <typename T>
  static void Change(const std::uint8_t* from, std::uint8_t* known, std::uint8_t* changed) {
    T before = 0, now = 0, all = 0;
    std::memcpy(&before, known, sizeof(T));
    std::memcpy(&now, from, sizeof(T));
    std::memcpy(&all, changed, sizeof(T));
    all = static_cast<T>(all | (before ^ now));
    std::memcpy(changed, &all, sizeof(T));
    std::memcpy(known, &now, sizeof(T));
  }

  std::vector<std::uint8_t> bytes_;
  std::array<std::vector<std::uint8_t>, 2> changed_;  ///< bits, in this window and in the one before
  std::array<std::uint32_t, 2> frames_{};             ///< likewise
  FrameRef begin_;                                    ///< of this window ...
  FrameRef before_;                                   ///< ... and of the one before
};

}  // namespace ecaudit::model
