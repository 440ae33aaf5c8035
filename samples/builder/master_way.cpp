#include "samples/builder/master_way.h"

#include <algorithm>

namespace ecaudit::samples {
namespace {

using Others = Numbering::Others;

constexpr MacAddress kNetworkCard{0x00, 0x1B, 0x21, 0x3C, 0x4D, 0x5E};
/// A frame of Ethernet without its checksum.
constexpr std::size_t kEthernetLeast = 60;

constexpr NamedWay kWays[] = {
    {.name = "soem", .way = {}},
    {.name = "twincat",
     .way = {.mac = {},
             .numbering = {.all = {0x80, 0xEF}, .others = Others::kZero, .while_scanning = 0xFF, .restarts = true},
             .padding = {.even = true},
             .first_station = 0x03E9,
             .clears_stations = true,
             .logical_base = 0x01000000,
             .grouping = {.status_behind_others = true},
             .time = {.command = Cmd::ARMW, .in_front = true, .bytes = 4},
             .mail = MailPolling::kMailbox,
             .writes_last_byte_of_mail = true,
             .always_acknowledges = false}},
    {.name = "twincat-two-counters",
     .way = {.mac = kNetworkCard,
             .numbering = {.all = {0x80, 0xFF},
                           .others = Others::kZero,
                           .cyclic = Numbering::Counter{0x00, 0xFF},
                           .in_process_data = true},
             .padding = {.even = true},
             .first_station = 0x03E9,
             .clears_stations = true,
             .logical_base = 0x01000000,
             .time = {.command = Cmd::ARMW, .in_front = true},
             .writes_last_byte_of_mail = true,
             .always_acknowledges = false}},
    {.name = "igh",
     .way = {.mac = kNetworkCard,
             .numbering = {.all = {0x00, 0xFF}, .others = Others::kCounted},
             .padding = {.ethernet_size = kEthernetLeast},
             .first_station = 0x0001,
             .clears_stations = true,
             .time = {.bytes = 4},
             .mail = MailPolling::kSyncManager,
             .counts_mail = false,
             .always_acknowledges = false,
             .reads_status_code = false,
             .renumbers_repetitions = true}},
    {.name = "ethercrab",
     .way = {.mac = {0x10, 0x10, 0x10, 0x10, 0x10, 0x10},
             .numbering = {.all = {0x00, 0xFF}, .others = Others::kCounted},
             .first_station = 0x1000,
             .time = {.in_front = true},
             .always_acknowledges = false,
             .reads_status_code = false}},
    {.name = "ethercrab-early",
     .way = {.mac = {0x10, 0x10, 0x10, 0x10, 0x10, 0x10},
             .numbering = {.all = {0x00, 0xFF}},
             .padding = {.least = 28, .ethernet_size = kEthernetLeast},
             .first_station = 0x1000,
             .always_acknowledges = false,
             .reads_status_code = false}},
    {.name = "kickcat",
     .way = {.mac = {0xCA, 0xDE, 0xCA, 0xDE, 0xDE, 0xFF},
             .numbering = {.all = {0x00, 0xFF}, .others = Others::kCounted},
             .padding = {.ethernet_size = kEthernetLeast},
             .first_station = 0x03E9,
             .grouping = {.apart_by_direction = true},
             .always_acknowledges = false,
             .requests_by_broadcast = true}},
    {.name = "acontis",
     .way = {.mac = kNetworkCard,
             .numbering = {.all = {0x80, 0xFF}, .others = Others::kSame, .cyclic = Numbering::Counter{0x00, 0x7F}},
             .addressing = Addressing::kAlias,
             .grouping = {.apart_by_slave = true, .own_frames = true},
             .time = {.in_front = true}}},
    {.name = "codesys",
     .way = {.mac = kNetworkCard,
             .numbering = {.all = {0x00, 0x00}},
             .padding = {.even = true, .ethernet_size = kEthernetLeast},
             .addressing = Addressing::kPosition,
             .grouping = {.apart_by_slave = true},
             .time = {.command = Cmd::ARMW, .in_front = true}}},
};

}  // namespace

std::span<const NamedWay> MasterWays() {
  return kWays;
}

const MasterWay& WayOf(std::string_view name) {
  const auto* found =
      std::find_if(std::begin(kWays), std::end(kWays), [name](const NamedWay& one) { return one.name == name; });
  return found == std::end(kWays) ? kWays[0].way : found->way;
}

}  // namespace ecaudit::samples
