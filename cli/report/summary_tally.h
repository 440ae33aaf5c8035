/// Counts over many captures.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "cli/report/digest.h"

namespace ecaudit::report {

/// What became of one capture.
enum class Status : std::uint8_t { kFail, kUnmet, kUnreadable, kLimited, kPass, kNothingToCheck };

/// "fail", "unmet" (something of --require is missing), "unreadable", "limited", "pass", "nothing-to-check" as in the
/// JSON summary.
[[nodiscard]] std::string_view Name(Status status);
[[nodiscard]] Status StatusOf(const CaptureDigest& capture);

/// The order in which all summaries list captures: what needs an engineer is first.
enum class Urgency : std::uint8_t { kFail, kUnmet, kUnreadable, kFindings, kLimited, kNothingToCheck, kNoFinding };
[[nodiscard]] Urgency UrgencyOf(const CaptureDigest& capture);

/// One rule over all captures; known findings are left out.
struct RuleTally {
  std::string rule;
  Severity severity = Severity::kInfo;  ///< the worst that occurs
  std::uint64_t captures = 0;
  std::uint64_t findings = 0;
  std::size_t first_capture = 0;  ///< place of the first of them in Digest::captures ...
  std::size_t first_finding = 0;  ///< ... and in its findings
};

/// Captures whose first cause is the same fault, wherever on the bus: rule and identity are equal. Of each
/// capture the cause counts that is read first, known findings left out.
struct CauseGroup {
  std::string rule;
  Severity severity = Severity::kInfo;  ///< the worst that occurs
  std::string identity;                 ///< Fingerprint::identity
  std::string title;                    ///< of the first capture's
  std::vector<std::size_t> captures;    ///< places in Digest::captures
  std::string first_time, last_time;    ///< when the captures begin, ISO 8601 UTC; empty when unknown
  std::vector<std::string> products;    ///< of the slaves, each once, sorted
  std::size_t example = 0;              ///< place of the finding in the first of the captures
};

struct Tally {
  Summary findings;
  std::uint64_t failed = 0;
  std::uint64_t unmet = 0;
  std::uint64_t limited = 0;
  std::uint64_t unreadable = 0;
  std::uint64_t passed = 0;
  std::uint64_t nothing_to_check = 0;
  std::vector<RuleTally> rules;    ///< worst severity first, then the most captures, then by id
  std::vector<CauseGroup> causes;  ///< likewise, then by title

  /// "fail": a capture failed, or lacks what is required; "incomplete": none did, but some could not be read or were
  /// not reached; "limited": one of them is; "pass".
  [[nodiscard]] std::string_view Verdict(const Digest& digest) const;
};

[[nodiscard]] Tally TallyOf(const Digest& digest);

}  // namespace ecaudit::report
