/// The verdict in one line that fits: what, where and when, before all that explains it.
#pragma once

#include <string>
#include <vector>

#include "cli/report/digest.h"
#include "cli/report/layout.h"

namespace ecaudit::report {

struct VerdictLine {
  std::string word;  ///< "FAIL", "PASS", ... as in HeadlineParts
  std::string rest;  ///< " akd.pcapng: slave 0 (AKD, 0x1001): SAFEOP refused ... (frame 760 at 0.759 s)". Printable
  Style style = Style::kPlain;  ///< of the word
};

/// It shows the root cause. What does not fit is left out in this order: consequence, folder of the capture, name of
/// the slave, time, name of the capture, frame. The cause is only cut where the line holds nothing else.
/// @param whole_path  of several captures: the path stays, and the line may grow longer for it
[[nodiscard]] VerdictLine VerdictLineOf(const CaptureDigest& capture, const TextStyle& style, bool whole_path = false);

/// Sentences that belong to the verdict and that the line may have no room for: what is required and missing, why the
/// verdict is limited, which part was examined.
[[nodiscard]] std::vector<std::string> VerdictNotes(const CaptureDigest& capture);

}  // namespace ecaudit::report
