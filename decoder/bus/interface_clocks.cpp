#include "decoder/bus/interface_clocks.h"

#include <algorithm>
#include <array>
#include <deque>
#include <iterator>
#include <limits>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "decoder/base/time.h"
#include "decoder/bus/direction.h"
#include "decoder/wire/frame_parser.h"

namespace ecaudit::bus {
namespace {

/// Frames of each interface that are examined, ...
constexpr std::size_t kFrames = 512;
/// ... and the minimum that has to show the same, besides one of four.
constexpr std::size_t kLeastPairs = 8;
/// Returns that are stamped so soon after their frames may be so by one clock.
constexpr std::int64_t kOneClockNs = 1'000'000;
constexpr std::size_t kInterfaces = 2;
/// How far they are apart at the beginning: clocks may run at different speed, ...
constexpr std::size_t kAtTheBeginning = 64;
/// ... and have run apart after a pause.
constexpr std::int64_t kLongPauseNs = 1'000'000'000;

struct Seen {
  std::uint64_t key = 0;
  Progress progress;
  FrameRef ref;
  bool mac_bit = false;
};

struct Side {
  std::uint16_t interface = 0;
  std::vector<Seen> frames;  ///< in file order
  bool full = false;         ///< or after a pause, or another recording

  void Add(const wire::FrameView& frame) {
    const FrameRef& ref = frame.ref();
    const FrameRef before = frames.empty() ? FrameRef{} : frames.back().ref;
    const std::int64_t pause = before.has_time && ref.has_time ? Difference(before.time, ref.time) : 0;
    const bool enough = frames.size() >= kAtTheBeginning && pause > kLongPauseNs;
    full = full || enough || (pause > 0 && ClockJumps(before.time, ref.time));
    if (full) return;
    frames.push_back({frame.key() ^ frame.sender(), ProgressOf(frame), ref, frame.mac_bit()});
    full = frames.size() == kFrames;
  }
};

/// Both copies of a frame, should they be that.
struct Pair {
  std::int64_t apart = 0;  ///< from the stamp of the outbound copy to that of the returned one
  std::uint16_t sent = 0;  ///< ordinals
  std::uint16_t returned = 0;
};

bool MayBeReturnOf(const Seen& sent, const Seen& returned) {
  return sent.key == returned.key && sent.ref.has_time && returned.ref.has_time &&
         Further(returned.progress, sent.progress);
}

/// One interface has both copies of its frames.
bool HasBothCopies(const Side& side) {
  std::unordered_map<std::uint64_t, const Seen*> last;
  std::size_t pairs = 0;
  for (const Seen& seen : side.frames) {
    const Seen*& before = last[seen.key];
    // What has come less far than one before it is the next frame that looks like it.
    if (before != nullptr && before->mac_bit == seen.mac_bit && Further(seen.progress, before->progress)) ++pairs;
    if (before != nullptr && before->mac_bit != seen.mac_bit) ++pairs;
    before = &seen;
  }
  return pairs * 8 > side.frames.size();
}

std::vector<Pair> AllPairs(const Side& sent, const Side& returned) {
  std::unordered_map<std::uint64_t, std::vector<std::uint16_t>> by_key;
  for (std::size_t i = 0; i < sent.frames.size(); ++i) {
    by_key[sent.frames[i].key].push_back(static_cast<std::uint16_t>(i));
  }
  std::vector<Pair> pairs;
  for (std::size_t k = 0; k < returned.frames.size(); ++k) {
    const Seen& back = returned.frames[k];
    const auto found = by_key.find(back.key);
    if (found == by_key.end()) continue;
    for (const std::uint16_t i : found->second) {
      const Seen& out = sent.frames[i];
      if (!MayBeReturnOf(out, back)) continue;
      pairs.push_back({Elapsed(out.ref.time, back.ref.time), i, static_cast<std::uint16_t>(k)});
    }
  }
  std::sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) { return a.apart < b.apart; });
  return pairs;
}

/// Pairs that are apart by about the same.
struct Heap {
  std::size_t first = 0;
  std::size_t end = 0;
  std::size_t pairs = 0;    ///< frames, each once
  std::int64_t spread = 0;  ///< mean distance from the middle
};

