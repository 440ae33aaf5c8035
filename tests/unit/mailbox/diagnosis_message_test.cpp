#include "decoder/mailbox/diagnosis_message.h"

#include <vector>

#include <gtest/gtest.h>

namespace ecaudit::mailbox {
namespace {

using Bytes = std::vector<std::uint8_t>;

/// Diag code, flags, text ID and time, then the parameters.
Bytes Message(std::uint16_t flags, const Bytes& parameters) {
  Bytes bytes{0x00,
              0xE8,
              0x10,
              0x42,
              static_cast<std::uint8_t>(flags),
              static_cast<std::uint8_t>(flags >> 8U),
              0x02,
              0x37,
              0x00,
              0xCA,
              0x9A,
              0x3B,
              0,
              0,
              0,
              0};
  bytes.insert(bytes.end(), parameters.begin(), parameters.end());
  return bytes;
}

std::string TextOf(const Bytes& bytes) {
  return DiagnosisText(ParseDiagnosisMessage(bytes));
}

TEST(DiagnosisMessage, HasTypeCodeTextAndTime) {
  const DiagnosisMessage message = ParseDiagnosisMessage(Message(0x0012, {}));
  EXPECT_EQ(message.code, 0x4210E800U);
  EXPECT_EQ(message.emergency_code(), 0x4210);
  EXPECT_EQ(message.text_id, 0x3702);
  EXPECT_TRUE(message.local_time());
  EXPECT_EQ(DiagnosisText(message),
            "error, diag code 0x4210e800 (emergency 0x4210), text ID 0x3702, local time 1.000 s");
  EXPECT_EQ(TextOf(Message(0x0001, {})).substr(0, 8), "warning,");
  EXPECT_EQ(TextOf(Message(0x0000, {})).substr(0, 12), "information,");
  EXPECT_EQ(TextOf(Message(0x0007, {})).substr(0, 7), "type 7,");
}

TEST(DiagnosisMessage, OnlyItsClassHasAnEmergencyCode) {
  Bytes bytes = Message(0x0002, {});
  bytes[1] = 0xE0;
  EXPECT_FALSE(ParseDiagnosisMessage(bytes).emergency_code());
}

TEST(DiagnosisMessage, ReadsParametersByTheirFlags) {
  EXPECT_EQ(ParseDiagnosisMessage(Message(0x0202, {0x05, 0, 0x02, 0x06, 0, 0x34, 0x12})).parameters,
            (std::vector<std::string>{"2", "4660"}));
  EXPECT_EQ(ParseDiagnosisMessage(Message(0x0102, {0x03, 0x20, 'a', '\n', 'c'})).parameters,
            (std::vector<std::string>{"\"a\\x0ac\""}));
  EXPECT_EQ(ParseDiagnosisMessage(Message(0x0102, {0x02, 0x10, 0xAB, 0xCD})).parameters.size(), 1U);
  EXPECT_EQ(ParseDiagnosisMessage(Message(0x0102, {0x02, 0x40, 0x02, 0x37})).parameters,
            (std::vector<std::string>{"text ID 0x3702"}));
}

TEST(DiagnosisMessage, StopsWhereParametersAreNotCompleteOrNotKnown) {
  for (const Bytes& parameters : {Bytes{}, Bytes{0x05}, Bytes{0x05, 0}, Bytes{0x07, 0, 1, 2, 3}, Bytes{0x01, 0x50, 1},
                                  Bytes{0x99, 0x09, 1}, Bytes{0xFF, 0x2F, 'a'}}) {
    const DiagnosisMessage message = ParseDiagnosisMessage(Message(0x0102, parameters));
    EXPECT_TRUE(message.cut);
    EXPECT_TRUE(message.parameters.empty());
  }
  EXPECT_FALSE(ParseDiagnosisMessage(Message(0x0102, {0x05, 0, 1})).cut);
}

TEST(DiagnosisMessage, TakesParametersThatFillTheBytesIfTheCountIsZero) {
  const Bytes parameters{0x05, 0, 0x11, 0x05, 0x10, 0x08, 0x2A, 0, 0x2A, 0};
  EXPECT_EQ(ParseDiagnosisMessage(Message(0x0002, parameters)).parameters.size(), 2U);
  for (const Bytes& other : {Bytes{0x05, 0}, Bytes{0x05, 0, 0x11, 0}, Bytes(10)}) {
    const DiagnosisMessage message = ParseDiagnosisMessage(Message(0x0002, other));
    EXPECT_TRUE(message.parameters.empty());
    EXPECT_FALSE(message.cut);
  }
}

TEST(DiagnosisMessage, HasTheDataOfItsEmergency) {
  const auto emergency =
      ParseDiagnosisMessage(Message(0x0202, {0x05, 0, 0x11, 0x05, 0x10, 0x0A, 0x2A, 0, 0x2B, 0})).emergency();
  ASSERT_TRUE(emergency);
  EXPECT_EQ(emergency->error_code, 0x4210);
  EXPECT_EQ(emergency->data[1], 0x2A);
  EXPECT_FALSE(ParseDiagnosisMessage(Message(0x0102, {0x04, 0x10, 1, 2, 3, 4})).emergency());
}

TEST(DiagnosisMessage, AcceptedValuesBelowTheRamAreALength) {
  EmergencyData emergency;
  emergency.data = {0x08, 0x2A, 0, 0x2A, 0};
  EXPECT_EQ(ParseTransition(emergency)->aspect, TransitionDiagnosis::Aspect::kLength);
  emergency.data = {0x09, 0, 0x18, 0xFF, 0x1F};
  EXPECT_EQ(ParseTransition(emergency)->aspect, TransitionDiagnosis::Aspect::kAddress);
}

TEST(DiagnosisMessage, ShortAndEmptyMessages) {
  EXPECT_EQ(TextOf(Bytes(15)), "too short");
  EXPECT_EQ(TextOf(Bytes(16)), "no message");
  EXPECT_EQ(TextOf(Bytes(40)), "no message");
}

std::string TextOf(const Bytes& bytes, const DiagnosisTexts& texts) {
  return DiagnosisText(ParseDiagnosisMessage(bytes), &texts);
}

TEST(DiagnosisMessage, HasTheTextOfItsId) {
  const Bytes bytes = Message(0x0202, {0x05, 0, 0x02, 0x06, 0, 0x34, 0x12});
  EXPECT_EQ(TextOf(bytes, {{0x3702, "Short circuit in module %d, channel 0x%04X"}}),
            "error: Short circuit in module 2, channel 0x1234 (text ID 0x3702), diag code 0x4210e800 (emergency "
            "0x4210), time 1000000000 ns");
  // What the text has no place for follows, and a place without parameter stays.
  EXPECT_EQ(TextOf(bytes, {{0x3702, "Module %u"}}).substr(0, 84),
            "error: Module 2 (text ID 0x3702), diag code 0x4210e800 (emergency 0x4210), parameter");
  EXPECT_EQ(TextOf(Message(0x0002, {}), {{0x3702, "Load of %d %%, 50% of %"}}).substr(0, 42),
            "error: Load of %d %, 50% of % (text ID 0x3");
}

TEST(DiagnosisMessage, WithoutATextOfItsIdIsAsBefore) {
  const Bytes bytes = Message(0x0012, {});
  EXPECT_EQ(TextOf(bytes, {{0x3703, "Another one"}, {0, "None"}}), TextOf(bytes));
  EXPECT_EQ(TextOf(bytes, {{0x3702, ""}}), TextOf(bytes));
}

TEST(DiagnosisMessage, AParameterMayBeATextItself) {
  const Bytes bytes = Message(0x0102, {0x02, 0x40, 0x01, 0x38});
  EXPECT_EQ(TextOf(bytes, {{0x3702, "Module: %s"}, {0x3801, "not configured"}}).substr(0, 29),
            "error: Module: not configured");
  EXPECT_EQ(TextOf(bytes, {{0x3801, "not configured"}}),
            "error, diag code 0x4210e800 (emergency 0x4210), text ID 0x3702, parameter \"not configured\", time "
            "1000000000 ns");
}

TEST(DiagnosisMessage, TextsAreSafeToPrint) {
  EXPECT_EQ(TextOf(Message(0x0002, {}), {{0x3702, "a\x1b[31m"}}).substr(0, 16), "error: a\\x1b[31m");
  EXPECT_EQ(TextOf(Message(0x0102, {0x02, 0x20, 'h', 'i'}), {{0x3702, "<%s>"}}).substr(0, 11), "error: <hi>");
}

TEST(DiagnosisMessage, FollowsTheFirstFiveSubindexes) {
  EXPECT_FALSE(IsDiagnosisMessage(0x10F3, 5));
  EXPECT_TRUE(IsDiagnosisMessage(0x10F3, 6));
  EXPECT_FALSE(IsDiagnosisMessage(0x10F4, 6));
}

}  // namespace
}  // namespace ecaudit::mailbox
