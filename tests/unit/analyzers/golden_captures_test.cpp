// What must be found in captures of real hardware, in those of third-party stacks in the lab, and in our samples. The
// expectations come from what is known of how each was made (README.md and the truth files beside them, expected.json
// of the samples); frame numbers were looked up with Wireshark.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "analyzers/analysis.h"
#include "analyzers/judge/catalogue.h"
#include "analyzers/result/rule_info.h"
#include "cli/report/sentences.h"
#include "decoder/capture/capture_reader.h"
#include "tests/support/folders.h"

namespace ecaudit {
namespace {

namespace fs = std::filesystem;

constexpr int kBus = -1;

struct Want {
  const char* severity;
  const char* rule;
  int slave;                          ///< position, kBus
  FrameNo frame = 0;                  ///< 0: not known
  std::uint64_t count = 0;            ///< 0: not known
  const char* caused_by = nullptr;    ///< rule
  std::vector<FrameNo> related = {};  ///< among others
  FrameNo last = 0;                   ///< 0: not known
  const char* says = nullptr;         ///< in title or message
};
using Expected = std::vector<Want>;

const Expected kClean;

const std::map<std::string, Expected>& LabTable() {
  static const std::map<std::string, Expected> table = {
      // Eight wrong settings, each the cause of its own refusal; the moved SM2 lies in the buffers of SM3.
      {"bad-sm-config.pcapng",
       {{"error", "sm-mailbox-config", 0, 273, 1, nullptr, {270}, 273, "SM0: length 256 instead of 1024"},
        {"error", "al-refused", 0, 276, 2, "sm-mailbox-config", {273}, 278, "0x0017"},
        {"error", "sm-mailbox-config", 0, 287, 1, nullptr, {284}, 287, "SM0: start 0x1000 instead of 0x1800"},
        {"error", "al-refused", 0, 290, 2, "sm-mailbox-config", {287}, 292, "0x0017"},
        {"error", "sm-mailbox-config", 0, 301, 1, nullptr, {300}, 301, "SM1: direction"},
        {"error", "al-refused", 0, 304, 2, "sm-mailbox-config", {301}, 306, "0x0017"},
        {"error", "sm-mailbox-config", 0, 315, 1, nullptr, {314}, 315, "SM1: not enabled"},
        {"error", "al-refused", 0, 318, 2, "sm-mailbox-config", {315}, 320, "0x0017"},
        {"error", "sm-process-config", 0, 609, 1, nullptr, {608}, 609, "SM2: length 10 instead of 12"},
        {"error", "al-refused", 0, 612, 2, "sm-process-config", {609}, 614, "0x0017"},
        {"error", "sm-process-config", 0, 621, 1, nullptr, {620}, 621, "SM2: start 0x1180 instead of 0x1100"},
        {"error", "sm-overlap", 0, 621, 1, "sm-process-config", {620, 600}},
        {"error", "al-refused", 0, 624, 2, "sm-process-config", {621}, 626, "0x0017"},
        {"error", "sm-process-config", 0, 635, 1, nullptr, {634}, 635, "SM3: length 36 instead of 32"},
        {"error", "al-refused", 0, 638, 2, "sm-process-config", {635}, 640, "0x0017"},
        {"error", "sm-process-config", 0, 647, 1, nullptr, {646}, 647, "SM3: not enabled"},
        {"error", "al-refused", 0, 650, 2, "sm-process-config", {647}, 652, "0x0017"}}},
      {"dc.pcapng", kClean},
      // Three copies too many; nothing is lost. With a bit flipped in the length of its datagram (LRW 4002) a frame is
      // still one that slaves can read, with padding behind.
      {"disturbed-returns.pcapng",
       {{"warning", "frame-duplicated", kBus, 2923, 3},
        {"warning", "frame-reordered", kBus, 3925},
        {"warning", "capture-truncated", kBus, 5923, 1}}},
      // The drive is made to fault after LRW 1500 (outbound 3555): enabled in 3558 (0x1237), Fault in 3560 (0x0218).
      {"drive-fault.pcapng", {{"error", "drive-fault", 0, 3560, 1, nullptr, {3558}, 3560, "0x0218"}}},
      {"empty-no-packets.pcap", kClean},
      {"empty-no-packets.pcapng", kClean},
      {"empty-shb-only.pcapng", kClean},
      // A FoE read (275) and a FoE write (4511), each answered by mailbox error 0x0002 (280, 4516); EEPROM: CoE only.
      {"foe-unsupported.pcapng",
       {{"warning", "mailbox-unsupported-protocol", 0, 275, 2, nullptr, {280}, 4511, "FoE"},
        {"error", "mailbox-error-reply", 0, 280, 2, "mailbox-unsupported-protocol", {275, 4511}, 4516, "0x0002"}}},
      // Identity of an MKD-C, a power supply, with the objects of a drive: it accepts 60C2h, 6060h and its PDOs 1720h
      // and 1B20h all the same.
      {"garbage-blocklen-huge.pcapng",
       {{"warning", "capture-truncated", kBus, 3000},
        {"info", "sdo-unknown-object", 0, 321, 2, nullptr, {}, 329, "60C2h"},
        {"info", "sdo-unknown-object", 0, 337, 1, nullptr, {}, 337, "6060h"},
        {"info", "sdo-unknown-object", 0, 377, 6, nullptr, {}, 417, "1720h"},
        {"info", "sdo-unknown-object", 0, 449, 11, nullptr, {}, 529, "1B20h"}}},
      {"garbage-blocklen-zero.pcapng",
       {{"warning", "capture-truncated", kBus, 3000},
        {"info", "sdo-unknown-object", 0, 321, 2, nullptr, {}, 329, "60C2h"},
        {"info", "sdo-unknown-object", 0, 337, 1, nullptr, {}, 337, "6060h"},
        {"info", "sdo-unknown-object", 0, 377, 6, nullptr, {}, 417, "1720h"},
        {"info", "sdo-unknown-object", 0, 449, 11, nullptr, {}, 529, "1B20h"}}},
      // INIT to BOOT (frame 285) is allowed by the manual; the slave stack has no BOOT and answers 0x0013. 0x0012 for
      // state 5
      // is not in the manual.
      {"illegal-init-to-op.pcapng",
       {{"error", "al-illegal-transition", 0, 269, 1, nullptr, {}, 269, "OP requested in INIT"},
        {"error", "al-refused", 0, 272, 1, "al-illegal-transition", {269}},
        {"error", "al-illegal-transition", 0, 277, 1, nullptr, {}, 277, "SAFEOP requested in INIT"},
        {"error", "al-refused", 0, 280, 1, "al-illegal-transition", {277}},
        {"error", "al-refused", 0, 288, 1, nullptr, {285}, 288, "0x0013"},
        {"error", "al-invalid-request", 0, 293, 1},
        {"error", "al-refused", 0, 296, 1, "al-invalid-request", {293}},
        {"warning", "al-undocumented-status-code", 0, 296, 1, "al-refused", {}, 296, "0x0012"},
        {"error", "al-illegal-transition", 0, 305, 1, nullptr, {}, 305, "OP requested in PREOP"},
        {"error", "al-refused", 0, 308, 1, "al-illegal-transition", {305}},
        {"error", "al-illegal-transition", 0, 313, 1, nullptr, {}, 313, "BOOT requested in PREOP"},
        {"error", "al-refused", 0, 316, 1, "al-illegal-transition", {313}},
        {"error", "al-illegal-transition", 0, 601, 1, nullptr, {}, 601, "BOOT requested in SAFEOP"},
        {"error", "al-refused", 0, 604, 1, "al-illegal-transition", {601}},
        {"error", "al-illegal-transition", 0, 1125, 1, nullptr, {}, 1125, "BOOT requested in OP"},
        {"error", "al-refused", 0, 1168, 1, "al-illegal-transition", {1125}, 1168, "SAFEOP+ERR"}}},
      // Eight cycles in a row are not sent (between 8791 and 8793), later one. By its manual the drive faults if more
      // than 7 are missing while it is enabled; the emulated drive has no such supervision and stays enabled.
      {"jitter.pcapng", {{"error", "sync-lost", 0, 8793, 1, nullptr, {8791}, 8793, "8 frames"}}},
      {"kickcat-ingenia-info.pcapng", kClean},
      // LRW 2139: selector 1 before valid; 3019: read again, the enable bit held since 2319 and the selector back at 0
      // since 2719; 3219 and 3319: bits 13 and 4; 3419 and 3519: selectors 5 and 31.
      {"latch.pcapng",
       {{"error", "latch-read-before-valid", 0, 4833, 1, nullptr, {4793}, 4833, "external latch 1 rising"},
        {"warning", "latch-rearm-without-edge", 0, 6593, 1, nullptr, {5193, 5993}, 6593, "external latch 1 rising"},
        {"error", "latch-reserved-bits", 0, 6993, 2, nullptr, {}, 7193, "0x2001 and 0x0010"},
        {"error", "latch-invalid-selector", 0, 7393, 2, nullptr, {}, 7593, "0x0501 and 0x1f01"}}},
      {"legal-shortcuts.pcapng", kClean},
      {"lost-frames.pcapng", {{"error", "frame-lost", kBus, 0, 113}}},
      // Only the first emergency got into the mailbox; the lab gives it counter 1 where 3 would follow.
      {"mailbox-emergency.pcapng",
       {{"error", "emcy-received", 0, 292, 1, nullptr, {}, 292, "0x7305"},
        {"warning", "mailbox-counter", 0, 292, 1, nullptr, {288}, 292, "counter 1"}}},
      // A segmented upload (275) is abandoned; the next two requests are answered by mailbox error 0x0007.
      {"mailbox-error-reply.pcapng",
       {{"warning", "sdo-incomplete", 0, 275, 1, nullptr, {280}, 275, "2FF0h:0"},
        {"error", "mailbox-error-reply", 0, 288, 2, "sdo-incomplete", {283, 4623}, 4628, "0x0007"}}},
      // The mailbox read in 295 is lost; the repeat request is not fulfilled, the upload (291) gets no answer.
      {"mailbox-read-reply-lost.pcapng",
       {{"error", "frame-lost", kBus, 295, 1},
        {"error", "mailbox-no-response", 0, 291, 1, "frame-lost", {}, 291, "1000h:0"}}},
      // The slave never takes the request (275); the next two are refused (working counter 0).
      {"mailbox-timeout.pcapng",
       {{"error", "mailbox-no-response", 0, 275, 1, nullptr, {}, 275, "still full"},
        {"error", "mailbox-overrun", 0, 0, 2, "mailbox-no-response", {275}}}},
      {"mid-run.pcapng", kClean},
      {"mixed-traffic.pcapng", kClean},
      {"no-ack-after-error.pcapng",
       {{"error", "al-illegal-transition", 0, 269, 1},
        {"error", "al-refused", 0, 272, 7, "al-illegal-transition", {269}, 296},
        {"error", "al-error-not-acknowledged", 0, 273, 6, nullptr, {272}, 293}}},
      {"one-slave-refuses.pcapng",
       {{"error", "sm-process-config", 1, 1269, 1, nullptr, {1268}, 1269, "SM2: length 11 instead of 12"},
        {"error", "al-refused", 1, 1314, 1, "sm-process-config", {1269}, 1314, "0x0017"}}},
      // Eleven aborts; two of uploads of what does not exist. 588 has its code four bytes too late. The SDO information
      // error (956) has a length that leaves its code out.
      {"sdo-mix.pcapng",
       {{"error", "sdo-abort", 0, 492, 1, nullptr, {487}, 492, "0x06010000"},
        {"info", "sdo-abort", 0, 516, 1, nullptr, {511}, 516, "0x06020000"},
        {"info", "sdo-abort", 0, 524, 1, nullptr, {519}, 524, "0x06090011"},
        {"error", "sdo-abort", 0, 532, 1, nullptr, {527}, 532, "0x06020000"},
        {"error", "sdo-write-read-only", 0, 535, 1, nullptr, {540}, 535, "1000h:0"},
        {"error", "sdo-abort", 0, 540, 1, "sdo-write-read-only", {535}, 540, "0x06010002"},
        {"error", "sdo-write-read-only", 0, 543, 1, nullptr, {548}, 543, "1018h:1"},
        {"error", "sdo-abort", 0, 548, 1, "sdo-write-read-only", {543}, 548, "0x06010002"},
        {"error", "sdo-abort", 0, 556, 1, nullptr, {551}, 556, "0x06010001"},
        {"error", "sdo-wrong-size", 0, 567, 1, nullptr, {572}, 567, "6071h:0"},
        {"error", "sdo-abort", 0, 572, 1, "sdo-wrong-size", {567}, 572, "0x06070010"},
        {"error", "sdo-wrong-size", 0, 575, 1, nullptr, {580}, 575, "60FFh:0"},
        {"error", "sdo-abort", 0, 580, 1, "sdo-wrong-size", {575}, 580, "0x06070010"},
        {"error", "sdo-wrong-size", 0, 583, 1, nullptr, {588}, 583, "60FFh:0"},
        {"error", "sdo-abort", 0, 588, 1, "sdo-wrong-size", {583}, 588, "0x00000008"},
        {"error", "sdo-abort", 0, 596, 1, nullptr, {591}, 596, "0x06010002"},
        {"error", "mailbox-malformed", 0, 956, 1, nullptr, {951}, 956, "0x06020000"}}},
      {"soem-ec-sample.pcapng", kClean},
      {"soem-eepromtool-info.pcapng", kClean},
      {"soem-eepromtool-read.pcapng", kClean},
      {"soem-slaveinfo-akd.pcapng", kClean},
      // By complete access SOEM takes parts of mapping entries for objects and asks for them: nothing is changed.
      {"soem-slaveinfo-akdca.pcapng",
       {{"info", "sdo-abort", 0, 294, 1, nullptr, {289}, 294, "0017h"},
        {"info", "sdo-abort", 0, 310, 1, nullptr, {305}, 310, "001Bh"}}},
      {"startup-40slaves-2frames.pcapng", kClean},
      {"startup-ok-1slave-be-nsec.pcap", kClean},
      {"startup-ok-1slave-be-usec.pcap", kClean},
      {"startup-ok-1slave-be.pcapng", kClean},
      {"startup-ok-1slave-cooked.pcapng", kClean},
      {"startup-ok-1slave-nsec.pcap", kClean},
      {"startup-ok-1slave-outbound-only.pcapng", {{"info", "capture-one-direction", kBus, 1}}},
      {"startup-ok-1slave-pdo1701.pcapng", kClean},
      {"startup-ok-1slave-qinq.pcapng", kClean},
      {"startup-ok-1slave-return-only.pcapng", {{"info", "capture-one-direction", kBus, 1}}},
      {"startup-ok-1slave-spb.pcapng", {{"info", "capture-timestamps", kBus, 1}}},
      {"startup-ok-1slave-tap2if.pcapng", kClean},
      {"startup-ok-1slave-tsresol2e30.pcapng", kClean},
      {"startup-ok-1slave-tsresol6.pcapng", kClean},
      {"startup-ok-1slave-udp.pcapng", kClean},
      {"startup-ok-1slave-usec.pcap", kClean},
      {"startup-ok-1slave-vlan.pcapng", kClean},
      {"startup-ok-1slave.pcapng", kClean},
      {"startup-ok-3slaves.pcapng", kClean},
      {"truncated-block-header.pcapng", {{"warning", "capture-truncated", kBus, 5000}}},
      {"truncated-mid-packet.pcap", {{"warning", "capture-truncated", kBus, 5000}}},
      {"truncated-mid-packet.pcapng", {{"warning", "capture-truncated", kBus, 5000}}},
      {"truncated-record-header.pcap", {{"warning", "capture-truncated", kBus, 5000}}},
      // The master pauses for 301.451 ms (2795 to 2799), the watchdog is 100 ms. The manual does not list its code.
      {"watchdog-sm.pcapng",
       {{"error", "sync-watchdog-margin", 0, 2799, 1, nullptr, {2795, 2798}, 2799, "301.451 ms"},
        {"error", "al-unexpected-change", 0, 2798, 2, "sync-watchdog-margin", {770}, 2900, "0x001b"},
        {"warning", "al-undocumented-status-code", 0, 2798, 1, "al-unexpected-change"}}},
      // 2000 process-data frames with working counter 6 instead of 9. Between them nothing counts the slaves.
      {"wkc-error-link-break.pcapng", {{"error", "wkc-mismatch", 2, 5288, 2000, nullptr, {}, 9286, "6 instead of 9"}}},
  };
  return table;
}

const std::map<std::string, Expected>& RealTable() {
  static const std::map<std::string, Expected> table = {
      {"replay-dc.pcapng", kClean},
      // ethercrab writes a station alias and the checksum over it, twice: the reader has to know, nothing is wrong.
      {"replay-ek1100-alias-address.pcapng",
       {{"info", "eeprom-written", 0, 1202, 4, nullptr, {}, 1290, "station alias"}}},
      {"replay-ek1914-no-complete-access.pcapng", kClean},
      {"replay-ek1914-segmented-upload.pcapng", kClean},
      {"rs-example-sii-el2004.pcapng", kClean},
      // SAFEOP requested in 743, refused from 760 on, the code only read in 6758. All lengths agree; the default
      // mapping that the master keeps has an odd length, and 6040h and 6041h four times: that this is why is an
      // inference. Three outbound frames without return; an ARP packet follows each of them.
      {"soem-sdinfo-akd.pcapng",
       {{"warning",
         "pdo-mapping-rule",
         0,
         6758,
         1,
         nullptr,
         {743, 506},
         6758,
         "Rx mapping has an odd length of 17 bytes"},
        {"info", "pdo-mapping-rule", 0, 6758, 1, nullptr, {743, 734}, 6758, "Tx mapping has an odd length of 17 bytes"},
        {"warning", "pdo-object-mapped-twice", 0, 743, 1, nullptr, {506}, 743, "6040h:0 is mapped 4 times in the Rx"},
        {"warning", "pdo-object-mapped-twice", 0, 743, 1, nullptr, {734}, 743, "6041h:0 is mapped 4 times in the Tx"},
        {"error", "al-refused", 0, 760, 0, "pdo-mapping-rule", {743, 6758}, 6762, "0x001d"},
        {"warning", "al-undocumented-status-code", 0, 6758, 1, "al-refused"},
        {"error", "frame-lost", kBus, 4607, 3, nullptr, {5457, 6455}, 6455, "3 frames of 3,381"}}},
      {"soem-single-lan9252.pcapng", kClean},
      {"twincat-run-ek1100-el1004.pcapng", {{"info", "capture-timestamps", kBus, 1}}},
      {"twincat-scan-boxes.pcapng", {{"info", "capture-timestamps", kBus, 1}}},
      {"twincat-scan-devices.pcapng", {{"info", "capture-one-direction", kBus, 1}}},
  };
  return table;
}

/// Damaged at random: whatever is found, the program must come through. Or no captures at all.
bool AnythingGoes(const std::string& name) {
  return name == "garbage-flipped-startup-ok-1slave.pcapng" || name == "garbage-random.pcapng" ||
         name == "empty-zero-length.pcapng" || name == "truncated-file-header.pcap";
}

std::string Describe(const Finding& finding, const AnalysisResult& result) {
  const SlaveSummary* slave = result.slave(finding.slave);
  return std::string(Name(finding.severity)) + " " + std::string(finding.rule) + " slave " +
         (slave == nullptr ? "-" : std::to_string(slave->position)) + " frame " + std::to_string(finding.first.number) +
         " to " + std::to_string(finding.last.number) + " count " + std::to_string(finding.count) + ": " +
         report::TitleOf(finding);
}

bool Matches(const Want& want, const Finding& finding, const AnalysisResult& result) {
  const SlaveSummary* slave = result.slave(finding.slave);
  const int position = slave == nullptr ? kBus : slave->position;
  const std::string_view cause =
      finding.caused_by == kNoFinding ? std::string_view() : result.findings[finding.caused_by].rule;
  const std::string told = report::TitleOf(finding) + "\n" + report::MessageOf(finding, result);
  return Name(finding.severity) == want.severity && finding.rule == want.rule && position == want.slave &&
         (want.frame == 0 || finding.first.number == want.frame) && (want.count == 0 || finding.count == want.count) &&
         cause == (want.caused_by == nullptr ? "" : want.caused_by) &&
         (want.last == 0 || finding.last.number == want.last) &&
         (want.says == nullptr || told.find(want.says) != std::string::npos) &&
         std::all_of(want.related.begin(), want.related.end(), [&](FrameNo frame) {
           return std::find(finding.related_frames.begin(), finding.related_frames.end(), frame) !=
                  finding.related_frames.end();
         });
}

std::vector<fs::path> CapturesIn(const fs::path& folder) {
  std::vector<fs::path> captures;
  if (!fs::exists(folder)) return captures;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".pcapng" || entry.path().extension() == ".pcap") captures.push_back(entry.path());
  }
  std::sort(captures.begin(), captures.end());
  return captures;
}

