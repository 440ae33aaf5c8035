/// What became of the outbound frames of a capture. Every one of them is in exactly one of the counts, at any moment.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <string_view>

namespace ecaudit::bus {

/// Why nobody can say of an outbound frame whether it came back.
enum class Undecided : std::uint8_t {
  kNoReturns,          ///< the capture holds no returned frames of its sender
  kNobodyAnswers,      ///< neither did what was repeated after it: most likely nothing came back to anybody
  kUnreadable,         ///< it is malformed itself: its return could not be told
  kCapturedTwice,      ///< most likely the packet before it, captured once more
  kHole,               ///< the capture misses frames while it was under way, by the indices
  kSilence,            ///< its sender was silent for long while it was under way: the capture may miss frames
  kSecondCapture,      ///< behind it another capture was put
  kUnreadableReturn,   ///< a packet that nobody can read may have been its return
  kBeforeFirstReturn,  ///< sent before the first return that the capture holds
  kRecorder,           ///< packets are missing at a regular distance: the recorder left out its return
};
inline constexpr std::size_t kUndecidedReasons = 10;

/// One sentence part for each, for example "the indices skip while it was under way".
[[nodiscard]] constexpr std::string_view Describe(Undecided reason) {
  constexpr std::array<std::string_view, kUndecidedReasons> kTexts{
      "no returned frames of their master in the capture",
      "nobody answers",
      "malformed",
      "captured twice",
      "the capture misses frames there",
      "a long silence behind them",
      "another capture begins behind them",
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
  std::uint64_t under_way = 0;  ///< not back yet; at the end of the capture those that still may come
  std::array<std::uint64_t, kUndecidedReasons> undecided{};

  [[nodiscard]] std::uint64_t undecided_total() const {
    return std::accumulate(undecided.begin(), undecided.end(), std::uint64_t{0});
  }
  [[nodiscard]] bool Balances() const { return outbound == returned + lost + under_way + undecided_total(); }
  void Count(Undecided reason) { ++undecided[static_cast<std::size_t>(reason)]; }
};

}  // namespace ecaudit::bus
