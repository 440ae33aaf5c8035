#include <algorithm>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "tests/unit/wire/packet_bytes.h"

namespace ecaudit::wire::test {
namespace {

void ExpectProblem(const Bytes& packet, FrameProblem problem, std::size_t readable) {
  const FrameView view = Parse(packet);
  EXPECT_EQ(view.kind(), FrameKind::kMalformed);
  EXPECT_EQ(view.problem(), problem) << Describe(view.problem());
  EXPECT_EQ(view.size(), readable);
}

/// A packet whose EtherCAT length is `by` bytes too long.
Bytes TooLong(const Bytes& datagrams, std::size_t by) {
  Bytes payload = Header(datagrams.size() + by);
  Append(payload, datagrams);
  return Plain(payload);
}

TEST(FrameProblem, NoHeader) {
  const Bytes none = Plain({});
  ExpectProblem(none, FrameProblem::kNoHeader, 0);
  const Bytes half = Plain({0x0E});
  ExpectProblem(half, FrameProblem::kNoHeader, 0);
}

TEST(FrameProblem, LengthBeyondFrame) {
  ExpectProblem(TooLong(Datagrams({{.index = 1}}), 1), FrameProblem::kLengthBeyondFrame, 1);
}

TEST(FrameProblem, AFrameThatIsWholeButForItsLengthCanBeAccepted) {
  const Bytes packet = TooLong(Datagrams({{.index = 1}}), 16);
  FrameView view = Parse(packet);
  EXPECT_TRUE(view.IsWholeButForLength());
  view.AcceptLength();
  EXPECT_EQ(view.kind(), FrameKind::kEtherCat);
  EXPECT_EQ(view.padding(), 16U);
  EXPECT_FALSE(view.IsWholeButForLength());
}

TEST(FrameProblem, AFrameWithMoreThanAWrongLengthCannotBeAccepted) {
  for (const DatagramBytes& last : {DatagramBytes{.index = 1, .flags = 0x8000}, DatagramBytes{.command = 77}}) {
    const Bytes packet = TooLong(last.Encode(), 16);
    FrameView view = Parse(packet);
    EXPECT_FALSE(view.IsWholeButForLength());
    view.AcceptLength();
    EXPECT_EQ(view.kind(), FrameKind::kMalformed);
  }
}

TEST(FrameProblem, DatagramBeyondLength) {
  // The header covers the first datagram and a part of the second.
  const Bytes two = Datagrams({{.index = 1}, {.index = 2}});
  for (std::size_t covered = 15; covered < two.size(); ++covered) {
    Bytes payload = Header(covered);
    Append(payload, two);
    const Bytes packet = Plain(payload);
    const FrameView view = Parse(packet);
    EXPECT_EQ(view.kind(), FrameKind::kMalformed) << covered;
    EXPECT_EQ(view.problem(), FrameProblem::kDatagramBeyondLength) << covered << Describe(view.problem());
  }
}

TEST(FrameProblem, DatagramBeyondFrame) {
  // Lengths of frame and header agree, that of the datagram does not.
  Bytes datagram = DatagramBytes{.data = Bytes(10, 0)}.Encode();
  datagram[6] = 11;
  ExpectProblem(Plain(Payload(datagram)), FrameProblem::kDatagramBeyondLength, 0);
}

TEST(FrameProblem, MoreWithoutDatagram) {
  const Bytes last = DatagramBytes{.index = 1, .flags = 0x8000}.Encode();
  ExpectProblem(Plain(Payload(last)), FrameProblem::kMoreWithoutDatagram, 1);
}

TEST(FrameProblem, MoreWithOnlyPaddingAfterIsNoDatagramOfZeros) {
  // Padding after the last datagram reads as a NOP without data (esc-reference 1.4).
  const Bytes last = DatagramBytes{.index = 1, .flags = 0x8000}.Encode();
  Bytes packet = Plain(Payload(last));
  packet.resize(60, 0);
  ExpectProblem(packet, FrameProblem::kMoreWithoutDatagram, 1);
}

TEST(FrameProblem, WhatTheLengthCoversAfterTheLastDatagramIsPadding) {
  // TwinCAT rounds up to even, others always write 28; slaves stop where the more flag is clear.
  for (const std::uint8_t fill : {std::uint8_t{0}, std::uint8_t{7}, std::uint8_t{255}}) {
    for (std::size_t padding = 1; padding < 40; ++padding) {
      const Bytes one = Datagrams({{.index = 1, .data = {1}}});
      Bytes payload = Header(one.size() + padding);
      Append(payload, one);
      Append(payload, Bytes(padding, fill));
      const Bytes packet = Plain(payload);
      const FrameView view = Parse(packet);
      EXPECT_EQ(view.kind(), FrameKind::kEtherCat);
      EXPECT_EQ(view.problem(), FrameProblem::kNone);
      ASSERT_EQ(view.size(), 1U);
      EXPECT_EQ(view.payload().size(), one.size());
      EXPECT_EQ(view.padding(), padding);
      EXPECT_EQ(Bytes(view.padding_bytes().begin(), view.padding_bytes().end()), Bytes(padding, fill));
    }
  }
}

TEST(FrameProblem, PaddingChangesNothingThatDistinguishesFrames) {
  const Bytes one = Datagrams({{.index = 1, .data = {1}}});
  const Bytes tight = Plain(Payload(one));
  Bytes payload = Header(one.size() + 1);
  Append(payload, one);
  Append(payload, {0});
  const Bytes padded = Plain(payload);
  EXPECT_EQ(Parse(tight).key(), Parse(padded).key());
  EXPECT_EQ(Parse(tight).used_bytes(), Parse(padded).used_bytes());
  EXPECT_EQ(Parse(tight).padding(), 0U);
}

TEST(FrameProblem, MoreAtTheEndOfThePaddingIsStillWrong) {
  const Bytes last = DatagramBytes{.index = 1, .flags = 0x8000}.Encode();
  Bytes payload = Header(last.size() + 9);
  Append(payload, last);
  Append(payload, Bytes(9, 0));
  const Bytes packet = Plain(payload);
  ExpectProblem(packet, FrameProblem::kMoreWithoutDatagram, 1);
}

TEST(FrameProblem, PaddingBeyondTheFrameIsStillWrong) {
  const Bytes one = Datagrams({{.index = 1}});
  Bytes payload = Header(one.size() + 8);
  Append(payload, one);
  Append(payload, Bytes(7, 0));
  ExpectProblem(Plain(payload), FrameProblem::kLengthBeyondFrame, 1);
}

TEST(FrameProblem, PaddingCutByTheSnapLengthLosesNoDatagram) {
  const Bytes one = Datagrams({{.index = 1}});
  Bytes payload = Header(one.size() + 8);
  Append(payload, one);
  const Bytes packet = Plain(payload);
  const FrameView view = Parse(packet, 1, static_cast<std::uint32_t>(packet.size() + 8));
  EXPECT_EQ(view.kind(), FrameKind::kEtherCat);
  EXPECT_EQ(view.size(), 1U);
  EXPECT_TRUE(view.padding_bytes().empty());
}

TEST(FrameProblem, UnknownCommand) {
  for (unsigned command = 15; command < 256; ++command) {
    const Bytes packet =
        Plain(Payload(Datagrams({{.index = 1}, {.command = static_cast<std::uint8_t>(command), .index = 2}})));
    ExpectProblem(packet, FrameProblem::kUnknownCommand, 2);
  }
}

TEST(FrameProblem, NoDatagram) {
  for (const std::size_t length : {0U, 1U, 9U}) {
    Bytes payload = Header(length);
    Append(payload, Bytes(length, 0));
    Bytes packet = Plain(payload);
    ExpectProblem(packet, FrameProblem::kNoDatagram, 0);
  }
  // Padded to the smallest frame: the zeros behind are no datagram either.
  Bytes padded = Plain(Header(0));
  padded.resize(60, 0);
  ExpectProblem(padded, FrameProblem::kNoDatagram, 0);
}

TEST(FrameProblem, PaddingIsIgnored) {
  for (const int fill : {0x00, 0xFF, 0x0C}) {
    Bytes packet = Plain(Payload(Datagrams({{.index = 1}})));
    packet.resize(60, static_cast<std::uint8_t>(fill));
    const FrameView view = Parse(packet);
    EXPECT_EQ(view.kind(), FrameKind::kEtherCat);
    EXPECT_EQ(view.size(), 1U);
    EXPECT_EQ(view.payload().size(), 14U);
  }
}

TEST(FrameProblem, EachHasItsOwnDescription) {
  std::set<std::string> texts;
  for (const FrameProblem problem : {FrameProblem::kNone, FrameProblem::kNoHeader, FrameProblem::kLengthBeyondFrame,
                                     FrameProblem::kDatagramBeyondLength, FrameProblem::kMoreWithoutDatagram,
                                     FrameProblem::kUnknownCommand, FrameProblem::kNoDatagram}) {
    texts.insert(std::string(Describe(problem)));
  }
  EXPECT_EQ(texts.size(), 7U);
  EXPECT_EQ(texts.count("?"), 0U);
}

// --- cut by the snap length: unknown, never malformed --------------------------------------------------------------

Bytes ThreeDatagrams() {
  return Plain(Payload(Datagrams({{.index = 1, .data = Bytes(4, 1)},
                                  {.command = 12, .index = 2, .data = Bytes(20, 2)},
                                  {.command = 7, .index = 3, .data = {}}})));
}

TEST(SnapLength, CutAtEveryByte) {
  const Bytes whole = ThreeDatagrams();
  // Ends of the datagrams: 16 + 16, + 32, + 12.
  const std::size_t ends[] = {32, 64, 76};
  ASSERT_EQ(whole.size(), 76U);
  for (std::size_t length = 0; length < whole.size(); ++length) {
    const Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length));
    const FrameView view = Parse(cut, 1, static_cast<std::uint32_t>(whole.size()));
    EXPECT_EQ(view.kind(), length < 14 ? FrameKind::kOther : FrameKind::kCut) << length;
    EXPECT_EQ(view.problem(), FrameProblem::kNone) << length;
    const auto readable = static_cast<std::size_t>(
        std::count_if(std::begin(ends), std::end(ends), [&](std::size_t e) { return e <= length; }));
    EXPECT_EQ(view.size(), readable) << length;
  }
}

