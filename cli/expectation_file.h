/// Expectations of start-ups: the JSON file that people or `startup --save` write (ecaudit.expectation/1, its schema is
/// beside the report's), or an ENI.
#pragma once

#include <memory>
#include <string>

#include "analyzers/result/analysis_result.h"
#include "analyzers/result/expectation.h"
#include "decoder/base/result.h"

namespace ecaudit::cli {

/// Reads `path`: XML is an ENI, all else must be an expectation. An unknown key is an error: a typing mistake must not
/// switch a check off. What is wrong is one line that names the place: "x.json: slaves[0].steps[3].value: ...".
[[nodiscard]] Result<std::shared_ptr<const startup::Expectation>> ReadExpectation(const std::string& path);

/// Whether the file is an ESI file by its root element: what it requires is compared, not its steps.
[[nodiscard]] bool IsEsi(const std::string& path);

/// The start-ups of `result` as a file, a line for each step. Values that vary between runs are null.
[[nodiscard]] std::string WriteExpectation(const AnalysisResult& result);

/// What keeps --save from writing to `path`, besides what CheckOutputPath() asks: a file that is there and no
/// expectation.
[[nodiscard]] std::optional<Error> CheckSavePath(const std::string& path);

}  // namespace ecaudit::cli
