#include "analyzers/model/slot_modules.h"

#include <cstdint>
#include <optional>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace ecaudit::model {
namespace {

using ::testing::ElementsAre;
using ::testing::Optional;
using Bytes = std::vector<std::uint8_t>;

struct Told {
  mailbox::SdoService service = mailbox::SdoService::kUpload;
  std::uint16_t index = 0xF050;
  std::uint8_t subindex = 0;
  Bytes data;
  bool complete_access = false;
  mailbox::SdoOutcome outcome = mailbox::SdoOutcome::kCompleted;
};

void Tell(SlotModules& modules, const Told& told) {
  mailbox::SdoTransfer transfer;
  transfer.service = told.service;
  transfer.outcome = told.outcome;
  transfer.has_object = true;
  transfer.index = told.index;
  transfer.subindex = told.subindex;
  transfer.complete_access = told.complete_access;
  transfer.data = ByteSpan(told.data.data(), told.data.size());
  transfer.size = told.data.size();
  modules.Apply(transfer);
}

TEST(SlotModules, AreKnownOnceTheListIsWhole) {
  SlotModules modules;
  EXPECT_FALSE(modules.TakeChanged());
  Tell(modules, {.subindex = 1, .data = {0x11, 0, 0, 0}});
  EXPECT_EQ(modules.Idents(), std::nullopt) << "how many there are is not known";
  Tell(modules, {.subindex = 0, .data = {2}});
  EXPECT_EQ(modules.Idents(), std::nullopt) << "the second is not known";
  Tell(modules, {.subindex = 2, .data = {0x22, 0, 0x01, 0}});
  EXPECT_THAT(modules.Idents(), Optional(ElementsAre(0x11U, 0x10022U)));
  EXPECT_TRUE(modules.TakeChanged());
  EXPECT_FALSE(modules.TakeChanged());
}

TEST(SlotModules, WithCompleteAccess) {
  SlotModules modules;
  Tell(modules, {.data = {2, 0, 1, 0, 0, 0, 2, 0, 0, 0}, .complete_access = true});
  EXPECT_THAT(modules.Idents(), Optional(ElementsAre(1U, 2U)));
}

TEST(SlotModules, ConfiguredBeforeDetected) {
  SlotModules modules;
  Tell(modules, {.data = {1, 0, 1, 0, 0, 0}, .complete_access = true});
  const auto configure = [&](std::uint8_t subindex, Bytes data) {
    Tell(modules, {.service = mailbox::SdoService::kDownload, .index = 0xF030, .subindex = subindex, .data = data});
  };
  configure(0, {0});
  EXPECT_THAT(modules.Idents(), Optional(ElementsAre(1U))) << "a master empties the list before it writes it";
  configure(1, {7, 0, 0, 0});
  configure(0, {1});
  EXPECT_THAT(modules.Idents(), Optional(ElementsAre(7U)));
}

TEST(SlotModules, WhatFailedTellsNothing) {
  SlotModules modules;
  Tell(modules, {.data = {1, 0, 1, 0, 0, 0}, .complete_access = true, .outcome = mailbox::SdoOutcome::kAborted});
  Tell(modules, {.service = mailbox::SdoService::kDownload, .data = {0}});  // F050h cannot be written
  EXPECT_EQ(modules.Idents(), std::nullopt);
  EXPECT_FALSE(modules.TakeChanged());
}

}  // namespace
}  // namespace ecaudit::model
