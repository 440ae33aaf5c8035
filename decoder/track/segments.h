/// in: whose datagram a slave answered.  out: whether a broadcast of a sender concerns a slave.
///
/// keeps: the senders, and the segment of each of them and of each slave.
///
/// Two programs may be captured at one tap, each with a bus of its own. A broadcast concerns the slaves of its own bus
/// only. A slave is one of them if it answered this sender, or if other slaves answered both this sender and the one
/// that it answered.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "decoder/base/ids.h"

namespace ecaudit::track {

class Segments {
 public:
  /// A slave answered what was meant for it alone.
  /// @return true where that is news
  bool OnAnswered(SlaveId slave, std::uint64_t sender) {
    const Sender* from = Add(sender);
    if (from == nullptr) return false;
    if (slave >= slaves_.size()) slaves_.resize(slave + std::size_t{1}, kUnknown);
    if (slaves_[slave] == from->segment) return false;
    if (slaves_[slave] == kUnknown) {
      slaves_[slave] = from->segment;
    } else {
      Join(slaves_[slave], from->segment);
    }
    common_ = from->segment;
    for (const std::uint8_t segment : slaves_) {
      if (segment != kUnknown && segment != common_) common_ = kSeveral;
    }
    return true;
  }
  /// False where nothing shows that what the sender broadcasts passes that slave.
  [[nodiscard]] bool MayConcern(SlaveId slave, std::uint64_t sender) const {
    if (slave >= slaves_.size() || slaves_[slave] == kUnknown) return true;
    const Sender* from = Find(sender);
    return from != nullptr && from->segment == slaves_[slave];
  }
  /// The same for every slave that has answered any sender.
  [[nodiscard]] bool MayConcernAll(std::uint64_t sender) const {
    if (common_ == kUnknown) return true;
    const Sender* from = Find(sender);
    return from != nullptr && from->segment == common_;
  }

  /// Frames of the sender showed how many slaves they passed.
  void OnCounted(std::uint64_t sender) {
    if (Sender* from = Add(sender)) from->counted = true;
  }
  [[nodiscard]] bool HasCounted(std::uint64_t sender) const {
    const Sender* from = Find(sender);
    return from != nullptr && from->counted;
  }

 private:
  static constexpr std::uint8_t kUnknown = 0;
  static constexpr std::uint8_t kSeveral = 0xFF;
  struct Sender {
    std::uint64_t mac = 0;
    std::uint8_t segment = kUnknown;
    bool counted = false;
  };

  [[nodiscard]] const Sender* Find(std::uint64_t mac) const {
    const auto end = senders_.begin() + static_cast<std::ptrdiff_t>(count_);
    const auto found = std::find_if(senders_.begin(), end, [&](const Sender& s) { return s.mac == mac; });
    return found == end ? nullptr : &*found;
  }
  /// Null where there are more of them than any tap shows: of those nothing is known.
  Sender* Add(std::uint64_t mac) {
    for (std::size_t i = 0; i < count_; ++i) {
      if (senders_[i].mac == mac) return &senders_[i];
    }
    if (count_ == senders_.size()) return nullptr;
    senders_[count_] = {mac, static_cast<std::uint8_t>(count_ + 1), false};
    return &senders_[count_++];
  }
  void Join(std::uint8_t one, std::uint8_t other) {
    for (std::size_t i = 0; i < count_; ++i) {
      if (senders_[i].segment == one) senders_[i].segment = other;
    }
    std::ranges::replace(slaves_, one, other);
  }

  std::array<Sender, 16> senders_{};
  std::size_t count_ = 0;
  std::vector<std::uint8_t> slaves_;
  std::uint8_t common_ = kUnknown;  // segment of all slaves that have answered
};

}  // namespace ecaudit::track
