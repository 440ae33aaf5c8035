/// in: DatagramPair with a logical address.  out: SlaveAccess, what it read from a mailbox.
///
/// keeps: the in mailboxes that some FMMU maps into the logical address space; nearly always none.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "decoder/esc/fmmu.h"
#include "decoder/track/datagram_pair.h"
#include "decoder/track/slave_states.h"

namespace ecaudit::track {

class MappedMailboxes {
 public:
  struct Mapped {
    SlaveId slave = kNoSlave;
    esc::Fmmu fmmu;

    /// A master may read mailboxes together with the process data. The working counter is shared, so whether this
    /// slave gave something shows only in the data: they differ from what was sent.
    [[nodiscard]] std::optional<SlaveAccess> Read(const DatagramPair& d) const;
  };

  MappedMailboxes(const SlaveStates& states, const MappingCache& mappings) : states_(states), mappings_(mappings) {}

  /// By slave, as the FMMUs and sync managers are set now. Valid until the next call.
  [[nodiscard]] const std::vector<Mapped>& Now() {
    if (version_ != mappings_.version()) Find();
    return mapped_;
  }

 private:
  void Find();

  const SlaveStates& states_;
  const MappingCache& mappings_;
  std::vector<Mapped> mapped_;
  std::uint64_t version_ = 0;  // of the mappings that it rests on
};

}  // namespace ecaudit::track
