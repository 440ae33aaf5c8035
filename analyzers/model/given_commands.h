/// in: control words that a drive acts on.  out: which transitions they commanded, and which word asked for a path.
///
/// keeps: the newest of these words.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "analyzers/model/drive_events.h"
#include "decoder/device/drive_profile.h"

namespace ecaudit::model {

class GivenCommands {
 public:
  struct Since {
    std::uint32_t transitions = 0;  ///< commanded, a bit each
    bool whole = false;             ///< none of the words can be missing
  };

  /// @param acts  the drive acts on the first word that was seen: others may have come before
  void OnFirst(bool acts) { history_whole_ = !acts; }
  void Add(std::uint32_t transitions, std::uint16_t word, const FrameRef& frame);
  /// The drive works its commands off in order: what it has done now was asked for by the first that does, and those
  /// before that one are over.
  void UseUp(const DrivePath& path);
  /// Transitions commanded since shortly before the state was last shown, and by the word in force then.
  [[nodiscard]] Since GivenSince(const FrameRef& last, std::int64_t reaction_ns) const;
  /// Whose word asked for it: the newest that commands a step which the drive did not have to take anyway.
  /// @param given  what counts as commanded, a bit each
  [[nodiscard]] FrameRef CommandOf(const device::DriveProfile& drive, const DrivePath& path, std::uint32_t given) const;

 private:
  struct Command {
    std::uint32_t transitions = 0;
    FrameRef frame;
    std::uint16_t word = 0;
  };
  static constexpr std::size_t kMost = 8;

  std::vector<Command> given_;  // the newest, a ring; empty until it is needed: most slaves are no drives
  std::size_t count_ = 0;       // ever given
  std::size_t used_up_ = 0;     // of these: the drive took what they command, and they command nothing more
  bool history_whole_ = false;  // no control word that may still act was given before the first one seen
};

}  // namespace ecaudit::model
