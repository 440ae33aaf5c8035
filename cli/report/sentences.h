/// Makes sentences of findings and reasons: the only place where a report's English comes from. Nothing reads it back.
#pragma once

#include <string>
#include <string_view>

#include "analyzers/result/analysis_result.h"

namespace ecaudit::report {

/// The sentences of a finding. Printable, of one line each, without line breaks.
struct Sentences {
  std::string title;    ///< without full stop, slave and frame
  std::string message;  ///< observed and expected
  std::string next;     ///< what to do; may be empty
};

/// @param result  which the finding is from: the next step of a consequence names its cause
[[nodiscard]] Sentences SentencesOf(const Finding& finding, const AnalysisResult& result);
/// Message and next step as one paragraph.
[[nodiscard]] std::string MessageOf(const Finding& finding, const AnalysisResult& result);
[[nodiscard]] std::string TitleOf(const Finding& finding);
/// Without a full stop: "the AL state before the request is not in the capture".
[[nodiscard]] std::string TextOf(const Reason& reason);
[[nodiscard]] std::string TextOf(const NotEvaluable& entry);

/// One template (finding_kind.h) filled with `arguments`. An argument that is missing outside of [ ... ] is written as
/// "?name?"; tests look for these.
[[nodiscard]] std::string Fill(std::string_view text, const Arguments& arguments);

/// A template for people who read about a rule: "<requested> refused [in <state_before>]".
[[nodiscard]] std::string OutlineOf(std::string_view text);

}  // namespace ecaudit::report
