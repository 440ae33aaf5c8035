#include "decoder/bus/frame_ledger.h"

#include <filesystem>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "decoder/bus/traffic_reader.h"
#include "decoder/capture/capture_reader.h"
#include "tests/support/folders.h"
#include "tests/unit/bus/pairing_log.h"

namespace ecaudit::bus::test {
namespace {

TEST(FrameLedger, EachReasonHasItsOwnDescription) {
  std::set<std::string> texts;
  for (std::size_t i = 0; i < kUndecidedReasons; ++i) texts.insert(std::string(Describe(static_cast<Undecided>(i))));
  EXPECT_EQ(texts.size(), kUndecidedReasons);
}

/// One of each fate, and all at the same time.
TEST(FrameLedger, BalancesAfterEachPacket) {
  Result<Trace> trace = Trace::Parse(R"(
+0us  FPRD 0x1001:0x0130 01 00 idx=1
+1ms  FPRD 0x1001:0x0130 01 00 idx=2 @lost
+2ms  FPRD 0x1001:0x0130 01 00 idx=2
+1ms  FPRD 0x1001:0x0130 01 00 idx=3 @twice
+1ms  LRW 0x1000 01 02 idx=4 @returned-only
+1ms  LRW 0x1000 01 02 idx=5 @cut=20
+90ms LRW 0x1000 01 02 idx=6 rtt=5ms
+1ms  LRW 0x1000 01 02 idx=7
+1ms  LRW 0x1000 01 02 idx=8 @lost
)");
  ASSERT_TRUE(trace);
  const std::vector<Packet> packets = trace->Packets();
  for (std::size_t n = 0; n <= packets.size(); ++n) {
    const Paired result =
        PairUp(std::vector<Packet>(packets.begin(), packets.begin() + static_cast<std::ptrdiff_t>(n)));
    EXPECT_TRUE(result.statistics.frames().Balances()) << n;
  }
}

/// True where the sum holds behind each packet of the capture.
void ExpectBalance(const std::filesystem::path& path) {
  Result<std::unique_ptr<capture::FrameSource>> source = capture::OpenCapture(path.string());
  if (!source) return;  // one of those that are no captures
  const PacketRange all;
  PairingLog log;
  TrafficReader reader(**source, all, nullptr, log);
  std::uint64_t off = 0;
  for (auto got = reader.Next(); got != TrafficReader::Got::kEnd; got = reader.Next()) {
    if (got != TrafficReader::Got::kPacket) continue;
    reader.Pair();
    if (!reader.statistics().frames().Balances()) ++off;
  }
  reader.Finish();
  const FrameLedger last = reader.statistics().frames();
  if (!last.Balances()) ++off;
  EXPECT_EQ(off, 0U) << path;
  EXPECT_LE(last.in_flight, 256U) << path;
}

void ExpectBalanceIn(const std::filesystem::path& folder) {
  std::error_code error;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder, error)) {
    const std::string type = entry.path().extension().string();
    if (type == ".pcap" || type == ".pcapng" || type == ".zst" || type == ".gz") ExpectBalance(entry.path());
  }
}

TEST(FrameLedger, BalancesForEverySample) {
  ExpectBalanceIn(std::filesystem::path(ecaudit::test::SourceDir()) / "samples/captures");
}

TEST(FrameLedger, BalancesForEverySharedCapture) {
  const std::filesystem::path shared = std::filesystem::path(ecaudit::test::SharedDir()) / "captures";
  if (!std::filesystem::exists(shared)) GTEST_SKIP() << "no shared captures";
  ExpectBalanceIn(shared);
}

}  // namespace
}  // namespace ecaudit::bus::test
