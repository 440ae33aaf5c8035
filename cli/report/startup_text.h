/// The start-ups of the slaves for a person: phase by phase, step by step.
#pragma once

#include <string>

#include "cli/report/report.h"
#include "cli/report/text_writer.h"

namespace ecaudit::report {

/// One capture after the other: what was found against an expectation, where `report.judged_startup` shows that there
/// was one, then the phases of each slave with their steps.
[[nodiscard]] std::string WriteStartupText(const Report& report, const TextStyle& style);

/// "INIT -> PREOP", "refused with 0x001d ...": one step as a line, without frame and time. Printable.
[[nodiscard]] std::string StepLine(const StartupStep& step);

}  // namespace ecaudit::report
