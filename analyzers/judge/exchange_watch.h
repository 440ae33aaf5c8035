/// in: logical datagrams, accesses to process memory, AL states.  out: process data of a slave in OP that an FMMU maps
/// and that no datagram carries, while other process data are exchanged.
///
/// keeps: what each FMMU maps, and whether anything accessed it since this mapping was set.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "decoder/track/events.h"
#include "decoder/track/network.h"

namespace ecaudit {

/// Of one slave, from its entry into OP until it left OP, or until the capture ended.
struct Unexchanged {
  FrameRef since, until;
  std::uint64_t output_bytes = 0, input_bytes = 0;
  std::uint64_t address = 0;  ///< the lowest logical one
  FrameNo mapped = 0;         ///< the frame that set it
};

class ExchangeWatch {
 public:
  void On(const track::LogicalAccess& access, const track::Network& network) {
    if (version_ != network.mapping_version()) FindMapped(access, network);
    last_ = access.frame();
    const Datagram now{true, access.command, access.address, access.length};
    Datagram& known = known_[(std::uint64_t{access.address} * 31U + access.length) % known_.size()];
    if (known == now) return;
    known = now;
    Mark(access);
  }
  /// A master may also read and write process data at the slave's own address.
  void On(const track::SlaveAccess& access);
  void EnteredOp(SlaveId slave, const FrameRef& frame);
  /// It left OP, as far as is known, or the capture ends.
  /// @return what was not exchanged for longer than any slow cycle
  std::optional<Unexchanged> Leaves(SlaveId slave);
  void Forget() { op_since_.clear(); }

 private:
  struct Datagram {
    bool used = false;
    wire::Command command = wire::Command::NOP;
    std::uint32_t address = 0;
    std::uint16_t length = 0;
    friend bool operator==(const Datagram&, const Datagram&) = default;
  };
  /// What one FMMU maps, in bytes.
  struct Mapped {
    SlaveId slave = kNoSlave;
    bool outputs = false;
    std::uint64_t begin = 0, end = 0;  ///< logical addresses
    MemoryRange memory;
    FrameNo set = 0;
    bool touched = false;
  };

  void FindMapped(const track::LogicalAccess& access, const track::Network& network);
  void Mark(const track::LogicalAccess& access);

  std::optional<std::uint64_t> version_;
  std::vector<Mapped> mapped_;
  FrameRef mapped_since_, last_;
  std::array<Datagram, 64> known_;
  std::vector<FrameRef> op_since_;  // of each slave; not seen: it is not known to be in OP
};

}  // namespace ecaudit
