/// keeps: what slaves took or gave lately. A frame whose loss shows late leaves that alone.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "decoder/base/ids.h"

namespace ecaudit::track {

class RecentAccesses {
 public:
  void Add(FrameNo sent, SlaveId slave, EscAddress address, std::size_t length) {
    kept_[next_] = {sent, slave, address, static_cast<std::uint16_t>(length)};
    next_ = (next_ + 1) % kept_.size();
  }

  /// A frame sent after `sent` has shown, or set, all of these bytes.
  [[nodiscard]] bool Since(FrameNo sent, SlaveId slave, EscAddress address, std::size_t length) const {
    return std::ranges::any_of(kept_, [&](const Entry& e) {
      return e.slave == slave && e.sent > sent && e.address <= address &&
             static_cast<std::size_t>(address - e.address) + length <= e.length;
    });
  }

 private:
  struct Entry {
    FrameNo sent = 0;
    SlaveId slave = kNoSlave;
    EscAddress address = 0;
    std::uint16_t length = 0;
  };

  std::array<Entry, 64> kept_{};
  std::size_t next_ = 0;
};

}  // namespace ecaudit::track
