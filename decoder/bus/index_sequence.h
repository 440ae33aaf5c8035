/// in: the frames of one master in the order in which they were sent.  out: whether frames between two of them are
/// missing, by the indices alone.
///
/// Masters number what they send, each in its own way: all frames in one row, cyclic and acyclic frames side by side, a
/// row for each slave, some frames not at all. Which way it is, is what the frames show: the counters of all three ways
/// are followed at once, and a frame that continues any of them that has been regular so far proves that none is
/// missing. One that continues none proves a capture gap where a counter that frames of its kind used to continue is
/// left. Masters that use one index for everything, or numbers without order, show nothing.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "decoder/bus/frame_numbers.h"
#include "decoder/bus/index_counter.h"
#include "decoder/wire/frame_view.h"

namespace ecaudit::bus {

class IndexSequence {
 public:
  enum class Step : std::uint8_t {
    kUnknown,  ///< the indices do not show
    kNext,     ///< follows the frame before, or is a whole number of rounds further: see span()
    kFew,  ///< a few numbers further than the next one, of a counter that is young, or that this sort of frame may not
           ///< share
    kBroken,  ///< frames are missing between this and the one before
  };

  /// The next frame. @param repeats it has the key of the frame before, which has not come back: a master may repeat it
  [[nodiscard]] Step Follow(const wire::FrameView& frame, bool repeats) noexcept;
  /// A frame was sent whose index cannot be read.
  void Skip() noexcept { ++break_; }
  /// True when the last frame has neither the index of the one before it, or of the one before of its sort, nor one
  /// that any counter was to have next: frames may be missing there.
  [[nodiscard]] bool loose() const { return loose_; }
  /// True when the last frame has the index of the one before it.
  [[nodiscard]] bool repeats() const { return repeats_; }
  /// True when the last frame has the index that some counter was to have next, be it regular or not.
  [[nodiscard]] bool continued() const { return continued_; }
  /// True when the master is regular and this is the index of its next frame.
  [[nodiscard]] bool IsNext(const wire::FrameView& frame) const noexcept;
  /// True when the index lies at most `count` after the last one: what was sent before that.
  [[nodiscard]] bool IsAfter(const wire::FrameView& frame, std::uint64_t count) const noexcept;
  /// True when the last frame had the number that was next, repetitions of it left out.
  [[nodiscard]] bool was_next() const { return was_next_; }
  /// True when the last frame has the index at which a counter restarts.
  [[nodiscard]] bool restarts() const noexcept;
  /// After kBroken: how many frames at least are missing, if any.
  [[nodiscard]] std::uint32_t skipped() const { return skipped_; }
  /// After kBroken: true when the counter that is broken has left out no number lately.
  [[nodiscard]] bool left_out_none() const { return left_out_none_; }
  /// After kBroken: true when the frames are missing somewhere before the frame before, see Jump.
  [[nodiscard]] bool broke_earlier() const { return broke_earlier_; }
  /// How many indices the master uses, as far as seen. After this number of frames the next one has the same again.
  [[nodiscard]] std::uint32_t span() const { return span_; }
  /// True when the frames are numbered: equal indices one after the other are then no coincidence.
  [[nodiscard]] bool IsNumbered(const wire::FrameView& frame) const noexcept;
  /// True when frames of some kind are numbered.
  [[nodiscard]] bool NumbersAny() const noexcept;

 private:
  /// A counter is one of a kind of frames when it was continued so often by them, without a miss between.
  static constexpr std::uint8_t kProven = 4;
  /// If this number of kinds of one half share the counter of all frames, the others of that half do.
  static constexpr int kProvenKinds = 3;
  /// Counters begin at multiples of this, or one after.
  static constexpr unsigned kRoundNumber = 16;
  /// Another counter has an index that lies this close by coincidence only.
  static constexpr std::uint32_t kFewNumbers = 8;
  static constexpr std::size_t kKinds = 16;
  /// Two programs send in turn if so often one goes on where it was left ...
  static constexpr std::uint8_t kTurns = 2;
  /// ... no more than this number of frames before. After that it may be long ago.
  static constexpr std::uint8_t kShortTurn = 16;

  struct Counter {
    IndexCounter indices;
    std::optional<std::uint8_t> last;  ///< index of the last frame
    std::uint32_t break_ = 0;          ///< of IndexSequence, when its last frame came
  };
  /// Frames of one kind: the same sort of command, and mostly the same slave or logical address.
  struct Kind {
    Counter own;
    std::uint8_t in_all = 0;   ///< frames of this kind that continued the counter of all frames, and ...
    std::uint8_t in_half = 0;  ///< ... that of their half
  };
  /// The counter of all frames, which had left out no number, stands elsewhere with the first frames of one half: they
  /// have a counter of their own, or frames are missing before them. Which it is shows the next frame of the other
  /// half.
  struct Jump {
    bool logical = false;  ///< the half that began
    std::uint32_t skipped = 0;
  };
  struct Verdict {
    bool next = false;
    bool broken = false;
    bool begins = false;
    bool few = false;
    std::uint32_t skipped = 0;   ///< by the first counter that is broken ...
    bool left_out_none = false;  ///< ... which has left out no number lately
  };

  [[nodiscard]] static std::size_t KindOf(const wire::FrameView& frame) noexcept;
  [[nodiscard]] static bool IsLogical(std::size_t kind) noexcept { return kind < kKinds / 2; }
  enum class Evidence : std::uint8_t { kNothing, kFollows, kOdd };
  /// @param proven shows whether the counter is one of this kind of frames; asked where it is not continued
  template <class Proven>
  [[nodiscard]] Evidence Ask(Counter& counter, std::uint8_t first, std::uint8_t last, Verdict& verdict,
                             const Proven& proven) const noexcept;

  /// @return the jump that turns out to be frames that are missing
  [[nodiscard]] std::optional<Jump> FollowJump(Evidence by_all, bool left_out_none, std::size_t kind) noexcept;
  [[nodiscard]] bool GoesOnWhereLeft(std::uint8_t first) noexcept;
  [[nodiscard]] bool SharesLikeOthers(std::size_t kind, std::uint8_t first) const noexcept;
  static void Prove(Evidence evidence, std::uint8_t& proven) noexcept;

  bool any_ = false;
  bool loose_ = false;
  bool continued_ = false;
  bool repeats_ = false;
  bool was_next_ = false;
  FrameNumbers last_;
  std::optional<FrameNumbers> left_;  ///< of the frame before the last one that did not continue the counter of all
  std::uint8_t since_left_ = 0;       ///< frames since then, at most kShortTurn + 1
  std::uint8_t turns_ = 0;            ///< at most kTurns
  std::uint32_t span_ = 1;
  std::uint32_t skipped_ = 0;
  bool left_out_none_ = false;
  bool broke_earlier_ = false;
  std::optional<Jump> jump_;
  std::uint32_t break_ = 0;  ///< counts places after which no counter need go on
  Counter all_;
  std::array<bool, 2> met_{};                 ///< a frame of that half
  std::array<std::uint32_t, 2> share_all_{};  ///< kinds of each half that continued it, one bit each
  std::array<Counter, 2> halves_;             ///< of logical commands, and of all others
  std::array<Kind, kKinds> kinds_;
};

}  // namespace ecaudit::bus
