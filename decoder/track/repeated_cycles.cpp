#include "decoder/track/repeated_cycles.h"

#include <algorithm>

#include "decoder/base/bytes.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/track/datagram_pair.h"

namespace ecaudit::track {
namespace {

using bus::BusTransaction;
using wire::Command;
using wire::FrameView;

constexpr std::size_t kIndexAt = 1;  // of a datagram: the master counts there
constexpr std::size_t kWord = sizeof(std::uint64_t);

bool DistributesTime(Command command) {
  return command == Command::ARMW || command == Command::FRMW;
}

/// What is sent in every cycle: process data, the time, and a read of all states.
bool IsCyclic(const wire::DatagramView& d) {
  if (!wire::IsDefined(d.command_byte()) || d.circulating() || d.irq() != 0 || d.data().empty()) return false;
  if (wire::IsLogical(d.command())) return true;
  if (DistributesTime(d.command())) return d.ado() == esc::kSystemTime && (d.length() == 4 || d.length() == 8);
  return d.command() == Command::BRD && d.ado() == esc::kAlStatus && d.length() <= 6;
}

/// Both copies are there, and lie in the packets themselves.
bool IsPlain(const BusTransaction& t) {
  return t.sent != nullptr && t.returned != nullptr && !t.assumed && !t.other_end && !t.joined &&
         t.gap == bus::GapBefore::kNone;
}

/// Unless the data changed, the slave that gives the time did not answer, whichever other slaves counted.
bool ClockAnswers(const BusTransaction& t) {
  for (std::size_t i = 0; i < t.returned->size() && i < t.sent->size(); ++i) {
    const wire::DatagramView returned = (*t.returned)[i];
    if (!DistributesTime(returned.command())) continue;
    const ByteSpan sent = (*t.sent)[i].data();
    if (std::equal(sent.begin(), sent.end(), returned.data().begin(), returned.data().end())) return false;
  }
  return true;
}

/// The first bytes of a frame's datagrams that all frames of its kind share.
std::uint64_t HeadOf(const FrameView& frame) {
  constexpr std::uint64_t kIndex = 0xFF00;
  return frame[0].KeptHeader() & ~kIndex;
}

}  // namespace

void RepeatedCycles::Copy::Take(const FrameView& frame, bool changed) {
  const ByteSpan payload = frame.payload();
  const auto load = [&](std::size_t at) { return LoadLittleEndian<std::uint64_t>(payload.data() + at); };
  size = payload.size();
  source_mac = frame.source_mac();
  offsets.assign(frame.offsets().begin(), frame.offsets().end());
  if (changed) {
    words.clear();
    for (std::size_t at = 0; at < size; at += kWord) {
      // The last word begins where it is whole.
      const std::size_t from = std::min(at, size - kWord);
      const auto bits = LoadLittleEndian<std::uint64_t>(mask.data() + from);
      if (bits != 0) words.push_back({from, bits, 0});
    }
  }
  for (Word& word : words) word.value = load(word.at) & word.mask;
}

bool RepeatedCycles::Copy::Matches(const FrameView& frame) const {
  const ByteSpan payload = frame.payload();
  if (payload.size() != size || frame.source_mac() != source_mac) return false;
  // After another link header (a tag, UDP) they lie elsewhere.
  if (offsets.empty() || frame.offsets()[0] != offsets[0]) return false;
  const std::uint8_t* const bytes = payload.data();
  std::uint64_t different = 0;
  for (const Word& word : words) {
    different |= (LoadLittleEndian<std::uint64_t>(bytes + word.at) & word.mask) ^ word.value;
  }
  return different == 0;
}

void RepeatedCycles::Copy::Keep() {
  if (last.bytes_.data() == kept.data()) return;  // it is
  kept.assign(last.bytes_.begin(), last.bytes_.end());
  last.bytes_ = kept;
}

/// Both copies are there, and nothing in them but what cycles are made of.
bool RepeatedCycles::MayRepeat(const BusTransaction& t) {
  if (!IsPlain(t)) return false;
  const FrameView& returned = *t.returned;
  if (returned.empty() || t.sent->size() != returned.size()) return false;
  std::size_t polls = 0;
  for (std::size_t i = 0; i < returned.size(); ++i) {
    if (!IsCyclic(returned[i]) || !IsCyclic((*t.sent)[i]) || returned[i].wkc() == 0) return false;
    if (returned[i].command() == Command::BRD) ++polls;
  }
  // Of two polls in one frame each may show something else.
  return polls <= 1 && ClockAnswers(t);
}

RepeatedCycles::Kind* RepeatedCycles::KindOf(const BusTransaction& t) {
  const FrameView& returned = *t.returned;
  if (returned.empty()) return nullptr;
  const std::uint64_t head = HeadOf(returned);
  const std::size_t size = returned.payload().size();
  for (Kind& kind : kinds_) {
    if (kind.used && kind.head == head && kind.returned.size == size) return &kind;
  }
  return nullptr;
}

void RepeatedCycles::OnTransaction(const BusTransaction& t) {
  if (!skips_) return network_.OnTransaction(t);
  Kind* kind = IsPlain(t) ? KindOf(t) : nullptr;
  if (kind != nullptr && kind->skips && kind->Repeats(t)) return Skip(*kind, t);
  Settle();
  PublishInFull(kind, t);
}

bool RepeatedCycles::Kind::Repeats(const BusTransaction& t) const {
  if (!sent.Matches(*t.sent) || !returned.Matches(*t.returned)) return false;
  // Of the same size, and with datagrams of the same lengths at the same places.
  const std::uint8_t* const out = t.sent->payload().data();
  const std::uint8_t* const back = t.returned->payload().data();
  return std::none_of(datagrams.begin(), datagrams.end(), [&](const RepeatedDatagram& d) {
    return d.is == RepeatedDatagram::Is::kTime && SameBytes({out + d.data_at, d.length}, {back + d.data_at, d.length});
  });
}

void RepeatedCycles::Skip(Kind& kind, const BusTransaction& t) {
  if (kind.skipped++ == 0) ++pending_;
  kind.order = ++orders_;
  kind.bytes_skipped += t.sent->bytes().size() + t.returned->bytes().size();
  kind.sent.Skip(*t.sent);
  kind.returned.Skip(*t.returned);
  const std::uint64_t news = events_.news();
  events_.Publish(FrameRepeated{t.sent->ref(), t.returned->ref()});
  for (std::size_t i = 0; i < kind.datagrams.size(); ++i) {
    const RepeatedDatagram& datagram = kind.datagrams[i];
    if (datagram.is == RepeatedDatagram::Is::kProcessData) {
      events_.Publish(LogicalRepeated{Network::LogicalAccessOf(DatagramPair(t, i))});
    } else if (datagram.is == RepeatedDatagram::Is::kTime) {
      events_.Publish(TimeRepeated{network_.AnswerOf(DatagramPair(t, i), datagram.slave)});
    }
  }
  if (events_.news() == news) return;
  // Something was found: what follows from it is reported in full until all is at rest again.
  Settle();
  Disturb();
}

void RepeatedCycles::Settle() {
  if (pending_ == 0) return;
  const std::uint64_t news = events_.news();
  events_.Publish(RepetitionEnds{});
  while (pending_ > 0) {
    Kind* first = nullptr;
    for (Kind& kind : kinds_) {
      if (kind.skipped > 0 && (first == nullptr || kind.order < first->order)) first = &kind;
    }
    if (first == nullptr) break;
    FrameView sent;
    FrameView returned;
    first->sent.Restore(sent);
    first->returned.Restore(returned);
    const BusTransaction last{&sent, &returned};
    const std::uint64_t before = first->skipped - 1;
    const std::uint64_t bytes = first->bytes_skipped - last.sent->bytes().size() - last.returned->bytes().size();
    first->skipped = first->bytes_skipped = 0;
    --pending_;
    if (before > 0) {
      network_.OnSkipped(before, bytes);
      events_.Publish(CyclesSkipped{last, before});
    }
    network_.OnTransaction(last);
  }
  if (events_.news() != news) Disturb();
}

/// @param kind null: not known, or none that may repeat
void RepeatedCycles::PublishInFull(Kind* kind, const BusTransaction& t) {
  const bool may_repeat = MayRepeat(t);
  const std::uint64_t news = events_.news();
  network_.OnTransaction(t);
  if (!may_repeat || events_.news() != news) {
    Disturb();
    return;
  }
  if (kind == nullptr) {
    kind = &kinds_[next_];
    next_ = (next_ + 1) % kinds_.size();
    kind->used = true;
    kind->head = HeadOf(*t.returned);
    kind->calm = 0;
  }
  const bool same = kind->calm > 0 && kind->sent.Matches(*t.sent) && kind->returned.Matches(*t.returned);
  if (!same) {
    kind->skips = false;
    kind->calm = 0;
  }
  const bool first = kind->calm++ == 0;
  if (first) MaskHeaders(*kind, t);
  kind->sent.Take(*t.sent, first);
  kind->returned.Take(*t.returned, first);
  if (!kind->skips && kind->calm >= kCalm && (kind->calm - kCalm) % kAskAgain == 0) Ask(*kind, t);
}

/// What all frames of a kind have in common, whichever of its data matter.
void RepeatedCycles::MaskHeaders(Kind& kind, const BusTransaction& t) {
  kind.datagrams.clear();
  const auto mask = [](Copy& copy, const FrameView& frame) {
    copy.mask.assign(frame.payload().size(), std::uint8_t{0xFF});
    const std::uint8_t* const begin = frame.payload().data();
    for (std::size_t i = 0; i < frame.size(); ++i) {
      const wire::DatagramView d = frame[i];
      const auto at = static_cast<std::size_t>(d.bytes().data() - begin);
      copy.mask[at + kIndexAt] = 0;
      if (d.command() == Command::BRD) continue;
      std::fill_n(copy.mask.begin() + static_cast<std::ptrdiff_t>(at + wire::kDatagramHeaderBytes), d.data().size(),
                  std::uint8_t{0});
    }
  };
  mask(kind.sent, *t.sent);
  mask(kind.returned, *t.returned);
  for (std::size_t i = 0; i < t.returned->size(); ++i) {
    const wire::DatagramView d = (*t.returned)[i];
    RepeatedDatagram datagram;
    datagram.data_at = static_cast<std::size_t>(d.data().data() - t.returned->payload().data());
    datagram.length = d.data().size();
    if (wire::IsLogical(d.command())) datagram.is = RepeatedDatagram::Is::kProcessData;
    if (DistributesTime(d.command())) {
      datagram.is = RepeatedDatagram::Is::kTime;
      datagram.slave = network_.Find(DatagramPair(t, i));
    }
    kind.datagrams.push_back(datagram);
  }
}

void RepeatedCycles::Ask(Kind& kind, const BusTransaction& t) {
  const CycleAtRest asked{t, kind.datagrams, kind.sent.mask, kind.returned.mask};
  if (network_.HasMappedMailboxes()) return;
  events_.Publish(asked);
  kind.skips = !asked.each_wanted;
  if (!kind.skips) return;
  kind.sent.Take(*t.sent, true);
  kind.returned.Take(*t.returned, true);
}

void RepeatedCycles::Keep() {
  if (pending_ == 0) return;
  for (Kind& kind : kinds_) {
    if (kind.skipped == 0) continue;
    kind.sent.Keep();
    kind.returned.Keep();
  }
}

void RepeatedCycles::Disturb() {
  for (Kind& kind : kinds_) {
    kind.skips = false;
    kind.calm = 0;
  }
}

void RepeatedCycles::OnSent(const FrameView& frame) {
  if (!AlTracker::AsksForState(frame)) return;
  Settle();
  network_.OnSent(frame);
  Disturb();  // what is in flight already comes back to slaves that were asked for something
}

void RepeatedCycles::OnDoubtful(const FrameView& sent) {
  Settle();
  Disturb();
  network_.OnDoubtful(sent);
}

void RepeatedCycles::OnLost(const FrameView& sent, bus::Loss loss, bool followed_by_other) {
  Settle();
  Disturb();
  network_.OnLost(sent, loss, followed_by_other);
}

void RepeatedCycles::OnDuplicate(const FrameView& returned, FrameNo original) {
  Settle();
  Disturb();
  network_.OnDuplicate(returned, original);
}

void RepeatedCycles::OnUnusable(const FrameView& frame, bus::Unusable reason, bool own_master) {
  Settle();
  Disturb();
  network_.OnUnusable(frame, reason, own_master);
}

}  // namespace ecaudit::track
