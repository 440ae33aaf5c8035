/// The report for a person: what matters most in the first line, how much was evaluated, the findings with their ids,
/// then slaves, what could not be evaluated, and the capture.
#pragma once

#include <string>

#include "cli/report/layout.h"
#include "cli/report/report.h"

namespace ecaudit::report {

/// Lines end with "\n"; names and texts from the capture are made printable.
[[nodiscard]] std::string WriteText(const Report& report, const TextStyle& style);
/// A line for each capture that could not be read; empty where all could.
[[nodiscard]] std::string UnreadableText(const Report& report, const TextStyle& style);

/// Of one capture only verdict, findings and what could not be evaluated.
[[nodiscard]] std::string WriteVerdict(const CaptureReport& capture, const TextStyle& style);

/// "slave 0 (AKD, 0x1001)" with what is known of it; "bus" for kNoSlave. Printable.
[[nodiscard]] std::string SlaveLabel(const AnalysisResult& result, SlaveId slave);

/// One line, the verdict and its main reason: "FAIL a.pcapng: slave 0 (AKD, 0x1001): ... (frame 760)". Printable.
[[nodiscard]] std::string Headline(const CaptureReport& capture);

}  // namespace ecaudit::report
