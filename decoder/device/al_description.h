/// What a drive family states about its AL state machine: transitions, refusals and AL status codes.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "decoder/esc/al.h"

namespace ecaudit::device {

/// Where a row comes from. A finding that rests on an inferred row is weaker than one that rests on print.
enum class Basis : std::uint8_t {
  kPrinted,   ///< stated by the family's own manual
  kStandard,  ///< stated by ETG documents, an ESC data sheet, or the slave stack code most drives use
  kInferred,  ///< the manual is silent; follows from the standard or from other rows; the note states how
};

/// One pair of states: may the master request it, and what does the drive do about it?
struct AlTransition {
  esc::AlState from = esc::AlState::INIT;
  esc::AlState to = esc::AlState::INIT;
  bool allowed = false;  ///< the master may request it
  /// False: the manual accepts the request but documents no effect, and real firmware may refuse it (INIT to BOOT of
  /// the Kollmorgen drives). Neither reaching `to` nor refusing with one of `tolerated_codes` contradicts the manual.
  bool performed = true;
  Basis basis = Basis::kPrinted;
  std::string action;       ///< what the drive does; empty when nothing is documented
  std::string requirement;  ///< what the drive checks first; empty when nothing is documented
  /// AL status codes by which the manual states such a request is refused; empty: none documented.
  std::vector<std::uint16_t> refusal_codes;
  /// Codes that the standard or real firmware gives here though the manual does not list them; the note states which.
  std::vector<std::uint16_t> tolerated_codes;
  std::string note;
  std::string source;
};

/// One AL status code of the family's list.
struct AlStatusCode {
  struct Transition {
    esc::AlState from;
    esc::AlState to;
  };

  std::uint16_t code = 0;
  std::string name;
  bool any_transition = false;          ///< may follow every request
  std::vector<Transition> transitions;  ///< requests it may refuse
  std::vector<esc::AlState> states;     ///< states in which it may appear without a request
  /// True: the manual binds the code to these transitions and states. False: they are typical, others are possible.
  bool exclusive = false;
  std::optional<esc::AlState> resulting_state;  ///< unset: the current state is kept (or it depends, see `result`)
  std::string result;                           ///< resulting state as printed ("current state + E")
  std::string note;
  std::string source;

  /// True when the code may refuse a request for `to` in `from`.
  [[nodiscard]] bool AppliesTo(esc::AlState from, esc::AlState to) const;
  /// True when the code may appear in `state` without a request.
  [[nodiscard]] bool AppliesIn(esc::AlState state) const;
};

/// A change that the drive makes by itself.
struct SpontaneousAlChange {
  esc::AlState from = esc::AlState::INIT;
  esc::AlState to = esc::AlState::INIT;
  std::vector<std::uint16_t> codes;  ///< AL status codes that explain it
  std::string cause;
  Basis basis = Basis::kPrinted;
  std::string note;
  std::string source;
};

struct AlDescription {
  std::vector<AlTransition> transitions;  ///< all 25 pairs, sorted by (from, to)
  std::vector<SpontaneousAlChange> spontaneous;
  std::vector<AlStatusCode> status_codes;  ///< sorted by code
  /// True: the manual states that no other codes are supported.
  bool status_codes_complete = false;
  /// Codes from here on are the vendor's own and need no entry; unset: no such range.
  std::optional<std::uint16_t> vendor_codes_from;
  std::string note;
  std::string source;

  /// Null only when the table lacks the pair.
  [[nodiscard]] const AlTransition* Find(esc::AlState from, esc::AlState to) const;
  [[nodiscard]] const AlStatusCode* FindCode(std::uint16_t code) const;
};

}  // namespace ecaudit::device
