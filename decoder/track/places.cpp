#include "decoder/track/places.h"

#include <algorithm>

#include "decoder/base/time.h"

namespace ecaudit::track {
namespace {

/// A link needs longer to come up: where as many slaves as before are there again so soon, it was the return of another
/// frame that counted otherwise, or a loose contact.
constexpr FrameNo kBrief = 64;
constexpr std::int64_t kBriefNs = 500'000'000;

}  // namespace

bool Places::OnlyBriefly(const FrameRef& frame) const {
  const bool soon = changed_.has_time && frame.has_time ? Elapsed(changed_.time, frame.time) <= kBriefNs
                                                        : frame.number - changed_.number <= kBrief;
  return soon && !named_;
}

void Places::OnCount(std::uint16_t count, const FrameRef& frame) {
  if (counted_ && count_ == count) return;
  const bool as_before = in_doubt_ > 0 && count == settled_count_ && OnlyBriefly(frame);
  if (in_doubt_ == 0) {
    settled_count_ = counted_ ? count_ : count;
    newcomers_ = 0;
    named_ = false;
  }
  const bool first = !counted_;
  counted_ = true;
  count_ = count;
  before_ = changed_.number;
  changed_ = frame;
  answered_ = 0;
  if (as_before) {
    SettleAll();
  } else if (!first) {
    in_doubt_ = slaves_.DoubtPlaces();
  }
}

bool Places::OnAnswer(SlaveId id, FrameNo sent) {
  const bool answered_before = HasAnswered(id);
  slaves_.NoteAnswer(id, sent);
  if (answered_before || !HasAnswered(id)) return false;
  ++answered_;
  if (in_doubt_ == 0) return false;
  if (answered_ == count_) SettleInOrder(sent);
  return true;
}

std::optional<bool> Places::OnLine(SlaveId id) const {
  if (!InDoubt(id)) return std::nullopt;
  if (HasAnswered(id)) return true;
  if (answered_ >= count_) return false;
  return std::nullopt;
}

SlaveId Places::NamedAt(SlavePos position, StationAddress station, bool written, FrameNo frame) {
  const SlaveId holder = slaves_.AtStation(station);
  if (holder != kNoSlave && (InDoubt(holder) || slaves_[holder].position.if_known() == nullptr)) {
    Place(holder, position, frame);
    return holder;
  }
  const SlaveId there = slaves_.AtPosition(position);
  if (there != kNoSlave) {
    // Who was there keeps its address while it has power. One that comes back without may be given another one.
    const bool is_another = !written || HasAnswered(there) || AwaitsNewcomers();
    if (!is_another) return there;
    slaves_.Displace(there, frame);
  }
  const SlaveId added = slaves_.AddAtPosition(position, frame);
  if (added == kNoSlave) return added;
  named_ = true;
  ++newcomers_;
  // All that are new are met: the others are in the places that are left.
  if (count_ == settled_count_ + newcomers_) SettleInOrder(frame);
  return added;
}

void Places::Place(SlaveId id, SlavePos position, FrameNo frame) {
  named_ = true;
  slaves_.MoveTo(id, Known<SlavePos>::Observed(position, frame));
}

void Places::Settle(SlaveId id) {
  if (!InDoubt(id)) return;
  slaves_.SettlePlace(id);
  --in_doubt_;
}

void Places::SettleAll() {
  for (std::size_t s = 0; s < slaves_.size() && in_doubt_ > 0; ++s) Settle(static_cast<SlaveId>(s));
}

/// Those that may have moved, in their order; none where that is not known.
std::vector<SlaveId> Places::InOrder(bool only_answered) const {
  std::vector<SlaveId> out;
  for (std::size_t s = 0; s < slaves_.size(); ++s) {
    const auto id = static_cast<SlaveId>(s);
    if (!slaves_[id].replaced && InDoubt(id) && (!only_answered || HasAnswered(id))) out.push_back(id);
  }
  std::ranges::sort(out, [&](SlaveId a, SlaveId b) { return slaves_[a].order < slaves_[b].order; });
  const auto same = [&](SlaveId a, SlaveId b) { return slaves_[a].order == slaves_[b].order; };
  if (std::ranges::adjacent_find(out, same) != out.end()) out.clear();
  return out;
}

/// Positions of which no slave is known to be there.
std::vector<SlavePos> Places::FreePlaces() const {
  std::vector<SlavePos> out;
  for (SlavePos p = 0; p < count_; ++p) {
    const SlaveId there = slaves_.AtPosition(p);
    if (there == kNoSlave || InDoubt(there)) out.push_back(p);
  }
  return out;
}

/// Slaves in operation are not plugged in another order. Where all that are left fill the places that are left, they
/// are there in their order: for certain where all of them answered.
void Places::SettleInOrder(FrameNo frame) {
  const std::vector<SlavePos> free = FreePlaces();
  std::vector<SlaveId> left = InOrder(true);
  const bool all_answered = left.size() == free.size();
  if (!all_answered) left = InOrder(false);
  if (left.size() != free.size()) return;
  // Where no slave has taken the place of another one, all are reported by the places they had.
  const bool moved = std::ranges::any_of(left, [&](SlaveId id) { return slaves_[id].position.if_known() == nullptr; });
  for (std::size_t i = 0; i < left.size(); ++i) {
    const SlavePos* position = slaves_[left[i]].position.if_known();
    const bool same = position != nullptr && *position == free[i];
    if (!same && !moved) continue;
    if (!same) slaves_.MoveTo(left[i], Known<SlavePos>::Inferred(free[i], frame));
    if (all_answered) Settle(left[i]);
  }
}

}  // namespace ecaudit::track
