/// What a rule reports: ids and typed values, no sentences. cli/report/sentences.h makes title and message of it.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "analyzers/options/severity.h"
#include "analyzers/result/finding_kind.h"
#include "analyzers/result/mapping_table.h"
#include "analyzers/result/reason.h"
#include "decoder/base/ids.h"

namespace ecaudit {

enum class Confidence : std::uint8_t {
  kObserved,  ///< rests on bytes and working counters only
  kInferred,  ///< rests on an assumption, named in the message
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

/// Slaves that share one finding of the bus (judge/one_for_many.h).
struct AffectedSlaves {
  std::uint64_t number = 0;        ///< 0: it is about one slave, or the bus
  std::string first;               ///< label of the slave that the arguments are about
  std::vector<std::string> named;  ///< labels, bounded
  std::string positions;           ///< "0-3, 7"
};

struct Finding {
  std::string_view rule;  ///< id in the catalogue; the string lives as long as the program
  /// From 1, in the order of the whole capture: "f3" in every report of it, whichever part the report shows. 0: the
  /// findings were not numbered, and the place counts.
  std::uint32_t number = 0;
  Severity severity = Severity::kInfo;
  const FindingKind* kind = nullptr;  ///< which of the rule's; never null once reported
  Arguments arguments;
  std::vector<Note> notes;
  std::uint8_t axis = 0;  ///< of a drive with several, the first is 0
  AffectedSlaves affected;
  SlaveId slave = kNoSlave;  ///< kNoSlave: the whole bus
  FrameRef first;            ///< the frame that shows it
  FrameRef last;             ///< last repetition, same as first when count is 1
  std::uint64_t count = 1;
  /// The condition that it reports lasts to this frame, kCaptureEnds: to the end; 0: not beyond `last`.
  FrameNo until = 0;
  static constexpr FrameNo kCaptureEnds = std::numeric_limits<FrameNo>::max();
  std::vector<FrameNo> related_frames;  ///< at most 16: the request, the configuration, ...
  FindingIndex caused_by = kNoFinding;
  /// The lowest rung (result/progress.h) that the master wanted and did not reach, or lost, because of it: "enabled".
  std::string_view holds;
  /// An error without visible effect that is rare on this bus: what holds something is read before it.
  bool aside = false;
  /// The user set the severity of the rule below that of the finding: only that decides whether it fails the capture.
  bool severity_is_lowered = false;
  Confidence confidence = Confidence::kObserved;
  Reference reference;
  /// The mappings that it is about, each direction alone; of several findings about one mapping, one has it.
  std::vector<std::shared_ptr<const MappingTable>> mapping;

  Finding& Set(std::string_view name, Value value) {
    arguments.Set(name, std::move(value));
    return *this;
  }
  Finding& Add(const NoteKind& note, Arguments of_note = {}) {
    notes.push_back({&note, std::move(of_note)});
    return *this;
  }
  [[nodiscard]] bool Is(std::string_view of_rule, std::string_view of_kind) const {
    return rule == of_rule && kind->name == of_kind;
  }
  [[nodiscard]] bool Has(const NoteKind& note) const;
};

/// A finding to be filled and reported.
[[nodiscard]] Finding Found(const FindingKind& kind, SlaveId slave, const FrameRef& first);

/// The first frame of what the finding is about: one that it names before its own.
[[nodiscard]] FrameNo BegunBy(const Finding& finding);

/// What distinguishes two findings of one rule and slave in all captures of one machine: kind, axis and the identity
/// arguments, without texts, counts, times and frames. "refused requested=4 al_status_code=29".
[[nodiscard]] std::string IdentityOf(const Finding& finding);

/// A rule that could not be evaluated for a slave or the bus, and why. One entry per rule, slave and reason.
struct NotEvaluable {
  std::string_view rule;
  SlaveId slave = kNoSlave;  ///< kNoSlave: the whole bus
  Reason reason;
  FrameNo first_frame = 0;  ///< first occasion; 0 when it holds for the whole capture
  std::uint64_t occasions = 1;
  std::uint64_t slaves = 0;  ///< > 0: the entry stands for this many slaves that are not named
};

}  // namespace ecaudit
