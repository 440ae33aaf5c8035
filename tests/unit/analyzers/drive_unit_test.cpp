// The drive state machine against the manuals' tables, and what the lab's captures show of it.
#include "analyzers/model/drive_unit.h"

#include <array>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "analyzers/analysis.h"
#include "analyzers/judge/catalogue.h"
#include "analyzers/result/rule_info.h"
#include "analyzers/wiring/event_bus.h"
#include "analyzers/words/drive_text.h"
#include "cli/report/sentences.h"
#include "decoder/capture/capture_reader.h"
#include "decoder/device/profile_registry.h"
#include "tests/support/folders.h"
#include "tests/unit/device/reference_tables.h"

namespace ecaudit {
namespace {

namespace fs = std::filesystem;
using device::DriveState;

/// Remembers what a unit concludes.
class Log : public EventBus {
 public:
  Log() {
    ListenTo<model::DriveCommanded, model::DriveBits, model::DriveStateChanged, model::DriveIllegalCommand,
             model::DriveIllegalChange>(Stage::kModel, *this);
  }
  void On(const model::DriveCommanded& e) { commands.push_back(e); }
  void On(const model::DriveBits& e) { bits.push_back(e); }
  void On(const model::DriveStateChanged& e) { states.push_back(e); }
  void On(const model::DriveIllegalCommand& e) { illegal_commands.push_back(e); }
  void On(const model::DriveIllegalChange& e) { illegal_changes.push_back(e); }

  std::vector<model::DriveCommanded> commands;
  std::vector<model::DriveBits> bits;
  std::vector<model::DriveStateChanged> states;
  std::vector<model::DriveIllegalCommand> illegal_commands;
  std::vector<model::DriveIllegalChange> illegal_changes;
};

/// A drive whose words travel by SDO; nothing is known of its AL state.
class SdoDrive {
 public:
  explicit SdoDrive(std::string_view profile) : al_(0, log), unit(0, al_, log) {
    unit.SetFamily(*device::BuiltinProfile(profile));
  }
  void Control(std::uint16_t word) { Transfer(0x6040, word, mailbox::SdoService::kDownload); }
  void Mode(std::int8_t mode) { Transfer(0x6060, static_cast<std::uint8_t>(mode), mailbox::SdoService::kDownload, 1); }
  void Status(std::uint16_t word) { Transfer(0x6041, word, mailbox::SdoService::kUpload); }

  Log log;

 private:
  void Transfer(std::uint16_t index, std::uint16_t word, mailbox::SdoService service, std::size_t size = 2) {
    const std::array<std::uint8_t, 2> bytes{static_cast<std::uint8_t>(word), static_cast<std::uint8_t>(word >> 8U)};
    mailbox::SdoTransfer transfer;
    transfer.slave = 0;
    transfer.service = service;
    transfer.has_object = true;
    transfer.index = index;
    transfer.data = std::span(bytes).first(size);
    transfer.size = size;
    time_ += 1'000'000;
    transfer.request = {++frame_, time_, true};
    transfer.response = {++frame_, time_, true};
    unit.OnSdo(transfer);
  }
  model::AlMachine al_;
  FrameNo frame_ = 0;
  TimeNs time_ = 0;

