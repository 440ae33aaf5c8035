/// Process data of a family: fixed PDOs, which PDOs may be assigned, and the rules of free mapping.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "decoder/device/al_description.h"
#include "decoder/device/object_dictionary.h"
#include "decoder/device/sourced.h"

namespace ecaudit::device {

/// How sure the object after an entry of a fixed PDO is; manuals print names and sizes, not indices.
enum class Confidence : std::uint8_t {
  kPrinted,    ///< name and size lead to one object
  kResolved,   ///< needed a small step (another spelling, low half of an object)
  kAmbiguous,  ///< several objects fit; the note names the others
  kInferred,   ///< taken from another manual of the same maker
};

struct PdoEntry {
  std::uint16_t index = 0;  ///< 0: padding
  std::uint8_t subindex = 0;
  std::uint16_t bits = 0;
  DataType type = DataType::kUnknown;
  std::string name;
  Confidence confidence = Confidence::kPrinted;
  std::string note;
};

struct PdoContent {
  std::uint16_t index = 0;
  PdoDirection direction = PdoDirection::kRx;
  std::string name;
  bool known = true;                         ///< false: the manual names the PDO but not what is in it
  bool fixed = true;                         ///< its mapping cannot be changed
  std::optional<std::uint8_t> sync_manager;  ///< assigned to this one by default (ESI only)
  bool mandatory = false;                    ///< ESI only
  std::vector<std::uint16_t> excludes;       ///< PDOs it cannot be assigned together with (ESI only)
  std::vector<PdoEntry> entries;
  std::string note;
  std::string source;

  /// Sum of the entries.
  [[nodiscard]] std::uint32_t bits() const;
};

/// A PDO index that may be written to an assignment object.
struct SelectablePdo {
  PdoDirection direction = PdoDirection::kRx;
  std::uint16_t index = 0;
  bool example_only = false;  ///< stands in an example of the manual but in no list of supported PDOs
  std::string note;
  std::string source;
};

/// An object that the manual lists for cyclic exchange.
struct CyclicObject {
  PdoDirection direction = PdoDirection::kRx;
  std::uint16_t index = 0;
  std::uint8_t subindex = 0;
  DataType type = DataType::kUnknown;  ///< unknown where the manual prints the size only
  std::uint16_t bits = 0;
  std::string name;
  std::string note;
  std::string source;
};

/// A limit of the process data length that holds under a condition.
struct ByteLimit {
  std::uint32_t bytes = 0;
  std::string condition;  ///< empty: always
  Basis basis = Basis::kPrinted;
  std::string note;
  std::string source;
};

/// Something that may be mapped to fill a gap.
struct Padding {
  PdoDirection direction = PdoDirection::kRx;
  std::uint16_t index = 0;
  std::uint8_t first_subindex = 0;
  std::uint8_t last_subindex = 0;
  std::uint16_t bits = 0;  ///< 0: any size
  std::string note;
  std::string source;
};

/// A rule in words, with the numbers beside it where there are any.
struct MappingRule {
  std::string rule;
  std::string value;
  std::string note;
  std::string source;
};

struct FlexibleMapping {
  std::vector<std::uint16_t> rx_pdos;  ///< mapping objects that may be written
  std::vector<std::uint16_t> tx_pdos;
  Sourced<std::uint32_t> max_pdos;  ///< per direction
  Sourced<std::uint32_t> max_bytes_per_pdo;
  Sourced<std::uint32_t> max_entries_per_pdo;
  /// PDOs for free mapping that are not used must be cleared, and fixed ones switched off.
  Sourced<bool> clear_unused;
  Sourced<bool> even_length;            ///< the length of a PDO must be even
  std::vector<ByteLimit> max_rx_bytes;  ///< smallest first; beyond the last nothing is allowed
  std::vector<ByteLimit> max_tx_bytes;
  std::vector<Padding> paddings;
};

struct PdoDescription {
  std::uint16_t rx_assign = 0x1C12;
  std::uint16_t tx_assign = 0x1C13;
  std::vector<SelectablePdo> selectable;  ///< sorted by index
  bool selectable_complete = false;       ///< the manual claims to list all
  std::vector<PdoContent> fixed;          ///< sorted by index
  std::vector<CyclicObject> cyclic;       ///< in the order of the manual
  bool cyclic_complete = false;
  std::optional<FlexibleMapping> flexible;  ///< unset: free mapping is not described
  std::vector<MappingRule> rules;           ///< all rules of the manual in words
  std::string note;
  std::string source;

  [[nodiscard]] const PdoContent* FindFixed(std::uint16_t index) const;
  /// True when the PDO may be assigned: listed as selectable (not only in an example), or one of the free ones.
  [[nodiscard]] bool IsAssignable(PdoDirection direction, std::uint16_t index) const;
  [[nodiscard]] const CyclicObject* FindCyclic(PdoDirection direction, std::uint16_t index,
                                               std::uint8_t subindex) const;
};

}  // namespace ecaudit::device