/// Those of a folder beside the project. Where it is absent, the folder itself, for a test that says so.
std::vector<fs::path> SharedCaptures(const char* name) {
  const fs::path folder = fs::path(test::SharedDir()) / "captures" / name;
  std::vector<fs::path> captures = CapturesIn(folder);
  if (captures.empty()) captures.push_back(folder);
  return captures;
}

void Check(const fs::path& path, const std::map<std::string, Expected>& table) {
  if (!fs::exists(path)) GTEST_SKIP() << path << " is absent";
  const std::string name = path.filename().string();
  auto source = capture::OpenCapture(path.string());
  if (AnythingGoes(name)) {
    if (source) (void)Analyse(**source, {});
    return;
  }
  const auto expected = table.find(name);
  ASSERT_NE(expected, table.end()) << "no expectation is written for " << name;
  ASSERT_TRUE(source) << source.error().message;
  const AnalysisResult result = Analyse(**source, {});
  std::vector<bool> used(result.findings.size(), false);
  for (const Want& want : expected->second) {
    bool found = false;
    for (std::size_t i = 0; i < result.findings.size() && !found; ++i) {
      if (!used[i] && Matches(want, result.findings[i], result)) found = used[i] = true;
    }
    EXPECT_TRUE(found) << "not found: " << want.severity << " " << want.rule << " slave " << want.slave << " frame "
                       << want.frame << " count " << want.count;
  }
  for (std::size_t i = 0; i < result.findings.size(); ++i) {
    EXPECT_TRUE(used[i]) << "not expected: " << Describe(result.findings[i], result);
  }
}

