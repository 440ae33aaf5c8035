/// in: what the units of a slave made of its process data.  out: whether the next data can change them.
///
/// Nearly every cycle carries the same control and status words as the one before; positions change, but no unit looks
/// at them then. So a unit reports after each cycle whether it is still, and which words it looked at. While these stay
/// the same, and nothing else reached the slave's model, the units only count.
#pragma once

#include <array>
#include <cstdint>

#include "analyzers/model/exchange.h"
#include "decoder/base/bytes.h"

namespace ecaudit::model {

/// How a unit left a cycle.
enum class Still : std::uint8_t {
  kNo,      ///< something changed, or may change without another word
  kIdle,    ///< the same words again would change nothing
  kCounts,  ///< likewise, but for the unit's Repeat()
};

class StillCycle {
 public:
  static constexpr std::size_t kMaxWords = 6;

  /// Begins again: no word is watched.
  void Clear() {
    generation_ = 0;
    count_ = 0;
  }
  /// @param bit, bits place of the word in `data`
  /// @return false when it cannot be watched: not 1 or 2 whole bytes inside `data`, or too many words
  bool Watch(ByteSpan data, std::uint32_t bit, unsigned bits) {
    const std::size_t at = bit / 8;
    if (bit % 8 != 0 || (bits != 8 && bits != 16) || !Fits(data, at, bits / 8) || count_ == kMaxWords) return false;
    words_[count_++] = {static_cast<std::uint32_t>(at), Load(data, at, bits == 16), bits == 16};
    return true;
  }
  /// The units are still; `generation` (not 0) identifies the slave's model at this moment.
  void Settle(std::uint64_t generation, Exchange exchange) {
    generation_ = generation;
    exchange_ = exchange;
  }
  /// The units are still as Settle() left them.
  [[nodiscard]] bool IsSettled(std::uint64_t generation, Exchange exchange) const {
    return generation == generation_ && exchange == exchange_;
  }
  /// Calls `visit(first byte, bytes)` for each word that is watched.
  template <class Visit>
  void ForEachWord(Visit visit) const {
    for (std::size_t i = 0; i < count_; ++i) visit(words_[i].at, words_[i].two_bytes ? 2 : 1);
  }
  [[nodiscard]] bool Repeats(std::uint64_t generation, Exchange exchange, ByteSpan data) const {
    if (!IsSettled(generation, exchange)) return false;
    for (std::size_t i = 0; i < count_; ++i) {
      const Word& word = words_[i];
      if (!Fits(data, word.at, word.two_bytes ? 2 : 1) || Load(data, word.at, word.two_bytes) != word.value) {
        return false;
      }
    }
    return true;
  }

  Still latch = Still::kNo, probe = Still::kNo, drive = Still::kNo;  ///< how each unit left it
  std::uint8_t axes = 0;  ///< with Still::kCounts, those of the drive that count, a bit each

 private:
  struct Word {
    std::uint32_t at = 0;
    std::uint16_t value = 0;
    bool two_bytes = false;
  };
  static std::uint16_t Load(ByteSpan data, std::size_t at, bool two_bytes) {
    return two_bytes ? LoadLittleEndian<std::uint16_t>(data.data() + at) : std::uint16_t{data[at]};
  }

  std::uint64_t generation_ = 0;
  Exchange exchange_ = Exchange::kUnknown;
  std::uint8_t count_ = 0;
  std::array<Word, kMaxWords> words_{};
};

}  // namespace ecaudit::model
