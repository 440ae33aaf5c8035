#include "decoder/bus/direction.h"

#include <algorithm>

namespace ecaudit::bus {
namespace {

constexpr std::uint64_t kMacBit = std::uint64_t{1} << 41U;

std::uint64_t Mix(std::uint64_t hash, std::uint64_t value) {
  hash ^= value + 0x9E3779B97F4A7C15ULL + (hash << 6U) + (hash >> 2U);
  return hash * 0xFF51AFD7ED558CCDULL;
}

}  // namespace

std::uint64_t FrameKey(const wire::FrameView& frame) noexcept {
  std::uint64_t hash = frame.size();
  for (std::size_t i = 0; i < frame.size(); ++i) {
    const wire::DatagramView d = frame[i];
    std::uint64_t address = d.ado();
    if (!wire::IncrementsAdp(d.command())) address |= static_cast<std::uint64_t>(d.adp()) << 16U;
    hash = Mix(hash, static_cast<std::uint64_t>(d.command_byte()) << 56U | static_cast<std::uint64_t>(d.index()) << 48U |
                         static_cast<std::uint64_t>(d.length()) << 32U | address);
  }
  return hash;
}

std::uint32_t FrameProgress(const wire::FrameView& frame) noexcept {
  std::uint32_t progress = 0;
  for (std::size_t i = 0; i < frame.size(); ++i) {
    progress += frame[i].wkc();
    // Broadcasts start at 0; position-addressed datagrams start anywhere, but the common offset does not matter.
    if (wire::IncrementsAdp(frame[i].command())) progress += frame[i].adp();
  }
  return progress;
}

bool AnyWorkingCounter(const wire::FrameView& frame) noexcept {
  for (std::size_t i = 0; i < frame.size(); ++i) {
    if (frame[i].wkc() != 0) return true;
  }
  return false;
}

DirectionLearner::Sender* DirectionLearner::Find(std::uint64_t mac) noexcept {
  return const_cast<Sender*>(static_cast<const DirectionLearner*>(this)->Find(mac));
}

const DirectionLearner::Sender* DirectionLearner::Find(std::uint64_t mac) const noexcept {
  const std::uint64_t base = mac & ~kMacBit;
  const auto end = senders_.begin() + static_cast<std::ptrdiff_t>(count_);
  const auto found = std::find_if(senders_.begin(), end, [&](const Sender& s) { return s.mac == base; });
  return found == end ? nullptr : &*found;
}

void DirectionLearner::Learn(const wire::FrameView& frame) noexcept {
  if (frame.kind() != wire::FrameKind::kEtherCat && frame.kind() != wire::FrameKind::kCut) return;
  Sender* sender = Find(frame.source_mac());
  if (sender == nullptr) {
    if (count_ == kMaxMasters) return;
    sender = &senders_[count_++];
    sender->mac = frame.source_mac() & ~kMacBit;
  }
  if (frame.flag() == capture::PacketFlag::kInbound) ++sender->flag_in;
  if (frame.flag() == capture::PacketFlag::kOutbound) ++sender->flag_out;
  if (!frame.mac_bit()) {
    ++sender->bit_clear;
    return;
  }
  ++sender->bit_set;
  if (AnyWorkingCounter(frame)) ++sender->bit_set_counted;
  const std::uint64_t key = FrameKey(frame);
  const std::uint32_t progress = FrameProgress(frame);
  const auto open = std::find_if(sender->open.begin(), sender->open.end(), [&](const Open& o) {
    return o.key == key && (progress > o.progress || (progress == 0 && o.progress == 0));
  });
  if (key != 0 && open != sender->open.end()) {
    if (progress > 0) ++sender->pairs;
    *open = {};
  } else {
    sender->open[sender->open_next] = {key, progress};
    sender->open_next = static_cast<std::uint8_t>((sender->open_next + 1U) % sender->open.size());
  }
}

void DirectionLearner::Finish() noexcept {
  bool any_outbound = false;
  bool any_returned = false;
  for (std::size_t i = 0; i < count_; ++i) {
    Sender& s = senders_[i];
    if (s.bit_clear > 0) {
      s.reading = Reading::kMacBit;
      master_proven_ = master_proven_ || s.bit_set > 0;
      any_outbound = true;
      any_returned = any_returned || s.bit_set > 0;
    } else if (s.bit_set > 1 && s.pairs * 4 >= s.bit_set) {
      // Two copies of (nearly) every frame. Flags of the capture file say which is which, where they do.
      s.reading = s.flag_in > 0 && s.flag_out > 0 ? Reading::kByFlag : Reading::kByPair;
      master_proven_ = true;
      any_outbound = any_returned = true;
    }
  }
  for (std::size_t i = 0; i < count_; ++i) {
    Sender& s = senders_[i];
    if (s.reading != Reading::kUnused) continue;
    if (s.bit_set_counted * 4 >= s.bit_set) {
      s.reading = Reading::kAllReturned;
      any_returned = true;
    } else if (master_proven_ || any_outbound) {
      s.reading = Reading::kForeign;
    } else {
      s.reading = Reading::kAllOutbound;
      any_outbound = true;
    }
  }
  outbound_only_ = any_outbound && !any_returned;
  returned_only_ = any_returned && !any_outbound;
}

Direction DirectionLearner::Classify(const wire::FrameView& frame) const noexcept {
  const Sender* sender = Find(frame.source_mac());
  if (sender == nullptr) {
    // A sender that shows up later: without the bit it is a master, with it only pairing can tell.
    return frame.mac_bit() ? (master_proven_ ? Direction::kForeign : Direction::kByPair) : Direction::kOutbound;
  }
  switch (sender->reading) {
    case Reading::kUnused:
    case Reading::kMacBit: return frame.mac_bit() ? Direction::kReturned : Direction::kOutbound;
    case Reading::kByFlag:
      if (frame.flag() == capture::PacketFlag::kOutbound) return Direction::kOutbound;
      return frame.flag() == capture::PacketFlag::kInbound ? Direction::kReturned : Direction::kByPair;
    case Reading::kByPair: return frame.mac_bit() ? Direction::kByPair : Direction::kOutbound;
    case Reading::kAllReturned: return frame.mac_bit() ? Direction::kReturned : Direction::kOutbound;
    case Reading::kAllOutbound: return Direction::kOutbound;
    case Reading::kForeign: return Direction::kForeign;
  }
  return Direction::kForeign;
}

}  // namespace ecaudit::bus
