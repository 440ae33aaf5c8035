/// in: a frame that returned.  out: the frame in flight that it answers, and what it is if there is none.
///
/// Frames are found by sender, content and order. Only where a master repeated a frame do time stamps decide.
#pragma once

#include "decoder/bus/frame_likeness.h"
#include "decoder/bus/pairing_context.h"
#include "decoder/bus/return_evidence.h"

namespace ecaudit::bus {

class ReturnMatching {
 public:
  explicit ReturnMatching(PairingContext& context) : context_(context) {}

  /// The frame in flight that this return answers; null: none.
  [[nodiscard]] SentFrame* FindOpen(const wire::FrameView& frame) noexcept;
  /// The same where both copies of a sender's frames look alike: what has come further than a frame in flight is its
  /// return. Where the tap has slaves on its way out, what they alone were asked returns as it passed.
  [[nodiscard]] SentFrame* FindLessFar(const wire::FrameView& frame) noexcept;
  /// The frame in flight that a damaged return most likely answers; null: none.
  [[nodiscard]] SentFrame* FindAlike(const wire::FrameView& frame) noexcept;
  /// The frame in flight that was altered on its way to this return; null: it is none of them.
  [[nodiscard]] SentFrame* FindAltered(const wire::FrameView& frame) noexcept;
  /// What returned a moment ago with the same bytes. A master with few indices sends equal frames again and again, so
  /// only what is close counts.
  [[nodiscard]] const SentFrame* FindOriginal(const wire::FrameView& frame) noexcept;
  /// @param sent the frame in flight that fits, or null  @param original of FindOriginal(), asked where it matters
  [[nodiscard]] ReturnVerdict Weigh(const wire::FrameView& frame, const SendingRhythm& rhythm, const SentFrame* sent,
                                    const SentFrame*& original) noexcept {
    // Nearly always: no more is asked.
    const bool plain = sent != nullptr && sent->overtaken == 0 && !sent->may_be_copy();
    return plain ? Decide(kReturns, {ReturnFact::kFits}) : WeighAll(frame, rhythm, sent, original);
  }

  /// True when a frame of the same commands, addresses and lengths that was sent later is still in flight: what
  /// returns may be that one's, where one before was lost and its sender numbers by what returns.
  [[nodiscard]] bool MayBeOfLater(const SentFrame& sent) noexcept;
  /// True when the master may have sent a frame like it once more since, whose outbound copy the capture misses.
  [[nodiscard]] bool MayBeOfMissing(const SentFrame& sent) noexcept;
  /// True when it returns so late, and numbers show so little, that it may answer a frame like it which the capture
  /// misses.
  [[nodiscard]] bool MayAnswerLater(const SentFrame& sent, const wire::FrameView& returned) noexcept;
  /// Remembers how many slaves frames pass.
  void LearnPassed(const SentFrame& sent, const wire::FrameView& returned) noexcept;

 private:
  [[nodiscard]] ReturnVerdict WeighAll(const wire::FrameView& frame, const SendingRhythm& rhythm, const SentFrame* sent,
                                       const SentFrame*& original) noexcept;
  [[nodiscard]] bool MayAnswer(const SentFrame& sent, const wire::FrameView& frame, Owner owner,
                               bool other_end) const noexcept;
  [[nodiscard]] SentFrame* FindCut(const wire::FrameView& frame) noexcept;
  [[nodiscard]] OfTwo WeighTwo(const FrameRef& first, const FrameRef& second, const FrameRef& returned) const noexcept;
  [[nodiscard]] bool PassedOthers(const SentFrame& sent, const wire::FrameView& frame) const noexcept;
  [[nodiscard]] bool IsTooOld(const SentFrame& sent, const wire::FrameView& frame) const noexcept;

  PairingContext& context_;
  int passed_ = kNotCounted;  ///< slaves that the last frame addressed by position passed
};

}  // namespace ecaudit::bus
