#include "decoder/process/pdo_mapping.h"

#include <vector>

#include <gtest/gtest.h>

namespace ecaudit::process {
namespace {

using mailbox::SdoOutcome;
using mailbox::SdoService;

/// One transfer as the tracker reports it.
struct Transfer {
  std::vector<std::uint8_t> bytes;
  mailbox::SdoTransfer sdo;

  Transfer(SdoService service, std::uint16_t index, std::uint8_t subindex, std::vector<std::uint8_t> data)
      : bytes(std::move(data)) {
    sdo.service = service;
    sdo.has_object = true;
    sdo.index = index;
    sdo.subindex = subindex;
    sdo.data = bytes;
    sdo.size = bytes.size();
    sdo.outcome = SdoOutcome::kCompleted;
    sdo.response.number = 10;
  }
};

TEST(PdoMapping, TheSequenceOfTheManualsSelectsAFixedPdo) {
  // AKD manual, 4.5: 1C12h:0 = 0, 1C12h:1 = 1701h, 1C12h:0 = 1.
  PdoMapping mapping;
  EXPECT_FALSE(mapping.Assigned(kRxAssignment));
  EXPECT_TRUE(mapping.Apply(Transfer(SdoService::kDownload, 0x1C12, 0, {0}).sdo));
  EXPECT_EQ(mapping.Assigned(kRxAssignment)->size(), 0U);
  mapping.Apply(Transfer(SdoService::kDownload, 0x1C12, 1, {0x01, 0x17}).sdo);
  mapping.Apply(Transfer(SdoService::kDownload, 0x1C12, 0, {1}).sdo);
  EXPECT_EQ(mapping.Assigned(kRxAssignment), (std::vector<std::uint16_t>{0x1701}));
  EXPECT_FALSE(mapping.Mapped(0x1701)) << "contents were never seen";
}

TEST(PdoMapping, WhatMayHaveBeenWrittenIsForgotten) {
  PdoMapping mapping;
  mapping.Apply(Transfer(SdoService::kUpload, 0x1C12, 0, {1}).sdo);
  mapping.Apply(Transfer(SdoService::kUpload, 0x1C12, 1, {0x00, 0x16}).sdo);
  EXPECT_TRUE(mapping.Forget(kRxAssignment, 1, false));
  EXPECT_FALSE(mapping.Forget(kRxAssignment, 1, false)) << "it is gone";
  EXPECT_FALSE(mapping.Assigned(kRxAssignment));
  EXPECT_TRUE(mapping.Find(kRxAssignment)->count.if_known()) << "another subindex stays";
  EXPECT_TRUE(mapping.Forget(kRxAssignment, 0, true));
  EXPECT_FALSE(mapping.Find(kRxAssignment)->count.if_known());
  EXPECT_TRUE(mapping.Find(kRxAssignment)->count_lost);
  mapping.Apply(Transfer(SdoService::kDownload, 0x1C12, 0, {0}).sdo);
  EXPECT_FALSE(mapping.Find(kRxAssignment)->count_lost);
  EXPECT_EQ(mapping.Assigned(kRxAssignment)->size(), 0U);
  EXPECT_FALSE(mapping.Forget(kTxAssignment, 0, true)) << "nothing was known of it";
}

TEST(PdoMapping, AnAbortedUploadShowsThatThereIsNoSuchPdo) {
  constexpr std::uint32_t kNoObject = 0x06020000;
  PdoMapping mapping;
  Transfer upload(SdoService::kUpload, 0x1A1A, 0, {});
  upload.sdo.outcome = SdoOutcome::kAborted;
  upload.sdo.abort_code = kNoObject;
  upload.sdo.last.number = 12;
  EXPECT_FALSE(mapping.Apply(upload.sdo)) << "nothing of the mapping changes";
  ASSERT_NE(mapping.MissingSince(0x1A1A), nullptr);
  EXPECT_EQ(*mapping.MissingSince(0x1A1A), 12U);
  EXPECT_EQ(mapping.MissingSince(0x1A00), nullptr);
  EXPECT_EQ(mapping.Find(0x1A1A), nullptr);

  mapping.Apply(Transfer(SdoService::kUpload, 0x1A1A, 0, {1}).sdo);
  EXPECT_EQ(mapping.MissingSince(0x1A1A), nullptr) << "now it is there";

  upload.sdo.aborted_by = mailbox::Direction::kOut;
  mapping.Apply(upload.sdo);
  EXPECT_EQ(mapping.MissingSince(0x1A1A), nullptr) << "the master gave up";
  for (unsigned n = 0; n < 2 * PdoMapping::kMaxMissing; ++n) {
    upload.sdo.aborted_by = mailbox::Direction::kIn;
    upload.sdo.index = static_cast<std::uint16_t>(0x1A00U + n);
    mapping.Apply(upload.sdo);
  }
  EXPECT_NE(mapping.MissingSince(0x1A00), nullptr);
  EXPECT_EQ(mapping.MissingSince(0x1A00 + PdoMapping::kMaxMissing), nullptr) << "no more are kept";
  mapping.Clear();
  EXPECT_EQ(mapping.MissingSince(0x1A00), nullptr);
}

TEST(PdoMapping, AnEntryBelowOthersIsLeftOut) {
  PdoMapping mapping;
  mapping.Apply(Transfer(SdoService::kDownload, 0x1600, 0, {0}).sdo);
  EXPECT_EQ(mapping.Find(0x1600)->left_out(), 0);
  mapping.Apply(Transfer(SdoService::kDownload, 0x1600, 1, {0x10, 0x00, 0x40, 0x60}).sdo);
  EXPECT_EQ(mapping.Find(0x1600)->left_out(), 0);
  mapping.Apply(Transfer(SdoService::kDownload, 0x1600, 3, {0x20, 0x00, 0x7A, 0x60}).sdo);
  EXPECT_EQ(mapping.Find(0x1600)->left_out(), 2);
  for (unsigned n = 1; n <= UINT8_MAX; ++n) {
    mapping.Apply(Transfer(SdoService::kDownload, 0x1601, static_cast<std::uint8_t>(n), {1, 0, 0, 0x70}).sdo);
  }
  EXPECT_EQ(mapping.Find(0x1601)->left_out(), 0);
}

TEST(PdoMapping, UploadsTeachAsMuchAsDownloads) {
  PdoMapping mapping;
  mapping.Apply(Transfer(SdoService::kUpload, 0x1600, 0, {2}).sdo);
  EXPECT_FALSE(mapping.Mapped(0x1600)) << "two entries announced, none seen";
  mapping.Apply(Transfer(SdoService::kUpload, 0x1600, 1, {0x10, 0x00, 0x40, 0x60}).sdo);
  mapping.Apply(Transfer(SdoService::kUpload, 0x1600, 2, {0x08, 0x01, 0x00, 0x00}).sdo);
  EXPECT_EQ(mapping.Mapped(0x1600), (std::vector<MappingEntry>{{0x6040, 0, 16}, {0x0000, 1, 8}}));
}

TEST(PdoMapping, CompleteAccessHasATwoByteCount) {
  PdoMapping mapping;
  Transfer assignment(SdoService::kUpload, 0x1C13, 0, {2, 0, 0x00, 0x1A, 0x01, 0x1A});
  assignment.sdo.complete_access = true;
  mapping.Apply(assignment.sdo);
  EXPECT_EQ(mapping.Assigned(kTxAssignment), (std::vector<std::uint16_t>{0x1A00, 0x1A01}));
  Transfer entries(SdoService::kDownload, 0x1A00, 0, {1, 0, 0x10, 0x00, 0x41, 0x60});
  entries.sdo.complete_access = true;
  mapping.Apply(entries.sdo);
  EXPECT_EQ(mapping.Mapped(0x1A00), (std::vector<MappingEntry>{{0x6041, 0, 16}}));
}

TEST(PdoMapping, WhatFailedOrIsIncompleteTeachesNothing) {
  PdoMapping mapping;
  Transfer aborted(SdoService::kDownload, 0x1C12, 0, {1});
  aborted.sdo.outcome = SdoOutcome::kAborted;
  EXPECT_FALSE(mapping.Apply(aborted.sdo));
  Transfer gap(SdoService::kUpload, 0x1C12, 0, {1});
  gap.sdo.data_gap = true;
  EXPECT_FALSE(mapping.Apply(gap.sdo));
  EXPECT_FALSE(mapping.Apply(Transfer(SdoService::kUpload, 0x6040, 0, {1, 0}).sdo)) << "no PDO object";
  EXPECT_EQ(mapping.Find(0x1C12), nullptr);
}

TEST(PdoMapping, WithoutAnswersDownloadsAreInferred) {
  PdoMapping mapping;
  Transfer sent(SdoService::kDownload, 0x1C12, 0, {0});
  sent.sdo.outcome = SdoOutcome::kNotCaptured;
  EXPECT_TRUE(mapping.Apply(sent.sdo));
  EXPECT_EQ(mapping.Find(0x1C12)->count.certainty(), Certainty::kInferred);
}

TEST(PdoMapping, VersionChangesOnlyWithNews) {
  PdoMapping mapping;
  mapping.Apply(Transfer(SdoService::kUpload, 0x1C12, 0, {1}).sdo);
  const std::uint32_t version = mapping.version();
  EXPECT_FALSE(mapping.Apply(Transfer(SdoService::kUpload, 0x1C12, 0, {1}).sdo));
  EXPECT_EQ(mapping.version(), version);
}

TEST(PdoMapping, MemoryIsBounded) {
  PdoMapping mapping;
  for (unsigned pdo = 0; pdo < 0x200; ++pdo) {
    for (unsigned sub = 1; sub < 256; ++sub) {
      mapping.Apply(Transfer(SdoService::kDownload, static_cast<std::uint16_t>(0x1600 + pdo),
                             static_cast<std::uint8_t>(sub), {1, 2, 3, 4})
                        .sdo);
    }
  }
  std::size_t values = 0;
  for (unsigned pdo = 0; pdo < 0x200; ++pdo) {
    const PdoObject* object = mapping.Find(static_cast<std::uint16_t>(0x1600 + pdo));
    values += object != nullptr ? object->values.size() : 0;
  }
  EXPECT_EQ(values, PdoMapping::kMaxValues);
}

}  // namespace
}  // namespace ecaudit::process