TEST(SnapLength, CutInThePaddingLosesNothing) {
  Bytes padded = Plain(Payload(Datagrams({{.index = 1}})));
  const std::size_t used = padded.size();
  padded.resize(60, 0);
  for (std::size_t length = used; length < 60; ++length) {
    const Bytes cut(padded.begin(), padded.begin() + static_cast<std::ptrdiff_t>(length));
    EXPECT_EQ(Parse(cut, 1, 60).kind(), FrameKind::kEtherCat) << length;
  }
}

TEST(SnapLength, CutInAProbesRecordLosesNoDatagram) {
  Bytes packet = ThreeDatagrams();
  Append(packet, {0x01, 0x01, 0x05, 0x10, 0x00, 0x00, 0x80, 0x00, 1, 2, 3, 4, 5, 6, 7, 8});
  for (std::size_t length = 76; length < packet.size(); ++length) {
    const Bytes cut(packet.begin(), packet.begin() + static_cast<std::ptrdiff_t>(length));
    const FrameView view = Parse(cut, 1, static_cast<std::uint32_t>(packet.size()));
    EXPECT_EQ(view.kind(), FrameKind::kEtherCat) << length;
    EXPECT_EQ(view.size(), 3U);
  }
}

TEST(SnapLength, WhatIsWrongBeforeTheCutStaysWrong) {
  // The second datagram reaches past the EtherCAT length; both lie before the cut.
  const Bytes two = Datagrams({{.index = 1}, {.index = 2}});
  Bytes payload = Header(two.size() - 2);
  Append(payload, two);
  Bytes packet = Plain(payload);
  packet.resize(60, 0);
  const FrameView view = Parse(packet, 1, 64);
  EXPECT_EQ(view.kind(), FrameKind::kMalformed);
  EXPECT_EQ(view.problem(), FrameProblem::kDatagramBeyondLength);
}