 public:
  model::DriveUnit unit;
};

struct Edge {
  DriveState from, to;
};
/// CiA 402, state machine.
const std::map<unsigned, Edge>& Edges() {
  using S = DriveState;
  static const std::map<unsigned, Edge> edges{
      {2, {S::kSwitchOnDisabled, S::kReadyToSwitchOn}},  {3, {S::kReadyToSwitchOn, S::kSwitchedOn}},
      {4, {S::kSwitchedOn, S::kOperationEnabled}},       {5, {S::kOperationEnabled, S::kSwitchedOn}},
      {6, {S::kSwitchedOn, S::kReadyToSwitchOn}},        {7, {S::kReadyToSwitchOn, S::kSwitchOnDisabled}},
      {8, {S::kOperationEnabled, S::kReadyToSwitchOn}},  {9, {S::kOperationEnabled, S::kSwitchOnDisabled}},
      {10, {S::kSwitchedOn, S::kSwitchOnDisabled}},      {11, {S::kOperationEnabled, S::kQuickStopActive}},
      {12, {S::kQuickStopActive, S::kSwitchOnDisabled}}, {15, {S::kFault, S::kSwitchOnDisabled}},
      {16, {S::kQuickStopActive, S::kOperationEnabled}}};
  return edges;
}

const std::map<DriveState, std::uint16_t>& Words() {
  using S = DriveState;
  static const std::map<DriveState, std::uint16_t> words{{S::kSwitchOnDisabled, 0x0240},
                                                         {S::kReadyToSwitchOn, 0x0221},
                                                         {S::kSwitchedOn, 0x0223},
                                                         {S::kOperationEnabled, 0x0227},
                                                         {S::kQuickStopActive, 0x0207},
                                                         {S::kFaultReactionActive, 0x022F},
                                                         {S::kFault, 0x0228}};
  return words;
}

// Every row of the table of commands in every state: the transition that the row names and that leaves the state is
// expected, and its state is reached without objection.
TEST(DriveUnit, EveryCommandInEveryState) {
  ECAUDIT_NEEDS_TABLE("ds402_commands");
  for (const device::Family& family : device::Families()) {
    if (!device::BuiltinProfile(family.profile)->drive) continue;
    const auto rows = device::Table("ds402_commands", family);
    for (const auto& row : rows) {
      const auto word = static_cast<std::uint16_t>(device::Number(row.at("value")));
      std::set<unsigned> commanded;  // by all rows that this word fits
      for (const auto& other : rows) {
        if ((word & device::Number(other.at("mask"))) != device::Number(other.at("value"))) continue;
        std::istringstream numbers(other.at("transitions"));
        for (std::string number; std::getline(numbers, number, ';');)
          commanded.insert(static_cast<unsigned>(std::stoul(number)));
      }
      for (const auto& [state, status] : Words()) {
        SCOPED_TRACE(std::string(family.profile) + " " + row.at("command") + " in " +
                     std::string(DriveStateName(state)));
        SdoDrive drive(family.profile);
        // Other levels before, but no edge of bit 7 other than the row's own.
        drive.Control(static_cast<std::uint16_t>((~word & 0x000FU)));
        drive.Status(status);
        drive.Status(status);
        drive.Control(word);
        ASSERT_FALSE(drive.log.commands.empty());
        const model::DriveCommanded& command = drive.log.commands.back();
        EXPECT_EQ(command.word, word);
        std::set<unsigned> expected;
        for (const unsigned number : commanded) {
          if (Edges().at(number).from == state) expected.insert(number);
        }
        if (expected.empty()) {
          EXPECT_TRUE(command.path.empty());
          continue;
        }
        ASSERT_EQ(expected.size(), 1U);
        ASSERT_FALSE(command.path.empty());
        EXPECT_EQ(command.path.numbers[0], *expected.begin());
        drive.Status(Words().at(Edges().at(*expected.begin()).to));
        ASSERT_FALSE(drive.log.states.empty());
        EXPECT_EQ(drive.log.states.back().path.count, 1);
        EXPECT_EQ(drive.log.states.back().path.numbers[0], *expected.begin());
        EXPECT_EQ(drive.log.states.back().reaction, TimeNs{1'000'000});
        EXPECT_TRUE(drive.log.illegal_changes.empty());
      }
    }
  }
}

TEST(DriveUnit, PilzTakesEdgesOnly) {
  SdoDrive drive("pilz-pmcprotego-d");
  drive.Status(0x0240);
  drive.Control(0x0000);
  drive.Control(0x0006);
  drive.Status(0x0221);
  drive.Control(0x0007);
  drive.Status(0x0223);
  ASSERT_EQ(drive.log.states.size(), 3U);
  EXPECT_EQ(drive.log.states[2].path.numbers[0], 3);
  // Bit 3 rises: transition 4. It stays: nothing more once the drive is back in Switched on.
  drive.Control(0x000F);
  ASSERT_FALSE(drive.log.commands.empty());
  EXPECT_EQ(drive.log.commands.back().path.count, 1);
  EXPECT_EQ(drive.log.commands.back().path.numbers[0], 4);
}

TEST(DriveUnit, LevelsAskForSeveralSteps) {
  SdoDrive drive("kollmorgen-akd-2011");
  drive.Control(0x0006);
  drive.Status(0x0221);
  drive.Control(0x000F);
  ASSERT_FALSE(drive.log.commands.empty());
  const model::DrivePath& path = drive.log.commands.back().path;
  ASSERT_EQ(path.count, 2);
  EXPECT_EQ(path.numbers[0], 3);
  EXPECT_EQ(path.numbers[1], 4);
  drive.Status(0x0227);  // Switched on was passed unseen
  EXPECT_EQ(drive.log.states.back().path.count, 2);
  EXPECT_TRUE(drive.log.illegal_changes.empty());
}

TEST(DriveUnit, BitsOfTheModeAreNoCommand) {
  SdoDrive drive("kollmorgen-akd-2011");
  drive.Control(0x000F);
  drive.Status(0x0227);
  for (const unsigned word : {0x001FU, 0x003FU, 0x010FU, 0xFF0FU & 0xFF7FU})
    drive.Control(static_cast<std::uint16_t>(word));
  EXPECT_TRUE(drive.log.commands.empty());
}

TEST(DriveUnit, EdgesOfBitsThatStartOrHoldAreNamed) {
  const auto text = [](std::string_view profile, std::int8_t mode, std::uint16_t before, std::uint16_t word) {
    SdoDrive drive(profile);
    drive.Status(0x0227);
    drive.Mode(mode);
    drive.Control(before);
    drive.Control(word);
    return drive.log.bits.empty() ? "" : EdgesText(*device::BuiltinProfile(profile)->drive, drive.log.bits.back());
  };
  // CiA 402, profile position and homing; PILZ 4.4.2.
  EXPECT_EQ(text("generic", 1, 0x000F, 0x001F), "bit 4 rises: new setpoint (control word 0x001f)");
  EXPECT_EQ(text("generic", 6, 0x001F, 0x010F),
            "bit 4 falls: homing operation start, bit 8 rises: halt (control word 0x010f)");
  EXPECT_EQ(text("pilz-pmcprotego-d", 6, 0x000F, 0x800F), "bit 15 rises: start homing (control word 0x800f)");
  EXPECT_EQ(text("pilz-pmcprotego-d", 8, 0x100F, 0x000F),
            "bit 12 falls: clear SAVE command channel (control word 0x000f)");
  // Heartbeats and commands of the state machine.
  EXPECT_EQ(text("generic", 1, 0x000F, 0x080F), "");
  EXPECT_EQ(text("generic", 1, 0x0006, 0x000F), "");
}

TEST(DriveUnit, FaultIsReachedFromEveryState) {
  for (const auto& [state, status] : Words()) {
    if (state == DriveState::kFault || state == DriveState::kFaultReactionActive) continue;
    SdoDrive drive("kollmorgen-mkd-n");
    drive.Control(0);
    drive.Status(status);
    drive.Status(0x0228);
    ASSERT_EQ(drive.log.states.size(), 2U);
    const model::DrivePath& path = drive.log.states[1].path;
    ASSERT_EQ(path.count, 2);
    EXPECT_EQ(path.numbers[0], 13);
    EXPECT_EQ(path.numbers[1], 14);
    EXPECT_TRUE(drive.log.illegal_changes.empty());
  }
}

TEST(DriveUnit, WordsWithoutMeaningAreNoError) {
  SdoDrive drive("kollmorgen-akd-2011");
  drive.Control(0);
  for (unsigned word = 0; word < 0x10000; word += 0x35) drive.Status(static_cast<std::uint16_t>(word | 0x0062U));
  EXPECT_TRUE(drive.log.illegal_changes.empty());
}

// --- captures -------------------------------------------------------------------------------------------------

fs::path Lab() {
  return fs::path(test::SharedDir()) / "captures" / "lab";
}

AnalysisOptions DriveRulesOnly() {
  AnalysisOptions options;
  for (const RuleInfo* rule : RuleCatalogue()) {
    if (rule->group != "Drive profile (DS402)") options.rules[std::string(rule->id)].off = true;
  }
  return options;
}

TEST(DriveCaptures, OnlyTheFaultOfDriveFaultIsFound) {
  if (!fs::exists(Lab())) GTEST_SKIP() << "the captures of the lab are absent";
  for (const fs::path& folder : {Lab(), Lab().parent_path() / "real"}) {
    for (const auto& entry : fs::directory_iterator(folder)) {
      const std::string name = entry.path().filename().string();
      if (name.starts_with("garbage") || (!name.ends_with(".pcapng") && !name.ends_with(".pcap"))) continue;
      SCOPED_TRACE(name);
      auto source = capture::OpenCapture(entry.path().string());
      if (!source) continue;
      const AnalysisResult result = Analyse(**source, DriveRulesOnly());
      if (name != "drive-fault.pcapng") {
        for (const Finding& finding : result.findings)
          ADD_FAILURE() << finding.rule << ": " << report::MessageOf(finding, result);
        continue;
      }
      ASSERT_EQ(result.findings.size(), 1U);
      EXPECT_EQ(result.findings[0].rule, "drive-fault");
      EXPECT_EQ(result.findings[0].first.number, 3560U);
      EXPECT_EQ(result.findings[0].count, 1U);
      EXPECT_EQ(result.findings[0].severity, Severity::kError);
    }
  }
}

// The status words that the master saw, in order, each once.
TEST(DriveCaptures, StatesOfDriveFaultAreThoseOfItsTruth) {
  std::ifstream file(Lab() / "drive-fault.truth.json");
  const nlohmann::json truth = nlohmann::json::parse(file, nullptr, false);
  if (!truth.is_object()) GTEST_SKIP() << "the captures of the lab are absent";
  std::vector<std::uint16_t> expected{0x0250};  // before the first command
  std::vector<std::uint16_t> commands;
  for (const auto& entry : truth["master_log"]) {
    const auto number = [&entry](const char* key) {
      return static_cast<std::uint16_t>(std::stoul(entry[key].get<std::string>(), nullptr, 16));
    };
    const std::string event = entry["ev"];
    if (event == "controlword") commands.push_back(number("value"));
    const char* key = entry.contains("statusword1") ? "statusword1" : entry.contains("slave1") ? "slave1" : "value";
    if (event != "statusword" && !entry.contains("statusword1")) continue;
    if (number(key) != expected.back()) expected.push_back(number(key));
  }
  auto source = capture::OpenCapture((Lab() / "drive-fault.pcapng").string());
  ASSERT_TRUE(source);
  const AnalysisResult result = Analyse(**source, {});
  ASSERT_EQ(result.slaves.size(), 1U);
  ASSERT_TRUE(result.slaves[0].drive);
  const DriveSummary& drive = *result.slaves[0].drive;
  std::vector<std::uint16_t> shown;
  std::vector<std::uint16_t> commanded;
  for (const DriveStep& step : drive.history) {
    if (step.kind == DriveStep::Kind::kState) shown.push_back(step.word.value_or(0));
    if (step.kind == DriveStep::Kind::kCommand) commanded.push_back(step.word.value_or(0));
  }
  EXPECT_EQ(shown, expected);
  EXPECT_EQ(commanded, commands);
  EXPECT_EQ(drive.faults, 1U);
  EXPECT_EQ(drive.enabled.size(), 2U);
  EXPECT_EQ(drive.state, "Switch on disabled");
}

}  // namespace
}  // namespace ecaudit
