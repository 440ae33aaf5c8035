/// What became of the outbound frames of a capture. Every one of them is in exactly one of the counts, at any moment.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <string_view>

namespace ecaudit::bus {

/// Why it is unknown whether an outbound frame returned.
enum class Undecided : std::uint8_t {
  kNoReturns,          ///< the capture holds no returned frames of its sender
  kNoAnswers,          ///< neither did its repetitions: most likely no frame returned at all
  kUnreadable,         ///< it is malformed itself: its return could not be recognised
  kCapturedTwice,      ///< most likely the packet before it, captured once more
  kCaptureGap,         ///< the capture misses frames while it was in flight, by the indices
  kSilence,            ///< its sender was silent for long while it was in flight: the capture may miss frames
  kSecondCapture,      ///< another capture begins after it
  kUnreadableReturn,   ///< an unreadable packet may have been its return
  kBeforeFirstReturn,  ///< sent before the first return that the capture holds
  kRecorder,           ///< packets are missing at a regular distance: the recorder left out its return
};
inline constexpr std::size_t kUndecidedReasons = 10;

/// One sentence part for each, for example "the indices skip while it was under way".
[[nodiscard]] constexpr std::string_view Describe(Undecided reason) {
  constexpr std::array<std::string_view, kUndecidedReasons> kTexts{
      "no returned frames of their master in the capture",
      "no frame returns",
      "malformed",
      "captured twice",
      "the capture misses frames there",
      "a long silence after them",
      "another capture begins after them",
      "an unreadable packet may be their return",
      "sent before the first return",
      "the recorder leaves out packets",
  };
  return kTexts[static_cast<std::size_t>(reason)];
}

struct FrameLedger {
  std::uint64_t outbound = 0;   ///< frames sent
  std::uint64_t returned = 0;   ///< came back, also those that came back damaged
  std::uint64_t lost = 0;       ///< must have come back, and did not
  std::uint64_t in_flight = 0;  ///< not back yet; at the end of the capture those that still may come
  std::array<std::uint64_t, kUndecidedReasons> undecided{};

  [[nodiscard]] std::uint64_t undecided_total() const {
    return std::accumulate(undecided.begin(), undecided.end(), std::uint64_t{0});
  }
  [[nodiscard]] bool Balances() const { return outbound == returned + lost + in_flight + undecided_total(); }
  void Count(Undecided reason) { ++undecided[static_cast<std::size_t>(reason)]; }
};

}  // namespace ecaudit::bus