TEST(SnapLength, EveryEncapsulationAtEveryByte) {
  // Nothing is ever read behind the cut and nothing is called malformed.
  const Bytes payload = Payload(Datagrams({{.index = 1}, {.index = 2}}));
  Bytes udp{0x45, 0, 0, 58, 0, 0, 0, 0, 64, 17, 0, 0, 10, 0, 0, 1, 10, 0, 0, 2, 0x88, 0xA4, 0x88, 0xA4, 0, 38, 0, 0};
  Append(udp, payload);
  Bytes cooked{0, 4, 0, 1, 0, 6, 1, 2, 3, 4, 5, 6, 0, 0, 0x88, 0xA4};
  Append(cooked, payload);
  Bytes cooked2{0x88, 0xA4, 0, 0, 0, 0, 0, 2, 0, 1, 4, 6, 1, 2, 3, 4, 5, 6, 0, 0};
  Append(cooked2, payload);
  const struct {
    Bytes packet;
    std::uint16_t link;
  } cases[] = {{Ethernet({0x81, 0x00, 0, 5, 0x88, 0xA4}, payload), 1},
               {Ethernet({0x08, 0x00}, udp), 1},
               {cooked, 113},
               {cooked2, 276}};
  for (const auto& c : cases) {
    const FrameView all = Parse(c.packet, c.link);
    ASSERT_EQ(all.kind(), FrameKind::kEtherCat);
    for (std::size_t length = 0; length < c.packet.size(); ++length) {
      const Bytes cut(c.packet.begin(), c.packet.begin() + static_cast<std::ptrdiff_t>(length));
      const FrameView view = Parse(cut, c.link, static_cast<std::uint32_t>(c.packet.size()));
      EXPECT_TRUE(view.kind() == FrameKind::kCut || view.kind() == FrameKind::kOther) << c.link << " " << length;
      for (std::size_t i = 0; i < view.size(); ++i) {
        EXPECT_LE(view[i].bytes().data() + view[i].bytes().size(), cut.data() + cut.size());
      }
    }
  }
}

TEST(SnapLength, ReportsWhenNotEvenTheTypeIsThere) {
  const Bytes whole = ThreeDatagrams();
  for (std::size_t length = 0; length < whole.size(); ++length) {
    const Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(length));
    EXPECT_EQ(Parse(cut, 1, 76).cut_before_type(), length < 14) << length;
    EXPECT_FALSE(Parse(cut, 1, static_cast<std::uint32_t>(length)).cut_before_type()) << "not cut: " << length;
  }
  // A packet of another protocol that was cut later is known to be no EtherCAT.
  const Bytes arp = Ethernet({0x08, 0x06}, Bytes(20, 0));
  EXPECT_FALSE(Parse(arp, 1, 60).cut_before_type());
  // IPv4 that was cut before the UDP ports might have been.
  const Bytes ip = Ethernet({0x08, 0x00}, {0x45, 0, 0, 58, 0, 0, 0, 0, 64, 17, 0, 0, 10, 0, 0, 1});
  EXPECT_TRUE(Parse(ip, 1, 90).cut_before_type());
}

}  // namespace
}  // namespace ecaudit::wire::test
