/// Captures that try to exhaust memory: what is kept does not grow with what they hold. Each is run at one length and
/// at three times that, and may not need noticeably more; and never more than the limit of the project.
#include <algorithm>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "analyzers/analysis.h"
#include "decoder/capture/capture_stream.h"
#include "samples/builder/scenarios/scenario.h"
#include "tests/perf/allocations.h"

namespace ecaudit::perf {
namespace {

using samples::Bytes;
using samples::Cmd;
using samples::Datagram;

constexpr std::int64_t kMiB = 1 << 20;
constexpr std::int64_t kLimit = 64 * kMiB;

/// Frames made one at a time, so that the capture itself needs no memory.
class MadeSource final : public capture::FrameSource {
 public:
  /// Fills the datagrams of exchange `n` as sent and as returned; without returned ones the frame does not come back.
  using Make = std::function<void(std::uint64_t n, std::vector<Datagram>& sent, std::vector<Datagram>& returned)>;

  MadeSource(std::uint64_t exchanges, Make make) : exchanges_(exchanges), make_(std::move(make)) {
    info_.path = "made.pcapng";
    info_.format = "pcapng";
    info_.interfaces.push_back({.name = {}, .resolution_ns = 1, .dropped = {}});
  }

  [[nodiscard]] capture::ReadStatus Next(capture::CapturedFrame& frame) noexcept override {
    if (!returned_.empty()) {
      samples::EtherCatFrame back;
      back.source = samples::AfterSlave(back.source);
      back.datagrams = std::exchange(returned_, {});
      return Give(back, 30'000, frame);
    }
    if (next_ == exchanges_) return capture::ReadStatus::kEnd;
    samples::EtherCatFrame out;
    make_(next_++, out.datagrams, returned_);
    return Give(out, 970'000, frame);
  }
  [[nodiscard]] const capture::CaptureInfo& info() const noexcept override { return info_; }

 private:
  capture::ReadStatus Give(const samples::EtherCatFrame& from, TimeNs later, capture::CapturedFrame& frame) {
    bytes_ = samples::EncodePacket(from);
    time_ += later;
    frame.number = ++info_.packets;
    frame.time = time_;
    frame.has_time = true;
    frame.link_type = 1;
    frame.interface_index = 0;
    frame.flag = capture::PacketFlag::kNone;
    frame.original_length = static_cast<std::uint32_t>(bytes_.size());
    frame.bytes = bytes_;
    return capture::ReadStatus::kFrame;
  }

  std::uint64_t exchanges_;
  Make make_;
  std::uint64_t next_ = 0;
  std::vector<Datagram> returned_;
  Bytes bytes_;
  TimeNs time_ = 1'704'067'200'000'000'000;
  capture::CaptureInfo info_;
};

Datagram Of(Cmd command, std::uint16_t adp, std::uint16_t ado, Bytes data) {
  Datagram d;
  d.command = command;
  d.adp = adp;
  d.ado = ado;
  d.data = std::move(data);
  return d;
}

Datagram Answered(Datagram sent, Bytes data, std::uint16_t wkc) {
  sent.data = std::move(data);
  sent.wkc = wkc;
  if (samples::CmdCountsSlaves(sent.command)) ++sent.adp;
  return sent;
}

/// A mailbox message of that type.
Bytes Message(std::uint8_t type, const Bytes& service) {
  Bytes message = samples::LeBytes(static_cast<std::uint16_t>(service.size()));
  samples::AppendBytes(message, Bytes{0, 0, 0, type});
  samples::AppendBytes(message, service);
  return message;
}

/// Most bytes at once, above what was there before.
std::int64_t PeakOf(capture::FrameSource& source) {
  ForgetPeak();
  const std::int64_t before = CountedAllocations().live;
  const AnalysisResult result = Analyse(source, {});
  EXPECT_GT(result.capture.packets, 0U);
  return CountedAllocations().peak - before;
}

void ExpectBounded(std::uint64_t exchanges, const MadeSource::Make& make, std::int64_t limit = kLimit,
                   std::int64_t more = kMiB) {
  MadeSource short_one(exchanges, make);
  const std::int64_t small = PeakOf(short_one);
  MadeSource long_one(3 * exchanges, make);
  const std::int64_t large = PeakOf(long_one);
  EXPECT_LT(large, small + more) << "three times the length";
  EXPECT_LT(large, limit);
}

/// A capture of a whole story; `repeat` is done so many times in PREOP.
std::int64_t PeakOfStory(int times, const std::function<void(samples::Story&, int)>& repeat) {
  samples::Story story;
  story.Add(samples::AkdDrive());
  story.master.Scan();
  story.master.BringToPreop();
  Bytes file = story.capture.Flush();
  for (int i = 0; i < times; ++i) {
    repeat(story, i);
    samples::AppendBytes(file, story.capture.Flush());
  }
  const auto source = capture::OpenCaptureFromMemory(file);
  EXPECT_TRUE(source);
  return source ? PeakOf(**source) : 0;
}

void ExpectBoundedStory(int times, const std::function<void(samples::Story&, int)>& repeat) {
  const std::int64_t small = PeakOfStory(times, repeat);
  const std::int64_t large = PeakOfStory(3 * times, repeat);
  EXPECT_LT(large, small + kMiB) << "three times the length";
  EXPECT_LT(large, kLimit);
}

TEST(BoundedMemory, SlavesAtAllStationAddresses) {
  ExpectBounded(
      30'000,
      [](std::uint64_t n, auto& sent, auto& returned) {
        sent.push_back(Of(Cmd::FPRD, static_cast<std::uint16_t>(n * 2 + 1), 0x0130, {0, 0}));
        returned.push_back(Answered(sent[0], {8, 0}, 1));
      },
      36 * kMiB);  // 2,048 models, of 17 KiB each; no bus has as many slaves
}

TEST(BoundedMemory, RegistersOfSlavesAtAllStationAddresses) {
  const auto make = [](std::uint64_t n, auto& sent, auto& returned) {
    // Each register page of each slave: the largest of what is kept of a slave.
    sent.push_back(Of(Cmd::FPWR, static_cast<std::uint16_t>(n % 2048 + 1), static_cast<std::uint16_t>(n / 2048 * 256),
                      Bytes(16, 1)));
    returned.push_back(Answered(sent[0], Bytes(16, 1), 1));
  };
  // Each rule keeps what it could evaluate of each of 2,048 slaves: about 0.4 MiB a rule.
  ExpectBounded(30'000, make, 68 * kMiB);
}

TEST(BoundedMemory, MailboxesAndProcessDataOfSlavesAtAllStationAddresses) {
  ExpectBounded(
      20'480,
      [](std::uint64_t n, auto& sent, auto& returned) {
        const auto station = static_cast<std::uint16_t>(n % 2048 + 1);
        const auto write = [&](std::uint16_t address, Bytes data) {
          sent.push_back(Of(Cmd::FPWR, station, address, data));
          returned.push_back(Answered(sent.back(), std::move(data), 1));
        };
        const auto read = [&](std::uint16_t address, Bytes data) {
          sent.push_back(Of(Cmd::FPRD, station, address, Bytes(data.size(), 0)));
          returned.push_back(Answered(sent.back(), std::move(data), 1));
        };
        // Sync managers, two FMMUs that map all slaves to the same place, and an SDO transfer of a bit of everything.
        write(0x0800, {0x00, 0x18, 128, 0, 0x26, 0, 1, 0, 0x00, 0x1C, 128, 0, 0x22, 0, 1, 0});
        write(0x0810, {0x00, 0x11, 6, 0, 0x64, 0, 1, 0, 0x00, 0x14, 6, 0, 0x20, 0, 1, 0});
        write(0x0600,
              {0, 0, 1, 0, 6, 0, 0, 7, 0x00, 0x11, 0, 2, 1, 0, 0, 0, 0, 0, 1, 0, 6, 0, 0, 7, 0x00, 0x14, 0, 1, 1});
        write(0x0120, {2, 0});
        read(0x0130, {2, 0, 0, 0, 0, 0});
        write(0x1800, Message(3, {0x00, 0x20, 0x2B, 0x40, 0x60, 0, 0x0F, 0, 0, 0}));
        read(0x1C00, Message(3, {0x00, 0x30, 0x60, 0x40, 0x60, 0, 0, 0, 0, 0}));
        if (n % 256 != 0) return;
        Datagram d = Of(Cmd::LRW, 0, 0, Bytes(8 + n / 256, 0));  // ever other datagrams
        d.set_logical(0x10000);
        sent.push_back(d);
        returned.push_back(Answered(d, d.data, static_cast<std::uint16_t>(3 * std::min<std::uint64_t>(n + 1, 2048))));
      },
      kLimit, 4 * kMiB);  // until the parts of the process image are as many as are kept
}

/// What one slave may keep, all of them together may not.
TEST(BoundedMemory, UnfinishedTransfersOfManySlaves) {
  ExpectBounded(10'000, [](std::uint64_t n, auto& sent, auto& returned) {
    // Uploads of 4 GiB, of which one segment comes after another; 512 slaves in turn.
    const auto station = static_cast<std::uint16_t>(n % 512 + 1);
    const std::uint64_t segment = n / 512;
    Bytes request = {0x00, 0x20, 0x40, 0x00, 0x20, 0, 0, 0, 0, 0};
    Bytes response = {0x00, 0x30, 0x41, 0x00, 0x20, 0, 0xFF, 0xFF, 0xFF, 0xFF};
    if (segment > 0) {
      request = {0x00, 0x20, static_cast<std::uint8_t>(0x60U | (segment & 1U) << 4U), 0, 0, 0, 0, 0, 0, 0};
      response.assign(1300, 1);
      response[0] = 0;
      response[1] = 0x30;
      response[2] = static_cast<std::uint8_t>((segment & 1U) << 4U);
    }
    sent.push_back(Of(Cmd::FPWR, station, 0x1800, Message(3, request)));
    returned.push_back(Answered(sent.back(), sent.back().data, 1));
    Datagram answer = Of(Cmd::FPRD, station, 0x2800, Message(3, response));
    returned.push_back(Answered(answer, answer.data, 1));
    answer.data.assign(answer.data.size(), 0);
    sent.push_back(std::move(answer));
  });
}

TEST(BoundedMemory, EepromsOfManySlaves) {
  ExpectBounded(10'000, [](std::uint64_t n, auto& sent, auto& returned) {
    // A word of ever other parts of the EEPROM, of 1,024 slaves.
    const auto station = static_cast<std::uint16_t>(n % 1024 + 1);
    sent.push_back(Of(Cmd::FPWR, station, 0x0502, samples::LeBytes(std::uint16_t{0x0100})));
    samples::AppendLe(sent[0].data, static_cast<std::uint32_t>(n / 1024 * 256));
    sent.push_back(Of(Cmd::FPRD, station, 0x0502, Bytes(14, 0)));
    returned.push_back(Answered(sent[0], sent[0].data, 1));
    returned.push_back(Answered(sent[1], Bytes(14, 0), 1));
  });
}

TEST(BoundedMemory, ObjectsAndTheirNamesOfManySlaves) {
  ExpectBounded(
      15'000,
      [](std::uint64_t n, auto& sent, auto& returned) {
        const auto station = static_cast<std::uint16_t>(n % 256 + 1);
        const auto low = static_cast<std::uint8_t>(n / 256);
        const auto high = static_cast<std::uint8_t>(0x20 + n / 65536);
        const auto exchange = [&](const Bytes& request, const Bytes& response) {
          sent.push_back(Of(Cmd::FPWR, station, 0x1800, Message(3, request)));
          returned.push_back(Answered(sent.back(), sent.back().data, 1));
          Datagram answer = Of(Cmd::FPRD, station, 0x2800, Message(3, response));
          returned.push_back(Answered(answer, answer.data, 1));
          answer.data.assign(answer.data.size(), 0);
          sent.push_back(std::move(answer));
        };
        exchange({0x00, 0x20, 0x40, low, high, 1, 0, 0, 0, 0}, {0x00, 0x30, 0x43, low, high, 1, 1, 2, 3, 4});
        Bytes name = {0x00, 0x80, 4, 0, 0, 0, low, high, 0x07, 0, 1, 7};
        name.resize(600, 'n');
        exchange({0x00, 0x80, 3, 0, 0, 0, low, high}, name);
      },
      kLimit, 9 * kMiB);  // fewer objects and steps than are kept
}

TEST(BoundedMemory, StatesAndStartupsOfManySlaves) {
  ExpectBounded(
      8'000,
      [](std::uint64_t n, auto& sent, auto& returned) {
        for (std::uint16_t i = 0; i < 8; ++i) {
          const auto station = static_cast<std::uint16_t>(8 * (n % 256) + i + 1);
          const auto state = static_cast<std::uint8_t>(1U + (n / 256 & 1U));
          sent.push_back(Of(Cmd::FPRD, station, 0x0130, Bytes(2, 0)));
          returned.push_back(Answered(sent.back(), {state, 0}, 1));
          sent.push_back(Of(Cmd::FPWR, station, static_cast<std::uint16_t>(0x0900 + n / 256 % 0x600), Bytes(16, 3)));
          returned.push_back(Answered(sent.back(), sent.back().data, 1));
        }
      },
      kLimit + 4 * kMiB,  // the most of all: thousands of slaves, with the coverage of each rule and their ladders
      8 * kMiB);          // registers that all slaves hold alike are kept once; the longer capture ends in between
}

TEST(BoundedMemory, LogicalAddressesWithoutEnd) {
  ExpectBounded(20'000, [](std::uint64_t n, auto& sent, auto& returned) {
    Datagram d = Of(Cmd::LRW, 0, 0, Bytes(8, static_cast<std::uint8_t>(n)));
    d.set_logical(static_cast<std::uint32_t>(n * 64));
    sent.push_back(d);
    returned.push_back(Answered(d, Bytes(8, 1), static_cast<std::uint16_t>(n % 50)));
  });
}

TEST(BoundedMemory, FindingsWithoutEnd) {
  ExpectBounded(
      80'000,
      [](std::uint64_t n, auto& sent, auto& returned) {
        // States nobody knows, requested of and shown by ever other slaves; writes to registers that are read-only.
        const auto station = static_cast<std::uint16_t>(0x1001 + n % 64);
        sent.push_back(Of(Cmd::FPWR, station, 0x0120, {static_cast<std::uint8_t>(n), 0}));
        sent.push_back(Of(Cmd::FPRD, station, 0x0130, Bytes(6, 0)));
        sent.push_back(Of(Cmd::FPWR, station, static_cast<std::uint16_t>(n % 0x1000), Bytes(2, 7)));
        returned.push_back(Answered(sent[0], sent[0].data, 1));
        returned.push_back(
            Answered(sent[1], {static_cast<std::uint8_t>(n / 64), 0, 0, 0, static_cast<std::uint8_t>(n), 0}, 1));
        returned.push_back(Answered(sent[2], sent[2].data, 1));
      },
      kLimit, 4 * kMiB);  // as many as are kept come late: few of the states are read twice in a row
}

TEST(BoundedMemory, FramesThatNeverComeBack) {
  ExpectBounded(20'000, [](std::uint64_t n, auto& sent, auto& returned) {
    sent.push_back(Of(Cmd::FPRD, 0x1001, 0x0130, Bytes(1400, 0)));
    sent[0].index = static_cast<std::uint8_t>(n);
    if (n % 1000 == 0) returned.push_back(Answered(sent[0], Bytes(1400, 1), 1));
  });
}

TEST(BoundedMemory, EepromWordsOfOneSlave) {
  ExpectBounded(20'000, [](std::uint64_t n, auto& sent, auto& returned) {
    // The whole address space of the EEPROM interface, 32 bits.
    const auto word = static_cast<std::uint32_t>(n * 0x9E3779B1U);
    sent.push_back(Of(Cmd::FPWR, 0x1001, 0x0502, samples::LeBytes(std::uint16_t{0x0100})));
    samples::AppendLe(sent[0].data, word);
    sent.push_back(Of(Cmd::FPRD, 0x1001, 0x0502, Bytes(14, 0)));
    Bytes back = samples::LeBytes(std::uint16_t{0});
    samples::AppendLe(back, word);
    back.resize(14, static_cast<std::uint8_t>(n));
    returned.push_back(Answered(sent[0], sent[0].data, 1));
    returned.push_back(Answered(sent[1], std::move(back), 1));
  });
}

