/// in: requests of AL states, broadcast reads of AL Status that all slaves counted for, what single slaves show.
/// out: BusAlOverdue.
///
/// Where only broadcasts are read, the state asked for is late when not all show it although all were asked, or no
/// slave does; and where the master gives up waiting. A slave that shows it by itself is reported by itself.
///
/// keeps: the state that was asked for last, of whom, and how long the broadcasts have not shown it.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "analyzers/model/al_machine.h"
#include "analyzers/model/model_events.h"
#include "decoder/base/event_sink.h"
#include "decoder/track/events.h"

namespace ecaudit::model {

class BusAlWait {
 public:
  /// @param events must outlive this
  explicit BusAlWait(const EventSink& events) : events_(events) {}

  void SetTimeouts(const AlTimeouts& timeouts) { timeouts_ = timeouts; }

  /// @param slave kNoSlave: all were asked, by a broadcast
  void OnRequest(esc::AlWord control, track::Acceptance acceptance, const FrameRef& frame, SlaveId slave);
  void On(const track::AlStatusOfAll& read);
  /// A state was asked for that broadcasts have not shown.
  [[nodiscard]] bool waits() const { return wait_.has_value(); }
  void On(const track::AlStatusRead& read);
  /// The master asks for a lower state instead, in this frame.
  void GiveUp(const FrameRef& frame);
  /// Broadcasts do not show the state that was asked for last, and the limit is not over. Not seen: nothing is waited
  /// for.
  [[nodiscard]] FrameRef waits_since() const {
    return wait_ && !wait_->is_late && wait_->late.polls >= kGivenUpPolls ? wait_->late.request : FrameRef{};
  }
  /// Some slave refused: that is what has to be reported.
  void Refused() { wait_.reset(); }
  /// Hardly anything else was asked for while the capture missed packets.
  void OnShortGap() {
    if (wait_) wait_->late.over_gap = true;
  }
  /// What happened in a longer capture gap, or between two runs, is unknown.
  void Forget() { Close(); }
  void Finish() {
    unfinished_ = waits_since();
    Close();
  }
  /// What was still waited for when the capture ended: the request, or not seen.
  [[nodiscard]] const FrameRef& unfinished() const { return unfinished_; }

 private:
  struct Wait {
    BusAlOverdue late;
    bool is_late = false;
    FrameRef looked;  ///< last read, or the request
  };

  [[nodiscard]] bool Concerns(SlaveId slave) const;
  [[nodiscard]] bool AllAsked(std::uint16_t slaves) const { return of_all_ || asked_.size() == slaves; }
  [[nodiscard]] std::int64_t LimitTo(std::uint8_t target, std::uint8_t from) const;
  /// What is late is reported.
  void Close();

  const EventSink& events_;
  AlTimeouts timeouts_;
  std::optional<Wait> wait_;
  FrameRef unfinished_;
  bool of_all_ = false;
  bool read_singly_ = false;    // a slave that was asked: it is reported by itself
  std::vector<SlaveId> asked_;  // by themselves, for what is waited for
};

}  // namespace ecaudit::model
