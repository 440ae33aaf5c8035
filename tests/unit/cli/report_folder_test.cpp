#include "cli/report_folder.h"

#include <gtest/gtest.h>

#include "cli/file_list.h"
#include "cli/report/fingerprint.h"

namespace ecaudit::cli {
namespace {

// The test vectors of the authors of FNV.
TEST(StableHash, IsFnv1a) {
  EXPECT_EQ(report::StableHash(""), 0xCBF29CE484222325U);
  EXPECT_EQ(report::StableHash("a"), 0xAF63DC4C8601EC8CU);
  EXPECT_EQ(report::StableHash("foobar"), 0x85944171F73967E8U);
}

TEST(ReportName, IsNameAndHashOfThePath) {
  // FNV-1a of "foobar" begins with 85944171f739.
  EXPECT_EQ(ReportName("foobar"), "foobar-85944171f739.json");
  EXPECT_NE(ReportName("a/x.pcap"), ReportName("b/x.pcap"));
  EXPECT_EQ(ReportName("a/x.pcap").substr(0, 7), "x.pcap-");
}

TEST(ReportName, FitsAFileSystem) {
  const std::string name = ReportName(std::string(255, 'x'));
  EXPECT_LE(name.size() + 7, 255U);  // with the ending of a temporary file
  EXPECT_EQ(ReportName("a/\n\x1b.pcap").substr(0, 8), "__.pcap-");
}

TEST(FileList, NamesOfCaptures) {
  for (const char* name : {"a.pcap", "a.pcapng", "A.PCAP", "a.cap", "a.pcap0", "a.pcap17", "a.pcap.gz", "a.cap.zst"}) {
    EXPECT_TRUE(IsCaptureName(name)) << name;
  }
  for (const char* name : {"pcap", "a.pcapx", "a.pcap1x", "a.json", "a.gz", "a", "", "a.pcapng.txt"}) {
    EXPECT_FALSE(IsCaptureName(name)) << name;
  }
}

TEST(FileList, RingBuffersAreRecognisedByTheirNames) {
  using Groups = std::vector<std::vector<std::string>>;
  const std::vector<std::string> files{"a/t_00001_20190501120000.pcapng",
                                       "a/t_00002_20190501130000.pcapng",
                                       "a/t_2.pcap",
                                       "a/t_20190501120000_00001.pcap.gz",
                                       "a/t_20190501130000_00002.pcap.gz",
                                       "a/u_00001_20190501120000.pcapng",
                                       "b/t_00001_20190501120000.pcapng",
                                       "b/x.pcap",
                                       "b/x.pcap1",
                                       "b/x.pcap2"};
  EXPECT_EQ(GroupRingBuffers(files), (Groups{{files[0], files[1]},
                                             {files[2]},
                                             {files[3], files[4]},
                                             {files[5]},
                                             {files[6]},
                                             {files[7], files[8], files[9]}}));
  EXPECT_EQ(GroupRingBuffers({}), Groups{});
}

}  // namespace
}  // namespace ecaudit::cli
