/// in: a command that the state machine does not offer in the state shown, and what comes after it.  out:
/// DriveIllegalCommand, where nothing makes it right.
///
/// Such a command may turn out right: the drive was about to change its state, or the word is Disable operation and the
/// first step of a switch-off sequence (7, 6, 0), which masters send whatever the state.
#pragma once

#include <cstdint>
#include <optional>

#include "analyzers/model/drive_events.h"
#include "decoder/base/event_sink.h"
#include "decoder/device/drive_profile.h"

namespace ecaudit::model {

class DoubtfulCommand {
 public:
  explicit DoubtfulCommand(EventSink& sink) : sink_(sink) {}

  [[nodiscard]] bool pending() const { return command_.has_value(); }
  void Begin(const DriveIllegalCommand& command);
  void Clear() { command_.reset(); }

  /// Another control word follows.
  /// @param needed  status words that must have shown the same state: the one that comes back with a control word is
  ///     older than it
  void OnWord(const device::DriveProfile& drive, std::uint16_t word, unsigned needed);
  /// The drive shows another state.
  /// @param control  control word in force; not known: unset
  /// @param mask  bits of the control word that command transitions
  void OnState(const device::DriveProfile& drive, device::DriveState state, std::optional<std::uint16_t> control,
               std::uint16_t mask);
  /// A status word shows that the state is the same.
  void OnSameState(const FrameRef& frame, std::int64_t reaction_ns, unsigned needed);
  /// Whether the drive acted on the command was not known until now: the status words before do not count.
  void BeginAgain() { statuses_ = 0; }

  /// Not decided when the capture ends: nothing came that makes it legal.
  [[nodiscard]] std::optional<DriveIllegalCommand> Undecided(unsigned needed) const;

 private:
  void Confirm(unsigned needed);

  EventSink& sink_;
  std::optional<DriveIllegalCommand> command_;
  unsigned statuses_ = 0;    // status words since that show the same state
  bool going_down_ = false;  // Shutdown followed: it may be the first step of a switch-off sequence
};

}  // namespace ecaudit::model
