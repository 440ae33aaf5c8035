#include "cli/report/junit_writer.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <string_view>
#include <utility>

#include "cli/report/layout.h"
#include "cli/report/times.h"
#include "cli/report/xml.h"
#include "decoder/base/text.h"

namespace ecaudit::report {
namespace {

/// The windyroad schema wants a time stamp in each suite; this one means "unknown".
constexpr std::string_view kNoTime = "1970-01-01T00:00:00";

struct TestCase {
  enum class Outcome { kPassed, kFailed, kSkipped, kError };
  std::string name;
  Outcome outcome = Outcome::kPassed;
  std::string message;  ///< one line
  std::string type;     ///< failures and errors
  std::string text;     ///< several lines
};

/// "samples.captures.trace_pcapng": CI servers make a tree of packages of it.
std::string ClassName(const std::string& path) {
  std::string name;
  for (const std::filesystem::path& part : std::filesystem::path(path).relative_path()) {
    std::string text = part.string();
    if (text == "." || text.empty()) continue;
    if (text == "..") text = "up";
    std::ranges::replace(text, '.', '_');
    name += (name.empty() ? "" : ".") + text;
  }
  return name.empty() ? "capture" : name;
}

/// "frame 760 at 0.759000 s (02:13:07.250 UTC), seen 5,999 times, last in frame 6762"
std::string Where(const FindingDigest& f) {
  if (f.frame == 0) return "whole capture";
  std::string text = "frame " + std::to_string(f.frame);
  if (f.time_s) text += " at " + Fixed(*f.time_s, 6) + " s";
  if (f.time) text += " (" + ClockText(*f.time, false, 3) + " UTC)";
  if (f.count > 1) text += ", seen " + Count(f.count, "time") + ", last in frame " + std::to_string(f.last_frame);
  return text;
}

std::string Describe(const CaptureDigest& capture, const FindingDigest& f) {
  std::string text = std::string(Name(f.severity)) + " " + f.rule + ", " + f.place + ", " + Where(f) + "\n" + f.title;
  if (!f.message.empty()) text += "\n" + f.message;
  if (f.caused_by < capture.findings.size()) {
    const FindingDigest& cause = capture.findings[f.caused_by];
    text += "\nconsequence of " + cause.rule + ": " + cause.title;
    if (cause.frame != 0) text += " (frame " + std::to_string(cause.frame) + ")";
  }
  if (f.confidence == Confidence::kInferred) text += "\ninferred: an assumption is involved";
  if (const std::string reference = ReferenceText(f.document, f.section); !reference.empty()) {
    text += "\nsource: " + reference;
  }
  if (!f.wireshark_filter.empty()) text += "\nWireshark: " + f.wireshark_filter;
  return text + "\nhelp: ecaudit explain " + f.rule;
}

/// The findings of one rule at one place that count, as one failed test case.
TestCase Failure(const CaptureDigest& capture, const std::vector<const FindingDigest*>& findings) {
  const FindingDigest& first = *findings.front();
  TestCase test{first.rule + ", " + first.place, TestCase::Outcome::kFailed, first.title, {}, {}};
  if (first.frame != 0) test.message += " (frame " + std::to_string(first.frame) + ")";
  if (findings.size() > 1) test.message += ", and " + Count(findings.size() - 1, "more finding");
  Severity worst = first.severity;
  for (const FindingDigest* f : findings) {
    worst = std::max(worst, f->severity);
    test.text += (test.text.empty() ? "" : "\n\n") + Describe(capture, *f);
  }
  test.type = Name(worst);
  return test;
}

/// Why a rule was not evaluated: each reason once, with the slaves it holds for.
std::vector<std::string> Reasons(const CaptureDigest& capture, std::string_view rule) {
  std::vector<std::pair<std::string, std::string>> reasons;  // reason, places
  for (const NotJudged& entry : capture.not_judged) {
    if (entry.rule != rule) continue;
    const std::string place = PlaceOf(entry, capture.slave_names);
    const auto same = std::ranges::find_if(reasons, [&](const auto& r) { return r.first == entry.reason; });
    if (same == reasons.end()) {
      reasons.emplace_back(entry.reason, place);
    } else {
      same->second += ", " + place;
    }
  }
  std::vector<std::string> lines;
  for (const auto& [reason, places] : reasons) lines.push_back(places + ": " + reason);
  return lines;
}

TestCase Skipped(std::string name, const std::vector<std::string>& reasons) {
  TestCase test{std::move(name), TestCase::Outcome::kSkipped, reasons.front(), {}, {}};
  if (reasons.size() > 1) test.message += ", and " + Count(reasons.size() - 1, "more reason");
  for (const std::string& reason : reasons) test.text += (test.text.empty() ? "" : "\n") + reason;
  return test;
}

/// Why there was nothing to evaluate for any slave; empty when there was something.
std::string NothingToJudge(const CaptureDigest& capture, std::string_view rule) {
  for (const RuleCoverageDigest& entry : capture.coverage) {
    if (entry.rule == rule && entry.count.applicable() == 0) return entry.why;
  }
  return {};
}

/// What --require asks for, as a test of its own.
TestCase Required(const CaptureDigest& capture) {
  TestCase test{"required: " + capture.required, TestCase::Outcome::kPassed, {}, {}, {}};
  if (capture.unmet.empty()) return test;
  test.outcome = TestCase::Outcome::kFailed;
  test.type = "required";
  test.message = capture.unmet.front();
  if (capture.unmet.size() > 1) test.message += ", and " + std::to_string(capture.unmet.size() - 1) + " more";
  for (const std::string& missing : capture.unmet) test.text += (test.text.empty() ? "" : "\n") + missing;
  return test;
}

bool SwitchedOff(const CaptureDigest& capture, std::string_view rule) {
  return std::ranges::any_of(capture.rules,
                             [rule](const auto& setting) { return setting.first == rule && setting.second == "off"; });
}

std::vector<TestCase> TestCases(const Digest& digest, const CaptureDigest& capture) {
  if (!capture.unreadable.empty()) {
    return {{"capture can be read", TestCase::Outcome::kError, capture.unreadable, "unreadable", capture.unreadable}};
  }
  std::map<std::string, std::vector<std::vector<const FindingDigest*>>> failed;  // by rule, then by place
  for (const FindingDigest& f : capture.findings) {
    if (!Counts(capture, f)) continue;
    auto& places = failed[f.rule];
    const auto same = std::ranges::find_if(places, [&](const auto& group) { return group.front()->place == f.place; });
    if (same == places.end()) {
      places.push_back({&f});
    } else {
      same->push_back(&f);
    }
  }
  std::vector<TestCase> tests;
  if (!capture.required.empty()) tests.push_back(Required(capture));
  if (capture.without_ethercat && failed.empty()) {
    tests.push_back(Skipped("EtherCAT traffic", {"no EtherCAT frame among " + Count(capture.packets, "packet")}));
    return tests;
  }
  if (!capture.judged) return {Skipped("verdict", {HeadlinePartsOf(capture).sentence})};
  // A report of another version may know rules that this catalogue lacks.
  std::vector<std::string> rules;
  for (const RuleInfo* rule : digest.rules) rules.emplace_back(rule->id);
  for (const auto& [rule, findings] : failed) rules.push_back(rule);
  for (const NotJudged& entry : capture.not_judged) rules.push_back(entry.rule);
  std::ranges::sort(rules);
  rules.erase(std::unique(rules.begin(), rules.end()), rules.end());
  for (const std::string& rule : rules) {
    const std::vector<std::string> reasons = Reasons(capture, rule);
    const auto failures = failed.find(rule);
    if (failures != failed.end()) {
      for (const auto& findings : failures->second) tests.push_back(Failure(capture, findings));
    }
    if (!reasons.empty()) {
      tests.push_back(Skipped(rule, reasons));
    } else if (SwitchedOff(capture, rule)) {
      tests.push_back(Skipped(rule, {"switched off by --rule or the configuration file"}));
    } else if (const std::string why = NothingToJudge(capture, rule); !why.empty()) {
      tests.push_back(Skipped(rule, {"not applicable: " + why}));
    } else if (failures == failed.end()) {
      tests.push_back({rule, TestCase::Outcome::kPassed, {}, {}, {}});
    }
  }
  return tests;
}

void Write(XmlWriter& xml, const TestCase& test, const std::string& class_name) {
  xml.Begin("testcase").Attribute("name", test.name).Attribute("classname", class_name).Attribute("time", 0);
  const std::string_view element = test.outcome == TestCase::Outcome::kFailed    ? "failure"
                                   : test.outcome == TestCase::Outcome::kError   ? "error"
                                   : test.outcome == TestCase::Outcome::kSkipped ? "skipped"
                                                                                 : "";
  if (!element.empty()) {
    xml.Begin(element).Attribute("message", test.message);
    if (!test.type.empty()) xml.Attribute("type", test.type);
    xml.Text(test.text).End();
  }
  xml.End();
}

/// Findings that are reported but do not fail the run.
std::string OtherFindings(const CaptureDigest& capture) {
  std::string text = Headline(capture) + "\n";
  for (const FindingDigest& f : capture.findings) {
    if (Counts(capture, f)) continue;
    text += std::string(f.known ? "known " : "") + std::string(Name(f.severity)) + " " + f.rule + ", " + f.place +
            ", " + Where(f) + ": " + OneLine(f.title) + "\n";
  }
  return text;
}

struct Totals {
  std::uint64_t tests = 0, failures = 0, errors = 0, skipped = 0;

