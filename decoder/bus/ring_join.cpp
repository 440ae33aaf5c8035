#include "decoder/bus/ring_join.h"

#include <algorithm>

#include "decoder/base/time.h"

namespace ecaudit::bus {
namespace {

/// The same but for the index and what slaves change.
bool AsksTheSame(const wire::FrameView& a, const wire::FrameView& b) {
  constexpr std::uint64_t kIndex = 0xFF00;
  if (a.size() != b.size()) return false;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (((a[i].KeptHeader() ^ b[i].KeptHeader()) & ~kIndex) != 0) return false;
  }
  return true;
}

/// Adds what `other` brought back to the datagram of the main end in `to` (header, data, working counter).
void AddDatagram(const wire::DatagramView& sent, const wire::DatagramView& other, std::span<std::uint8_t> to) {
  const std::size_t end = to.size() - wire::kWorkingCounterBytes;
  const auto mine = static_cast<unsigned>(to[end] | to[end + 1] << 8U);
  const unsigned sum = mine + other.wkc();
  to[end] = static_cast<std::uint8_t>(sum & 0xFFU);
  to[end + 1] = static_cast<std::uint8_t>(sum >> 8U & 0xFFU);
  const ByteSpan before = sent.data();
  const ByteSpan theirs = other.data();
  const std::span<std::uint8_t> data = to.subspan(wire::kDatagramHeaderBytes, theirs.size());
  if (wire::IsNodeAddressed(other.command())) {
    if (mine == 0) std::copy(theirs.begin(), theirs.end(), data.begin());
    return;
  }
  for (std::size_t i = 0; i < theirs.size() && i < before.size(); ++i) {
    if (theirs[i] != before[i]) data[i] = theirs[i];
  }
}

}  // namespace

void RingJoin::Push(const BusTransaction& transaction) {
  const bool both = transaction.sent != nullptr && transaction.returned != nullptr;
  if (transaction.other_end) broken_until_ = transaction.returned->ref().number + kBrokenFor;
  if (broken_until_ == 0 || !both || transaction.returned->ref().number > broken_until_) {
    Flush();
    to_.OnTransaction(transaction);
    return;
  }
  if (!waits_ || !IsOtherHalf(transaction)) {
    Flush();
    Keep(transaction);
    return;
  }
  waits_ = false;
  const bool kept_is_main = !half_.other_end;
  const wire::FrameView& main = kept_is_main ? half_.returned : *transaction.returned;
  const wire::FrameView& main_sent = kept_is_main ? half_.sent : *transaction.sent;
  const wire::FrameView& other = kept_is_main ? *transaction.returned : half_.returned;
  const wire::FrameView& other_sent = kept_is_main ? *transaction.sent : half_.sent;
  joined_.assign(main.bytes().begin(), main.bytes().begin() + static_cast<std::ptrdiff_t>(main.used_bytes()));
  for (std::size_t i = 0; i < main.size(); ++i) {
    if (wire::IncrementsAdp(main[i].command())) continue;
    const auto at = static_cast<std::size_t>(main[i].bytes().data() - main.bytes().data());
    AddDatagram(other_sent[i], other[i], std::span(joined_).subspan(at, main[i].bytes().size()));
  }
  wire::FrameView view;
  view.Rebase(main, joined_);
  to_.OnTransaction(
      {.sent = &main_sent, .returned = &view, .gap = std::max(half_.gap, transaction.gap), .joined = true});
}

void RingJoin::Flush() {
  if (!waits_) return;
  waits_ = false;
  to_.OnTransaction({.sent = &half_.sent,
                     .returned = &half_.returned,
                     .gap = half_.gap,
                     .other_end = half_.other_end,
                     .joined = true});
}

void RingJoin::Keep(const BusTransaction& transaction) {
  const auto keep = [](const wire::FrameView& from, wire::FrameView& to, std::vector<std::uint8_t>& bytes) {
    const ByteSpan used = from.bytes().first(from.used_bytes());
    bytes.assign(used.begin(), used.end());
    to.Rebase(from, bytes);
  };
  keep(*transaction.sent, half_.sent, half_.sent_bytes);
  keep(*transaction.returned, half_.returned, half_.returned_bytes);
  half_.other_end = transaction.other_end;
  half_.gap = transaction.gap;
  waits_ = true;
}

bool RingJoin::IsOtherHalf(const BusTransaction& transaction) const {
  const FrameRef& mine = half_.sent.ref();
  const FrameRef& theirs = transaction.sent->ref();
  if (half_.other_end == transaction.other_end || !mine.has_time || !theirs.has_time) return false;
  // A copy that the snap length has cut has not all of them.
  const std::size_t datagrams = half_.sent.size();
  if (half_.returned.size() != datagrams || transaction.returned->size() != datagrams) return false;
  const std::int64_t apart = Elapsed(mine.time, theirs.time);
  return apart >= -kAtOnceNs && apart <= kAtOnceNs && AsksTheSame(*transaction.sent, half_.sent);
}

}  // namespace ecaudit::bus
