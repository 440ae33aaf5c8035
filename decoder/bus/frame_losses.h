/// Which frames are lost, and which may have returned unseen: tables of evidence and verdict, and who applies them.
#pragma once

#include "decoder/base/evidence.h"
#include "decoder/bus/drop_pattern.h"
#include "decoder/bus/pairing_context.h"

namespace ecaudit::bus {

/// What became of a frame that is given up.
enum class Fate : std::uint8_t { kLost, kCapturedTwice, kDoubted, kNoAnswers, kNoReturns };

enum class GivenUpFact : std::uint8_t {
  kMayBeCopy,  ///< most likely the packet before it, captured twice
  kDoubted,    ///< something showed that it may have returned unseen
  kAnswered,   ///< frames return to its sender
  kNoAnswers,  ///< its master repeats frames after a time-out, and none ever returned
};

inline constexpr auto kFates = [] {
  using F = GivenUpFact;
  return std::to_array<EvidenceRow<F, Fate>>({
      {{F::kMayBeCopy}, {}, Fate::kCapturedTwice},
      {{F::kDoubted}, {}, Fate::kDoubted},
      {{F::kNoAnswers}, {F::kAnswered}, Fate::kNoAnswers},
      {{}, {F::kAnswered}, Fate::kNoReturns},
      {{}, {}, Fate::kLost},
  });
}();

/// Whether a frame still in flight at the end of the capture is given up.
enum class AtEnd : std::uint8_t { kInFlight, kOvertaken, kSilence };

enum class AtEndFact : std::uint8_t {
  kOvertaken,      ///< frames sent later returned
  kOtherPort,      ///< returns have an interface of their own, which may have stopped a moment earlier
  kTimed,          ///< its time stamp and that of the last packet are known
  kSomeSentLater,  ///< kSilentFrames of its sender were sent later, none of which returned
  kManySentLater,  ///< likewise kSilentFramesUntimed
  kOverdue,        ///< it is out for longer than any other
};

inline constexpr auto kFatesAtEnd = [] {
  using F = AtEndFact;
  return std::to_array<EvidenceRow<F, AtEnd>>({
      {{F::kOvertaken}, {}, AtEnd::kOvertaken},
      {{F::kOtherPort}, {}, AtEnd::kInFlight},
      {{F::kTimed, F::kSomeSentLater, F::kOverdue}, {}, AtEnd::kSilence},
      {{F::kManySentLater}, {F::kTimed}, AtEnd::kSilence},
      {{}, {}, AtEnd::kInFlight},
  });
}();

class FrameLosses {
 public:
  explicit FrameLosses(PairingContext& context) : context_(context) {}

  /// All that this sender sent before the frame of this number and that is still open has been overtaken.
  void Overtake(std::uint8_t sender, std::uint64_t sequence) noexcept;
  /// A frame returned that this number of others had overtaken: others may return as late. Twice that is added.
  void LearnLatest(std::uint32_t overtaken) noexcept {
    if (overtaken > latest_) latest_ = overtaken;
  }
  /// The window is full: its oldest frame is given up.
  void GiveUpOldest() noexcept;
  /// Of the frames before the one of this number, the sink gets those that are lost since the last call.
  void Report(std::uint64_t sequence) noexcept;
  /// Frames of its sender before the first one that returns: as many as no bus loses in a row, for longer than a frame
  /// is in flight. No slave was there to answer.
  void DoubtSentWithoutAnswer(const SentFrame& first_answered) noexcept;
  /// Before what returned is handed over: what it means may depend on frames that it overtook.
  void DoubtOvertakenBy(const SentFrame& sent) noexcept;
  /// The outbound copy of a return is missing.
  void MissOutbound(const FrameRef& returned) noexcept {
    drops_.MissOutbound(returned.number, context_.statistics.outbound);
  }
  /// The capture ends. @param last packet with a time stamp
  void Finish(const FrameRef& last) noexcept;

 private:
  void Lose(SentFrame& sent, Loss loss) noexcept;

  PairingContext& context_;
  std::uint32_t latest_ = 0;  ///< frames that overtook a numbered one which returned then, at most
  DropPattern drops_;
};

}  // namespace ecaudit::bus