std::size_t DistinctReturns(const std::vector<Pair>& pairs, std::size_t first, std::size_t end) {
  std::array<bool, kFrames> seen{};
  std::size_t count = 0;
  for (std::size_t i = first; i < end; ++i) {
    if (!seen[pairs[i].returned]) ++count;
    seen[pairs[i].returned] = true;
  }
  return count;
}

std::int64_t Spread(const std::vector<Pair>& pairs, std::size_t first, std::size_t end) {
  const std::int64_t middle = pairs[first + (end - first) / 2].apart;
  std::int64_t sum = 0;
  for (std::size_t i = first; i < end; ++i) sum += Difference(middle, pairs[i].apart);
  return sum / static_cast<std::int64_t>(end - first);
}

/// Heaps that do not overlap, the largest first.
std::vector<Heap> Heaps(const std::vector<Pair>& pairs) {
  std::vector<Heap> all;
  for (std::size_t first = 0, end = 0; first < pairs.size(); ++first) {
    while (end < pairs.size() && Elapsed(pairs[first].apart, pairs[end].apart) <= kRoundTripSpreadNs) ++end;
    all.push_back({first, end, end - first, 0});
  }
  std::stable_sort(all.begin(), all.end(), [](const Heap& a, const Heap& b) { return a.pairs > b.pairs; });
  std::vector<Heap> chosen;
  constexpr std::size_t kMost = 16;
  for (const Heap& heap : all) {
    if (chosen.size() == kMost) break;
    const bool overlaps = std::any_of(chosen.begin(), chosen.end(), [&](const Heap& other) {
      return heap.first < other.end && other.first < heap.end;
    });
    if (overlaps) continue;
    Heap& taken = chosen.emplace_back(heap);
    taken.pairs = DistinctReturns(pairs, heap.first, heap.end);
    taken.spread = Spread(pairs, heap.first, heap.end);
  }
  std::stable_sort(chosen.begin(), chosen.end(), [](const Heap& a, const Heap& b) { return a.pairs > b.pairs; });
  return chosen;
}

/// True when as many frames, or nearly, come back within a millisecond.
bool MayBeOneClock(const std::vector<Pair>& pairs, std::size_t most) {
  std::array<bool, kFrames> seen{};
  std::size_t count = 0;
  for (const Pair& pair : pairs) {
    if (pair.apart < 0 || pair.apart > kOneClockNs) continue;
    if (!seen[pair.returned]) ++count;
    seen[pair.returned] = true;
  }
  return count * 4 >= most * 3;
}

/// Cycles that look all alike fit to each other as well: of those the round trips differ least that are none of other
/// cycles.
const Heap& MostLikely(const std::vector<Heap>& heaps) {
  const Heap* best = &heaps.front();
  for (const Heap& heap : heaps) {
    if (heap.pairs * 10 >= heaps.front().pairs * 9 && heap.spread * 2 < best->spread) best = &heap;
  }
  return *best;
}

/// True when the packets stand in the file as the moved stamps show.
bool StandInOrder(const Side& sent, const Side& returned, std::int64_t ahead) {
  constexpr std::size_t kAside = 2;
  constexpr std::size_t kOneIn = 50;
  std::vector<std::pair<TimeNs, FrameNo>> by_time;
  for (const Seen& seen : sent.frames) by_time.emplace_back(seen.ref.time, seen.ref.number);
  for (const Seen& seen : returned.frames) by_time.emplace_back(Elapsed(ahead, seen.ref.time), seen.ref.number);
  std::sort(by_time.begin(), by_time.end());
  std::vector<FrameNo> by_number;
  for (const auto& [time, number] : by_time) by_number.push_back(number);
  std::sort(by_number.begin(), by_number.end());
  std::size_t elsewhere = 0;
  for (std::size_t i = 0; i < by_time.size(); ++i) {
    const std::size_t first = i < kAside ? 0 : i - kAside;
    const std::size_t last = std::min(i + kAside, by_time.size() - 1);
    if (by_time[i].second < by_number[first] || by_time[i].second > by_number[last]) ++elsewhere;
  }
  return elsewhere * kOneIn <= by_time.size();
}

