/// in: answers to datagrams for one slave.  out: the addresses of which all returned with working counter 0.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>

#include "decoder/base/ids.h"
#include "decoder/base/time.h"
#include "decoder/track/events.h"
#include "decoder/wire/command.h"

namespace ecaudit {

class UnansweredAddresses {
 public:
  struct Accesses {
    FrameRef first, last;
    EscAddress address = 0;  ///< in the first of them
    std::uint64_t count = 0;
    std::uint64_t writes = 0;
    EscAddress written = 0;  ///< in the first write

    /// From the first to the last; nothing without time stamps.
    [[nodiscard]] std::optional<TimeNs> Lasted() const {
      if (!first.has_time || !last.has_time) return std::nullopt;
      return Elapsed(first.time, last.time);
    }
  };

  /// @param key  the address of the slave: a station or a position
  void Add(std::uint32_t key, const track::Answered& answer) {
    if (all_.size() == kMost && !all_.contains(key)) return;
    Accesses& accesses = all_[key];
    if (accesses.count++ == 0) {
      accesses.first = answer.returned;
      accesses.address = answer.address;
    }
    accesses.last = answer.returned;
    const bool writes = answer.command == wire::Command::FPWR || answer.command == wire::Command::APWR;
    if (writes && accesses.writes++ == 0) accesses.written = answer.address;
  }
  void Remove(std::uint32_t key) {
    if (!all_.empty()) all_.erase(key);
  }
  void Clear() { all_.clear(); }
  [[nodiscard]] const std::map<std::uint32_t, Accesses>& all() const { return all_; }

 private:
  static constexpr std::size_t kMost = 64;
  std::map<std::uint32_t, Accesses> all_;
};

}  // namespace ecaudit