std::string NameOf(const ::testing::TestParamInfo<fs::path>& info) {
  std::string name = info.param.filename().string();
  for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  return name;
}

class LabCapture : public ::testing::TestWithParam<fs::path> {};
TEST_P(LabCapture, FindsWhatIsKnownOfIt) {
  Check(GetParam(), LabTable());
}
INSTANTIATE_TEST_SUITE_P(Golden, LabCapture, ::testing::ValuesIn(SharedCaptures("lab")), NameOf);

class RealCapture : public ::testing::TestWithParam<fs::path> {};
TEST_P(RealCapture, FindsWhatIsKnownOfIt) {
  Check(GetParam(), RealTable());
}
INSTANTIATE_TEST_SUITE_P(Golden, RealCapture, ::testing::ValuesIn(SharedCaptures("real")), NameOf);

TEST(GoldenCaptures, TablesNameRulesOfTheCatalogue) {
  for (const auto* table : {&LabTable(), &RealTable()}) {
    for (const auto& [name, expected] : *table) {
      for (const Want& want : expected) {
        EXPECT_NE(FindRule(want.rule), nullptr) << name << ": " << want.rule;
        if (want.caused_by != nullptr) EXPECT_NE(FindRule(want.caused_by), nullptr) << name << ": " << want.caused_by;
      }
    }
  }
}