/// Of each return the pair that is apart by the least more or less than most are.
std::vector<Pair> NearestToMiddle(std::span<const Pair> heap) {
  const std::int64_t middle = heap[heap.size() / 2].apart;
  const auto off = [&](const Pair& pair) { return Difference(middle, pair.apart); };
  std::vector<Pair> pairs(heap.begin(), heap.end());
  std::sort(pairs.begin(), pairs.end(), [&](const Pair& a, const Pair& b) {
    return a.returned != b.returned ? a.returned < b.returned : off(a) < off(b);
  });
  const auto same = [](const Pair& a, const Pair& b) { return a.returned == b.returned; };
  pairs.erase(std::unique(pairs.begin(), pairs.end(), same), pairs.end());
  return pairs;
}

/// Each return with the oldest frame before it in the file that it may answer: the pairs of a capture whose packets
/// stand in order. Those that are apart by about as much as most.
std::vector<Pair> PairsInFileOrder(const Side& sent, const Side& returned) {
  std::unordered_map<std::uint64_t, std::deque<std::uint16_t>> in_flight;
  std::vector<Pair> pairs;
  std::size_t out = 0;
  for (std::size_t k = 0; k < returned.frames.size(); ++k) {
    const Seen& back = returned.frames[k];
    for (; out < sent.frames.size() && sent.frames[out].ref.number < back.ref.number; ++out) {
      in_flight[sent.frames[out].key].push_back(static_cast<std::uint16_t>(out));
    }
    std::deque<std::uint16_t>& like = in_flight[back.key];
    if (like.empty() || !MayBeReturnOf(sent.frames[like.front()], back)) continue;
    const std::uint16_t first = like.front();
    like.pop_front();
    pairs.push_back({Elapsed(sent.frames[first].ref.time, back.ref.time), first, static_cast<std::uint16_t>(k)});
  }
  if (pairs.empty()) return pairs;
  std::vector<std::int64_t> apart;
  for (const Pair& pair : pairs) apart.push_back(pair.apart);
  std::nth_element(apart.begin(), apart.begin() + static_cast<std::ptrdiff_t>(apart.size() / 2), apart.end());
  const std::int64_t middle = apart[apart.size() / 2];
  std::erase_if(pairs, [&](const Pair& p) { return Difference(middle, p.apart) > kRoundTripSpreadNs; });
  return pairs;
}

/// As much as lets no return come before its frame. Where the packets stand in order, not before the frame that stands
/// before it either.
std::int64_t HowFarAhead(const Side& sent, const Side& returned, std::span<const Pair> pairs, bool in_order) {
  std::int64_t ahead = std::numeric_limits<std::int64_t>::max();
  for (const Pair& pair : pairs.first(std::min(pairs.size(), kAtTheBeginning))) {
    const Seen& back = returned.frames[pair.returned];
    ahead = std::min(ahead, Elapsed(kLeastRoundTripNs, pair.apart));
    const auto behind = std::partition_point(sent.frames.begin(), sent.frames.end(),
                                             [&](const Seen& out) { return out.ref.number < back.ref.number; });
    if (!in_order || behind == sent.frames.begin() || !std::prev(behind)->ref.has_time) continue;
    ahead = std::min(ahead, Elapsed(std::prev(behind)->ref.time, back.ref.time));
  }
  return ahead;
}

/// How many packets are stamped before the one that stands before them in the file.
std::size_t GoingBack(const Side& sent, const Side& returned) {
  std::vector<std::pair<FrameNo, TimeNs>> packets;
  for (const Side* side : {&sent, &returned}) {
    for (const Seen& seen : side->frames) packets.emplace_back(seen.ref.number, seen.ref.time);
  }
  std::sort(packets.begin(), packets.end());
  const auto back = [](const auto& a, const auto& b) { return b.second < a.second; };
  std::size_t count = 0;
  for (std::size_t i = 1; i < packets.size(); ++i) count += back(packets[i - 1], packets[i]) ? 1U : 0U;
  return count;
}

/// True when the stamps, as they are, go with the order of the packets, and few frames are in flight at once: then the
/// line is slow, or not even that, and the clocks may be one.
bool MayBeSlowLine(const Side& sent, const Side& returned, const std::vector<Pair>& in_file) {
  constexpr std::size_t kFewInFlight = 4;
  constexpr std::size_t kOneIn = 50;
  std::vector<std::size_t> in_flight;
  for (const Pair& pair : in_file) {
    if (pair.apart < 0) return false;
    std::size_t later = pair.sent;
    while (later < sent.frames.size() && sent.frames[later].ref.number < returned.frames[pair.returned].ref.number) {
      ++later;
    }
    in_flight.push_back(later - pair.sent);
  }
  std::sort(in_flight.begin(), in_flight.end());
  return in_flight[in_flight.size() / 2] <= kFewInFlight &&
         GoingBack(sent, returned) * kOneIn <= sent.frames.size() + returned.frames.size();
}

