/// in: logical datagrams, accesses to process memory, AL states.  out: process data of a slave in OP that an FMMU maps
/// and no datagram ever carries, while others are exchanged.
///
/// keeps: what each FMMU maps and whether anything touched it since the mapping is what it is.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "decoder/track/events.h"
#include "decoder/track/network.h"

namespace ecaudit {

/// Of one slave, from when it was in OP until it left, or the capture ended.
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
  /// Process data may be read and written at the slave's own address, too.
  void On(const track::SlaveAccess& access);
  void EnteredOp(SlaveId slave, const FrameRef& frame);
  /// It is in OP no more, as far as is known, or the capture ends.
  /// @return what was not exchanged for so long that no slow cycle explains it
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
