#include "tests/property/rewrites.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <unordered_map>
#include <utility>

namespace ecaudit::test {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Result = std::optional<std::vector<Packet>>;

constexpr std::size_t kEthernetHeader = 14;
constexpr std::size_t kEthernetLeast = 60;
constexpr std::size_t kEtherCatMost = 1498;

/// The same every time, and without order.
std::uint32_t Scramble(std::uint32_t n) {
  n = (n ^ n >> 16U) * 0x7FEB352DU;
  n = (n ^ n >> 15U) * 0x846CA68BU;
  return n ^ n >> 16U;
}

void PutLe(Bytes& bytes, std::size_t at, std::uint16_t value) {
  bytes[at] = static_cast<std::uint8_t>(value & 0xFFU);
  bytes[at + 1] = static_cast<std::uint8_t>(value >> 8U);
}

std::uint16_t GetLe(const Bytes& bytes, std::size_t at) {
  return static_cast<std::uint16_t>(bytes[at] | bytes[at + 1] << 8U);
}

/// Changes the bytes of every packet; a packet that is longer now was so on the wire.
template <typename Change>
std::vector<Packet> Each(const WireCapture& capture, Change change) {
  std::vector<Packet> packets = capture.packets;
  for (Packet& packet : packets) {
    const std::size_t size = packet.bytes.size();
    change(packet);
    if (packet.original_length != 0) {
      packet.original_length = static_cast<std::uint32_t>(packet.original_length + packet.bytes.size() - size);
    }
  }
  return packets;
}

// ---------------------------------------------------------------------------------------------- numbering

/// A frame as a numbering master sees it.
struct Place {
  std::uint32_t number = 0;     ///< of the frame
  std::uint32_t datagrams = 0;  ///< sent before it
  std::uint32_t of_half = 0;    ///< frames with process data before it, or frames without
  bool cyclic = false;
  std::uint32_t process_data = 0;  ///< the last datagram with process data; 0 where there is none
};

constexpr std::uint8_t kLrd = 10, kLrw = 12;

/// @param scheme index of datagram k in a frame
template <typename Scheme>
std::vector<Packet> Renumber(NumberedPackets numbered, Scheme scheme) {
  std::unordered_map<std::uint32_t, Place> places;
  Place next;
  std::uint32_t halves[2] = {0, 0};
  for (std::size_t i = 0; i < numbered.packets.size(); ++i) {
    if (numbered.frames[i] == kNoFrame) continue;
    Packet& packet = numbered.packets[i];
    const std::optional<EtherCatPart> part = FindEtherCat(packet);
    if (!part) continue;
    const auto [place, is_new] = places.try_emplace(numbered.frames[i], next);
    if (is_new) {
      place->second.cyclic = part->cyclic;
      for (std::uint32_t k = 0; k < part->count(); ++k) {
        const std::uint8_t command = packet.bytes[part->datagrams[k]];
        if (command >= kLrd && command <= kLrw) place->second.process_data = k;
      }
      place->second.of_half = halves[part->cyclic ? 1 : 0]++;
      ++next.number;
      next.datagrams += static_cast<std::uint32_t>(part->count());
    }
    for (std::uint32_t k = 0; k < part->count(); ++k) {
      packet.bytes[part->datagrams[k] + 1] = static_cast<std::uint8_t>(scheme(place->second, k) & 0xFFU);
    }
  }
  return std::move(numbered.packets);
}

/// Where packets are cut or came back damaged, not every copy could be numbered anew.
template <typename Scheme>
Result Numbered(const WireCapture& capture, Scheme scheme) {
  if (capture.cut) return std::nullopt;
  NumberedPackets numbered = NumberFrames(capture.packets);
  if (!numbered.all_known) return std::nullopt;
  return Renumber(std::move(numbered), scheme);
}

Result SixteenSlots(const WireCapture& c) {
  return Numbered(c, [](const Place& p, std::uint32_t) { return p.number % 16; });
}
Result Running(const WireCapture& c) {
  return Numbered(c, [](const Place& p, std::uint32_t) { return p.number; });
}
Result RunningFrom80ToEf(const WireCapture& c) {
  return Numbered(c, [](const Place& p, std::uint32_t k) { return k == 0 ? 0x80 + p.number % 0x70 : 0; });
}
Result OneForEachDatagram(const WireCapture& c) {
  return Numbered(c, [](const Place& p, std::uint32_t k) { return p.datagrams + k; });
}
Result OneIndexForAll(const WireCapture& c) {
  return Numbered(c, [](const Place&, std::uint32_t) { return 0xFFU; });
}
Result FirstNumberedOthersFf(const WireCapture& c) {
  return Numbered(c, [](const Place& p, std::uint32_t k) { return k == 0 ? p.number : 0xFFU; });
}
Result RoundOfHundred(const WireCapture& c) {
  return Numbered(c, [](const Place& p, std::uint32_t) { return p.number % 100; });
}
Result TwoCounters(const WireCapture& c) {
  return Numbered(c,
                  [](const Place& p, std::uint32_t) { return p.cyclic ? p.of_half % 0x80 : 0x80 + p.of_half % 0x80; });
}
/// TwinCAT: a counter for process data, which stands in one of their datagrams, and one for all else.
Result ProcessDataNumbered(const WireCapture& c) {
  return Numbered(c, [](const Place& p, std::uint32_t k) {
    if (k != (p.cyclic ? p.process_data : 0)) return std::uint32_t{0};
    return p.cyclic ? p.of_half : 0x80 + p.of_half % 0x80;
  });
}
Result InStepsOfSeven(const WireCapture& c) {
  return Numbered(c, [](const Place& p, std::uint32_t k) { return p.number * 7 + k; });
}
Result WithoutOrder(const WireCapture& c) {
  return Numbered(c, [](const Place& p, std::uint32_t) { return Scramble(p.number); });
}

/// The master leaves out numbers before these frames: shares of a hundred of all frames. Only where both copies of all
/// frames are there nothing else shows that frames are missing.
template <std::size_t kCount>
Result LeavesOut(const WireCapture& capture, std::uint32_t numbers, const std::array<std::uint32_t, kCount>& before) {
  if (capture.cut) return std::nullopt;
  NumberedPackets numbered = NumberFrames(capture.packets);
  std::unordered_map<std::uint32_t, std::uint32_t> copies;
  for (const std::uint32_t frame : numbered.frames) {
    if (frame != kNoFrame) ++copies[frame];
  }
  const bool whole = std::all_of(copies.begin(), copies.end(), [](const auto& frame) { return frame.second == 2; });
  if (!numbered.all_known || !whole) return std::nullopt;
  const auto frames = static_cast<std::uint32_t>(copies.size());
  return Renumber(std::move(numbered), [&](const Place& p, std::uint32_t) {
    std::uint32_t left_out = 0;
    for (const std::uint32_t share : before) left_out += p.number >= frames * share / 100 ? numbers : 0;
    return p.number + left_out;
  });
}
Result LeavesOutFiveOnce(const WireCapture& c) {
  return LeavesOut(c, 5, std::array{40U});
}
Result LeavesOutSixtyFourThrice(const WireCapture& c) {
  return LeavesOut(c, 64, std::array{30U, 55U, 80U});
}

// ---------------------------------------------------------------------------------------------- padding

/// Makes the EtherCAT length `length`, with zeros behind the datagrams.
void Cover(Packet& packet, const EtherCatPart& part, std::size_t length) {
  const std::uint16_t header = GetLe(packet.bytes, part.header);
  const std::size_t covered = header & 0x07FFU;
  if (covered >= length) return;
  packet.bytes.insert(packet.bytes.begin() + static_cast<std::ptrdiff_t>(part.end()), length - covered, 0);
  PutLe(packet.bytes, part.header, static_cast<std::uint16_t>((header & 0xF800U) | length));
}

/// In UDP the lengths of the packet would have to follow.
template <typename Length>
Result Covering(const WireCapture& capture, Length length) {
  if (capture.cut || capture.has_udp) return std::nullopt;
  return Each(capture, [&](Packet& packet) {
    if (const std::optional<EtherCatPart> part = FindEtherCat(packet)) {
      Cover(packet, *part, length(GetLe(packet.bytes, part->header) & 0x07FFU));
    }
  });
}

Result PaddedToEven(const WireCapture& capture) {
  return Covering(capture, [](std::size_t length) { return length + length % 2; });
}
Result PaddedTo28(const WireCapture& capture) {
  return Covering(capture, [](std::size_t length) { return std::max<std::size_t>(length, 28); });
}
/// As a master does it that takes the length of the packet for that of the datagrams. Slaves do not look at it.
Result LengthOfTheWholeFrame(const WireCapture& capture) {
  if (capture.cut || capture.has_udp || capture.has_esl) return std::nullopt;
  // A length that is wrong already would no longer be the only one.
  const auto beyond = [](const Packet& packet) {
    constexpr std::size_t kHeaders = kEthernetHeader + 2;
    return packet.bytes.size() > kHeaders && packet.bytes[12] == 0x88 && packet.bytes[13] == 0xA4 &&
           (GetLe(packet.bytes, kEthernetHeader) & 0x07FFU) + kHeaders > packet.bytes.size();
  };
  if (std::any_of(capture.packets.begin(), capture.packets.end(), beyond)) return std::nullopt;
  return Each(capture, [](Packet& packet) {
    const std::optional<EtherCatPart> part = FindEtherCat(packet);
    constexpr std::size_t kLongest = 0x07FF;
    if (!part || packet.bytes.size() > kLongest) return;
    const std::uint16_t header = GetLe(packet.bytes, part->header);
    PutLe(packet.bytes, part->header, static_cast<std::uint16_t>((header & 0xF800U) | packet.bytes.size()));
  });
}
Result PaddedTo60(const WireCapture& capture) {
  if (capture.cut || capture.has_esl) return std::nullopt;
  return Each(capture, [](Packet& packet) {
    // What is no frame could become one.
    if (packet.link_type != 1 || packet.bytes.size() >= kEthernetLeast || !FindEtherCat(packet)) return;
    packet.bytes.resize(kEthernetLeast, 0);
  });
}

// ---------------------------------------------------------------------------------------------- around the frames

/// Its addresses stand at the beginning. Also of frames that no slave can read: the address shows whose they are.
bool HasPlainAddresses(const Packet& packet) {
  const std::optional<EtherCatPart> part = FindEtherCat(packet);
  if (part) return part->plain;
  return packet.link_type == 1 && packet.bytes.size() >= kEthernetHeader && packet.bytes[12] == 0x88 &&
         packet.bytes[13] == 0xA4;
}

Result OtherMacs(const WireCapture& capture) {
  return Each(capture, [](Packet& packet) {
    if (!HasPlainAddresses(packet)) return;
    // Two senders stay two, and the bit that slaves set stays as it is.
    constexpr std::uint8_t kOthers[6] = {0x10, 0x1B, 0x21, 0x44, 0x55, 0x66};
    for (std::size_t i = 0; i < 6; ++i) packet.bytes[6 + i] ^= kOthers[i];
  });
}

/// Slaves that send back from the group's address to that of the master.
Result MacsExchanged(const WireCapture& capture) {
  constexpr std::array<std::uint8_t, 6> kMaster{0x00, 0x1B, 0x21, 0x44, 0x55, 0x66};
  constexpr std::array<std::uint8_t, 6> kGroup{0x01, 0x01, 0x05, 0x01, 0x00, 0x00};
  std::optional<std::uint64_t> sender;
  bool one_sender = true;
  std::vector<Packet> packets = Each(capture, [&](Packet& packet) {
    if (!HasPlainAddresses(packet)) return;
    std::uint64_t mac = 0;
    for (std::size_t i = 6; i < 12; ++i) mac = mac << 8U | packet.bytes[i];
    const bool returned = (mac >> 41U & 1U) != 0;
    mac &= ~(std::uint64_t{1} << 41U);
    one_sender = one_sender && mac == sender.value_or(mac);
    sender = mac;
    std::ranges::copy(returned ? kMaster : kGroup, packet.bytes.begin());
    std::ranges::copy(returned ? kGroup : kMaster, packet.bytes.begin() + 6);
  });
  return one_sender ? Result(std::move(packets)) : std::nullopt;
}

Result TwoTags(const WireCapture& capture) {
  return Each(capture, [](Packet& packet) {
    const std::optional<EtherCatPart> part = FindEtherCat(packet);
    if (!part || !part->plain) return;
    constexpr std::uint8_t kTags[] = {0x88, 0xA8, 0x00, 0x02, 0x81, 0x00, 0xE0, 0x05};
    packet.bytes.insert(packet.bytes.begin() + 12, std::begin(kTags), std::end(kTags));
  });
}

Result InUdp(const WireCapture& capture) {
  if (capture.cut) return std::nullopt;
  return Each(capture, [](Packet& packet) {
    const std::optional<EtherCatPart> part = FindEtherCat(packet);
    if (!part || !part->plain) return;
    const std::size_t payload = packet.bytes.size() - kEthernetHeader;
    Bytes around{0x45, 0, 0,   0,   0,   0,   0,    0,    64,   17,   0, 0, 10, 0,
                 0,    1, 255, 255, 255, 255, 0x88, 0xA4, 0x88, 0xA4, 0, 0, 0,  0};
    const auto put = [&](std::size_t at, std::size_t value) {
      around[at] = static_cast<std::uint8_t>(value >> 8U);
      around[at + 1] = static_cast<std::uint8_t>(value & 0xFFU);
    };
    put(2, payload + 28);
    put(24, payload + 8);
    packet.bytes[12] = 0x08;
    packet.bytes[13] = 0x00;
    packet.bytes.insert(packet.bytes.begin() + kEthernetHeader, around.begin(), around.end());
  });
}

Result WithFcs(const WireCapture& capture) {
  if (capture.cut || capture.has_esl) return std::nullopt;
  return Each(capture, [](Packet& packet) {
    if (packet.link_type != 1 || packet.bytes.size() < kEthernetLeast) return;
    const std::uint32_t sum = Scramble(static_cast<std::uint32_t>(packet.time));
    for (unsigned shift = 0; shift < 32; shift += 8) {
      packet.bytes.push_back(static_cast<std::uint8_t>(sum >> shift & 0xFFU));
    }
  });
}

/// An address request of another host before one packet in twenty, and now and then nonsense instead of it.
Result OtherTraffic(const WireCapture& capture) {
  std::vector<Packet> packets;
  // Where nobody else is there, whoever tells nonsense is the master.
  const bool any_master = std::any_of(capture.packets.begin(), capture.packets.end(),
                                      [](const Packet& packet) { return FindEtherCat(packet).has_value(); });
  for (std::size_t i = 0; i < capture.packets.size(); ++i) {
    const Packet& packet = capture.packets[i];
    if (Scramble(static_cast<std::uint32_t>(i)) % 20 == 0) {
      Packet& other = packets.emplace_back(packet);
      other.bytes.assign(kEthernetLeast, 0);
      std::fill_n(other.bytes.begin(), 6, std::uint8_t{0xFF});
      const std::uint8_t source[] = {0x34, 0x48, 0xED, 0x00, 0x00, 0x07, 0x08, 0x06};
      std::copy(std::begin(source), std::end(source), other.bytes.begin() + 6);
      // Some tell nonsense under EtherCAT's own type, with and without the bit that slaves set in an address.
      if (any_master && Scramble(static_cast<std::uint32_t>(i)) % 160 == 0) {
        const std::uint8_t nonsense[] = {0x88, 0xA4, 0x64, 0x10, 0x04, 0x20, 0x01, 0x10, 0x30, 0x01, 0x02};
        std::copy(std::begin(nonsense), std::end(nonsense), other.bytes.begin() + 12);
        if (i % 2 != 0) other.bytes[6] |= 2U;
      }
      other.link_type = 1;
      other.original_length = 0;
      other.flag = capture::PacketFlag::kNone;
      if (packet.link_type != 1) packets.pop_back();
    }
    packets.push_back(packet);
  }
  return packets;
}

/// Somebody at a mirror port looks for slaves, and nobody answers: with broadcasts of the master, under its index.
Result AStrangerAsks(const WireCapture& capture) {
  constexpr std::size_t kOneIn = 160;  // of more than one in a hundred the report says that they were not analysed
  constexpr std::uint8_t kOwnAddress[] = {0x00, 0x0A, 0x35, 0x01, 0x02, 0x03};
  const auto passed_slaves = [](const Packet& packet) { return (packet.bytes[6] & 2U) != 0; };
  std::size_t returned = 0;
  for (const Packet& packet : capture.packets) {
    const std::optional<EtherCatPart> part = FindEtherCat(packet);
    if (!part || !part->plain) return std::nullopt;
    if (passed_slaves(packet)) ++returned;
  }
  if (returned == 0 || returned == capture.packets.size()) return std::nullopt;
  std::vector<Packet> packets;
  std::size_t next = kOneIn;
  for (std::size_t i = 0; i < capture.packets.size(); ++i) {
    const Packet& packet = capture.packets[i];
    packets.push_back(packet);
    const EtherCatPart part = *FindEtherCat(packet);
    const bool broadcast = packet.bytes[part.datagrams.front()] == static_cast<std::uint8_t>(wire::Command::BRD);
    if (i < next || passed_slaves(packet) || part.count() != 1 || !broadcast) continue;
    next = i + kOneIn;
    Packet stranger = packet;
    std::copy(std::begin(kOwnAddress), std::end(kOwnAddress), stranger.bytes.begin() + 6);
    packets.push_back(std::move(stranger));
  }
  if (packets.size() == capture.packets.size()) return std::nullopt;
  return packets;
}

// ---------------------------------------------------------------------------------------------- time

Result InMicroseconds(const WireCapture& capture) {
  return Each(capture, [](Packet& packet) { packet.time = packet.time / 1000 * 1000; });
}

Result YearsLater(const WireCapture& capture) {
  constexpr TimeNs kThreeYears = 100'000'000'000'000'000;
  return Each(capture, [](Packet& packet) { packet.time += kThreeYears; });
}

// ---------------------------------------------------------------------------------------------- frames

Packet OneDatagram(const Packet& packet, const EtherCatPart& part, std::size_t k) {
  Packet one = packet;
  const std::size_t from = part.datagrams[k];
  const std::size_t to = part.datagrams[k + 1];
  one.bytes.resize(part.header + 2);
  PutLe(one.bytes, part.header, static_cast<std::uint16_t>(0x1000U | (to - from)));
  one.bytes.insert(one.bytes.end(), packet.bytes.begin() + static_cast<std::ptrdiff_t>(from),
                   packet.bytes.begin() + static_cast<std::ptrdiff_t>(to));
  one.bytes[part.header + 2 + 7] &= 0x7FU;  // no more datagrams
  if (packet.bytes.size() >= kEthernetLeast && one.bytes.size() < kEthernetLeast) one.bytes.resize(kEthernetLeast, 0);
  one.original_length = 0;
  return one;
}

/// Each datagram in a frame of its own. The time stays with the process data: in another frame it would not be theirs.
Result Split(const WireCapture& capture) {
  if (capture.cut) return std::nullopt;
  const NumberedPackets numbered = NumberFrames(capture.packets);
  if (!numbered.all_known) return std::nullopt;
  NumberedPackets split;
  constexpr std::uint32_t kMostDatagrams = 256;
  for (std::size_t i = 0; i < numbered.packets.size(); ++i) {
    const Packet& packet = numbered.packets[i];
    const std::uint32_t frame = numbered.frames[i];
    const std::optional<EtherCatPart> part = frame == kNoFrame ? std::nullopt : FindEtherCat(packet);
    if (!part || !part->plain || part->count() == 1 || part->has_time) {
      split.packets.push_back(packet);
      split.frames.push_back(frame == kNoFrame ? kNoFrame : frame * kMostDatagrams);
      continue;
    }
    for (std::uint32_t k = 0; k < part->count(); ++k) {
      split.packets.push_back(OneDatagram(packet, *part, k));
      split.frames.push_back(frame * kMostDatagrams + k);
    }
  }
  if (split.packets.size() == numbered.packets.size()) return std::nullopt;
  return Renumber(std::move(split), [](const Place& p, std::uint32_t) { return p.number; });
}

bool MayJoin(const Packet& first, const Packet& second) {
  const std::optional<EtherCatPart> a = FindEtherCat(first);
  const std::optional<EtherCatPart> b = FindEtherCat(second);
  return a && b && a->plain && b->plain && a->end() - a->header - 2 + b->end() - b->header <= kEtherCatMost;
}

Packet Joined(const Packet& first, const Packet& second) {
  const EtherCatPart a = *FindEtherCat(first);
  const EtherCatPart b = *FindEtherCat(second);
  Packet joined = first;
  joined.bytes.resize(a.end());
  joined.bytes[a.datagrams[a.count() - 1] + 7] |= 0x80U;  // more datagrams
  joined.bytes.insert(joined.bytes.end(), second.bytes.begin() + static_cast<std::ptrdiff_t>(b.datagrams.front()),
                      second.bytes.begin() + static_cast<std::ptrdiff_t>(b.end()));
  PutLe(joined.bytes, a.header, static_cast<std::uint16_t>(0x1000U | (joined.bytes.size() - a.header - 2)));
  if (joined.bytes.size() < kEthernetLeast) joined.bytes.resize(kEthernetLeast, 0);
  joined.original_length = 0;
  return joined;
}

/// Two frames that were sent behind each other and came back behind each other become one.
Result Join(const WireCapture& capture) {
  if (capture.cut) return std::nullopt;
  const NumberedPackets numbered = NumberFrames(capture.packets);
  if (!numbered.all_known) return std::nullopt;
  std::unordered_map<std::uint32_t, std::vector<std::size_t>> copies;
  for (std::size_t i = 0; i < numbered.frames.size(); ++i) {
    if (numbered.frames[i] != kNoFrame) copies[numbered.frames[i]].push_back(i);
  }
  NumberedPackets joined;
  std::vector<bool> done(numbered.packets.size());
  std::vector<std::size_t> with(numbered.packets.size(), 0);  // the packet that is put behind; 0: none
  bool any = false;
  for (std::size_t i = 0; i + 1 < numbered.packets.size(); ++i) {
    if (done[i] || numbered.frames[i] == kNoFrame || numbered.frames[i + 1] == kNoFrame) continue;
    const std::vector<std::size_t>& a = copies[numbered.frames[i]];
    const std::vector<std::size_t>& b = copies[numbered.frames[i + 1]];
    const bool beside = a.size() == 2 && b.size() == 2 && a[0] == i && b[0] == i + 1 && b[1] == a[1] + 1;
    if (!beside || !MayJoin(numbered.packets[i], numbered.packets[i + 1]) ||
        !MayJoin(numbered.packets[a[1]], numbered.packets[b[1]])) {
      continue;
    }
    for (const std::size_t copy : {std::size_t{0}, std::size_t{1}}) {
      with[a[copy]] = b[copy];
      done[a[copy]] = done[b[copy]] = true;
    }
    any = true;
  }
  if (!any) return std::nullopt;
  for (std::size_t i = 0; i < numbered.packets.size(); ++i) {
    if (done[i] && with[i] == 0) continue;  // went into the one before
    joined.packets.push_back(with[i] == 0 ? numbered.packets[i]
                                          : Joined(numbered.packets[i], numbered.packets[with[i]]));
    joined.frames.push_back(numbered.frames[i]);
  }
  return Renumber(std::move(joined), [](const Place& p, std::uint32_t) { return p.number; });
}

constexpr RewriteLaw kLaws[] = {
    {"sixteen slots", SixteenSlots, Keeps::kAll, true},
    {"running", Running, Keeps::kAll, true},
    {"0x80 to 0xEF, others 0", RunningFrom80ToEf, Keeps::kAll, true},
    {"one for each datagram", OneForEachDatagram, Keeps::kAll, true},
    {"one index for all", OneIndexForAll, Keeps::kSaid, true},
    {"others 0xFF", FirstNumberedOthersFf, Keeps::kAll, true},
    {"a round of a hundred", RoundOfHundred, Keeps::kAll, true},
    {"two counters", TwoCounters, Keeps::kAll, true},
    {"process data numbered, others 0", ProcessDataNumbered, Keeps::kAll, true},
    {"in steps of seven", InStepsOfSeven, Keeps::kAll, true},
    {"without order", WithoutOrder, Keeps::kSaid, true},
    {"leaves out five numbers", LeavesOutFiveOnce, Keeps::kRules, true},
    {"leaves out 64 numbers, thrice", LeavesOutSixtyFourThrice, Keeps::kRules, true},
    {"padded to even", PaddedToEven},
    {"padded to 28", PaddedTo28},
    {"padded to 60", PaddedTo60},
    {"length of the whole frame", LengthOfTheWholeFrame},
    {"other MACs", OtherMacs},
    {"MACs exchanged by the slaves", MacsExchanged},
    {"two tags", TwoTags},
    {"in UDP", InUdp},
    {"with FCS", WithFcs},
    {"other traffic", OtherTraffic},
    {"a stranger asks", AStrangerAsks},
    {"in microseconds", InMicroseconds},
    {"years later", YearsLater},
    {"split", Split, Keeps::kFrames},
    {"joined", Join, Keeps::kFrames},
};

}  // namespace

std::span<const RewriteLaw> RewriteLaws() {
  return kLaws;
}

}  // namespace ecaudit::test
