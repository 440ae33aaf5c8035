/// Facts of the manuals that no rule computes with; `ecaudit profiles` shows them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace ecaudit::device {

/// A numeric limit.
struct Limit {
  std::string name;
  std::string value;
  std::string unit;
  std::string meaning;
  std::string note;
  std::string source;
};

/// Anything else worth knowing: LEDs, connectors, process descriptions.
struct Fact {
  std::string category;
  std::string name;
  std::string value;
  std::string note;
  std::string source;
};

/// A category of the EEPROM, or what the manual states about its emulation.
struct EepromFact {
  std::string kind;  ///< "category", "identity", "event", ...
  std::string key;
  std::optional<std::uint16_t> category;  ///< its number, for a category
  std::optional<std::uint16_t> word;      ///< of the EEPROM, that it is about
  std::string fact;
  std::vector<std::string> rules;  ///< rules whose findings about that word it explains
  std::string note;
  std::string source;
};

/// One bit, or one value, of a fieldbus parameter (FBUS.PARAM02 and others).
struct FieldbusParameter {
  std::string parameter;
  std::optional<std::uint8_t> bit;
  std::optional<std::int32_t> value;
  std::string meaning;
  std::vector<std::string> rules;  ///< rules whose findings it explains or changes
  std::string note;
  std::string source;
};

}  // namespace ecaudit::device
