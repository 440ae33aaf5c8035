/// in: modes of operation as the master requests them (6060h) and the drive shows them (6061h).  out: DriveMode, where
/// they change.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "analyzers/model/drive_events.h"
#include "decoder/base/event_sink.h"

namespace ecaudit::model {

class DriveModes {
 public:
  DriveModes(SlaveId slave, EventSink& sink, std::uint8_t axis) : slave_(slave), sink_(sink), axis_(axis) {}

  [[nodiscard]] const std::optional<std::int8_t>& requested() const { return requested_; }
  [[nodiscard]] const std::optional<std::int8_t>& shown() const { return shown_; }
  /// The same request again would change nothing.
  [[nodiscard]] bool request_is_of_this_run() const { return !of_run_before_[0]; }

  /// Likewise what the drive shows.
  [[nodiscard]] bool shown_is_of_this_run() const { return !of_run_before_[1]; }

  /// @param shown  by the drive, else requested
  /// @return true where it is another one
  bool On(std::int8_t value, bool shown, const FrameRef& frame, bool by_sdo, bool inferred) {
    std::optional<std::int8_t>& known = shown ? shown_ : requested_;
    bool& of_run_before = of_run_before_[shown ? 1 : 0];
    if (known == value && !of_run_before) return false;
    known = value;
    of_run_before = false;
    sink_.Publish(DriveMode{slave_, axis_, frame, shown, value, by_sdo, inferred});
    return true;
  }
  /// A download of 6060h may have been done or not.
  void ForgetRequest() { requested_.reset(); }
  void OnRunBegan() { of_run_before_ = {true, true}; }

 private:
  SlaveId slave_;
  EventSink& sink_;
  std::uint8_t axis_;
  std::optional<std::int8_t> requested_, shown_;
  std::array<bool, 2> of_run_before_{};  // requested, shown: to be reported again
};

}  // namespace ecaudit::model
