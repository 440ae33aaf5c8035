/// in: control and status words of one axis.  out: what the master commands, what of it the drive took, and the states
/// that the drive shows.
#pragma once

#include <cstdint>
#include <optional>

#include "analyzers/model/drive_events.h"

namespace ecaudit::model {

struct DriveControl {
  enum class Way : std::uint8_t { kUnknown, kSdo, kMapped };
  /// What a word that the drive took changed.
  struct News {
    std::optional<std::uint16_t> before;
    bool first = false;        ///< none was taken before, in the whole capture
    bool changed = false;      ///< bits that command transitions
    bool activated = false;    ///< the drive acts on it, and did not on the word before
    std::uint16_t motion = 0;  ///< changed bits that DriveBits reports

    [[nodiscard]] bool any() const { return !before || changed || activated; }
  };

  Way way = Way::kUnknown;             ///< process data overwrite what the mailbox brings
  std::optional<std::uint16_t> sent;   ///< as the master sent it last
  std::optional<std::uint16_t> taken;  ///< as the drive took it last
  bool inferred = false;               ///< that it took it
  bool acts = false;                   ///< the drive acted on `taken`
  FrameRef since;                      ///< `taken` commands the same since this frame
  std::uint64_t ambiguous = 0;         ///< times that mapped copies differed, so that the command was not known
  std::uint16_t mask = 0;              ///< bits that command transitions
  std::uint16_t motion_mask = 0;       ///< further ones that DriveBits reports

  [[nodiscard]] bool seen() const { return way != Way::kUnknown; }
  [[nodiscard]] bool mapped() const { return way == Way::kMapped; }
  void SetFamily(const device::DriveProfile& drive);
  News Take(std::uint16_t word, const FrameRef& frame, bool drive_acts, bool is_inferred);
};

struct DriveStatus {
  static constexpr std::uint16_t kWarningBit = 0x0080;

  /// The last state that was known.
  struct KnownState {
    std::optional<device::DriveState> state;
    std::uint16_t word = 0;  ///< last status word that showed it
    FrameRef last;           ///< and its frame
    bool was_zero = false;   ///< the word was 0 when the state began
  };
  /// The last run of status words that fit no state of the family.
  struct WithoutState {
    FrameRef first, last;
    std::uint64_t words = 0;  ///< 0: there was none
    std::uint16_t word = 0;   ///< the first of them
    std::optional<device::DriveState> before;
    FrameNo before_last = 0;  ///< last frame that showed the state before
    bool inferred = false;
  };

  bool mapped = false;  ///< inputs have held one
  bool by_sdo = false;  ///< came `word`
  std::optional<std::uint16_t> word;
  FrameRef last;                            ///< last status word
  std::optional<device::DriveState> state;  ///< as shown now; unset: the word fits none
  FrameRef state_since;
  KnownState known;
  WithoutState without_state;
  bool is_without_state = false;  ///< the run goes on

  [[nodiscard]] bool seen() const { return last.seen(); }
  void SetFamily(const device::DriveProfile& drive);
  /// The word that is known came once more.
  void Repeat(const FrameRef& frame) {
    last = frame;
    if (state) {
      known.last = frame;
      known.word = *word;
    } else if (is_without_state) {
      ++without_state.words;
      without_state.last = frame;
    }
  }
  /// Of another word that inputs bring: it shows the same state, and differs in bits only that no event reports.
  [[nodiscard]] bool Confirms(std::uint16_t new_word) const {
    return state && ((*word ^ new_word) & (mask | kWarningBit)) == 0;
  }
  /// Such a word came.
  void Confirm(std::uint16_t new_word, const FrameRef& frame) {
    by_sdo = false;
    word = known.word = new_word;
    last = known.last = frame;
  }
  /// Another word than before.
  /// @return false: it shows nothing. Before any other word, 0 is what unused memory holds
  [[nodiscard]] bool Take(std::uint16_t new_word, const FrameRef& frame, bool is_by_sdo);
  /// The word shows another state than the word before.
  /// @return the change, without what led to it
  [[nodiscard]] DriveStateChanged Change(std::optional<device::DriveState> to, const FrameRef& frame, bool inferred);

  std::uint16_t mask = 0;  ///< bits that distinguish states
};

}  // namespace ecaudit::model
