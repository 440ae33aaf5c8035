/// Checks that the sentences of a finding are short and complete.
#pragma once

#include <string>
#include <vector>

#include "analyzers/result/finding.h"

namespace ecaudit::test {

/// What is wrong with the sentences that a report writes of `finding`, one text each:
///
/// - an argument is missing ("?name?")
/// - the title is longer than 70 characters
/// - a sentence has more than 25 words
/// - blanks or full stops stand twice, or before a comma
///
/// Names that come from captures, manuals and profiles count as one word, lists as two of their entries; meanings of
/// codes and the number of the axis do not count.
[[nodiscard]] std::vector<std::string> ProblemsOfSentences(const Finding& finding);

}  // namespace ecaudit::test
