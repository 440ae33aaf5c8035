// What a slave's process data hold, from each source and combination of sources (ETG.1000.6 5.6.7.4).
#include "analyzers/model/process_data.h"

#include <vector>

#include <gtest/gtest.h>

#include "decoder/device/profile_registry.h"

namespace ecaudit::model {
namespace {

using device::PdoContent;
using device::PdoDirection;

/// One slave with its parts; feeds transfers as the tracker reports them.
class ProcessDataTest : public testing::Test {
 protected:
  ProcessDataTest() { process_.SetFamily(*device::BuiltinProfile("kollmorgen-akd-2011")); }

  void Write(std::uint16_t index, std::uint8_t subindex, std::vector<std::uint8_t> bytes,
             mailbox::SdoOutcome outcome = mailbox::SdoOutcome::kCompleted) {
    mailbox::SdoTransfer sdo;
    sdo.service = mailbox::SdoService::kDownload;
    sdo.has_object = true;
    sdo.index = index;
    sdo.subindex = subindex;
    sdo.data = bytes;
    sdo.size = bytes.size();
    sdo.outcome = outcome;
    sdo.request.number = frame_++;
    if (outcome == mailbox::SdoOutcome::kCompleted) sdo.response.number = frame_++;
    process_.Apply(sdo);
  }
  void SetSyncManager(std::size_t n, std::uint16_t length) {
    const auto low = static_cast<std::uint8_t>(length);
    const auto high = static_cast<std::uint8_t>(length >> 8U);
    const std::vector<std::uint8_t> bytes{0x00, 0x11, low, high, 0x24, 0x00, 0x01, 0x00};
    state_.registers.Write(esc::SyncManagerAddress(n), bytes, Certainty::kObserved);
    ++state_.mapping_version;
  }
  /// The master reads four words of the EEPROM, as TwinCAT does: command, then status, address and data in one.
  void ReadEeprom(std::uint16_t word, std::vector<std::uint16_t> words) {
    words.resize(4, 0xFFFF);
    const auto low = static_cast<std::uint8_t>(word);
    const auto high = static_cast<std::uint8_t>(word >> 8U);
    const std::vector<std::uint8_t> command{0x00, 0x01, low, high, 0, 0};
    std::vector<std::uint8_t> answer{0x40, 0x00, low, high, 0, 0};
    for (const std::uint16_t w : words) {
      answer.push_back(static_cast<std::uint8_t>(w));
      answer.push_back(static_cast<std::uint8_t>(w >> 8U));
    }
    track::SlaveAccess access;
    access.address = 0x0502;
    access.acceptance = track::Acceptance::kAccepted;
    access.sent.number = frame_++;
    access.returned.number = frame_++;
    access.command = wire::Command::FPWR;
    access.written = command;
    state_.sii.OnAccess(access, nullptr);
    access.command = wire::Command::FPRD;
    access.written = {};
    access.read = answer;
    access.sent.number = frame_++;
    access.returned.number = frame_++;
    state_.sii.OnAccess(access, nullptr);
    process_.OnDescriptionChanged();
  }
  track::SlaveState state_;
  events::ObjectNames names_;
  ProcessData process_{state_, names_};
  FrameNo frame_ = 100;
};

TEST_F(ProcessDataTest, NothingSeenIsUnknownWithAReason) {
  EXPECT_EQ(process_.rx().source, LayoutSource::kUnknown);
  EXPECT_FALSE(process_.rx().known());
  EXPECT_NE(process_.rx().reason.find("1C12h"), std::string::npos) << process_.rx().reason;
  EXPECT_NE(process_.tx().reason.find("1C13h"), std::string::npos);
}

TEST_F(ProcessDataTest, AFixedPdoIsDecodedByTheManual) {
  // AKD manual 4.5: 1701h is the position command value (60C1h:1, four bytes) and the control word.
  Write(0x1C12, 0, {0});
  Write(0x1C12, 1, {0x01, 0x17});
  Write(0x1C12, 0, {1});
  const ProcessLayout& rx = process_.rx();
  ASSERT_TRUE(rx.known()) << rx.reason;
  EXPECT_EQ(rx.source, LayoutSource::kObserved);
  EXPECT_EQ(rx.since, 105U) << "the answer to the last download";
  EXPECT_EQ(rx.pdos, std::vector<std::uint16_t>{0x1701});
  EXPECT_EQ(rx.bytes(), 6U);
  ASSERT_NE(rx.Find(0x60C1, 1), nullptr);
  EXPECT_EQ(rx.Find(0x60C1, 1)->bit_offset, 0U);
  const Signal* control = rx.Find(0x6040, 0);
  ASSERT_NE(control, nullptr);
  EXPECT_EQ(control->bits, 16);
  EXPECT_EQ(control->bit_offset, 32U);
  EXPECT_EQ(control->sync_manager, 2);
  EXPECT_FALSE(control->name.empty());
  EXPECT_FALSE(process_.tx().known());
}

TEST_F(ProcessDataTest, OffsetsRunOnThroughPdosAndGaps) {
  Write(0x1A00, 0, {2});
  Write(0x1A00, 1, {0x10, 0x00, 0x41, 0x60});
  Write(0x1A00, 2, {0x08, 0x00, 0x00, 0x00});
  Write(0x1A01, 0, {1});
  Write(0x1A01, 1, {0x20, 0x00, 0x63, 0x60});
  Write(0x1C13, 0, {2});
  Write(0x1C13, 1, {0x00, 0x1A});
  Write(0x1C13, 2, {0x01, 0x1A});
  const ProcessLayout& tx = process_.tx();
  ASSERT_TRUE(tx.known()) << tx.reason;
  ASSERT_EQ(tx.signals.size(), 3U);
  EXPECT_EQ(tx.signals[0].bit_offset, 0U);
  EXPECT_TRUE(tx.signals[1].gap());
  EXPECT_EQ(tx.signals[2].bit_offset, 24U);
  EXPECT_EQ(tx.signals[2].sync_manager, 3);
  EXPECT_EQ(tx.bytes(), 7U);
  EXPECT_EQ(tx.bytes_of(3), 7U);
  EXPECT_EQ(tx.bytes_of(2), 0U);
}

TEST_F(ProcessDataTest, ContentsThatWereNeverSeenStayUnknown) {
  Write(0x1C12, 1, {0x00, 0x16});
  Write(0x1C12, 0, {1});
  const ProcessLayout& rx = process_.rx();
  EXPECT_EQ(rx.source, LayoutSource::kObserved);
  EXPECT_FALSE(rx.known());
  EXPECT_NE(rx.reason.find("1600h"), std::string::npos) << rx.reason;
  EXPECT_EQ(rx.pdos, std::vector<std::uint16_t>{0x1600});
}

TEST_F(ProcessDataTest, APartOfTheAssignmentConfirmsOrExcludesTheDefault) {
  PdoContent pdo;
  pdo.index = 0x1701;
  pdo.sync_manager = 2;
  pdo.entries = {{0x6040, 0, 16, device::DataType::kUnsigned16, "Word", {}, ""}};
  device::EniSlave eni;
  eni.pdos = {pdo};
  const device::EniConfig config;
  process_.SetEni(&eni, &config);
  Write(0x1C12, 1, {0x01, 0x17});
  EXPECT_TRUE(process_.rx().known()) << process_.rx().reason;
  EXPECT_EQ(process_.rx().source, LayoutSource::kEni);
  Write(0x1C12, 1, {0x02, 0x17});
  EXPECT_FALSE(process_.rx().known());
  EXPECT_EQ(process_.rx().source, LayoutSource::kUnknown);
  EXPECT_NE(process_.rx().reason.find("only a part"), std::string::npos);
}

TEST_F(ProcessDataTest, MappingSeenTakesTheNamesOfThePdoThatTheManualPrints) {
  // AKD manual 4.5: 1B01h is the position actual value and the status word.
  Write(0x1B01, 0, {2});
  Write(0x1B01, 1, {0x20, 0x00, 0x63, 0x60});
  Write(0x1B01, 2, {0x10, 0x00, 0x41, 0x60});
  Write(0x1C13, 0, {1});
  Write(0x1C13, 1, {0x01, 0x1B});
  ASSERT_TRUE(process_.tx().known()) << process_.tx().reason;
  ASSERT_NE(process_.tx().Find(0x6063, 0), nullptr);
  EXPECT_NE(process_.tx().Find(0x6063, 0)->name, "");
  EXPECT_FALSE(process_.tx().Find(0x6063, 0)->name_inferred);
}

TEST_F(ProcessDataTest, ScaleIsThatOfTheProcessDataWhereTheManualHasAnother) {
  process_.SetFamily(*device::BuiltinProfile("kollmorgen-mkd-n"));
  Write(0x1A00, 0, {0});
  Write(0x1A00, 1, {0x20, 0x00, 0x6C, 0x60});  // "PDO in RPM", 1000:1 by SDO
  Write(0x1A00, 2, {0x20, 0x00, 0x7B, 0x54});  // 1000:1
  Write(0x1A00, 0, {2});
  Write(0x1C13, 0, {0});
  Write(0x1C13, 1, {0x00, 0x1A});
  Write(0x1C13, 0, {1});
  ASSERT_EQ(process_.tx().signals.size(), 2U) << process_.tx().reason;
  EXPECT_EQ(process_.tx().signals[0].scale, "1:1");
  EXPECT_TRUE(process_.tx().signals[0].scaled_by_sdo);
  EXPECT_EQ(process_.tx().signals[1].scale, "1000:1");
}

TEST_F(ProcessDataTest, APartOfTheAssignmentIsNotEnough) {
  Write(0x1C12, 0, {2});
  Write(0x1C12, 1, {0x01, 0x17});
  EXPECT_FALSE(process_.rx().known());
  Write(0x1C12, 2, {0x22, 0x17});
  EXPECT_EQ(process_.rx().pdos.size(), 2U);
}

TEST_F(ProcessDataTest, AnEmptyAssignmentIsKnownAndHasNoBytes) {
  Write(0x1C12, 0, {0});
  EXPECT_TRUE(process_.rx().known());
  EXPECT_EQ(process_.rx().bytes(), 0U);
}

TEST_F(ProcessDataTest, WithoutAnswersItIsAssumed) {
  Write(0x1C12, 1, {0x01, 0x17}, mailbox::SdoOutcome::kNotCaptured);
  Write(0x1C12, 0, {1}, mailbox::SdoOutcome::kNotCaptured);
  EXPECT_TRUE(process_.rx().known());
  EXPECT_TRUE(process_.rx().assumed);
}

TEST_F(ProcessDataTest, ARefusedDownloadChangesNothing) {
  Write(0x1C12, 0, {0}, mailbox::SdoOutcome::kAborted);
  EXPECT_EQ(process_.rx().source, LayoutSource::kUnknown);
}

TEST_F(ProcessDataTest, EniNamesTheAssignmentUntilItIsSeen) {
  device::EniSlave eni;
  eni.pdos.resize(1);
  const device::EniConfig config;
  eni.pdos[0].index = 0x1600;
  eni.pdos[0].direction = PdoDirection::kRx;
  eni.pdos[0].sync_manager = 2;
  eni.pdos[0].entries = {{0x6040, 0, 16, device::DataType::kUnsigned16, "CW", device::Confidence::kPrinted, ""}};
  process_.SetEni(&eni, &config);
  ASSERT_TRUE(process_.rx().known()) << process_.rx().reason;
  EXPECT_EQ(process_.rx().source, LayoutSource::kEni);
  EXPECT_EQ(process_.rx().bytes(), 2U);
  Write(0x1C12, 0, {0});
  EXPECT_EQ(process_.rx().source, LayoutSource::kObserved);
  EXPECT_EQ(process_.rx().bytes(), 0U);
}

TEST_F(ProcessDataTest, VariablesOfTheEniNameWhatLiesAtTheirPlace) {
  device::EniSlave eni;
  eni.pdos.resize(1);
  eni.pdos[0].index = 0x1600;
  eni.pdos[0].direction = PdoDirection::kRx;
  eni.pdos[0].sync_manager = 2;
  eni.pdos[0].entries = {{0x6040, 0, 16, device::DataType::kUnsigned16, "CW", device::Confidence::kPrinted, ""},
                         {0x60C1, 1, 32, device::DataType::kInteger32, "Pos", device::Confidence::kPrinted, ""}};
  eni.outputs = {{160, 48}};
  device::EniConfig config;
  config.outputs.variables = {{"Axis.CW", "", "UINT", 16, 160}, {"Axis.Half", "", "UINT", 16, 176}};
  process_.SetEni(&eni, &config);
  ASSERT_EQ(process_.rx().signals.size(), 2U);
  EXPECT_EQ(process_.rx().signals[0].variable, "Axis.CW");
  EXPECT_EQ(process_.rx().signals[1].variable, "") << "only half of the entry";
  // What is copied there from an input is called after that.
  config.inputs.variables = {{"Encoder.Position", "", "DINT", 32, 64}};
  config.cyclic.resize(1);
  config.cyclic[0].frames.resize(1);
  config.cyclic[0].frames[0].commands.resize(1);
  config.cyclic[0].frames[0].commands[0].copies = {{64, 176, 32}};
  process_.OnDescriptionChanged();
  EXPECT_EQ(process_.rx().signals[1].variable, "copy of Encoder.Position");
  // The master's place for the slave has another size than what the slave has mapped: nothing can be said.
  eni.outputs = {{160, 32}};
  process_.OnDescriptionChanged();
  EXPECT_EQ(process_.rx().signals[0].variable, "");
}

TEST_F(ProcessDataTest, ADefaultThatDoesNotFitTheSyncManagerIsContradicted) {
  device::EniSlave eni;
  eni.pdos.resize(1);
  const device::EniConfig config;
  eni.pdos[0].index = 0x1600;
  eni.pdos[0].sync_manager = 2;
  eni.pdos[0].entries = {{0x6040, 0, 16, device::DataType::kUnsigned16, "CW", device::Confidence::kPrinted, ""}};
  process_.SetEni(&eni, &config);
  SetSyncManager(2, 2);
  EXPECT_TRUE(process_.rx().known());
  SetSyncManager(2, 6);
  EXPECT_TRUE(process_.rx().contradicted);
  EXPECT_FALSE(process_.rx().known());
  EXPECT_EQ(process_.rx().reason, "the default PDOs fill 2 bytes, but sync manager 2 is set to 6 bytes");
}

/// An EEPROM without lists of PDOs: of a coupler without mailbox it means that there are none, of a slave with CoE that
/// only 1C12h and 1C13h tell.
TEST_F(ProcessDataTest, EepromWithoutPdosTellsOnlyOfSlavesWithoutCoe) {
  ReadEeprom(0x40, {30, 1, 0x0000, 0xFFFF});  // one category, and the end mark
  EXPECT_FALSE(process_.rx().known()) << "what protocols it has is not known";
  ReadEeprom(0x1C, {0x0004, 0, 0, 0});  // CoE
  EXPECT_EQ(process_.rx().reason,
            "the assignment 1C12h is not in the capture, and the EEPROM lists no PDO, which leaves them to CoE");
  EXPECT_FALSE(process_.tx().known());
  ReadEeprom(0x1C, {0x0000, 0, 0, 0});
  EXPECT_TRUE(process_.rx().known());
  EXPECT_EQ(process_.rx().source, LayoutSource::kDefault);
  EXPECT_EQ(process_.rx().bytes(), 0U);
  EXPECT_TRUE(process_.tx().known());
}

TEST_F(ProcessDataTest, EepromOfACoeSlaveTellsADirectionWithoutPdos) {
  ReadEeprom(0x1C, {0x0004, 0, 0, 0});
  // TxPDO category of one PDO, 1A00h with 6041h in sync manager 3; then the end mark.
  ReadEeprom(0x40, {50, 8, 0x1A00, 0x0301});
  ReadEeprom(0x44, {0x0000, 0x0000, 0x6041, 0x0000});
  ReadEeprom(0x48, {0x1006, 0x0000, 0xFFFF, 0xFFFF});
  EXPECT_TRUE(process_.tx().known()) << process_.tx().reason;
  EXPECT_EQ(process_.tx().bytes(), 2U);
  EXPECT_TRUE(process_.rx().known()) << process_.rx().reason;
  EXPECT_EQ(process_.rx().bytes(), 0U);
}

TEST_F(ProcessDataTest, CoeSlaveWithoutSyncManagerOfProcessDataHasNone) {
  ReadEeprom(0x1C, {0x0004, 0, 0, 0});
  // Sync managers: mailbox out, mailbox in, inputs; then the end mark.
  ReadEeprom(0x40, {41, 12, 0x1000, 0x0080});
  ReadEeprom(0x44, {0x0026, 0x0101, 0x1080, 0x0080});
  ReadEeprom(0x48, {0x0022, 0x0201, 0x1100, 0x0000});
  ReadEeprom(0x4C, {0x0020, 0x0401, 0xFFFF, 0xFFFF});
  ReadEeprom(0x50, {0xFFFF, 0xFFFF, 0xFFFF, 0xFFFF});
  EXPECT_TRUE(process_.rx().known()) << process_.rx().reason;
  EXPECT_EQ(process_.rx().bytes(), 0U);
  EXPECT_FALSE(process_.tx().known());
}

TEST_F(ProcessDataTest, AnObservedMappingIsNotDoubtedForItsLength) {
  Write(0x1C12, 1, {0x01, 0x17});
  Write(0x1C12, 0, {1});
  SetSyncManager(2, 99);
  EXPECT_TRUE(process_.rx().known());
  EXPECT_FALSE(process_.rx().contradicted);
}

TEST_F(ProcessDataTest, VersionChangesWithEveryInput) {
  std::uint64_t before = process_.version();
  const auto changed = [&] {
    const bool is = process_.version() != before;
    before = process_.version();
    return is;
  };
  Write(0x1C12, 0, {0});
  EXPECT_TRUE(changed());
  Write(0x1C12, 0, {0});
  EXPECT_FALSE(changed()) << "the same value again";
  SetSyncManager(2, 4);
  EXPECT_TRUE(changed());
  process_.OnDescriptionChanged();
  EXPECT_TRUE(changed());
}

/// 606Ch of an MKD-N: 1000:1 by SDO, in rpm in process data.
TEST_F(ProcessDataTest, ProcessDataHaveTheirOwnScale) {
  const device::DeviceDescription& family = *device::BuiltinProfile("kollmorgen-mkd-n");
  process_.SetFamily(family);
  Write(0x1C13, 0, {0});
  Write(0x1C13, 1, {0x20, 0x1B});
  Write(0x1C13, 0, {1});
  const Signal* velocity = process_.tx().Find(0x606C, 0);
  ASSERT_NE(velocity, nullptr);
  EXPECT_EQ(velocity->scale, "1:1");
  EXPECT_EQ(velocity->unit, "rpm");
  EXPECT_EQ(family.object(0x606C, 0)->scale, "1000:1");
  const Signal* input = process_.tx().Find(0x3470, 4);
  ASSERT_NE(input, nullptr);
  EXPECT_EQ(input->scale, "1000:1") << "no scale of its own in process data";
}

}  // namespace
}  // namespace ecaudit::model
