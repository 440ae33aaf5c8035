#include "decoder/bus/interface_groups.h"

#include <algorithm>

#include "decoder/base/time.h"
#include "decoder/base/wrapping.h"

namespace ecaudit::bus {
namespace {

/// Two interfaces see one packet within this.
constexpr std::int64_t kBridgedNs = 200'000;
/// Both ends of a redundant line send within this.
constexpr std::int64_t kBothEndsNs = 50'000;
/// Minimum share of pairs among the frames of an interface, where both copies of what is sent are captured.
constexpr std::uint32_t kPairsOneIn = 8;
constexpr std::uint32_t kClosedPairs = 4;
/// A bridge shows nearly all packets twice, ...
constexpr std::uint32_t kSeenTwiceOneIn = 2;
/// ... and of what one end of a line sends so little is sent by it alone. Two masters send at once by chance, too, or
/// where both begin with the same.
constexpr std::uint32_t kAloneOneIn = 8;
/// Number of slaves, or of answers of one, at one address on both interfaces that shows two of them.
constexpr std::uint32_t kTwoOfThem = 8;

/// Of the first and last bytes of the datagrams: enough to distinguish packets that are sent at about the same time.
std::uint64_t ContentOf(const wire::FrameView& frame) {
  constexpr std::size_t kWord = sizeof(std::uint64_t);
  constexpr std::size_t kEnd = 6 * kWord;
  const ByteSpan all = frame.payload();
  std::uint64_t hash = all.size();
  const auto add = [&hash](ByteSpan bytes) {
    for (; bytes.size() >= kWord; bytes = bytes.subspan(kWord)) {
      hash = WrappingProduct(hash ^ LoadLittleEndian<std::uint64_t>(bytes.data()), std::uint64_t{0x9E3779B97F4A7C15});
      hash ^= hash >> 29U;
    }
  };
  add(all.first(std::min(all.size(), kEnd)));
  add(all.last(std::min(all.size(), kEnd)));
  return hash;
}

bool AreWithin(const FrameRef& a, const FrameRef& b, std::int64_t ns) {
  if (!a.has_time || !b.has_time) return false;
  const std::int64_t apart = Elapsed(a.time, b.time);
  return apart >= -ns && apart <= ns;
}

}  // namespace

std::optional<std::size_t> InterfaceGroups::PlaceOf(std::uint16_t interface) noexcept {
  for (std::size_t i = 0; i < count_; ++i) {
    if (interfaces_[i].number == interface) return i;
  }
  if (count_ == kMost) {
    too_many_ = true;
    return std::nullopt;
  }
  interfaces_[count_].number = interface;
  interfaces_[count_].group = count_;
  return count_++;
}

/// As much of it as shows whether another packet is the same.
InterfaceGroups::Seen InterfaceGroups::FindCopy(const wire::FrameView& frame) noexcept {
  const std::uint64_t sender = frame.sender();
  return {.key = frame.key() ^ WrappingProduct(sender, std::uint64_t{0x9E3779B97F4A7C15}),
          .content = ContentOf(frame),
          .progress = ProgressOf(frame),
          .frame = frame.ref(),
          .sender = sender,
          .at = kMost,
          .mac_bit = frame.mac_bit()};
}

InterfaceGroups::Seen InterfaceGroups::Look(const wire::FrameView& frame, std::size_t at) noexcept {
  Seen seen = FindCopy(frame);
  seen.what = WhatIsAsked(frame);
  seen.at = at;
  seen.index = frame[0].index();
  seen.only_broadcast = frame.size() == 1 && wire::IsBroadcast(frame[0].command());
  seen.taken = IsAccepted(frame);
  return seen;
}

void InterfaceGroups::Keep(const Seen& seen) noexcept {
  last_[next_] = seen;
  next_ = (next_ + 1) % last_.size();
}

void InterfaceGroups::Learn(const wire::FrameView& frame) noexcept {
  if (frame.kind() != wire::FrameKind::kEtherCat || frame.empty()) return;
  const std::optional<std::size_t> at = PlaceOf(frame.interface_index());
  if (!at) return;
  ++interfaces_[*at].frames;
  const Seen seen = Look(frame, *at);
  Compare(seen);
  Keep(seen);
}

/// With what was seen lately. The one of this interface that it is the return of counts before those of others.
void InterfaceGroups::Compare(const Seen& seen) noexcept {
  Interface& own = interfaces_[seen.at];
  Seen* sent = nullptr;
  std::array<bool, kMost> copies{};
  std::array<bool, kMost> at_once{};
  std::array<bool, kMost> both_accepted{};
  for (std::size_t back = 1; back <= last_.size(); ++back) {
    Seen& before = last_[(next_ + last_.size() - back) % last_.size()];
    if (!before.frame.seen()) break;
    const bool elsewhere = before.at != seen.at;
    const bool same = before.key == seen.key;
    if (elsewhere && same && before.content == seen.content && before.progress == seen.progress &&
        before.mac_bit == seen.mac_bit && AreWithin(before.frame, seen.frame, kBridgedNs)) {
      copies[before.at] = true;
    }
    if (elsewhere && before.sender != seen.sender) {
      // With each frame some masters send one broadcast at the other end.
      const bool dummy = before.index == seen.index && before.only_broadcast != seen.only_broadcast;
      const bool alike = before.what == seen.what;
      if ((alike || dummy) && AreWithin(before.frame, seen.frame, kBothEndsNs)) at_once[before.at] = true;
      if (alike && before.taken && seen.taken) both_accepted[before.at] = true;
    }
    const bool moved = Further(seen.progress, before.progress) || (seen.mac_bit && !before.mac_bit);
    if (!same || !moved || before.answered) continue;
    if (sent == nullptr || (sent->at != seen.at && !elsewhere)) sent = &before;
  }
  for (std::size_t i = 0; i < count_; ++i) {
    own.copies[i] += copies[i] ? 1U : 0U;
    own.at_once[i] += at_once[i] ? 1U : 0U;
    own.both_accepted[i] += both_accepted[i] ? 1U : 0U;
  }
  if (sent == nullptr) return;
  sent->answered = true;
  if (sent->at == seen.at) {
    ++own.pairs;
  } else {
    ++own.crossed[sent->at];
  }
}

bool InterfaceGroups::AreLinked(std::size_t a, std::size_t b) const noexcept {
  const Interface& x = interfaces_[a];
  const Interface& y = interfaces_[b];
  const std::uint32_t frames = std::min(x.frames, y.frames);
  const auto both = [&](const auto& counts) { return (x.*counts)[b] + (y.*counts)[a]; };
  // Each slave is reached from one end of a broken line; where both reach the one of that address there are two.
  const std::uint32_t at_once = std::min(both(&Interface::at_once), frames);
  const bool two_ends = (frames - at_once) * kAloneOneIn <= frames && both(&Interface::both_accepted) < kTwoOfThem;
  return both(&Interface::crossed) * kPairsOneIn >= frames || both(&Interface::copies) * kSeenTwiceOneIn >= frames ||
         two_ends;
}

void InterfaceGroups::Finish(std::size_t described) noexcept {
  if (too_many_ || count_ == 0) return;
  for (std::size_t a = 0; a < count_; ++a) {
    for (std::size_t b = a + 1; b < count_; ++b) {
      if (!AreLinked(a, b)) continue;
      const std::size_t joined = interfaces_[b].group;
      for (Interface& one : interfaces_) {
        if (one.group == joined) one.group = interfaces_[a].group;
      }
    }
  }
  std::array<std::uint32_t, kMost> frames{};
  std::array<std::uint32_t, kMost> pairs{};
  for (std::size_t i = 0; i < count_; ++i) {
    const Interface& one = interfaces_[i];
    frames[one.group] += one.frames;
    pairs[one.group] += one.pairs;
    for (std::size_t k = 0; k < count_; ++k) pairs[one.group] += one.crossed[k];
  }
  const auto closed = [&](std::size_t group) {
    return pairs[group] >= kClosedPairs && pairs[group] * kPairsOneIn >= frames[group];
  };
  std::optional<std::size_t> main;
  for (std::size_t group = 0; group < count_; ++group) {
    if (closed(group) && (!main || frames[group] > frames[*main])) main = group;
  }
  if (!main) return;
  closed_ = true;
  awaits_more_ = described > count_;
  for (std::size_t i = 0; i < count_; ++i) {
    const std::size_t group = interfaces_[i].group;
    other_[i] = group != *main && closed(group);
    begun_[i] = group != *main && frames[group] < 2 * kClosedPairs;
    awaits_more_ = awaits_more_ || begun_[i];
  }
}

bool InterfaceGroups::IsOther(const wire::FrameView& frame) noexcept {
  if (!closed_) return false;
  const std::uint16_t interface = frame.interface_index();
  const bool readable = frame.kind() == wire::FrameKind::kEtherCat && !frame.empty();
  for (std::size_t i = 0; i < count_; ++i) {
    if (interfaces_[i].number != interface) continue;
    if (begun_[i]) break;
    if (awaits_more_ && readable && !other_[i]) Keep(FindCopy(frame));
    return other_[i];
  }
  return !readable || !IsCopy(FindCopy(frame));
}

bool InterfaceGroups::IsCopy(const Seen& seen) const noexcept {
  return std::any_of(last_.begin(), last_.end(), [&](const Seen& before) {
    return before.frame.seen() && before.key == seen.key && before.content == seen.content &&
           before.progress == seen.progress && before.mac_bit == seen.mac_bit &&
           AreWithin(before.frame, seen.frame, kBridgedNs);
  });
}

}  // namespace ecaudit::bus
