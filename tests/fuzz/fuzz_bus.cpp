/// A bus in a compact language, so that a few bytes reach deep into trackers, models and rules. Input: frames, each
///
///   | flags 1 | gap 1 | datagram ... |      flags 1:0 datagrams - 1, 2 no outbound copy, 3 no returned copy,
///                                           4 returned twice, 5 slaves 2 instead of 1, 6 without time stamps
///   datagram: | command 1 | address 1 | wkc 1 | length 1 | data |
///
/// `address` chooses from a table of the addresses that mean something, `gap` is the time to the next frame in steps
/// of 2^n us.
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "samples/builder/frame_builder.h"
#include "tests/fuzz/bus_addresses.h"
#include "tests/fuzz/whole_analysis.h"
#include "tests/support/memory_source.h"

namespace ecaudit {
namespace {

/// Takes bytes off the input; zeros behind its end.
class Input {
 public:
  explicit Input(ByteSpan bytes) : bytes_(bytes) {}
  [[nodiscard]] bool empty() const { return bytes_.empty(); }
  std::uint8_t Byte() {
    const std::uint8_t byte = bytes_.empty() ? std::uint8_t{0} : bytes_[0];
    bytes_ = Slice(bytes_, 1);
    return byte;
  }
  ByteSpan Take(std::size_t count) {
    const ByteSpan taken = Slice(bytes_, 0, count);
    bytes_ = Slice(bytes_, taken.size());
    return taken;
  }

 private:
  ByteSpan bytes_;
};

struct Exchange {
  samples::EtherCatFrame sent;
  samples::EtherCatFrame returned;
};

void AddDatagram(Input& input, Exchange& exchange, std::uint8_t index, std::uint16_t slaves) {
  samples::Datagram sent;
  sent.command = static_cast<samples::Cmd>(input.Byte() % 15U);
  const std::uint8_t address = input.Byte();
  const std::uint8_t wkc = input.Byte();
  const std::size_t length = input.Byte() % 160U;
  sent.index = index;
  if (samples::CmdIsLogical(sent.command)) {
    sent.set_logical(0x10000U + (address & 0x0FU) * 4U);
  } else {
    sent.ado = fuzz::kBusAddresses[(address & 0x7FU) % fuzz::kBusAddresses.size()];
    const bool by_station = sent.command >= samples::Cmd::FPRD && sent.command <= samples::Cmd::FPRW;
    const std::uint16_t which = address >> 7U;
    sent.adp = static_cast<std::uint16_t>(by_station || sent.command == samples::Cmd::FRMW ? 0x1001U + which
                                                                                           : 0x10000U - which);
  }
  const ByteSpan data = input.Take(length);
  samples::Bytes bytes(data.begin(), data.end());
  bytes.resize(length, 0);
  samples::Datagram returned = sent;
  returned.data = bytes;
  returned.wkc = wkc % 16U;
  returned.circulating = (wkc & 0x80U) != 0;
  if (samples::CmdCountsSlaves(sent.command)) returned.adp = static_cast<std::uint16_t>(sent.adp + slaves);
  sent.data = samples::CmdWrites(sent.command) ? bytes : samples::Bytes(length, 0);
  exchange.sent.datagrams.push_back(std::move(sent));
  exchange.returned.datagrams.push_back(std::move(returned));
}

std::vector<test::Packet> Packets(Input input) {
  constexpr std::size_t kMaxFrames = 300;
  std::vector<test::Packet> packets;
  TimeNs time = 1'704'067'200'000'000'000;
  for (std::size_t frame = 0; frame < kMaxFrames && !input.empty(); ++frame) {
    const std::uint8_t flags = input.Byte();
    time += TimeNs{1000} << (input.Byte() % 24U);
    const std::uint16_t slaves = (flags & 0x20U) != 0 ? 2 : 1;
    Exchange exchange;
    for (unsigned i = 0; i <= (flags & 3U); ++i) {
      AddDatagram(input, exchange, static_cast<std::uint8_t>(frame), slaves);
    }
    exchange.returned.source = samples::AfterSlave(exchange.returned.source);
    const auto add = [&](const samples::EtherCatFrame& from, TimeNs at) {
      test::Packet packet;
      packet.bytes = samples::EncodePacket(from);
      packet.time = at;
      packet.has_time = (flags & 0x40U) == 0;
      packets.push_back(std::move(packet));
    };
    if ((flags & 4U) == 0) add(exchange.sent, time);
    if ((flags & 8U) == 0) add(exchange.returned, time + 30'000);
    if ((flags & 16U) != 0) add(exchange.returned, time + 40'000);
  }
  return packets;
}

}  // namespace
}  // namespace ecaudit

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  ecaudit::test::MemorySource source(ecaudit::Packets(ecaudit::Input({data, size})));
  ecaudit::fuzz::AnalyseAndReport(source, size);
  return 0;
}
