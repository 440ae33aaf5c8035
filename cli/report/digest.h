/// What summaries and CI formats need of a report: verdicts, findings, what could not be evaluated; no slaves, no
/// traffic.
///
/// A digest comes from an analysis (DigestOf) or from a JSON report that was written earlier (digest_json.h); both give
/// the same, so a summary does not depend on which of them it was made from.
#pragma once

#include <compare>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "analyzers/options/slave_names.h"
#include "analyzers/result/rule_info.h"
#include "cli/report/coverage_tally.h"
#include "cli/report/report.h"

namespace ecaudit::report {

/// A finding. All texts are printable; `message` may hold line breaks.
struct FindingDigest {
  std::string rule;
  Severity severity = Severity::kInfo;
  std::string kind;      ///< which of the rule's; empty in reports of the first versions
  std::string identity;  ///< IdentityOf(Finding): the same in all captures of one machine
  std::string title;
  std::string message;            ///< with the next step
  std::string next;               ///< what to do; may be empty
  std::optional<SlavePos> slave;  ///< position; nothing for the whole bus
  std::optional<StationAddress> station_address;
  std::string place;       ///< "slave 0 (AKD, 0x1001)", "bus"
  std::string product;     ///< of the slave: "vendor 0x0000006a, product 0x00414b44"; empty when unknown
  FrameNo frame = 0;       ///< 0: none
  FrameNo last_frame = 0;  ///< last repetition
  std::uint64_t count = 1;
  std::optional<double> time_s;  ///< from the first packet
  std::optional<TimeNs> time;    ///< of the first frame
  std::vector<FrameNo> related_frames;
  std::string holds;                 ///< rung that the master wanted and did not reach because of it; empty: none
  bool aside = false;                ///< Finding::aside
  std::size_t caused_by = kNoCause;  ///< place in CaptureDigest::findings
  Confidence confidence = Confidence::kObserved;
  std::string document, section;  ///< of the reference; may be empty
  std::string wireshark_filter;   ///< may be empty
  bool known = false;             ///< the baseline lists it
  std::string known_because;      ///< what the baseline states of it; may be empty
  std::uint64_t line = 0;         ///< of its frame in the text of `decode`; 0: not counted

  static constexpr std::size_t kNoCause = SIZE_MAX;
  auto operator<=>(const FindingDigest&) const = default;
};

/// A rule that could not be evaluated.
struct NotJudged {
  std::string rule;
  std::optional<SlavePos> slave;  ///< position; nothing for the whole bus, and for all slaves alike
  std::string reason;
  bool every_slave = false;  ///< it holds for each slave
  std::string code;          ///< "not-in-capture"; empty in reports of the first versions
  auto operator<=>(const NotJudged&) const = default;
};

/// How far one rule was evaluated.
struct RuleCoverageDigest {
  std::string rule;
  CoverageCount count;
  std::string why;  ///< it does not apply; empty: it applies everywhere
  auto operator<=>(const RuleCoverageDigest&) const = default;
};

/// The result of one capture.
struct CaptureContent {
  std::string path;
  /// Why the capture could not be read, in which case nothing but `path` is filled. Empty: it was read.
  std::string unreadable;
  std::uint64_t packets = 0;
  std::uint64_t ethercat_frames = 0;
  bool without_ethercat = false;   ///< nothing to check
  std::uint64_t slaves = 0;        ///< in the report
  std::uint64_t slaves_there = 0;  ///< as the last broadcast showed; 0: none did
  std::string first_time;          ///< ISO 8601 UTC; empty when unknown
  std::optional<double> duration_s;
  SlaveNames slave_names;          ///< what texts call its slaves
  bool complete = true;            ///< false: damaged, or stopped early
  bool judged = true;              ///< false: there is no verdict
  std::string limited;             ///< what makes a verdict "limited"; empty: nothing
  std::string required;            ///< as in --require; empty: nothing
  std::vector<std::string> unmet;  ///< what of it is missing
  Selection selection;
  FailOn fail_on = FailOn::kError;
  std::string config;                                      ///< path of the configuration file; empty: none
  std::string baseline;                                    ///< path; empty: none
  std::vector<std::pair<std::string, std::string>> rules;  ///< settings of rules: id and severity, or "off"
  std::vector<std::string> devices;     ///< of its slaves, each once, sorted; as FindingDigest::product
  std::vector<FindingDigest> findings;  ///< as in the report
  std::vector<NotJudged> not_judged;
  std::vector<RuleCoverageDigest> coverage;  ///< empty in reports of the first versions

