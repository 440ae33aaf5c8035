// The slave models against what slaves really did: over all captures of real hardware and of the lab, each foretold
// state answer, mailbox transfer and working counter is compared. Deviations are the faults that were put in on
// purpose.
#include <algorithm>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "analyzers/analysis.h"
#include "decoder/capture/capture_reader.h"
#include "tests/support/folders.h"

namespace ecaudit {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> Captures() {
  std::vector<fs::path> paths;
  for (const char* folder : {"real", "lab"}) {
    std::error_code error;
    for (fs::directory_iterator it(fs::path(test::SharedDir()) / "captures" / folder, error), end; !error && it != end;
         it.increment(error)) {
      const std::string extension = it->path().extension().string();
      if (extension == ".pcapng" || extension == ".pcap") paths.push_back(it->path());
    }
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

/// Where a capture must deviate from what the models foretell: faults put in on purpose (README and truth files).
/// A refusal whose cause the model sees is foretold and no deviation: the eight sync manager faults of bad-sm-config
/// and the one of one-slave-refuses.
struct Deviations {
  std::uint64_t al = 0;
  std::uint64_t working_counter = 0;
};

TEST(Predictions, HoldOnRealTrafficExceptWhereAFaultWasPutIn) {
  const std::vector<fs::path> captures = Captures();
  if (captures.empty()) GTEST_SKIP() << "captures not beside the project";
  const std::map<std::string, Deviations> faults = {
      {"watchdog-sm.pcapng", {1, 0}},              // falls out of OP with 0x001B
      {"soem-sdinfo-akd.pcapng", {1, 0}},          // SAFEOP refused with 0x001D; the vendor does not tell the reason
      {"wkc-error-link-break.pcapng", {0, 2000}},  // link open from LRW 2000 to 4000
  };
  std::uint64_t made = 0;
  for (const fs::path& path : captures) {
    SCOPED_TRACE(path.filename().string());
    auto source = capture::OpenCapture(path.string());
    if (!source) continue;
    const PredictionSummary p = Analyse(**source, {}).bus.predictions;
    made += p.al_answers.made + p.mailbox_accesses.made + p.working_counters.made;
    EXPECT_EQ(p.mailbox_accesses.held, p.mailbox_accesses.made);
    if (path.filename().string().starts_with("garbage-")) continue;  // bits were flipped anywhere
    const auto fault = faults.find(path.filename().string());
    const Deviations expected = fault == faults.end() ? Deviations{} : fault->second;
    EXPECT_EQ(p.al_answers.made - p.al_answers.held, expected.al);
    EXPECT_EQ(p.working_counters.made - p.working_counters.held, expected.working_counter);
  }
  EXPECT_GT(made, 100'000U) << "the models foretell too little to prove anything";
}

}  // namespace
}  // namespace ecaudit
