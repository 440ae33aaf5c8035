/// The protocols beside SDO: parsing of single messages, and their tables.
#include <regex>
#include <set>

#include <gtest/gtest.h>

#include "decoder/base/text.h"
#include "decoder/mailbox/aoe.h"
#include "decoder/mailbox/emergency.h"
#include "decoder/mailbox/eoe.h"
#include "decoder/mailbox/error_reply.h"
#include "decoder/mailbox/foe.h"
#include "decoder/mailbox/soe.h"
#include "decoder/mailbox/voe.h"
#include "tests/unit/mailbox/mailbox_test_support.h"

namespace ecaudit::mailbox {
namespace {

/// The part of the engineering reference between two texts.
std::string Section(const std::string& from, const std::string& to) {
  const std::string reference = ReadReference("esc-reference.md");
  const std::size_t begin = reference.find(from);
  if (begin == std::string::npos) return {};
  return reference.substr(begin, reference.find(to, begin) - begin);
}

TEST(ErrorReply, FieldsAndDetails) {
  const Bytes bytes = FromHex("01 00 07 00");
  const ErrorReply reply = ParseErrorReply(bytes);
  EXPECT_EQ(reply.type, 1);
  EXPECT_EQ(reply.detail, 7);
  EXPECT_FALSE(reply.too_short);
  EXPECT_TRUE(ParseErrorReply(ByteSpan(bytes).first(3)).too_short);

  const std::string section = Section("### 8.3", "### 8.4");
  if (section.empty()) GTEST_SKIP() << "reference not beside the project";
  // "u16 detail: 1 syntax, 2 unsupported protocol, ... 9 service in work"
  const std::regex detail("([1-9]) ([a-z]+)");
  const std::string list = section.substr(section.find("detail:"), section.find("[KC") - section.find("detail:"));
  int details = 0;
  for (std::sregex_iterator it(list.begin(), list.end(), detail); it != std::sregex_iterator(); ++it) {
    EXPECT_FALSE(MailboxErrorText(static_cast<std::uint16_t>(std::stoi((*it)[1]))).empty()) << it->str();
    ++details;
  }
  EXPECT_EQ(details, 9);
  EXPECT_EQ(MailboxErrorText(2), "the mailbox protocol is not supported");
  EXPECT_EQ(MailboxErrorText(7), "no more memory in the slave");
  EXPECT_EQ(MailboxErrorText(0), "");
  EXPECT_EQ(MailboxErrorText(10), "");
  EXPECT_EQ(MailboxErrorText(0xFFFF), "");
}

TEST(Emergency, Fields) {
  // mailbox-emergency packet 292, behind the CoE header
  const Bytes bytes = FromHex("05 73 01 11 22 33 44 55");
  const EmergencyData data = ParseEmergency(bytes);
  EXPECT_EQ(data.error_code, 0x7305);
  EXPECT_EQ(data.error_register, 1);
  EXPECT_EQ(data.data, (std::array<std::uint8_t, 5>{0x11, 0x22, 0x33, 0x44, 0x55}));
  EXPECT_FALSE(data.too_short);
  const EmergencyData cut = ParseEmergency(ByteSpan(bytes).first(4));
  EXPECT_TRUE(cut.too_short);
  EXPECT_EQ(cut.data[0], 0x11);
  EXPECT_EQ(cut.data[1], 0);
}

TEST(Foe, MessagesAndErrors) {
  const Bytes request = FromHex("01 00 78 56 34 12 45 43 41 54");
  FoeMessage message = ParseFoe(request);
  EXPECT_EQ(message.operation, FoeOperation::kReadRequest);
  EXPECT_EQ(message.parameter, 0x12345678U);
  EXPECT_EQ(Text(message.data), "ECAT");
  const Bytes busy = FromHex("06 00 05 00 64 00 77 61 69 74");
  message = ParseFoe(busy);
  EXPECT_EQ(message.operation, FoeOperation::kBusy);
  EXPECT_EQ(message.done, 5);
  EXPECT_EQ(message.entire, 100);
  EXPECT_EQ(Text(message.data), "wait");
  EXPECT_TRUE(ParseFoe(ByteSpan(request).first(5)).too_short);
  EXPECT_EQ(Name(FoeOperation::kWriteRequest), "write request");
  EXPECT_EQ(Name(static_cast<FoeOperation>(9)), "operation 9");

  const std::string section = Section("### 8.5", "### 8.6");
  if (section.empty()) GTEST_SKIP() << "reference not beside the project";
  const std::regex code("0x80[01][0-9A-F]");
  std::set<std::string_view> texts;
  for (std::sregex_iterator it(section.begin(), section.end(), code); it != std::sregex_iterator(); ++it) {
    const auto number = static_cast<std::uint32_t>(std::stoul(it->str(), nullptr, 16));
    EXPECT_FALSE(FoeErrorText(number).empty()) << it->str();
    texts.insert(FoeErrorText(number));
  }
  EXPECT_GE(texts.size(), 13U);
  EXPECT_EQ(FoeErrorText(0x8001), "file not found");
  EXPECT_EQ(FoeErrorText(0x8008), "only allowed in BOOT");
  EXPECT_EQ(FoeErrorText(0x8009), "file not allowed in BOOT");
  EXPECT_EQ(FoeErrorText(1), "file not found");  // older numbering
  EXPECT_EQ(FoeErrorText(0x8100), "");
  EXPECT_EQ(FoeErrorText(0x12345678), "");
}

TEST(Eoe, HeaderFields) {
  // type 0, port 2, last, time appended; fragment 3, offset 5 * 32, frame 9
  const Bytes bytes = FromHex("20 03 43 91 aa");
  const EoeHeader header = ParseEoe(bytes);
  EXPECT_EQ(header.type, EoeType::kFragment);
  EXPECT_EQ(header.port, 2);
  EXPECT_TRUE(header.last_fragment);
  EXPECT_TRUE(header.time_appended);
  EXPECT_FALSE(header.time_requested);
  EXPECT_EQ(header.fragment, 3);
  EXPECT_EQ(header.blocks, 5);
  EXPECT_EQ(header.frame, 9);
  EXPECT_EQ(header.data.size(), 1U);
  EXPECT_TRUE(ParseEoe(ByteSpan(bytes).first(3)).too_short);
  EXPECT_EQ(Name(EoeType::kGetIpResponse), "get IP response");
  EXPECT_EQ(Name(static_cast<EoeType>(12)), "type 12");
}

TEST(Eoe, ResultsOfTheReference) {
  const std::string section = Section("### 8.6", "### 8.7");
  if (section.empty()) GTEST_SKIP() << "reference not beside the project";
  for (const int result : {0, 1, 2, 0x0201, 0x0202, 0x0401}) {
    EXPECT_FALSE(EoeResultText(static_cast<std::uint16_t>(result)).empty()) << result;
  }
  for (const char* code : {"0x0201", "0x0202", "0x0401"}) EXPECT_NE(section.find(code), std::string::npos);
  EXPECT_EQ(EoeResultText(0x0201), "no IP support");
  EXPECT_EQ(EoeResultText(0x0203), "");
}

TEST(Eoe, IpParameters) {
  // TwinCAT to an AKD: everything but a DNS server; 192.168.0.139 is sent as 8b 00 a8 c0
  const Bytes bytes = FromHex(
      "2f000000 020100000003 8b00a8c0 00ffffff 0100a8c0 00000000"
      "616b640000000000000000000000000000000000000000000000000000000000");
  const EoeIpParameters ip = ParseIpParameters(bytes);
  ASSERT_TRUE(ip.mac && ip.ip && ip.subnet_mask && ip.gateway);
  EXPECT_EQ(ecaudit::MacText(*ip.mac), "02:01:00:00:00:03");
  EXPECT_EQ(IpText(*ip.ip), "192.168.0.139");
  EXPECT_EQ(IpText(*ip.subnet_mask), "255.255.255.0");
  EXPECT_EQ(IpText(*ip.gateway), "192.168.0.1");
  EXPECT_FALSE(ip.dns_server.has_value());
  EXPECT_EQ(Text(ip.dns_name), "akd");
  const EoeIpParameters cut = ParseIpParameters(ByteSpan(bytes).first(13));
  EXPECT_TRUE(cut.mac.has_value());
  EXPECT_FALSE(cut.ip.has_value());
  EXPECT_TRUE(cut.cut);
  EXPECT_FALSE(ip.cut);
  EXPECT_FALSE(ParseIpParameters({}).mac.has_value());
}

TEST(Eoe, EthernetInside) {
  const Bytes udp = FromHex(
      "ffffffffffff 000a35010203 0800 45000020 00010000 4011 0000 c0a8008b c0a800ff 3039 88a4 000c 0000 01020304");
  EthernetSummary s = SummariseEthernet(udp);
  EXPECT_TRUE(s.valid);
  EXPECT_EQ(ecaudit::MacText(s.source), "00:0a:35:01:02:03");
  EXPECT_EQ(EtherTypeName(s.ether_type), "IPv4");
  EXPECT_EQ(s.ip_protocol, 17);
  EXPECT_EQ(IpText(*s.source_ip), "192.168.0.139");
  EXPECT_EQ(IpText(*s.destination_ip), "192.168.0.255");
  EXPECT_EQ(s.source_port, 12345);
  EXPECT_EQ(s.destination_port, 0x88A4);

  Bytes later_fragment = udp;
  later_fragment[20] = 0x00;
  later_fragment[21] = 0x10;  // fragment offset: no ports here
  s = SummariseEthernet(later_fragment);
  EXPECT_TRUE(s.source_ip.has_value());
  EXPECT_FALSE(s.source_port.has_value());

  const Bytes arp = FromHex(
      "ffffffffffff 000a35010203 8100 0005 0806 0001 0800 06 04 0001 000a35010203 c0a80001 000000000000 c0a80002");
  s = SummariseEthernet(arp);
  EXPECT_EQ(s.vlan, 5);
  EXPECT_EQ(EtherTypeName(s.ether_type), "ARP");
  EXPECT_EQ(IpText(*s.source_ip), "192.168.0.1");
  EXPECT_EQ(IpText(*s.destination_ip), "192.168.0.2");
  EXPECT_FALSE(s.source_port.has_value());

  EXPECT_FALSE(SummariseEthernet(ByteSpan(arp).first(13)).valid);
  for (std::size_t n = 0; n < udp.size(); ++n) (void)SummariseEthernet(ByteSpan(udp).first(n));
  EXPECT_EQ(EtherTypeName(0x1234), "0x1234");
}

TEST(Soe, HeaderNamesAndErrors) {
  // drive 2, write request; elements name and value; IDN P-1-0200
  const Bytes bytes = FromHex("43 42 c8 90 11 22");
  const SoeHeader header = ParseSoe(bytes);
  EXPECT_EQ(header.operation, SoeOperation::kWriteRequest);
  EXPECT_FALSE(header.incomplete);
  EXPECT_FALSE(header.error);
  EXPECT_EQ(header.drive, 2);
  EXPECT_EQ(ElementNames(header.elements), "name, value");
  EXPECT_EQ(IdnName(header.idn_or_fragments_left), "P-1-0200");
  EXPECT_EQ(header.data.size(), 2U);
  EXPECT_EQ(IdnName(17), "S-0-0017");
  EXPECT_EQ(IdnName(0x8FFF), "P-0-4095");
  EXPECT_EQ(ElementNames(0), "");
  EXPECT_TRUE(ParseSoe(ByteSpan(bytes).first(3)).too_short);
  EXPECT_EQ(Name(SoeOperation::kEmergency), "emergency");
  EXPECT_EQ(Name(static_cast<SoeOperation>(7)), "operation 7");
  EXPECT_EQ(SoeErrorText(0x1001), "IDN does not exist");
  EXPECT_EQ(SoeErrorText(0x7004), "operation data are read only");
  EXPECT_EQ(SoeErrorText(0x800A), "invalid drive number");
  EXPECT_EQ(SoeErrorText(0x1002), "");
  EXPECT_EQ(SoeErrorText(0xFFFF), "");
}

TEST(Aoe, HeaderAndParameters) {
  const char* header = "ac1011 0a0101 5303  c0a80001 0101 0080  0300 0400 10000000 00000000 78563412";  // write
  const Bytes write = FromHex(std::string(header) + "20f00000 01000000 04000000 01020304");
  AmsHeader ams = ParseAms(write);
  EXPECT_FALSE(ams.too_short);
  EXPECT_EQ(Text(ams.target), "172.16.17.10.1.1");
  EXPECT_EQ(ams.target_port, 851);
  EXPECT_EQ(Text(ams.source), "192.168.0.1.1.1");
  EXPECT_EQ(ams.source_port, 32768);
  EXPECT_EQ(Name(ams.command), "write");
  EXPECT_FALSE(ams.response());
  EXPECT_EQ(ams.length, 16U);
  EXPECT_EQ(ams.invoke_id, 0x12345678U);
  AdsParameters ads = ParseAds(ams);
  EXPECT_EQ(ads.index_group, 0xF020U);
  EXPECT_EQ(ads.index_offset, 1U);
  EXPECT_EQ(ads.write_length, 4U);
  EXPECT_FALSE(ads.read_length.has_value());
  EXPECT_EQ(Copy(ads.data), FromHex("01020304"));

  Bytes read_write = write;
  read_write[16] = 9;
  read_write[20] = 20;
  const Bytes tail = FromHex("20f00000 02000000 08000000 04000000 61626364");
  read_write.resize(32);
  read_write.insert(read_write.end(), tail.begin(), tail.end());
  ads = ParseAds(ParseAms(read_write));
  EXPECT_EQ(ads.read_length, 8U);
  EXPECT_EQ(ads.write_length, 4U);
  EXPECT_EQ(Text(ads.data), "abcd");

  Bytes response = read_write;
  response[18] = 5;
  response[20] = 12;
  response.resize(32);
  const Bytes answer = FromHex("00000000 04000000 01020304");
  response.insert(response.end(), answer.begin(), answer.end());
  ams = ParseAms(response);
  EXPECT_TRUE(ams.response());
  ads = ParseAds(ams);
  EXPECT_EQ(ads.result, 0U);
  EXPECT_EQ(ads.read_length, 4U);
  EXPECT_EQ(ads.data.size(), 4U);
  EXPECT_FALSE(ads.index_group.has_value());

  for (std::size_t n = 0; n < write.size(); ++n) {
    const AmsHeader cut = ParseAms(ByteSpan(write).first(n));
    EXPECT_EQ(cut.too_short, n < 32);
    (void)ParseAds(cut);
  }
  EXPECT_EQ(Name(static_cast<AdsCommand>(12)), "command 12");
}

TEST(Voe, Header) {
  const Bytes bytes = FromHex("6a000000 0100 aabb");
  const VoeHeader voe = ParseVoe(bytes);
  EXPECT_EQ(voe.vendor_id, 0x6AU);
  EXPECT_EQ(voe.vendor_type, 1);
  EXPECT_EQ(Copy(voe.data), FromHex("aabb"));
  EXPECT_TRUE(ParseVoe(ByteSpan(bytes).first(5)).too_short);
}

}  // namespace
}  // namespace ecaudit::mailbox
