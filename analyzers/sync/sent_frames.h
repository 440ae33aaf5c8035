/// in: frames as they pass.  out: how long a frame is, when a probe saw it, and which outputs were sent.
///
/// keeps: facts of the last 1024 frames, the last 1024 outbound datagrams with outputs.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "decoder/base/ids.h"
#include "decoder/track/slave_state.h"
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
  void AddOutputs(FrameNo frame, std::uint32_t address, std::uint16_t length) {
    outputs_[outputs_count_++ % kOutputs] = {frame, address, length, false};
  }
  /// The frame came back: whether slaves took its outputs is known.
  void Returned(FrameNo sent);

  /// Null when the frame is not in the capture, or long past.
  [[nodiscard]] const FrameFacts* FactsOf(FrameNo number) const {
    const FrameFacts& facts = facts_[number % kFacts];
    return number != 0 && facts.number == number ? &facts : nullptr;
  }
  /// Frames with outputs for the slave with these FMMUs that were sent after `before` and before `after` (0: until
  /// now), and never returned.
  [[nodiscard]] std::uint64_t UnreturnedBetween(FrameNo before, FrameNo after, const track::KnownFmmus& fmmus) const;

 private:
  struct Outputs {
    FrameNo frame = 0;
    std::uint32_t address = 0;
    std::uint16_t length = 0;
    bool returned = false;
  };
  static constexpr std::size_t kFacts = 1024;
  static constexpr std::size_t kOutputs = 1024;

  std::array<FrameFacts, kFacts> facts_{};
  std::array<Outputs, kOutputs> outputs_{};  // the newest at outputs_count_ - 1
  std::uint64_t outputs_count_ = 0;
};

}  // namespace ecaudit::sync