  auto operator<=>(const CaptureContent&) const = default;
};

/// One capture, and where more of it stands.
struct CaptureDigest : CaptureContent {
  std::string report;  ///< name of the file with the whole report; empty: none
  std::string page;    ///< name of the file with its page (HTML); empty: none

  bool operator==(const CaptureDigest&) const = default;
};

/// What one run, or several merged ones, found.
struct Digest {
  std::string version;                     ///< of the program
  std::span<const RuleInfo* const> rules;  ///< the catalogue, sorted by id
  std::vector<CaptureDigest> captures;     ///< in the order they are reported
  std::uint64_t not_reached = 0;           ///< captures that an interrupted run did not come to
};

[[nodiscard]] CaptureDigest DigestOf(const CaptureReport& capture);
/// Captures that could not be read follow the others.
[[nodiscard]] Digest DigestOf(const Report& report);

[[nodiscard]] Summary Summarise(const CaptureDigest& capture);
/// Sums over all captures; fails when one of them does.
[[nodiscard]] Summary Summarise(const Digest& digest);

/// True when the finding makes the verdict of `capture` "fail".
[[nodiscard]] bool Counts(const CaptureDigest& capture, const FindingDigest& finding);

/// "slave 0 (AKD, 0x1001)" with what is known of it. Printable.
[[nodiscard]] std::string SlaveLabel(const SlaveNames& names, SlavePos position, std::string_view name,
                                     const std::optional<StationAddress>& station_address);

/// "vendor 0x0000006a, product 0x00414b44"; empty unless both are known.
[[nodiscard]] std::string ProductText(std::optional<std::uint32_t> vendor, std::optional<std::uint32_t> product);

/// Each once, without those that are not known.
void SortDevices(std::vector<std::string>& devices);

/// "slave 2", "all slaves", "bus"
[[nodiscard]] std::string PlaceOf(const NotJudged& entry, const SlaveNames& names);

/// What the first line shows, as places in CaptureDigest::findings: the root of the tree that is read first, and the
/// worst finding of that tree, which differs where the cause is the milder of the two.
struct MainFinding {
  std::size_t worst = 0;
  std::size_t root = 0;
};
/// Nothing where there is no finding, or all are known.
[[nodiscard]] std::optional<MainFinding> MainFindingOf(const CaptureDigest& capture);

/// What keeps a verdict without errors from being the whole truth; see coverage_tally.h.
[[nodiscard]] std::vector<Reservation> Reservations(const CaptureDigest& capture);

/// The verdict and its main reason.
struct HeadlineParts {
  std::string verdict;  ///< "FAIL", "UNMET" (something of --require is missing), "LIMITED", "PASS", "NOTHING-TO-CHECK",
                        ///< "NOT-JUDGED", "ERROR"
  std::string sentence;                ///< "slave 0 (AKD, 0x1001): ... (frame 760)". Printable
  std::string reservation = {};        ///< part of the sentence: ", but the capture misses packets"; may be empty
  std::string short_reservation = {};  ///< the same for a line without room
};
[[nodiscard]] HeadlineParts HeadlinePartsOf(const CaptureDigest& capture);

/// A sentence about the capture with its name: "a.pcapng: no findings ...". Names it once.
[[nodiscard]] std::string WithName(const CaptureDigest& capture, const std::string& sentence);
/// The same as one line, with the capture's name: "FAIL a.pcapng: slave 0 (AKD, 0x1001): ... (frame 760)". Printable.
[[nodiscard]] std::string Headline(const CaptureDigest& capture);
/// "7 slaves, 6 of them known by broadcasts only".
/// @param there  as the last broadcast counted; 0: none did
[[nodiscard]] std::string SlavesText(std::uint64_t shown, std::uint64_t there);

}  // namespace ecaudit::report
