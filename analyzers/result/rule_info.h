/// What the catalogue knows of a rule; `ecaudit rules`, `ecaudit explain`, docs/rules.md and reports print it.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "analyzers/result/finding.h"

namespace ecaudit {

/// What a rule is about: what must be on the bus, and in the capture, so that there is something to evaluate.
enum class Subject : std::uint8_t {
  kOfChapter,      ///< what the other rules of its chapter are about
  kCapture,        ///< the file
  kBus,            ///< frames, no single slave
  kOtherPackets,   ///< packets of other protocols beside them; all that follow are evaluated for each slave
  kSlave,          ///< any slave
  kEeprom,         ///< a slave whose EEPROM is read
  kAlState,        ///< a slave whose AL Status is read
  kAlRequest,      ///< a slave of which states are requested
  kConfiguration,  ///< a slave whose sync managers and FMMUs are seen to be set
  kMailbox,        ///< a slave whose mailbox is used
  kCoe,            ///< ... for CoE
  kEoe,            ///< ... for EoE
  kMapping,        ///< a slave with process data whose contents are known
  kMappingWrites,  ///< a slave whose PDO assignment or mapping is written or read
  kProcessData,    ///< a slave that exchanges process data
  kTiming,         ///< ... under a clock that is good enough to measure it
  kCycle,          ///< ... and for which a cycle time is set
  kDrive,          ///< a drive whose control and status word are seen
  kClock,          ///< a slave whose distributed clock is used
  kLatch,          ///< a slave whose latch words are seen
  kFaultBits,      ///< a slave whose family has objects with bits that show faults
  kExpectation     ///< a start-up for which an expectation is given
};

/// How much of what came before its frames a finding rests on, and so what packets that the capture misses may explain.
enum class History : std::uint8_t {
  kNone,    ///< nothing: what it finds stands in the frames that it cites
  kMostly,  ///< settings and states, which a master repeats or reads again
  kWhole    ///< an order or a sequence, which one missing packet makes another one
};

struct RuleInfo {
  std::string_view id;     ///< the name in the catalogue; never reused
  std::string_view group;  ///< "AL state machine", as the catalogue's headings
  Severity severity;       ///< default; where a rule has two, the higher
  History history = History::kMostly;
  /// It compares with what only the manual of the family states: an unknown device is not evaluable.
  bool of_family = false;
  Subject subject = Subject::kOfChapter;
  std::string_view title;   ///< one line, present tense, no full stop
  std::string_view needs;   ///< what must be known before it can be evaluated
  std::string_view source;  ///< document and section it rests on
  /// The sentences: all kinds of findings it reports, and all notes it adds to findings.
  std::span<const FindingKind* const> kinds = {};
  std::span<const NoteKind* const> notes = {};
  /// Rules that have to receive each event, and finish, before this one: it uses their findings. Nothing else may
  /// depend on the order of rules.
  std::span<const std::string_view> after = {};
  /// Markdown with the headings What it checks, Why it matters, How it is decided, Example, What to do
  std::string_view doc;
};

}  // namespace ecaudit
