// What the master wanted of a PDO mapping, what the slave accepted, and where each entry lies, as part of findings.
#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "analyzers/analysis.h"
#include "cli/report/mapping_text.h"
#include "tests/support/folders.h"
#include "tests/support/trace_builder.h"

namespace ecaudit {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

/// The lines of each table of each finding, with the rule of the finding before them.
std::vector<std::string> TablesOf(const std::string& name) {
  const std::filesystem::path rules = std::filesystem::path(test::SourceDir()) / "tests" / "rules";
  const auto trace = test::Trace::Load((rules / (name + ".trace")).string());
  if (!trace) {
    ADD_FAILURE() << trace.error().message;
    return {};
  }
  std::vector<std::string> lines;
  for (const Finding& finding : Analyse(*trace->Source(), {}).findings) {
    for (const auto& table : finding.mapping) {
      lines.emplace_back(finding.rule);
      for (std::string& line : report::MappingLines(*table)) lines.push_back(std::move(line));
    }
  }
  return lines;
}

TEST(MappingTables, WhatFollowsAnAbortedEntryMayBeShifted) {
  EXPECT_THAT(TablesOf("sdo-abort/violates-800"),
              ElementsAre("sdo-abort",
                          "mapping    inputs (SM3): wanted 10 bytes, in the slave maybe 6 bytes, sync manager 10 "
                          "bytes (frame 38)",
                          "  entry    wanted           slave                 wanted at  slave at",
                          "  1C13h:1  1A00h            accepted",
                          "  1A00h:1  6041h:0, 16 bit  accepted              byte 0     byte 0",
                          "  1A00h:2  6077h:0, 32 bit  aborted (0x06040041)  byte 2     -",
                          "  1A00h:3  6064h:0, 32 bit  accepted              byte 6     byte 2?"));
}

TEST(MappingTables, NothingIsShiftedIfTheMasterTakesWhatTheSlaveAccepted) {
  EXPECT_THAT(TablesOf("sdo-abort/violates-801"),
              ElementsAre("sdo-abort",
                          "mapping    inputs (SM3): wanted 10 bytes, in the slave maybe 6 bytes, sync manager 6 "
                          "bytes (frame 38)",
                          "  entry    wanted           slave                 wanted at  slave at",
                          "  1C13h:1  1A00h            accepted",
                          "  1A00h:1  6041h:0, 16 bit  accepted              byte 0     byte 0",
                          "  1A00h:2  6077h:0, 32 bit  aborted (0x06040041)  byte 2     -",
                          "  1A00h:3  6064h:0, 32 bit  accepted              byte 6     byte 2?"));
}

TEST(MappingTables, AnUploadShowsAnotherEntry) {
  EXPECT_THAT(TablesOf("al-refused/violates-800"),
              ElementsAre("sm-process-config",
                          "mapping    inputs (SM3): wanted 10 bytes, in the slave 8 bytes, sync manager 10 bytes "
                          "(frame 42)",
                          "  entry    wanted           slave                wanted at  slave at",
                          "  1C13h:1  1A00h            accepted",
                          "  1A00h:1  6041h:0, 16 bit  accepted             byte 0     byte 0",
                          "  1A00h:2  6077h:0, 32 bit  has 6077h:0, 16 bit  byte 2     byte 2",
                          "  1A00h:3  6064h:0, 32 bit  accepted             byte 6     byte 4, shifted"));
}

TEST(MappingTables, APdoIsNotAssigned) {
  EXPECT_THAT(
      TablesOf("sdo-abort/violates-802"),
      ElementsAre("sdo-abort", "mapping    inputs (SM3): in the slave maybe 2 bytes, sync manager 6 bytes (frame 34)",
                  "  entry    wanted           slave                 wanted at  slave at",
                  "  1C13h:1  1A00h            accepted",
                  "  1A00h:1  6041h:0, 16 bit  accepted              byte 0     byte 0",
                  "  1C13h:2  1A01h            aborted (0x06090030)"));
}

TEST(MappingTables, TheTypeOfAnObjectMayShiftWhatFollows) {
  EXPECT_THAT(TablesOf("al-refused/violates-802"),
              ElementsAre("al-refused",
                          "mapping    inputs (SM3): wanted 10 bytes, in the slave maybe 8 bytes, sync manager 10 "
                          "bytes (frame 42)",
                          "  entry    wanted           slave                              wanted at  slave at",
                          "  1C13h:1  1A00h            accepted",
                          "  1A00h:1  6041h:0, 16 bit  accepted                           byte 0     byte 0",
                          "  1A00h:2  6077h:0, 32 bit  accepted, but its type has 16 bit  byte 2     byte 2",
                          "  1A00h:3  6064h:0, 32 bit  accepted                           byte 6     byte 4?"));
}

TEST(MappingTables, NoneIfAllWasAccepted) {
  EXPECT_THAT(TablesOf("al-refused/violates-801"), IsEmpty());
}

TEST(MappingTables, ASlaveThatAbortsKeepsWhatItHad) {
  EXPECT_THAT(TablesOf("sdo-abort/violates-803"),
              ElementsAre("sdo-abort",
                          "mapping    inputs (SM3): wanted 10 bytes, in the slave 8 bytes, sync manager 10 bytes "
                          "(frame 34)",
                          "  entry    wanted           slave                                      wanted at  slave at",
                          "  1C13h:1  -                has 1A00h",
                          "  1A00h:1  6041h:0, 16 bit  accepted                                   byte 0     byte 0",
                          "  1A00h:2  6077h:0, 32 bit  aborted (0x06010002), has 6077h:0, 16 bit  byte 2     byte 2",
                          "  1A00h:3  6064h:0, 32 bit  accepted                                   byte 6     byte 4, "
                          "shifted"));
}

TEST(MappingTables, OneTableForAMappingOfSeveralFindings) {
  const std::vector<std::string> lines = TablesOf("pdo-not-mappable/violates-3");
  EXPECT_THAT(lines, SizeIs(testing::Gt(3U)));
  EXPECT_EQ(
      std::count(lines.begin(), lines.end(), "  entry    wanted           slave                 wanted at  slave at"),
      1);
}

}  // namespace
}  // namespace ecaudit