TEST(BoundedMemory, DistinctObjectsWithoutEnd) {
  ExpectBoundedStory(6'000, [](samples::Story& story, int n) {
    story.master.Download(0, static_cast<std::uint16_t>(0x2000 + n % 0x4000), static_cast<std::uint8_t>(n / 0x4000),
                          {1, 2, 3, 4});
  });
}

TEST(BoundedMemory, SegmentsWithoutEnd) {
  bool begun = false;
  ExpectBoundedStory(2'000, [&](samples::Story& story, int n) {
    Bytes request(10, 0);
    request[1] = 0x20;                                                      // SDO request
    request[2] = n == 0 ? 0x21 : static_cast<std::uint8_t>((n & 1) << 4U);  // initiate of 4 GiB, then segments
    if (n == 0) {
      request[3] = 0x00;
      request[4] = 0x20;
      samples::StoreLe(request, 6, std::uint32_t{0xFFFFFFFF});
    } else {
      request.resize(120, static_cast<std::uint8_t>(n));
    }
    begun = begun || n == 0;
    story.master.WriteMailbox(0, 3, std::move(request));
    story.master.Wait(1'000'000);
    story.master.ReadMailbox(0, 2'000'000);
  });
  EXPECT_TRUE(begun);
}

TEST(BoundedMemory, FragmentsWithoutEnd) {
  for (const std::uint8_t protocol : {std::uint8_t{2}, std::uint8_t{4}, std::uint8_t{5}}) {  // EoE, FoE, SoE
    ExpectBoundedStory(1'000, [&](samples::Story& story, int n) {
      Bytes service(100, static_cast<std::uint8_t>(n));
      if (protocol == 2) {
        service[0] = 0;  // fragment, not the last
        service[1] = 0;
        samples::StoreLe(service, 2, static_cast<std::uint16_t>((n & 0x3F) | (n == 0 ? 0x0FC0 : 0) | 0x1000));
      } else if (protocol == 4) {
        service[0] = n == 0 ? 2 : 3;  // write request, then data
        service[1] = 0;
        samples::StoreLe(service, 2, static_cast<std::uint32_t>(n));
      } else {
        service[0] = 0x03 | 0x08;  // write request, incomplete
        samples::StoreLe(service, 2, static_cast<std::uint16_t>(1000 - n));
      }
      story.master.WriteMailbox(0, protocol, std::move(service));
      story.master.Wait(1'000'000);
      story.master.ReadMailbox(0, 2'000'000);
    });
  }
}

TEST(BoundedMemory, CommentsAndInterfacesWithoutEnd) {
  const auto peak = [](int packets) {
    samples::WrittenCapture capture;
    capture.interfaces.resize(static_cast<std::size_t>(packets) / 4,
                              samples::WrittenInterface{.name = "eth", .dropped = {}});
    for (int i = 0; i < packets; ++i) {
      samples::WrittenPacket packet{.bytes = Bytes(60, 0), .time = i, .comment = std::string(2000, 'c')};
      packet.interface_index = static_cast<std::uint32_t>(i) / 4U;
      capture.packets.push_back(std::move(packet));
    }
    const Bytes file = samples::EncodePcapNg(capture);
    const auto source = capture::OpenCaptureFromMemory(file);
    EXPECT_TRUE(source);
    return source ? PeakOf(**source) : 0;
  };
  const std::int64_t small = peak(4'000);
  EXPECT_LT(peak(12'000), small + kMiB) << "an interface has a few bytes, comments are kept up to a number";
}

}  // namespace
}  // namespace ecaudit::perf
