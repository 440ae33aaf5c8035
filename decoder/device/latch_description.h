/// Latch control word and latch status word of a family, or those of the touch probe of CiA 402.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace ecaudit::device {

/// A row of one of the two words: a field, or one value of it.
struct LatchField {
  std::uint8_t first = 0;  ///< bit
  std::uint8_t last = 0;
  std::uint16_t mask = 0;
  std::uint16_t value = 0;  ///< under `mask`; 0 for reserved bits
  bool reserved = false;    ///< reserved, or without a meaning in the manual
  std::uint8_t input = 0;   ///< status word: the digital input whose state the bit shows; 0: none
  std::string meaning;
  std::string note;
  std::string source;
};

struct ObjectAddress {
  std::uint16_t index = 0;
  std::uint8_t subindex = 0;
};

/// One edge of one input that can be captured.
struct LatchEdge {
  std::string name;                      ///< "external latch 1 rising"
  std::uint16_t enable = 0;              ///< bits of the control word that arm it, all together
  std::uint16_t valid = 0;               ///< bit of the status word that shows a position was captured
  std::uint8_t selector = 0;             ///< read selector in the control word, acknowledge in the status word; 0: none
  std::vector<ObjectAddress> positions;  ///< objects that hold the captured position; empty: not documented
  std::uint8_t touch_probe = 0;          ///< 1 or 2: the touch probe that uses the same capture unit; 0: none
  std::string capture_unit;              ///< what the manual calls that unit; may be empty
  std::string note;
  std::string source;

  [[nodiscard]] bool EnabledBy(std::uint16_t control_word) const {
    return enable != 0 && (control_word & enable) == enable;
  }
};

struct LatchDescription {
  std::uint16_t control_object = 0;
  std::uint16_t status_object = 0;
  std::uint16_t selector_mask = 0;     ///< of the control word
  std::uint16_t acknowledge_mask = 0;  ///< of the status word
  std::uint16_t reserved_control = 0;  ///< bits of the control word that must be 0
  std::uint16_t reserved_status = 0;   ///< bits of the status word without a meaning
  std::vector<LatchEdge> edges;
  /// Other objects that hold latch positions; the manual does not name their edges.
  std::vector<ObjectAddress> other_positions;
  std::vector<LatchField> control;  ///< rows of the manual
  std::vector<LatchField> status;
  std::string note;
  std::string source;

  [[nodiscard]] std::uint8_t Selector(std::uint16_t control_word) const;
  [[nodiscard]] std::uint8_t Acknowledge(std::uint16_t status_word) const;
  /// The edge a selector reads, or null when the family defines no such selector.
  [[nodiscard]] const LatchEdge* FindSelector(std::uint8_t selector) const;
};

}  // namespace ecaudit::device
