// The rules of the synchronisation chapter over real and lab captures: every fault of the truth files at its frame, and
// nothing else anywhere.
#include <algorithm>
#include <map>

#include <gtest/gtest.h>

#include "tests/support/folders.h"
#include "tests/unit/sync/sync_test_support.h"

namespace ecaudit::test {
namespace {

namespace fs = std::filesystem;

/// rule, severity, frame, count
struct Want {
  const char* rule;
  Severity severity;
  FrameNo frame;
  std::uint64_t count;
};

std::vector<const Finding*> SyncFindings(const AnalysisResult& result) {
  std::vector<const Finding*> found;
  for (const Finding& finding : result.findings) {
    if (finding.rule.starts_with("sync-")) found.push_back(&finding);
  }
  return found;
}

void Expect(const AnalysisResult& result, const std::vector<Want>& wanted) {
  const auto found = SyncFindings(result);
  for (const Want& want : wanted) {
    EXPECT_TRUE(std::any_of(found.begin(), found.end(),
                            [&](const Finding* f) {
                              return f->rule == want.rule && f->severity == want.severity &&
                                     f->first.number == want.frame && f->count == want.count;
                            }))
        << "not found: " << want.rule << " in frame " << want.frame << ", " << want.count << " times";
  }
  for (const Finding* f : found) {
    EXPECT_TRUE(std::any_of(wanted.begin(), wanted.end(),
                            [&](const Want& want) { return f->rule == want.rule && f->first.number == want.frame; }))
        << "not expected: " << f->rule << " in frame " << f->first.number << ": " << IdentityOf(*f);
  }
}

bool Related(const AnalysisResult& result, std::string_view rule, FrameNo first, const std::vector<FrameNo>& frames) {
  for (const Finding& f : result.findings) {
    if (f.rule != rule || f.first.number != first) continue;
    return std::all_of(frames.begin(), frames.end(), [&](FrameNo frame) {
      return std::find(f.related_frames.begin(), f.related_frames.end(), frame) != f.related_frames.end();
    });
  }
  return false;
}

// Outputs of cycles by the truth file (packet numbers): 2793 and 2795 are 400 us late, 4793 300 us early, 5793 150 us
// and 6793 400 us late, before 8793 eight cycles are skipped, 9777 is 900 us late, 10177 450 us early, before 11777 one
// is skipped.
TEST(SyncRuleCaptures, JitterByTheManualOfTheAkd) {
  const auto packets = LoadPackets("lab/jitter.pcapng");
  if (packets.empty()) GTEST_SKIP() << "the captures of the lab are absent";
  // Without SYNC0 an AKD has no jitter limit; more than seven missing frames are F125.
  Expect(AnalysePackets(packets), {{"sync-lost", Severity::kError, 8793, 1}});
}

TEST(SyncRuleCaptures, JitterByTheManualOfThePilzDrive) {
  const auto packets = LoadPackets("lab/jitter.pcapng");
  if (packets.empty()) GTEST_SKIP() << "the captures of the lab are absent";
  AnalysisOptions options;
  options.default_profile = "pilz-pmcprotego-d";
  const AnalysisResult result = AnalysePackets(packets, options);
  // A frame that is 900 us late misses its own cycle.
  Expect(result, {{"sync-window-violation", Severity::kError, 2793, 4},
                  {"sync-window-violation", Severity::kError, 8793, 3},
                  {"sync-lost", Severity::kError, 2795, 2}});
  EXPECT_TRUE(Related(result, "sync-window-violation", 2793, {2795, 6793, 10177}));
  EXPECT_TRUE(Related(result, "sync-window-violation", 8793, {9777, 11777}));
}

TEST(SyncRuleCaptures, WithoutAClockNothingIsJudged) {
  auto packets = LoadPackets("lab/jitter.pcapng");
  if (packets.empty()) GTEST_SKIP() << "the captures of the lab are absent";
  std::uint64_t random = 1;
  for (Packet& packet : packets) {
    random = random * 6364136223846793005U + 1442695040888963407U;
    packet.time = static_cast<TimeNs>(random >> 2U);
  }
  for (const char* profile : {"", "pilz-pmcprotego-d"}) {
    AnalysisOptions options;
    options.default_profile = profile;
    Expect(AnalysePackets(packets, options), {});
  }
}

TEST(SyncRuleCaptures, DcTimeServesWhereStampsAreGarbage) {
  auto packets = LoadPackets("lab/dc.pcapng");
  if (packets.empty()) GTEST_SKIP() << "the captures of the lab are absent";
  std::uint64_t random = 1;
  for (Packet& packet : packets) {
    random = random * 6364136223846793005U + 1442695040888963407U;
    packet.time = static_cast<TimeNs>(random >> 2U);
  }
  // From the 1000th cyclic frame on 16 leave the capture, both copies: eight cycles and more without outputs. They are
  // as many as the master has indices, so that it seems to have paused.
  std::vector<Packet> cut;
  std::size_t cyclic = 0;
  for (Packet& packet : packets) {
    const bool lrw = packet.bytes.size() > 100 && packet.bytes.size() < 200 && packet.bytes[16] == 12;
    cyclic += lrw ? 1 : 0;
    if (lrw && cyclic > 2000 && cyclic <= 2032) continue;
    cut.push_back(packet);
  }
  const AnalysisResult result = AnalysePackets(cut);
  const auto found = SyncFindings(result);
  EXPECT_EQ(std::count_if(found.begin(), found.end(), [](const Finding* f) { return f->rule == "sync-lost"; }), 3);
  EXPECT_EQ(
      std::count_if(found.begin(), found.end(), [](const Finding* f) { return f->rule == "sync-window-violation"; }),
      3);
  EXPECT_EQ(found.size(), 6U);
}

// The master pauses for 300 ms, the watchdog is 100 ms.
TEST(SyncRuleCaptures, WatchdogOfTheSyncManager) {
  const auto packets = LoadPackets("lab/watchdog-sm.pcapng");
  if (packets.empty()) GTEST_SKIP() << "the captures of the lab are absent";
  const AnalysisResult result = AnalysePackets(packets);
  Expect(result, {{"sync-watchdog-margin", Severity::kError, 2799, 1}});
  const auto change = std::find_if(result.findings.begin(), result.findings.end(),
                                   [](const Finding& f) { return f.rule == "al-unexpected-change"; });
  ASSERT_NE(change, result.findings.end());
  ASSERT_LT(change->caused_by, result.findings.size());
  EXPECT_EQ(result.findings[change->caused_by].rule, "sync-watchdog-margin");
}

/// Every other capture: no fault of synchronisation is in any of them.
TEST(SyncRuleCaptures, NothingIsInvented) {
  const fs::path captures = fs::path(test::SharedDir()) / "captures";
  if (!fs::exists(captures)) GTEST_SKIP() << "the captures of the lab are absent";
  for (const char* folder : {"lab", "real"}) {
    for (const auto& entry : fs::directory_iterator(captures / folder)) {
      const std::string name = entry.path().filename().string();
      if (!name.ends_with(".pcapng") && !name.ends_with(".pcap")) continue;
      if (name == "jitter.pcapng" || name == "watchdog-sm.pcapng" || name.starts_with("garbage")) continue;
      SCOPED_TRACE(name);
      auto source = capture::OpenCapture(entry.path().string());
      if (source) Expect(Analyse(**source, {}), {});
    }
  }
}

}  // namespace
}  // namespace ecaudit::test