TEST(GoldenCaptures, TablesNameFilesThatExist) {
  const fs::path captures = fs::path(test::SharedDir()) / "captures";
  if (!fs::exists(captures)) GTEST_SKIP() << "the captures of the lab are absent";
  for (const auto& [name, expected] : LabTable()) EXPECT_TRUE(fs::exists(captures / "lab" / name)) << name;
  for (const auto& [name, expected] : RealTable()) EXPECT_TRUE(fs::exists(captures / "real" / name)) << name;
}

// --- our own samples
// --------------------------------------------------------------------------------------------------

class Sample : public ::testing::TestWithParam<fs::path> {};

bool FrameFits(const nlohmann::json& wanted, FrameNo frame) {
  const FrameNo sent = wanted.value("sent", FrameNo{0});
  const FrameNo returned = wanted.value("returned", FrameNo{0});
  if (sent == 0 && returned == 0) return true;
  if (frame == sent || frame == returned) return true;
  return wanted.contains("until") && frame >= std::max(sent, returned) && frame <= wanted["until"].get<FrameNo>();
}

TEST_P(Sample, ReportHoldsWhatItWasMadeFor) {
  std::ifstream file(fs::path(test::SourceDir()) / "samples/captures/expected.json");
  const nlohmann::json all = nlohmann::json::parse(file, nullptr, false);
  ASSERT_TRUE(all.is_object());
  const std::string name = GetParam().filename().string();
  ASSERT_TRUE(all.contains(name)) << name << " is not in expected.json";
  auto source = capture::OpenCapture(GetParam().string());
  ASSERT_TRUE(source) << source.error().message;
  const AnalysisResult result = Analyse(**source, {});

  std::vector<bool> used(result.findings.size(), false);
  for (const nlohmann::json& wanted : all[name]["findings"]) {
    const std::string rule = wanted["rule"];
    EXPECT_NE(FindRule(rule), nullptr) << rule << " is not in the catalogue";
    bool found = false;
    for (std::size_t i = 0; i < result.findings.size(); ++i) {
      const Finding& finding = result.findings[i];
      const SlaveSummary* slave = result.slave(finding.slave);
      const bool same_slave = wanted["slave"].is_null() || (slave != nullptr && slave->position == wanted["slave"]);
      if (used[i] || finding.rule != rule || !same_slave || !FrameFits(wanted, finding.first.number)) continue;
      if (wanted.contains("count") && finding.count != wanted["count"].get<std::uint64_t>()) continue;
      found = used[i] = true;
      break;
    }
    EXPECT_TRUE(found || wanted.value("optional", false)) << "not found: " << wanted.dump();
  }
  for (std::size_t i = 0; i < result.findings.size(); ++i) {
    if (result.findings[i].severity == Severity::kInfo) continue;
    EXPECT_TRUE(used[i]) << "not expected: " << Describe(result.findings[i], result);
  }
}

INSTANTIATE_TEST_SUITE_P(Golden, Sample,
                         ::testing::ValuesIn(CapturesIn(fs::path(test::SourceDir()) / "samples/captures")), NameOf);

}  // namespace
}  // namespace ecaudit
