// Names that are not ASCII, from the wire to all that the program writes: EEPROMs and drives use Latin-1.
#include <cstdio>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "cli/program.h"
#include "samples/builder/scenarios/scenario.h"
#include "tests/unit/cli/temp_dir.h"

namespace ecaudit {
namespace {

/// What the program writes to standard output.
std::string Written(const std::vector<std::string>& arguments, const test::TempDir& folder) {
  const std::string path = folder.Path("output");
  std::FILE* const out = std::fopen(path.c_str(), "wb");
  std::FILE* const err = std::tmpfile();
  if (out == nullptr || err == nullptr) {
    ADD_FAILURE() << "no room for files";
    return {};
  }
  EXPECT_LE(cli::RunProgram(arguments, out, err), 1) << arguments.front();
  std::fclose(out);
  std::fclose(err);
  return test::TempDir::Read(path);
}

/// A run of a drive that its EEPROM calls "Klöckner", with a sequence for terminals after the name, and its object
/// 1008h "Köln 10µs", and of a terminal whose input its EEPROM calls "10µs". All of it is in Latin-1.
samples::Bytes Capture() {
  samples::Story story;
  samples::SlaveDescription drive = samples::AkdDrive();
  drive.sii.name =
      "Kl\xF6"
      "ckner\x1B[2J";
  samples::SlaveDescription terminal = samples::InputTerminal();
  terminal.sii.tx_pdos.at(0).entries.at(0).name = "10\xB5s";
  drive.objects.AddText(0x1008, "K\xF6ln 10\xB5s", "Manufacturer device name");
  story.Add(std::move(drive));
  story.Add(std::move(terminal));
  story.master.Scan();
  for (std::uint16_t word = 0; word < 0x0180; word = static_cast<std::uint16_t>(word + 2)) {
    story.master.ReadEeprom(0, word);
    story.master.ReadEeprom(1, word);
  }
  story.master.BringToPreop();
  story.master.Upload(0, 0x1008, 0);
  story.master.BringToSafeop();
  story.master.BringToOp({});
  story.master.Cycles(5);
  return story.Finish().file;
}

TEST(ForeignNames, AreTextInAllThatIsWritten) {
  const test::TempDir folder;
  const samples::Bytes bytes = Capture();
  const std::string file = folder.Write("drive.pcapng", std::string(bytes.begin(), bytes.end()));
  const std::vector<std::pair<std::vector<std::string>, std::string>> wanted = {
      {{"check", file}, "Klöckner\\x1b[2J"},
      {{"check", "--format", "json", file}, "Klöckner\\\\x1b[2J"},
      {{"events", "--type", "eeprom", file}, "Klöckner\\x1b[2J"},
      {{"events", "--type", "eeprom", "--format", "jsonl", file}, "\"name\":\"10µs\""},
      {{"events", "--type", "sdo", file}, "Köln 10µs"},
      {{"events", "--type", "sdo", "--format", "jsonl", file}, "Köln 10µs"},
      {{"signals", "--format", "csv", file}, "10µs"},
  };
  for (const auto& [arguments, name] : wanted) {
    const std::string text = Written(arguments, folder);
    EXPECT_NE(text.find(name), std::string::npos) << name << " of " << testing::PrintToString(arguments);
    for (const char* escaped : {"\x1B", "\\xb5", "\\xf6"}) {
      EXPECT_EQ(text.find(escaped), std::string::npos) << escaped << " of " << testing::PrintToString(arguments);
    }
  }
}

}  // namespace
}  // namespace ecaudit
