#include "cli/report/junit_writer.h"

#include <array>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/cli/sample_result.h"

namespace ecaudit::report {
namespace {

using test::MakeFinding;
using test::OneReport;
using test::RefusedSafeop;
using ::testing::HasSubstr;
using ::testing::Not;

RuleInfo Rule(std::string_view id, Severity severity) {
  RuleInfo rule{};
  rule.id = id;
  rule.severity = severity;
  rule.title = "title";
  return rule;
}

const RuleInfo kRefused = Rule("al-refused", Severity::kError);
const RuleInfo kLost = Rule("frame-lost", Severity::kError);
const RuleInfo kAbort = Rule("sdo-abort", Severity::kError);
const RuleInfo kSync = Rule("sync-lost", Severity::kError);
const std::array<const RuleInfo*, 4> kRules{&kRefused, &kLost, &kAbort, &kSync};

Digest DigestWith(CaptureReport capture) {
  Report report = OneReport(std::move(capture));
  report.rules = kRules;
  return DigestOf(report);
}

// Written by hand from the forms that Jenkins (junit-10.xsd) and windyroad (JUnit.xsd) describe.
constexpr std::string_view kOneCapture = R"xml(<?xml version="1.0" encoding="UTF-8"?>
<testsuites name="ecaudit" tests="4" failures="1" errors="0" time="0">
  <testsuite name="lab/akd.pcapng" package="lab.akd_pcapng" id="0" tests="4" failures="1" errors="0" skipped="2" time="0" timestamp="2019-05-01T12:00:00" hostname="localhost">
    <properties>
      <property name="ecaudit.version" value="1.2.3"/>
      <property name="fail_on" value="error"/>
      <property name="verdict" value="fail"/>
    </properties>
    <testcase name="al-refused, slave 0 (AKD, 0x1001)" classname="lab.akd_pcapng" time="0">
      <failure message="SAFEOP refused with AL status code 0x001d (frame 760)" type="error">error al-refused, slave 0 (AKD, 0x1001), frame 760 at 0.759000 s (12:00:00.759 UTC), seen 5,999 times, last in frame 6762
SAFEOP refused with AL status code 0x001d
The slave &lt;stayed&gt; in PREOP &amp; waits
source: AKD EtherCAT Communication, 4.3
Wireshark: frame.number==760 || frame.number==6762 || frame.number==743
help: ecaudit explain al-refused</failure>
    </testcase>
    <testcase name="frame-lost" classname="lab.akd_pcapng" time="0">
      <skipped message="bus: the end is not in the capture">bus: the end is not in the capture</skipped>
    </testcase>
    <testcase name="sdo-abort" classname="lab.akd_pcapng" time="0"/>
    <testcase name="sync-lost" classname="lab.akd_pcapng" time="0">
      <skipped message="slave 0: DC is not in the capture">slave 0: DC is not in the capture</skipped>
    </testcase>
    <system-out>FAIL lab/akd.pcapng: slave 0 (AKD, 0x1001): SAFEOP refused with AL status code 0x001d (frame 760)
</system-out>
    <system-err/>
  </testsuite>
</testsuites>
)xml";

TEST(JunitWriter, OneCapture) {
  CaptureReport capture = RefusedSafeop();
  capture.result.capture.file.path = "lab/akd.pcapng";
  test::SetTexts(capture.result.findings[0], "SAFEOP refused with AL status code 0x001d",
                 "The slave <stayed> in PREOP & waits");
  EXPECT_EQ(WriteJunit(DigestWith(capture)), kOneCapture);
}

TEST(JunitWriter, FindingsOfOneRuleAtOneSlaveAreOneCase) {
  CaptureReport capture = RefusedSafeop();
  capture.result.findings.push_back(MakeFinding("al-refused", Severity::kError, 7, 800));
  capture.result.findings.push_back(MakeFinding("al-refused", Severity::kError, kNoSlave, 801, 0));
  const std::string xml = WriteJunit(DigestWith(capture));
  EXPECT_THAT(xml, HasSubstr("failures=\"2\""));
  EXPECT_THAT(xml, HasSubstr("(frame 760), and 1 more finding\""));
  EXPECT_THAT(xml, HasSubstr("name=\"al-refused, bus\""));
  EXPECT_THAT(xml, HasSubstr("consequence of al-refused: SAFEOP refused with AL status code 0x001d (frame 760)"));
}

TEST(JunitWriter, FindingsThatDoNotCountAreOutput) {
  CaptureReport capture = RefusedSafeop();
  capture.fail_on = FailOn::kNever;
  const std::string xml = WriteJunit(DigestWith(capture));
  EXPECT_THAT(xml, Not(HasSubstr("<failure")));
  EXPECT_THAT(xml, HasSubstr("<testcase name=\"al-refused\" classname=\"akd_pcapng\" time=\"0\"/>"));
  EXPECT_THAT(xml, HasSubstr("error al-refused, slave 0 (AKD, 0x1001), frame 760"));
}

TEST(JunitWriter, PathsBecomeClasses) {
  const std::array<std::pair<std::string, std::string>, 4> paths{
      {{"/data/a.b/x.pcap", "data.a_b.x_pcap"}, {"../x.pcap", "up.x_pcap"}, {"./x.pcap", "x_pcap"}, {"-", "-"}}};
  for (const auto& [path, name] : paths) {
    CaptureReport capture = RefusedSafeop();
    capture.result.capture.file.path = path;
    EXPECT_THAT(WriteJunit(DigestWith(capture)), HasSubstr("package=\"" + name + "\"")) << path;
  }
}

TEST(JunitWriter, NoCapture) {
  EXPECT_EQ(WriteJunit(Digest{}),
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
            "<testsuites name=\"ecaudit\" tests=\"0\" failures=\"0\" errors=\"0\" time=\"0\"/>\n");
}

}  // namespace
}  // namespace ecaudit::report
