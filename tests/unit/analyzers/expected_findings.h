/// The text form of what an analysis must find, beside each .trace of tests/rules/, and the comparison with what it
/// found.
///
/// One entry a line; `#` begins a comment:
///
///   error al-refused  slave=0  frame=answer.returned  count=3  caused_by=al-illegal-transition  kind=refused
///   error al-refused  slave=0  frame=answer.returned  kind=refused  al_status_code=0x001d  note=init-commands-missing
///   warning capture-snaplen  slave=-  frame=7  confidence=inferred  kind=cut
///   not-evaluable al-timeout  slave=0  no-stamps
///   not-evaluable al-refused  slave=0  not-in-capture al-state-before
///
/// slave=N is the position, `-` the whole bus. A frame is a number, or the mark of a line of the trace (its outbound
/// copy; NAME.returned: its returned copy). last= is checked where it is given; without count= it is 1, without
/// caused_by= there is no cause, without confidence= it is observed. related= lists frames that must be among the
/// related ones, note= a note that it must have, without= a note or an argument that it must not have. axis= counts
/// from 1. Other words are arguments: NAME=VALUE, or NOTE.NAME=VALUE of a note, with the value as reports write it,
/// without its meaning ("0x001d", "6040h:0", "frame 12" or "12"), as the code of a word, or "yes" and "no".
/// cause.NAME=VALUE is an argument of the finding that caused_by= names.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "analyzers/result/analysis_result.h"
#include "decoder/base/result.h"
#include "tests/support/trace_builder.h"

namespace ecaudit::test {

struct ExpectedFinding {
  std::string severity;
  std::string rule;
  std::optional<SlavePos> slave;
  FrameNo frame = 0;
  std::optional<FrameNo> last;
  std::uint64_t count = 1;
  std::string caused_by;  ///< rule of the cause, empty for none
  std::vector<std::pair<std::string, std::string>> cause_arguments;
  std::string confidence = "observed";
  std::vector<FrameNo> related;
  std::string kind;
  std::optional<unsigned> axis;
  std::vector<std::string> notes;
  std::vector<std::string> without;  ///< notes or arguments
  std::vector<std::pair<std::string, std::string>> arguments;
  std::string line;  ///< as written, for messages
};

struct ExpectedNotEvaluable {
  std::string rule;
  std::optional<SlavePos> slave;
  std::string code, what;
};

struct Expectations {
  std::vector<ExpectedFinding> findings;
  std::vector<ExpectedNotEvaluable> not_evaluable;
};

/// Reads the text form; marks are looked up in `trace`. The error names the line.
[[nodiscard]] Result<Expectations> ParseExpectations(std::string_view text, const Trace& trace);

/// What `finding` says in the text form, for messages.
[[nodiscard]] std::string TextOf(const Finding& finding, const AnalysisResult& result);

/// "kind=refused al_status_code=0x001d note=..." of a finding: its kind, what tells it apart, and its notes.
[[nodiscard]] std::string KindTextOf(const Finding& finding);
/// The line of the text form that describes it.
[[nodiscard]] std::string LineOf(const NotEvaluable& entry, const AnalysisResult& result);
[[nodiscard]] bool Matches(const ExpectedNotEvaluable& expected, const NotEvaluable& entry,
                           const AnalysisResult& result);

/// True when `finding` is what `expected` describes.
[[nodiscard]] bool Matches(const ExpectedFinding& expected, const Finding& finding, const AnalysisResult& result);

}  // namespace ecaudit::test
