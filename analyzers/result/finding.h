/// What a rule reports. A finding is ids, numbers and short texts; the writers in cli/report make lines and JSON of it.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "analyzers/options/severity.h"
#include "decoder/base/ids.h"

namespace ecaudit {

enum class Confidence : std::uint8_t {
  kObserved,  ///< rests on bytes and working counters only
  kInferred,  ///< rests on an assumption, named in the message
};

/// One compared value, named: {"al_status_code", 0x1D, kHex}. Numbers that people write in hexadecimal stay numbers.
struct Evidence {
  enum class Notation : std::uint8_t { kDecimal, kHex };
  std::string name;
  std::variant<std::int64_t, double, bool, std::string> value;
  Notation notation = Notation::kDecimal;  ///< how a person writes it
};

struct Reference {
  std::string document;  ///< key in docs/sources.md: "AKD-2011"
  std::string section;   ///< "4.3.4"
};

/// The first citation of a source as rules and profiles write it: "AKD-2011, 4.3.4; MKD, 4.3.4". Empty for "".
[[nodiscard]] Reference ReferenceTo(std::string_view source);

/// Index of a finding in AnalysisResult::findings; also used while the analysis runs.
using FindingIndex = std::uint32_t;
inline constexpr FindingIndex kNoFinding = 0xFFFFFFFF;

struct Finding {
  std::string_view rule;  ///< id in the catalogue; the string lives as long as the program
  Severity severity = Severity::kInfo;
  std::string title;         ///< one line without slave and frame: "SAFEOP refused with AL status code 0x001d"
  std::string message;       ///< what happened, observed and expected values, what the manual says, what to do
  SlaveId slave = kNoSlave;  ///< kNoSlave: the whole bus
  FrameRef first;            ///< the frame that shows it
  FrameRef last;             ///< last repetition, same as first when count is 1
  std::uint64_t count = 1;
  std::vector<FrameNo> related_frames;  ///< at most 16: the request, the configuration, ...
  FindingIndex caused_by = kNoFinding;
  Confidence confidence = Confidence::kObserved;
  std::vector<Evidence> evidence;
  Reference reference;
};

/// A rule that could not be judged for a slave or the bus, and why. One entry per rule, slave and reason.
struct NotEvaluable {
  std::string_view rule;
  SlaveId slave = kNoSlave;  ///< kNoSlave: the whole bus
  std::string reason;        ///< "AL state not known: the capture starts in operation", without a full stop
  FrameNo first_frame = 0;   ///< first occasion; 0 when it holds for the whole capture
  std::uint64_t occasions = 1;
};

}  // namespace ecaudit