  void Add(const std::vector<TestCase>& cases) {
    tests += cases.size();
    const auto count = [&cases](TestCase::Outcome outcome) {
      return static_cast<std::uint64_t>(std::ranges::count(cases, outcome, &TestCase::outcome));
    };
    failures += count(TestCase::Outcome::kFailed);
    errors += count(TestCase::Outcome::kError);
    skipped += count(TestCase::Outcome::kSkipped);
  }
};

void Property(XmlWriter& xml, std::string_view name, std::string_view value) {
  xml.Begin("property").Attribute("name", name).Attribute("value", value).End();
}

void Suite(XmlWriter& xml, const Digest& digest, const CaptureDigest& capture, std::size_t index,
           const std::vector<TestCase>& tests) {
  Totals totals;
  totals.Add(tests);
  const std::string class_name = ClassName(capture.path);
  // Without zone and fraction, as the schemas have it.
  const std::string_view time = capture.first_time.size() < kNoTime.size()
                                    ? kNoTime
                                    : std::string_view(capture.first_time).substr(0, kNoTime.size());
  xml.Begin("testsuite").Attribute("name", capture.path).Attribute("package", class_name).Attribute("id", index);
  xml.Attribute("tests", totals.tests).Attribute("failures", totals.failures).Attribute("errors", totals.errors);
  xml.Attribute("skipped", totals.skipped).Attribute("time", 0).Attribute("timestamp", time);
  xml.Attribute("hostname", "localhost").Begin("properties");
  Property(xml, "ecaudit.version", digest.version);
  Property(xml, "fail_on", Name(capture.fail_on));
  if (const std::string limits = LimitsText(capture.selection); !limits.empty()) Property(xml, "limited_by", limits);
  if (!capture.baseline.empty()) Property(xml, "baseline", capture.baseline);
  if (capture.unreadable.empty() && capture.judged) Property(xml, "verdict", Summarise(capture).Verdict());
  if (capture.unreadable.empty() && capture.judged) {
    for (const Reservation& reservation : Reservations(capture)) Property(xml, "reservation", reservation.text);
  }
  xml.End();
  for (const TestCase& test : tests) Write(xml, test, class_name);
  xml.Begin("system-out").Text(OtherFindings(capture)).End();
  xml.Begin("system-err").End().End();
}

}  // namespace

std::string WriteJunit(const Digest& digest) {
  Totals totals;
  std::vector<std::vector<TestCase>> suites;
  for (const CaptureDigest& capture : digest.captures) totals.Add(suites.emplace_back(TestCases(digest, capture)));
  XmlWriter xml;
  xml.Begin("testsuites").Attribute("name", "ecaudit").Attribute("tests", totals.tests);
  xml.Attribute("failures", totals.failures).Attribute("errors", totals.errors).Attribute("time", 0);
  for (std::size_t i = 0; i < suites.size(); ++i) Suite(xml, digest, digest.captures[i], i, suites[i]);
  return xml.Take();
}

}  // namespace ecaudit::report