/// What the order of the packets shows, where they stand in that of the wire.
std::optional<ClocksApart> ByOrder(const Side& sent, const Side& returned, const std::vector<Pair>& in_file) {
  if (!StandInOrder(sent, returned, HowFarAhead(sent, returned, in_file, false))) return std::nullopt;
  const std::int64_t ahead = HowFarAhead(sent, returned, in_file, true);
  return ClocksApart{sent.interface, returned.interface, ahead, in_file.size(), true};
}

/// What the stamps show, whatever the order of the packets.
std::optional<ClocksApart> ByStamps(const Side& sent, const Side& returned, const std::vector<Pair>& pairs,
                                    const std::vector<Heap>& heaps) {
  if (MayBeOneClock(pairs, heaps.front().pairs)) return std::nullopt;
  const Heap& heap = MostLikely(heaps);
  const std::vector<Pair> shown = NearestToMiddle(std::span(pairs).subspan(heap.first, heap.end - heap.first));
  const std::int64_t ahead = HowFarAhead(sent, returned, shown, false);
  return ClocksApart{sent.interface, returned.interface, ahead, shown.size(), false};
}

std::optional<ClocksApart> Compare(const Side& sent, const Side& returned) {
  const std::vector<Pair> pairs = AllPairs(sent, returned);
  if (pairs.size() < kLeastPairs) return std::nullopt;
  const std::vector<Heap> heaps = Heaps(pairs);
  const std::size_t all = std::min(sent.frames.size(), returned.frames.size());
  if (heaps.front().pairs < kLeastPairs || heaps.front().pairs * 4 < all) return std::nullopt;
  const std::vector<Pair> in_file = PairsInFileOrder(sent, returned);
  if (in_file.size() * 4 >= heaps.front().pairs * 3) {
    const auto one_clock = [](const Pair& pair) { return pair.apart >= 0 && pair.apart <= kOneClockNs; };
    if (std::all_of(in_file.begin(), in_file.end(), one_clock)) return std::nullopt;
    if (MayBeSlowLine(sent, returned, in_file)) return std::nullopt;
    if (const auto apart = ByOrder(sent, returned, in_file)) return apart;
  }
  return ByStamps(sent, returned, pairs, heaps);
}

}  // namespace

std::optional<ClocksApart> CompareClocks(capture::FrameSource& source) noexcept {
  std::array<Side, kInterfaces> sides;
  std::size_t count = 0;
  wire::FrameParser parser;
  parser.AcceptLengths();  // both copies of a frame are alike, whatever it writes there
  capture::CapturedFrame packet;
  while (source.Next(packet) == capture::ReadStatus::kFrame) {
    const wire::FrameView& frame = parser.Parse(packet);
    if (frame.kind() != wire::FrameKind::kEtherCat || frame.empty()) continue;
    const auto known = std::find_if(sides.begin(), sides.begin() + static_cast<std::ptrdiff_t>(count),
                                    [&](const Side& side) { return side.interface == frame.interface_index(); });
    if (known == sides.end()) return std::nullopt;
    if (known == sides.begin() + static_cast<std::ptrdiff_t>(count)) {
      known->interface = frame.interface_index();
      ++count;
    }
    const bool was_full = known->full;
    known->Add(frame);
    if (known->full && !was_full && HasBothCopies(*known)) return std::nullopt;
    if (std::all_of(sides.begin(), sides.end(), [](const Side& side) { return side.full; })) break;
  }
  if (count < kInterfaces || HasBothCopies(sides[0]) || HasBothCopies(sides[1])) return std::nullopt;
  const std::optional<ClocksApart> there = Compare(sides[0], sides[1]);
  const std::optional<ClocksApart> back = Compare(sides[1], sides[0]);
  if (there && back) return there->pairs >= back->pairs ? there : back;
  return there ? there : back;
}

}  // namespace ecaudit::bus
