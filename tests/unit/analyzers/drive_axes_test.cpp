// Several axes of one drive: ETG.6010 says where their objects lie.
#include "analyzers/model/drive_axes.h"

#include <array>
#include <vector>

#include <gtest/gtest.h>

#include "analyzers/model/model_events.h"
#include "analyzers/wiring/event_bus.h"
#include "decoder/device/profile_registry.h"

namespace ecaudit {
namespace {

using device::DriveState;
using model::DriveAxes;

TEST(DriveAxes, WordsLieSoFarApart) {
  constexpr unsigned kDistance = 0x800;
  for (std::uint8_t axis = 0; axis < 8; ++axis) {
    const unsigned offset = axis * kDistance;
    EXPECT_EQ(DriveAxes::AxisOfWord(static_cast<std::uint16_t>(0x6040 + offset), 0, 16), axis);
    EXPECT_EQ(DriveAxes::AxisOfWord(static_cast<std::uint16_t>(0x6041 + offset), 0, 16), axis);
    EXPECT_EQ(DriveAxes::AxisOfWord(static_cast<std::uint16_t>(0x6042 + offset), 0, 16), std::nullopt);
    EXPECT_EQ(DriveAxes::AxisOfWord(static_cast<std::uint16_t>(0x6041 + offset), 1, 16), std::nullopt);
    EXPECT_EQ(DriveAxes::AxisOfWord(static_cast<std::uint16_t>(0x6041 + offset), 0, 8), std::nullopt);
  }
  EXPECT_EQ(DriveAxes::AxisOfWord(0xA040, 0, 16), std::nullopt);
  EXPECT_EQ(DriveAxes::AxisOfWord(0x5840, 0, 16), std::nullopt);
}

class AxesLog : public EventBus {
 public:
  AxesLog() { ListenTo<model::DriveStateChanged, model::DriveFaultExplained, model::DriveMode>(Stage::kModel, *this); }
  void On(const model::DriveStateChanged& e) { states.push_back(e); }
  void On(const model::DriveFaultExplained& e) { explained.push_back(e); }
  void On(const model::DriveMode& e) { modes.push_back(e); }

  std::vector<model::DriveStateChanged> states;
  std::vector<model::DriveFaultExplained> explained;
  std::vector<model::DriveMode> modes;
};

class DriveOfAxes : public testing::Test {
 protected:
  DriveOfAxes() : al_(0, log_), axes_(0, al_, log_) { axes_.SetFamily(*device::BuiltinProfile("generic")); }

  void Upload(std::uint16_t index, std::uint16_t value, std::size_t size = 2) {
    const std::array<std::uint8_t, 2> bytes{static_cast<std::uint8_t>(value), static_cast<std::uint8_t>(value >> 8U)};
    mailbox::SdoTransfer transfer;
    transfer.slave = 0;
    transfer.service = mailbox::SdoService::kUpload;
    transfer.has_object = true;
    transfer.index = index;
    transfer.data = ByteSpan(bytes).first(size);
    transfer.size = static_cast<std::uint32_t>(size);
    transfer.request = {++frame_, 0, true};
    transfer.response = {++frame_, 0, true};
    axes_.OnSdo(transfer);
  }

  AxesLog log_;
  model::AlMachine al_;
  DriveAxes axes_;
  FrameNo frame_ = 0;
};

TEST_F(DriveOfAxes, EachHasItsState) {
  EXPECT_FALSE(axes_.seen());
  Upload(0x6041, 0x0227);
  Upload(0x7041, 0x0228);
  ASSERT_EQ(log_.states.size(), 2U);
  EXPECT_EQ(log_.states[0].axis, 0);
  EXPECT_EQ(log_.states[1].axis, 2);
  EXPECT_EQ(log_.states[1].to, DriveState::kFault);
  EXPECT_EQ(axes_.axis(0).status().state, DriveState::kOperationEnabled);
  EXPECT_EQ(axes_.axis(2).status().state, DriveState::kFault);
  std::vector<unsigned> seen;
  axes_.ForEachSeen([&](const model::DriveUnit& unit) { seen.push_back(unit.axis()); });
  EXPECT_EQ(seen, (std::vector<unsigned>{0, 2}));
}

TEST_F(DriveOfAxes, ReasonsAreTheAxisOwnWhereTheObjectIs) {
  Upload(0x6041, 0x0228);
  Upload(0x6841, 0x0228);
  Upload(0x683F, 0x7305);
  ASSERT_EQ(log_.explained.size(), 1U);
  EXPECT_EQ(log_.explained[0].axis, 1);
  EXPECT_EQ(log_.explained[0].code, 0x7305U);
  Upload(0x6861, 8, 1);
  ASSERT_EQ(log_.modes.size(), 1U);
  EXPECT_EQ(log_.modes[0].axis, 1);
  EXPECT_EQ(axes_.axis(0).modes().shown(), std::nullopt);
}

TEST_F(DriveOfAxes, ANumberOfEntriesIsNoStatusWord) {
  Upload(0x7041, 8, 1);
  EXPECT_FALSE(axes_.seen());
}

}  // namespace
}  // namespace ecaudit
