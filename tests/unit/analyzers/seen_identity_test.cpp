// What a slave is, by EEPROM words 8 to 15 and objects 1018h and 1008h (ETG.1000.6, ETG.2010).
#include "analyzers/model/seen_identity.h"

#include <vector>

#include <gtest/gtest.h>

namespace ecaudit::model {
namespace {

using Source = track::IdentityLearned::Source;
using Bytes = std::vector<std::uint8_t>;

track::IdentityLearned Eeprom(std::optional<std::uint32_t> vendor, std::optional<std::uint32_t> product) {
  track::IdentityLearned event;
  event.frame.number = 10;
  event.vendor_id = vendor;
  event.product_code = product;
  return event;
}

mailbox::SdoTransfer Upload(std::uint16_t index, std::uint8_t subindex, const Bytes& data) {
  mailbox::SdoTransfer transfer;
  transfer.service = mailbox::SdoService::kUpload;
  transfer.has_object = true;
  transfer.index = index;
  transfer.subindex = subindex;
  transfer.data = data;
  transfer.size = data.size();
  transfer.response.number = 20;
  return transfer;
}

Bytes Number(std::uint8_t low) {
  return {low, 0, 0, 0};
}

TEST(SeenIdentity, ObjectAgainstEepromRowByRow) {
  struct Row {
    const char* what;
    std::optional<std::uint32_t> vendor, product;  // of the EEPROM
    std::uint8_t subindex, value;                  // of 1018h
    bool learned;
    std::optional<std::uint32_t> vendor_then, product_then;
    Source source;
  };
  for (const Row& row : {
           Row{"only the object", {}, {}, 1, 7, true, 7, {}, Source::kObject1018},
           Row{"the product was missing", 7, {}, 2, 8, true, 7, 8, Source::kObject1018},
           Row{"the vendor was missing", {}, 8, 1, 7, true, 7, 8, Source::kEeprom},
           Row{"the serial number was missing", 7, 8, 4, 9, true, 7, 8, Source::kEeprom},
           Row{"the EEPROM has another product", 7, 8, 2, 9, false, 7, 8, Source::kEeprom},
           Row{"it has the same", 7, 8, 2, 8, false, 7, 8, Source::kEeprom},
           Row{"the number of entries", 7, {}, 0, 4, false, 7, {}, Source::kEeprom},
           Row{"no such entry", 7, {}, 5, 4, false, 7, {}, Source::kEeprom},
       }) {
    SeenIdentity identity(3);
    if (row.vendor || row.product) EXPECT_FALSE(identity.Learn(Eeprom(row.vendor, row.product))) << row.what;
    const Bytes data = Number(row.value);
    EXPECT_EQ(identity.Learn(Upload(0x1018, row.subindex, data)), row.learned) << row.what;
    EXPECT_EQ(identity.known().slave, 3) << row.what;
    EXPECT_EQ(identity.known().vendor_id, row.vendor_then) << row.what;
    EXPECT_EQ(identity.known().product_code, row.product_then) << row.what;
    EXPECT_EQ(identity.known().source, row.source) << row.what;
    EXPECT_EQ(identity.known().frame.number, row.source == Source::kObject1018 ? 20U : 10U) << row.what;
  }
}

TEST(SeenIdentity, AnObjectThatWasReadMayBeReadAgain) {
  SeenIdentity identity(0);
  const Bytes first = Number(7);
  const Bytes then = Number(8);
  EXPECT_TRUE(identity.Learn(Upload(0x1018, 2, first)));
  EXPECT_FALSE(identity.Learn(Upload(0x1018, 2, first)));
  EXPECT_TRUE(identity.Learn(Upload(0x1018, 2, then)));
  EXPECT_EQ(identity.known().product_code, 8U);
}

TEST(SeenIdentity, CompleteAccessBeginsWithTheNumberOfEntries) {
  Bytes data{4, 0, 7, 0, 0, 0, 8, 0, 0, 0, 9, 0, 0, 0};  // up to the revision
  for (const std::uint8_t subindex : {std::uint8_t{0}, std::uint8_t{1}}) {
    if (subindex == 1) data.erase(data.begin(), data.begin() + 2);
    mailbox::SdoTransfer transfer = Upload(0x1018, subindex, data);
    transfer.complete_access = true;
    SeenIdentity identity(0);
    EXPECT_TRUE(identity.Learn(transfer));
    EXPECT_EQ(identity.known().vendor_id, 7U);
    EXPECT_EQ(identity.known().product_code, 8U);
    EXPECT_EQ(identity.known().revision, 9U);
    EXPECT_FALSE(identity.known().serial.has_value());
  }
}

TEST(SeenIdentity, NothingIsLearnedFromWhatIsNotWhole) {
  const Bytes data = Number(7);
  SeenIdentity identity(0);
  for (const auto spoil : {
           +[](mailbox::SdoTransfer& t) { t.has_object = false; },
           +[](mailbox::SdoTransfer& t) { t.service = mailbox::SdoService::kDownload; },
           +[](mailbox::SdoTransfer& t) { t.outcome = mailbox::SdoOutcome::kSuperseded; },
           +[](mailbox::SdoTransfer& t) { t.data_gap = true; },
           +[](mailbox::SdoTransfer& t) { t.size_mismatch = true; },
           +[](mailbox::SdoTransfer& t) { t.data = t.data.first(2); },
           +[](mailbox::SdoTransfer& t) { t.index = 0x1000; },
       }) {
    mailbox::SdoTransfer transfer = Upload(0x1018, 1, data);
    spoil(transfer);
    EXPECT_FALSE(identity.Learn(transfer));
  }
  EXPECT_TRUE(identity.Learn(Upload(0x1018, 1, data)));
}

TEST(SeenIdentity, AnotherDeviceHasAnotherName) {
  const Bytes name{'A', 'K', 'D', ' ', 0, 0};
  const Bytes other{'M', 'K', 'D'};
  SeenIdentity identity(0);
  EXPECT_FALSE(identity.Learn(Eeprom(7, 8)));
  EXPECT_TRUE(identity.Learn(Upload(0x1008, 0, name)));
  EXPECT_EQ(identity.known().model, "AKD");
  EXPECT_FALSE(identity.Learn(Upload(0x1008, 0, other)));  // the first one stays
  EXPECT_FALSE(identity.Learn(Eeprom(7, {})));             // the same device, read in part
  EXPECT_EQ(identity.known().model, "AKD");
  EXPECT_TRUE(identity.Learn(Eeprom(7, 9)));
  EXPECT_EQ(identity.known().model, "");
  EXPECT_TRUE(identity.Learn(Upload(0x1008, 0, other)));
  EXPECT_EQ(identity.known().model, "MKD");
}

}  // namespace
}  // namespace ecaudit::model
