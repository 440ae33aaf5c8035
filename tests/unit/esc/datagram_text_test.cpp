#include "decoder/esc/datagram_text.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace ecaudit::esc {
namespace {

using wire::Command;

std::string Describe(Command command, EscAddress address, const std::vector<std::uint8_t>& data, std::uint16_t wkc,
                     bool returned) {
  std::vector<std::uint8_t> bytes = {static_cast<std::uint8_t>(command),
                                     0,
                                     0x01,
                                     0x10,
                                     static_cast<std::uint8_t>(address & 0xFFU),
                                     static_cast<std::uint8_t>(address >> 8U),
                                     static_cast<std::uint8_t>(data.size() & 0xFFU),
                                     0,
                                     0,
                                     0};
  bytes.insert(bytes.end(), data.begin(), data.end());
  bytes.push_back(static_cast<std::uint8_t>(wkc & 0xFFU));
  bytes.push_back(static_cast<std::uint8_t>(wkc >> 8U));
  return DescribeDatagram(wire::DatagramView(bytes, 0), returned);
}

TEST(DescribeDatagram, ReadsSayNothingUntilTheyReturn) {
  EXPECT_EQ(Describe(Command::FPRD, 0x0130, {0, 0, 0, 0, 0, 0}, 0, false), "AL Status - AL Status Code");
  EXPECT_EQ(Describe(Command::FPRD, 0x0130, {0x12, 0, 0, 0, 0x1D, 0}, 1, true),
            "AL Status: PREOP+ERR; AL Status Code: 0x001d invalid output configuration");
  EXPECT_EQ(Describe(Command::FPRD, 0x0130, {0, 0}, 0, true), "AL Status (no answer)");
  EXPECT_EQ(Describe(Command::FPRD, 0x0700, {0, 0}, 0, true), "0x0700 (no answer)");
}

TEST(DescribeDatagram, Writes) {
  EXPECT_EQ(Describe(Command::FPWR, 0x0120, {0x04, 0}, 0, false), "AL Control: SAFEOP");
  EXPECT_EQ(Describe(Command::FPWR, 0x0120, {0x04, 0}, 1, true), "AL Control: SAFEOP");
  EXPECT_EQ(Describe(Command::BWR, 0x0120, {0x11, 0}, 0, true), "AL Control: INIT, acknowledge (not accepted)");
}

TEST(DescribeDatagram, BroadcastReadsAreOred) {
  EXPECT_EQ(Describe(Command::BRD, 0x0130, {0x08, 0}, 3, true), "AL Status: OP (all slaves ORed)");
  EXPECT_EQ(Describe(Command::BRD, 0x0130, {0x08, 0}, 1, true), "AL Status: OP");
}

TEST(DescribeDatagram, ReadAndWriteAtOnce) {
  EXPECT_EQ(Describe(Command::FPRW, 0x0120, {0x02, 0}, 0, false), "AL Control: PREOP");
  EXPECT_EQ(Describe(Command::FPRW, 0x0120, {0x01, 0}, 3, true), "AL Control: INIT");
  EXPECT_EQ(Describe(Command::FRMW, 0x0910, {0, 0, 0, 0}, 0, false), "System Time");
  EXPECT_EQ(Describe(Command::FRMW, 0x0910, {0x10, 0, 0, 0}, 2, true), "System Time: 16 ns (lower half)");
}

TEST(DescribeDatagram, ProcessDataAndNothing) {
  EXPECT_EQ(Describe(Command::LRW, 0x0001, {1, 2, 3}, 3, true), "logical 0x00011001, 3 bytes");
  EXPECT_EQ(Describe(Command::FPWR, 0x1800, {1}, 1, true), "process RAM 0x1800, 1 byte");
  EXPECT_EQ(Describe(Command::NOP, 0x0130, {1}, 0, true), "");
  EXPECT_EQ(Describe(static_cast<Command>(77), 0x0130, {1}, 0, true), "");
}

}  // namespace
}  // namespace ecaudit::esc
