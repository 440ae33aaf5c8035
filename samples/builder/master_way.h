/// The ways of masters, as data: how one numbers, pads, addresses, groups, repeats, distributes time and looks for
/// mail. ScriptedMaster does whatever a scenario tells it in any of these ways; fields of different masters go together
/// freely.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "decoder/base/ids.h"
#include "samples/builder/frame_builder.h"

namespace ecaudit::samples {

/// Which indices the datagrams carry.
struct Numbering {
  struct Counter {
    std::uint8_t first = 0;
    std::uint8_t last = 15;  ///< behind it comes `first` again
  };
  /// Of the datagrams behind the first one of a frame.
  enum class Others : std::uint8_t { kSame, kCounted, kZero };

  Counter all{};
  Others others = Others::kSame;
  std::optional<Counter> cyclic{};               ///< frames with process data count here instead
  bool in_process_data = false;                  ///< in these the number stands in the last datagram of such data
  std::optional<std::uint8_t> while_scanning{};  ///< carried by all frames of a scan
  bool restarts = false;                         ///< at `first`, when a scan is done
};

/// Zeros behind the datagrams, and what is said of them.
struct Padding {
  bool even = false;              ///< the EtherCAT length is rounded up to an even number
  std::uint16_t least = 0;        ///< the EtherCAT length is never less
  std::size_t ethernet_size = 0;  ///< smallest outbound frame, as Ethernet sees it
};

/// How a slave is spoken to once all slaves are known.
enum class Addressing : std::uint8_t { kStation, kPosition, kAlias };

/// How the process image is cut into datagrams, and these into frames.
struct Grouping {
  bool apart_by_direction = false;  ///< LRD and LWR instead of LRW
  bool apart_by_slave = false;
  bool own_frames = false;            ///< one datagram a frame, sent without waiting for the frame before
  bool status_behind_others = false;  ///< BRD 0x0130 as second datagram of every frame without process data
};

/// The frame that carries the time of the first slave to the others.
struct TimeDistribution {
  Cmd command = Cmd::FRMW;  ///< or ARMW
  bool in_front = false;    ///< of the process data instead of behind
  std::uint8_t bytes = 8;   ///< or 4
};

/// How a master learns that a slave has mail.
enum class MailPolling : std::uint8_t {
  kStatus,       ///< reads 0x080D
  kSyncManager,  ///< reads the eight bytes from 0x0808
  kMailbox,      ///< reads the mailbox, in vain while it is empty
};

struct MasterWay {
  MacAddress mac{0x01, 0x01, 0x01, 0x01, 0x01, 0x01};
  Numbering numbering{};
  Padding padding{};
  Addressing addressing = Addressing::kStation;
  std::uint16_t first_station = 0x1001;
  bool clears_stations = false;  ///< writes 0 to all station addresses first
  std::uint32_t logical_base = 0;
  Grouping grouping{};
  TimeDistribution time{};
  MailPolling mail = MailPolling::kStatus;
  bool counts_mail = true;                ///< else the counter of the mailbox header stays 0
  bool writes_last_byte_of_mail = false;  ///< a message and the last byte of the mailbox, instead of all of it
  bool always_acknowledges = true;        ///< AL Control is written as 0x11, 0x12, 0x14, 0x18
  bool requests_by_broadcast = false;     ///< AL Control of all slaves at once on the way up
  bool reads_status_code = true;          ///< polls 6 bytes from 0x0130, else 2
  TimeNs think_time = 20'000;             ///< from a returned frame to the next one
  TimeNs poll_interval = 1'000'000;       ///< between reads of AL Status
  TimeNs mailbox_interval = 500'000;      ///< between reads of the mailbox
  TimeNs frame_timeout = 2'000'000;       ///< until a frame is sent again
  bool renumbers_repetitions = false;     ///< else it is sent again under the same index
  int attempts = 3;
  TimeNs wake_jitter = 3'000;  ///< process-data frames leave up to this late
};

struct NamedWay {
  std::string_view name;  ///< "soem"
  MasterWay way{};
};

/// What is known of well-known masters, from public captures and sources. Nobody has seen a capture of the last two:
/// theirs are ways that masters are reported to have, under a name that may have them.
[[nodiscard]] std::span<const NamedWay> MasterWays();
/// By name, which must be one of the above.
[[nodiscard]] const MasterWay& WayOf(std::string_view name);

}  // namespace ecaudit::samples
