#include "decoder/mailbox/header.h"

#include <set>

#include <gtest/gtest.h>

#include "decoder/mailbox/sdo.h"
#include "tests/unit/mailbox/mailbox_test_support.h"

namespace ecaudit::mailbox {
namespace {

TEST(MailboxHeader, AllFields) {
  // length 0x0102, address 0x1001, channel 5, priority 2, type 3, counter 6
  const Bytes bytes = FromHex("02 01 01 10 85 63");
  const Header header = ParseHeader(bytes);
  EXPECT_EQ(header.length, 0x0102);
  EXPECT_EQ(header.address, 0x1001);
  EXPECT_EQ(header.channel, 5);
  EXPECT_EQ(header.priority, 2);
  EXPECT_EQ(header.protocol, Protocol::kCoE);
  EXPECT_EQ(header.counter, 6);
  EXPECT_FALSE(header.reserved_bit);
}

TEST(MailboxHeader, CounterRunsFromOneToSeven) {
  EXPECT_EQ(NextCounter(1), 2);
  EXPECT_EQ(NextCounter(6), 7);
  EXPECT_EQ(NextCounter(7), 1);
}

TEST(MailboxHeader, ProtocolNames) {
  EXPECT_EQ(Name(Protocol::kCoE), "CoE");
  EXPECT_EQ(Name(Protocol::kVoE), "VoE");
  EXPECT_EQ(Name(Protocol::kError), "error");
  EXPECT_EQ(Name(static_cast<Protocol>(9)), "type 9");
  EXPECT_TRUE(IsDefined(Protocol::kVoE));
  EXPECT_FALSE(IsDefined(static_cast<Protocol>(6)));
}

TEST(MailboxHeader, EveryProblemIsFoundAndDescribed) {
  struct Case {
    const char* bytes;
    std::size_t mailbox_length;
    Direction direction;
    Problem problem;
  };
  const Case cases[] = {
      {"0a 00 00 00 00 13 00 20 40 00 1c 00 00 00 00 00", 1024, Direction::kOut, Problem::kNone},
      {"0a 00 00 00 00", 1024, Direction::kOut, Problem::kNoHeader},
      {"00 00 00 00 00 13", 1024, Direction::kOut, Problem::kLengthZero},
      {"0b 00 00 00 00 13 00 20 40 00 1c 00 00 00 00 00 00", 16, Direction::kOut, Problem::kLengthBeyondMailbox},
      {"0b 00 00 00 00 13 00 20 40 00 1c 00 00 00 00 00", 1024, Direction::kOut, Problem::kLengthBeyondData},
      {"0a 00 00 00 00 93 00 20 40 00 1c 00 00 00 00 00", 1024, Direction::kOut, Problem::kReservedBit},
      {"0a 00 00 00 00 18 00 20 40 00 1c 00 00 00 00 00", 1024, Direction::kOut, Problem::kUnknownType},
      {"01 00 00 00 00 13 00", 1024, Direction::kOut, Problem::kServiceTooShort},  // half a CoE header
      {"09 00 00 00 00 13 00 10 05 73 01 11 22 33 44", 1024, Direction::kIn, Problem::kServiceTooShort},  // emergency
      {"02 00 00 00 00 13 00 90", 1024, Direction::kOut, Problem::kServiceInvalid},  // CoE service 9
      {"0a 00 00 00 00 13 00 20 a0 00 1c 00 00 00 00 00", 1024, Direction::kOut, Problem::kServiceInvalid},  // block
      {"06 00 00 00 00 13 00 80 08 00 00 00", 1024, Direction::kOut, Problem::kServiceInvalid},  // SDO information 8
      {"06 00 00 00 00 14 07 00 00 00 00 00", 1024, Direction::kOut, Problem::kServiceInvalid},  // FoE operation 7
      {"05 00 00 00 00 14 01 00 00 00 00", 1024, Direction::kOut, Problem::kServiceTooShort},
      {"04 00 00 00 00 12 0a 00 00 00", 1024, Direction::kOut, Problem::kServiceInvalid},   // EoE type 10
      {"04 00 00 00 00 15 00 00 00 00", 1024, Direction::kOut, Problem::kServiceInvalid},   // SoE operation 0
      {"04 00 00 00 00 11 00 00 00 00", 1024, Direction::kOut, Problem::kServiceTooShort},  // AMS header needs 32
      {"02 00 00 00 00 10 01 00", 1024, Direction::kIn, Problem::kServiceTooShort},
      {"04 00 00 00 00 10 01 00 02 00", 1024, Direction::kIn, Problem::kNone},
      {"03 00 00 00 00 03 00 30 20", 1024, Direction::kIn, Problem::kNone},  // short answer of KickCAT to a segment
      {"01 00 00 00 00 1f 00", 1024, Direction::kIn, Problem::kNone},        // VoE: the vendor's choice
  };
  std::set<std::string_view> texts;
  for (const Case& c : cases) {
    const Bytes bytes = FromHex(c.bytes);
    EXPECT_EQ(ParseMessage(bytes, c.mailbox_length, c.direction).problem, c.problem) << c.bytes;
    texts.insert(Describe(c.problem));
  }
  EXPECT_EQ(texts.count(""), 1U);
  EXPECT_EQ(texts.size(), 9U);
}

TEST(MailboxHeader, ADamagedMessageStillGivesWhatIsThere) {
  const Bytes bytes = FromHex("0e 00 00 00 00 03 00 20 60 12 1c 01 00 00 00 00");
  const MessageView view = ParseMessage(bytes, 16, Direction::kIn);
  EXPECT_EQ(view.problem, Problem::kLengthBeyondMailbox);
  EXPECT_EQ(view.payload.size(), 10U);
}

/// The example of section 4.12.3 (AKD), 4.13.3 (MKD), 4.10.3 (Pilz), byte by byte.
TEST(MailboxHeader, PrintedExamplesOfTheManuals) {
  std::map<std::string, std::map<std::string, Bytes>> examples;
  for (auto& row : ReadTable("mailbox_example.csv")) {
    Bytes& bytes = examples[row["family"]][row["direction"]];
    ASSERT_EQ(bytes.size(), std::stoul(row["byte"]));
    bytes.push_back(static_cast<std::uint8_t>(std::stoul(row["value"], nullptr, 16)));
  }
  if (examples.empty()) GTEST_SKIP() << "reference tables not beside the project";
  ASSERT_EQ(examples.size(), 4U);
  for (auto& [family, example] : examples) {
    SCOPED_TRACE(family);
    ASSERT_EQ(example["out"].size(), 16U);
    ASSERT_EQ(example["in"].size(), 16U);

    const MessageView out = ParseMessage(example["out"], 512, Direction::kOut);
    EXPECT_EQ(out.problem, Problem::kNone);
    EXPECT_EQ(out.header.length, 10);
    EXPECT_EQ(out.header.protocol, Protocol::kCoE);
    EXPECT_EQ(out.header.counter, 0);
    const CoeHeader request = ParseCoeHeader(out.payload);
    EXPECT_EQ(request.service, CoeService::kSdoRequest);
    EXPECT_EQ(request.number, 0);
    const SdoMessage sdo = ParseSdo(Slice(out.payload, kCoeHeaderBytes), Direction::kOut);
    EXPECT_EQ(sdo.kind, SdoKind::kDownloadInitiate);
    EXPECT_TRUE(sdo.expedited);
    EXPECT_EQ(sdo.index, 0x1C12);
    EXPECT_EQ(sdo.subindex, 1);
    EXPECT_EQ(Copy(sdo.data), FromHex("04 17"));

    // The printed answer counts its length from byte 2 and calls itself a request: decoded all the same.
    const MessageView in = ParseMessage(example["in"], 512, Direction::kIn);
    EXPECT_EQ(in.header.length, 14);
    EXPECT_EQ(in.problem, Problem::kLengthBeyondData);
    EXPECT_EQ(ParseCoeHeader(in.payload).service, CoeService::kSdoRequest);
    const SdoMessage answer = ParseSdo(Slice(in.payload, kCoeHeaderBytes), Direction::kIn);
    EXPECT_EQ(answer.kind, SdoKind::kDownloadInitiate);
    EXPECT_EQ(answer.index, 0x1C12);
    EXPECT_EQ(answer.subindex, 1);

    // Inside a whole mailbox of 512 bytes the length is no contradiction, only the service remains odd.
    Bytes whole = example["in"];
    whole.resize(512);
    EXPECT_EQ(ParseMessage(whole, 512, Direction::kIn).problem, Problem::kNone);
  }
}

TEST(MailboxHeader, CoeServicesOfTheManuals) {
  const std::map<std::string, std::string> expected = {{"1", "emergency"},
                                                       {"2", "SDO request"},
                                                       {"3", "SDO response"},
                                                       {"4", "TxPDO"},
                                                       {"5", "RxPDO"},
                                                       {"6", "TxPDO remote transmission request"},
                                                       {"7", "RxPDO remote transmission request"}};
  const auto rows = ReadTable("coe_types.csv");
  if (rows.empty()) GTEST_SKIP() << "reference tables not beside the project";
  for (auto row : rows) {
    const auto name = expected.find(row["value"]);
    if (name == expected.end()) continue;
    EXPECT_EQ(Name(static_cast<CoeService>(std::stoi(row["value"]))), name->second) << row["meaning"];
  }
  EXPECT_EQ(Name(static_cast<CoeService>(8)), "SDO information");  // ETG; reserved in the manuals
  EXPECT_EQ(Name(static_cast<CoeService>(9)), "service 9");
}

}  // namespace
}  // namespace ecaudit::mailbox
