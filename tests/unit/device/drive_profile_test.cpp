#include <map>
#include <set>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "decoder/base/text.h"
#include "decoder/device/profile_registry.h"
#include "tests/unit/device/reference_tables.h"

namespace ecaudit::device {
namespace {

/// Families that are drives: MKD-C is a power supply of device profile 401.
std::vector<Family> Drives() {
  std::vector<Family> drives;
  for (const Family& family : Families()) {
    if (family.profile != "kollmorgen-mkd-c") drives.push_back(family);
  }
  return drives;
}

const DriveProfile& Drive(std::string_view name) {
  return *BuiltinProfile(name)->drive;
}

TEST(DriveProfile, MkdCIsNoDrive) {
  EXPECT_FALSE(BuiltinProfile("kollmorgen-mkd-c")->drive);
  for (const Family& family : Drives()) EXPECT_TRUE(BuiltinProfile(family.profile)->drive) << family.profile;
  EXPECT_TRUE(BuiltinProfile("generic")->drive);
}

TEST(DriveProfile, StatesAreThoseOfTheManuals) {
  ECAUDIT_NEEDS_TABLE("ds402_states");
  for (const Family& family : Drives()) {
    SCOPED_TRACE(family.profile);
    const DriveProfile& drive = Drive(family.profile);
    const auto rows = Table("ds402_states", family);
    const auto descriptions = Table("ds402_state_descriptions", family);
    ASSERT_EQ(drive.states.size(), rows.size());
    ASSERT_EQ(descriptions.size(), rows.size());
    for (const test::CsvRow& row : rows) {
      const auto found = std::find_if(drive.states.begin(), drive.states.end(), [&](const DriveStateRow& state) {
        return DriveStateName(state.state) == row.at("state");
      });
      ASSERT_NE(found, drive.states.end()) << row.at("state");
      EXPECT_EQ(found->printed.mask, Number(row.at("mask")));
      EXPECT_EQ(found->printed.value, Number(row.at("value")));
      const auto text = std::find_if(descriptions.begin(), descriptions.end(),
                                     [&](const test::CsvRow& d) { return d.at("state") == row.at("state"); });
      ASSERT_NE(text, descriptions.end());
      EXPECT_EQ(found->meaning, text->at("meaning"));
      EXPECT_NE(found->source.find(CitationOf(text->at("source"))), std::string::npos);
    }
  }
}

TEST(DriveProfile, CommandsAreThoseOfTheManuals) {
  ECAUDIT_NEEDS_TABLE("ds402_commands");
  for (const Family& family : Drives()) {
    if (family.profile == "pilz-pmcprotego-d") continue;
    SCOPED_TRACE(family.profile);
    const DriveProfile& drive = Drive(family.profile);
    const auto rows = Table("ds402_commands", family);
    ASSERT_EQ(drive.commands.size(), rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const DriveCommand& command = drive.commands[i];
      EXPECT_EQ(command.name, rows[i].at("command"));
      EXPECT_EQ(command.mask, Number(rows[i].at("mask")));
      EXPECT_EQ(command.value, Number(rows[i].at("value")));
      std::string transitions;
      for (const std::uint8_t number : command.transitions) {
        transitions += (transitions.empty() ? "" : ";") + std::to_string(number);
      }
      EXPECT_EQ(transitions, rows[i].at("transitions"));
      EXPECT_EQ(command.source, CitationOf(rows[i].at("source")));
      EXPECT_EQ(command.rising, command.name == "Fault reset" ? 0x0080 : 0);
      EXPECT_EQ(command.falling, 0);
    }
  }
}

/// "X", "0", "1", "P" or "N" of one control word bit.
std::string Level(const DriveCommand& command, unsigned bit) {
  const auto flag = static_cast<std::uint16_t>(1U << bit);
  if ((command.mask & flag) == 0) return "X";
  if ((command.rising & flag) != 0) return "P";
  if ((command.falling & flag) != 0) return "N";
  return (command.value & flag) != 0 ? "1" : "0";
}

TEST(DriveProfile, PilzEdgesAreThoseOfTheManual) {
  ECAUDIT_NEEDS_TABLE("pilz_controlword_edges");
  const DriveProfile& drive = Drive("pilz-pmcprotego-d");
  const auto rows = Table("pilz_controlword_edges");
  ASSERT_EQ(drive.commands.size(), rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    SCOPED_TRACE("transition " + rows[i].at("transition") + rows[i].at("variant"));
    const DriveCommand& command = drive.commands[i];
    ASSERT_EQ(command.transitions.size(), 1U);
    EXPECT_EQ(command.transitions[0], Number(rows[i].at("transition")));
    EXPECT_EQ(command.variant, rows[i].at("variant"));
    std::string printed;
    for (const char* bit : {"bit7", "bit3", "bit2", "bit1", "bit0"}) printed += rows[i].at(bit);
    std::string read;
    for (const unsigned bit : {7U, 3U, 2U, 1U, 0U}) read += Level(command, bit);
    EXPECT_EQ(command.printed.empty() ? read : command.printed, printed);
    EXPECT_EQ(command.source, CitationOf(rows[i].at("source")));
  }
  const auto actions = Table("pilz_controlword_edge_actions");
  ASSERT_EQ(drive.edge_actions.size(), actions.size());
  for (std::size_t i = 0; i < actions.size(); ++i) {
    EXPECT_EQ(drive.edge_actions[i].rising, actions[i].at("edge") == "P");
    EXPECT_EQ(drive.edge_actions[i].bit, Number(actions[i].at("bit")));
    EXPECT_EQ(drive.edge_actions[i].action, actions[i].at("action"));
    EXPECT_EQ(drive.edge_actions[i].condition, actions[i].at("condition"));
  }
}

TEST(DriveProfile, WordBitsAreThoseOfTheManuals) {
  ECAUDIT_NEEDS_TABLE("controlword_bits");
  for (const Family& family : Drives()) {
    SCOPED_TRACE(family.profile);
    for (const bool control : {true, false}) {
      const auto rows = Table(control ? "controlword_bits" : "statusword_bits", family);
      const auto& bits = control ? Drive(family.profile).control_bits : Drive(family.profile).status_bits;
      ASSERT_EQ(bits.size(), rows.size());
      for (std::size_t i = 0; i < rows.size(); ++i) {
        EXPECT_EQ(bits[i].bit, Number(rows[i].at("bit")));
        EXPECT_EQ(bits[i].name, rows[i].at("name"));
        if (!NamesATable(rows[i].at("meaning"))) {
          EXPECT_EQ(bits[i].meaning, rows[i].at("meaning"));
        }
        EXPECT_EQ(bits[i].source, CitationOf(rows[i].at("source")));
      }
    }
  }
}

TEST(DriveProfile, ModesAreThoseOfTheManuals) {
  ECAUDIT_NEEDS_TABLE("operation_modes");
  for (const Family& family : Drives()) {
    SCOPED_TRACE(family.profile);
    const DriveProfile& drive = Drive(family.profile);
    const auto rows = Table("operation_modes", family);
    ASSERT_EQ(drive.modes.size(), rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const OperationMode& mode = drive.modes[i];
      EXPECT_EQ(mode.value, std::stoi(rows[i].at("value_6060_signed")));
      EXPECT_EQ(static_cast<std::uint8_t>(mode.value), Number(rows[i].at("value_6060_hex")));
      EXPECT_EQ(mode.name, rows[i].at("name"));
      const auto text = [](const std::optional<std::int32_t>& number) { return number ? std::to_string(*number) : ""; };
      EXPECT_EQ(text(mode.printed_opmode ? mode.printed_opmode : mode.opmode), rows[i].at("opmode"));
      EXPECT_EQ(text(mode.cmdsource), rows[i].at("cmdsource"));
      EXPECT_EQ(mode.source, CitationOf(rows[i].at("source")));
    }
    const auto mode_bits = Table("mode_bits", family);
    ASSERT_EQ(drive.mode_bits.size(), mode_bits.size());
    for (std::size_t i = 0; i < mode_bits.size(); ++i) {
      EXPECT_EQ(drive.mode_bits[i].mode, std::stoi(mode_bits[i].at("mode_number")));
      EXPECT_EQ(drive.mode_bits[i].name, mode_bits[i].at("mode_name"));
      EXPECT_EQ(drive.mode_bits[i].bit4, mode_bits[i].at("bit4"));
      EXPECT_EQ(drive.mode_bits[i].bit5, mode_bits[i].at("bit5"));
      EXPECT_EQ(drive.mode_bits[i].bit6, mode_bits[i].at("bit6"));
    }
  }
}

TEST(DriveProfile, AkdSupportsThreeModes) {
  const DriveProfile& akd = Drive("kollmorgen-akd-2011");
  EXPECT_TRUE(akd.modes_complete);
  std::set<int> supported;
  for (int value = -128; value <= 127; ++value) {
    if (akd.FindMode(static_cast<std::int8_t>(value)) != nullptr) supported.insert(value);
  }
  EXPECT_THAT(supported, ::testing::ElementsAre(3, 6, 7));
}

// CiA 402 patterns with don't-care bits set to 1 and to 0.
TEST(DriveProfile, StatusWordShowsTheState) {
  const DriveProfile& akd = Drive("kollmorgen-akd-2010");
  EXPECT_EQ(akd.StateOf(0x0000), DriveState::kNotReadyToSwitchOn);
  EXPECT_EQ(akd.StateOf(0x0220), DriveState::kNotReadyToSwitchOn);
  EXPECT_EQ(akd.StateOf(0x0250), DriveState::kSwitchOnDisabled);
  EXPECT_EQ(akd.StateOf(0x0231), DriveState::kReadyToSwitchOn);
  EXPECT_EQ(akd.StateOf(0x0233), DriveState::kSwitchedOn);
  EXPECT_EQ(akd.StateOf(0x1637), DriveState::kOperationEnabled);
  EXPECT_EQ(akd.StateOf(0x0217), DriveState::kQuickStopActive);
  EXPECT_EQ(akd.StateOf(0x021F), DriveState::kFaultReactionActive);
  EXPECT_EQ(akd.StateOf(0x0238), DriveState::kFault);
  EXPECT_EQ(akd.StateOf(0x0211), std::nullopt);  // ready to switch on needs bit 5
}

TEST(DriveProfile, PilzStatusWordIsReadAsPrintedAndAsStandard) {
  const DriveProfile& pilz = Drive("pilz-pmcprotego-d");
  EXPECT_EQ(pilz.StateOf(0x0040), DriveState::kSwitchOnDisabled);  // printed for two states
  EXPECT_EQ(pilz.StateOf(0x0000), DriveState::kNotReadyToSwitchOn);
  EXPECT_EQ(pilz.StateOf(0x0001), DriveState::kReadyToSwitchOn);
  EXPECT_EQ(pilz.StateOf(0x0021), DriveState::kReadyToSwitchOn);
  EXPECT_EQ(pilz.StateOf(0x0023), DriveState::kSwitchedOn);
  EXPECT_EQ(pilz.StateOf(0x0027), DriveState::kOperationEnabled);
  EXPECT_EQ(pilz.StateOf(0x0003), DriveState::kQuickStopActive);
  EXPECT_EQ(pilz.StateOf(0x0007), DriveState::kQuickStopActive);
  EXPECT_EQ(pilz.StateOf(0x0028), DriveState::kFault);
  EXPECT_EQ(pilz.StateOf(0x0008), DriveState::kFault);
  EXPECT_EQ(pilz.StateOf(0x000F), DriveState::kFaultReactionActive);
  EXPECT_EQ(pilz.StateOf(0x002F), DriveState::kFaultReactionActive);
}

constexpr std::uint32_t Numbers(std::initializer_list<unsigned> numbers) {
  std::uint32_t bits = 0;
  for (const unsigned number : numbers) bits |= 1U << number;
  return bits;
}

TEST(DriveProfile, ControlWordCommandsByLevel) {
  const DriveProfile& akd = Drive("kollmorgen-akd-2010");
  using S = DriveState;
  EXPECT_EQ(akd.Commanded(S::kSwitchOnDisabled, 0x00, 0x06), Numbers({2}));
  EXPECT_EQ(akd.Commanded(S::kReadyToSwitchOn, 0x06, 0x07), Numbers({3}));
  EXPECT_EQ(akd.Commanded(S::kReadyToSwitchOn, 0x06, 0x0F), Numbers({3}));  // then 4, from the next state
  EXPECT_EQ(akd.Commanded(S::kSwitchedOn, 0x0F, 0x0F), Numbers({4}));
  EXPECT_EQ(akd.Commanded(S::kOperationEnabled, 0x0F, 0x07), Numbers({5}));
  EXPECT_EQ(akd.Commanded(S::kOperationEnabled, 0x0F, 0x02), Numbers({11}));
  EXPECT_EQ(akd.Commanded(S::kOperationEnabled, 0x0F, 0x00), Numbers({9}));
  EXPECT_EQ(akd.Commanded(S::kQuickStopActive, 0x02, 0x0F), Numbers({16}));
  EXPECT_EQ(akd.Commanded(S::kOperationEnabled, 0x0F, 0x0F), 0U);
  EXPECT_EQ(akd.Commanded(S::kSwitchOnDisabled, 0x00, 0x0F), 0U);  // enabling is not offered here
  EXPECT_NE(akd.CommandedAnywhere(0x00, 0x0F), 0U);
}

TEST(DriveProfile, FaultResetNeedsAnEdge) {
  const DriveProfile& akd = Drive("kollmorgen-akd-2010");
  EXPECT_EQ(akd.Commanded(DriveState::kFault, 0x00, 0x80), Numbers({15}));
  EXPECT_EQ(akd.Commanded(DriveState::kFault, 0x80, 0x80), 0U);
}

TEST(DriveProfile, PilzCommandsByEdge) {
  const DriveProfile& pilz = Drive("pilz-pmcprotego-d");
  using S = DriveState;
  EXPECT_EQ(pilz.Commanded(S::kReadyToSwitchOn, 0x06, 0x07), Numbers({3}));
  EXPECT_EQ(pilz.Commanded(S::kReadyToSwitchOn, 0x07, 0x07), 0U);
  EXPECT_EQ(pilz.Commanded(S::kSwitchedOn, 0x07, 0x0F), Numbers({4}));
  EXPECT_EQ(pilz.Commanded(S::kOperationEnabled, 0x0F, 0x07), Numbers({5}));
  // A falling bit 2: quick stop while bit 3 is set, else setpoints off.
  EXPECT_EQ(pilz.Commanded(S::kOperationEnabled, 0x0F, 0x0B), Numbers({11}));
  EXPECT_EQ(pilz.Commanded(S::kOperationEnabled, 0x07, 0x03), Numbers({5}));
  EXPECT_EQ(pilz.Commanded(S::kFault, 0x00, 0x80), Numbers({15}));
  EXPECT_EQ(pilz.Find(16), nullptr);
}

TEST(DriveProfile, LegalPathsAreFound) {
  const DriveProfile& akd = Drive("kollmorgen-mkd-n");
  ASSERT_NE(akd.Find(DriveState::kSwitchedOn, DriveState::kOperationEnabled), nullptr);
  EXPECT_EQ(akd.Find(DriveState::kSwitchedOn, DriveState::kOperationEnabled)->number, 4);
  ASSERT_NE(akd.Find(DriveState::kSwitchedOn, DriveState::kFaultReactionActive), nullptr);
  EXPECT_EQ(akd.Find(DriveState::kSwitchedOn, DriveState::kFaultReactionActive)->number, 13);
  EXPECT_EQ(akd.Find(DriveState::kFault, DriveState::kFaultReactionActive), nullptr);
  EXPECT_EQ(akd.Find(DriveState::kSwitchOnDisabled, DriveState::kOperationEnabled), nullptr);
  EXPECT_EQ(akd.Find(DriveState::kFault, DriveState::kOperationEnabled), nullptr);
  EXPECT_EQ(akd.transitions.size(), 17U);
}

TEST(DriveProfile, ControlWordActsInOpOnly) {
  EXPECT_THAT(Drive("pilz-pmcprotego-d").control_word_in, ::testing::ElementsAre(esc::AlState::OP));
  EXPECT_THAT(Drive("pilz-pmcprotego-d").status_word_in,
              ::testing::ElementsAre(esc::AlState::SAFEOP, esc::AlState::OP));
}

TEST(DriveProfile, StandardObjectsAreInherited) {
  const DeviceDescription* akd = BuiltinProfile("kollmorgen-akd-2010");
  ASSERT_NE(akd->object(0x6064, 0), nullptr);
  EXPECT_EQ(akd->object(0x6064, 0)->types[0], DataType::kInteger32);
  EXPECT_EQ(akd->object_name(0x6040, 0), "Control word");
  EXPECT_EQ(akd->object_name(0x20A4, 0), "Latch control word");
  EXPECT_EQ(akd->object_name(0x5FFF, 0), "");
}

// Fault slots stand in MKD 5.3.3; no other manual names an object for fault numbers.
TEST(DriveProfile, FaultObjectsAreThoseOfTheStandardAndOfTheFamily) {
  for (const char* name : {"generic", "pilz-pmcprotego-d", "kollmorgen-akd-2010", "kollmorgen-mkd-n"}) {
    const FaultObject* code = Drive(name).FindFaultObject(0x603F, 0);
    const FaultObject* history = Drive(name).FindFaultObject(0x1003, 1);
    ASSERT_TRUE(code != nullptr && history != nullptr) << name;
    EXPECT_EQ(code->kind, FaultValue::kErrorCode);
    EXPECT_EQ(history->kind, FaultValue::kErrorHistory);
    EXPECT_EQ(Drive(name).FindFaultObject(0x1003, 2), nullptr) << "an older entry is no reason of the present fault";
  }
  EXPECT_EQ(Drive("generic").FindFaultObject(0x2001, 1), nullptr);
  EXPECT_EQ(Drive("pilz-pmcprotego-d").FindFaultObject(0x2001, 1), nullptr);
  const FaultObject* mkd = Drive("kollmorgen-mkd-n").FindFaultObject(0x2001, 10);
  const FaultObject* akd = Drive("kollmorgen-akd-2011").FindFaultObject(0x2001, 1);
  ASSERT_TRUE(mkd != nullptr && akd != nullptr);
  EXPECT_EQ(mkd->kind, FaultValue::kFaultNumber);
  EXPECT_EQ(mkd->basis, Basis::kPrinted);
  EXPECT_EQ(akd->basis, Basis::kInferred);
  EXPECT_EQ(Drive("kollmorgen-mkd-n").FindFaultObject(0x2001, 0), nullptr) << "the number of slots";
}

}  // namespace
}  // namespace ecaudit::device
