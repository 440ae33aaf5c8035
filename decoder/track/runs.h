/// in: frames by the clock; AL states and what broadcasts write.  out: RunBegan.
///
/// keeps: when the last frame passed, and whether some slave has left INIT in this run, or was to.
#pragma once

#include <cstdint>

#include "decoder/base/event_sink.h"
#include "decoder/base/time.h"
#include "decoder/track/datagram_pair.h"
#include "decoder/track/events.h"

namespace ecaudit::track {

class Runs {
 public:
  explicit Runs(EventSink& events) : events_(events) {}

  /// Whether the clock shows that this frame, the first after a capture gap, belongs to another recording.
  [[nodiscard]] bool IsOtherRecording(const FrameRef& frame) const {
    return frame.has_time && last_.has_time && ClockJumps(last_.time, frame.time);
  }
  /// The last frame so far that has a time stamp.
  [[nodiscard]] const FrameRef& last() const { return last_; }
  void OnFrame(const FrameRef& frame) {
    if (frame.has_time) last_ = frame;
  }
  /// Another recording begins with this frame.
  void BeginRecording(const FrameRef& frame);
  /// A broadcast that writes: masters that start set all slaves back, whatever these were doing.
  void OnBroadcastWrite(const DatagramPair& d);
  /// A slave is in this state, or was asked to go there.
  void OnState(esc::AlWord word) { in_use_ = in_use_ || word.state() > static_cast<std::uint8_t>(esc::AlState::INIT); }

 private:
  EventSink& events_;
  FrameRef last_;  ///< first copy of the last transaction with a time stamp
  bool in_use_ = false;
};

}  // namespace ecaudit::track
