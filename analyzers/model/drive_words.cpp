#include "analyzers/model/drive_words.h"

#include <utility>

namespace ecaudit::model {
namespace {

using device::DriveState;

/// Bits 4 to 6, whose meaning depends on the mode, and halt (bit 8).
constexpr unsigned kMotionBits = 0x0170;

}  // namespace

void DriveControl::SetFamily(const device::DriveProfile& drive) {
  unsigned commands = 0;
  unsigned motion = kMotionBits;
  for (const device::DriveCommand& command : drive.commands) commands |= command.automatic ? 0U : command.mask;
  for (const device::EdgeAction& row : drive.edge_actions) motion |= 1U << row.bit;
  mask = static_cast<std::uint16_t>(commands);
  motion_mask = static_cast<std::uint16_t>(motion & ~commands);
}

DriveControl::News DriveControl::Take(std::uint16_t word, const FrameRef& frame, bool drive_acts, bool is_inferred) {
  const std::optional<std::uint16_t> before = std::exchange(taken, word);
  const unsigned differs = before ? *before ^ word : 0U;
  const News news{before, !since.seen(), (differs & mask) != 0, drive_acts && !acts,
                  static_cast<std::uint16_t>(differs & motion_mask)};
  acts = drive_acts;
  inferred = is_inferred;
  if (news.any()) since = frame;
  return news;
}

void DriveStatus::SetFamily(const device::DriveProfile& drive) {
  mask = drive.StateBits();
  if (word && state) state = drive.StateOf(*word);
}

bool DriveStatus::Take(std::uint16_t new_word, const FrameRef& frame, bool is_by_sdo) {
  last = frame;
  word = new_word;
  by_sdo = is_by_sdo;
  const bool unused = new_word == 0 && !known.state;
  if (unused) is_without_state = false;
  return !unused;
}

DriveStateChanged DriveStatus::Change(std::optional<DriveState> to, const FrameRef& frame, bool inferred) {
  DriveStateChanged change;
  change.frame = frame;
  change.from = known.state;
  change.from_last = known.last.number;
  change.to = to;
  change.word = *word;
  if (known.state) change.word_before = known.word;
  change.first_zero = known.was_zero;
  change.by_sdo = by_sdo;
  change.inferred = inferred;
  state = to;
  is_without_state = !to;
  if (!to) {
    without_state = {frame, frame, 0, *word, known.state, known.last.number, inferred};
  } else if (known.state != to) {
    known.state = to;
    known.was_zero = *word == 0;
    state_since = frame;
  }
  return change;
}

}  // namespace ecaudit::model
