/// Mailboxes that a master reads with its process data: where they lie in logical datagrams.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "decoder/esc/fmmu.h"
#include "decoder/esc/sync_manager.h"
#include "decoder/mailbox/header.h"
#include "decoder/wire/frame_view.h"

namespace ecaudit::cli::anonymize {

class MappedMailboxes {
 public:
  struct Place {
    std::uint32_t slave = 0;
    mailbox::Direction direction = mailbox::Direction::kIn;
    std::size_t begin = 0;  ///< in the data of the datagram
    std::size_t length = 0;
  };

  /// Every datagram with an ESC address, in file order. @param slave  any number that identifies the slave
  void Subscribe(const wire::DatagramView& datagram, std::uint32_t slave);
  /// The whole mailboxes in a logical datagram.
  [[nodiscard]] std::vector<Place> In(const wire::DatagramView& datagram);

 private:
  /// What was written to FMMUs and sync managers of one slave.
  struct Units {
    std::array<std::uint8_t, esc::kMaxFmmus * esc::kFmmuBytes> fmmus{};
    std::array<std::uint8_t, esc::kMaxSyncManagers * esc::kSyncManagerBytes> managers{};
  };
  static constexpr std::size_t kMostSlaves = 4096;

  struct Mapped {
    Place place;  ///< `begin` unused
    std::uint64_t logical = 0;
  };

  void FindMapped();

  std::map<std::uint32_t, Units> units_;
  std::vector<Mapped> mapped_;
  bool changed_ = false;  ///< since mapped_ was made
};

}  // namespace ecaudit::cli::anonymize
