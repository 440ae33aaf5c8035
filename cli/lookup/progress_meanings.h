/// Pages of the rungs of the progress ladder, and of the questions that they answer.
#pragma once

#include <string_view>
#include <vector>

#include "cli/lookup/meaning.h"

namespace ecaudit::cli::lookup {

/// "enabled", "sync": a rung of result/progress.h; "axis does not move", "does not reach OP", "drops out of OP": a
/// question.
void AddProgress(std::string_view what, std::vector<Meaning>& out);

/// What AddProgress() knows, for suggestions and completion.
[[nodiscard]] std::vector<std::string_view> ProgressTopics();

}  // namespace ecaudit::cli::lookup
