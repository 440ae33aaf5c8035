/// in: frames as they pass.  out: how long a frame is, when a probe saw it, and which frames with outputs were sent.
///
/// keeps: facts of the last 1024 frames, numbers of the last 256 outbound ones with outputs.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "decoder/base/ids.h"
#include "decoder/wire/frame_view.h"

namespace ecaudit::sync {

/// What is known of a frame from its bytes.
struct FrameFacts {
  FrameNo number = 0;
  std::uint32_t bytes = 0;
  std::optional<TimeNs> esl;  ///< stamp of a probe
};

class SentFrames {
 public:
  void Add(const wire::FrameView& frame) {
    FrameFacts& facts = facts_[frame.ref().number % kFacts];
    facts.number = frame.ref().number;
    facts.bytes = static_cast<std::uint32_t>(frame.bytes().size());
    facts.esl.reset();
    if (frame.esl().present && frame.esl().has_time) facts.esl = static_cast<TimeNs>(frame.esl().time_ns);
  }
  /// The outbound frame writes process data.
  void AddOutputs(FrameNo frame) { outputs_[outputs_count_++ % kOutputs] = frame; }

  /// Null when the frame is not in the capture, or long past.
  [[nodiscard]] const FrameFacts* FactsOf(FrameNo number) const {
    const FrameFacts& facts = facts_[number % kFacts];
    return number != 0 && facts.number == number ? &facts : nullptr;
  }
  /// Frames with outputs that were sent behind `before` and before `after` (0: until now): those that did not come
  /// back, where the two are neighbours among those that did.
  [[nodiscard]] std::uint64_t UnreturnedBetween(FrameNo before, FrameNo after) const;

 private:
  static constexpr std::size_t kFacts = 1024;
  static constexpr std::size_t kOutputs = 256;

  std::array<FrameFacts, kFacts> facts_{};
  std::array<FrameNo, kOutputs> outputs_{};  // the newest at outputs_count_ - 1
  std::uint64_t outputs_count_ = 0;
};

}  // namespace ecaudit::sync
