#include "analyzers/model/split_signals.h"

#include <algorithm>

#include "decoder/esc/bit_copy.h"

namespace ecaudit::model {
namespace {

std::uint64_t MaskOf(const SignalPiece& piece) {
  const std::uint64_t ones = piece.bits >= 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << piece.bits) - 1;
  return piece.in_signal >= 64 ? 0 : ones << piece.in_signal;
}

const FrameRef& Stamp(const Sighting& where, bool sent) {
  return sent ? where.sent : where.returned;
}

/// Whether two datagrams, `a` before `b`, belong to one exchange.
bool Together(const Sighting& a, const Sighting& b, TimeNs cycle_ns) {
  if (a.exchange != b.exchange) return false;
  const bool sent = a.sent.seen() && b.sent.seen();
  const FrameRef& from = Stamp(a, sent);
  const FrameRef& to = Stamp(b, sent);
  if (!from.seen() || !to.seen()) return false;
  if (from.number == to.number) return true;
  if (!from.has_time || !to.has_time || to.time < from.time) return false;
  return (to.time - from.time) * 2 < cycle_ns;
}

}  // namespace

void SignalFragments::Keep(const SplitSignal& signal, ByteSpan data, const Sighting& where) {
  for (const SignalPiece& piece : signal.pieces) {
    const auto same = [&](const Fragment& f) {
      return f.signal == signal.number && f.where.slave == where.slave && f.where.direction == where.direction &&
             f.piece.in_signal == piece.in_signal && f.piece.bits == piece.bits;
    };
    auto found = std::find_if(fragments_.begin(), fragments_.end(), same);
    if (found == fragments_.end()) {
      if (fragments_.size() < kMost) {
        found = fragments_.insert(fragments_.end(), Fragment());
      } else {
        found = fragments_.begin() + static_cast<std::ptrdiff_t>(next_);
        next_ = (next_ + 1) % kMost;
      }
    }
    *found = {where, signal.number, piece, {}};
    if (!esc::CopyBits(data, piece.in_datagram, found->value, 0, piece.bits)) found->where = {};
  }
}

bool SignalFragments::Complete(const SplitSignal& signal, const Sighting& where, TimeNs cycle_ns,
                               std::span<std::uint8_t> value) const {
  std::uint64_t missing = MaskOf({0, 0, signal.bits});
  for (const SignalPiece& piece : signal.pieces) missing &= ~MaskOf(piece);
  for (const Fragment& f : fragments_) {
    if (f.signal != signal.number || f.where.slave != where.slave || f.where.direction != where.direction) continue;
    if (!Together(f.where, where, cycle_ns)) continue;
    if (esc::CopyBits(f.value, 0, value, f.piece.in_signal, f.piece.bits)) missing &= ~MaskOf(f.piece);
  }
  return missing == 0;
}

const SplitSignal& SplitSignals::Add(SplitSignal signal) {
  if (signal.role != SplitSignal::Role::kEarlier) {
    signal.bit = static_cast<std::uint32_t>(bytes_ * 8);
    // Room for a number of 64 bits: what is joined is put together as one.
    bytes_ += std::max<std::size_t>(8, (signal.bits + 7U) / 8U);
  }
  signals_.push_back(std::move(signal));
  return signals_.back();
}

void SplitSignals::Measure(const Sighting& where) {
  const FrameRef& now = where.sent.seen() ? where.sent : where.returned;
  if (now.number == last_.number) return;  // asked for again
  if (now.has_time && last_.has_time && now.time > last_.time) {
    const TimeNs gap = now.time - last_.time;
    cycle_ns_ = cycle_ns_ == 0 ? gap : std::min(cycle_ns_, gap);
  }
  last_ = now;
}

ByteSpan SplitSignals::Gather(ByteSpan data, const Sighting& where, SignalFragments& fragments, bool& whole) {
  whole = data.size() >= datagram_bytes_;
  if (!whole) return {};
  Measure(where);
  buffer_.assign(bytes_, 0);
  std::copy_n(data.begin(), static_cast<std::ptrdiff_t>(datagram_bytes_), buffer_.begin());
  const std::span<std::uint8_t> buffer(buffer_);
  for (const SplitSignal& signal : signals_) {
    if (signal.role == SplitSignal::Role::kEarlier) {
      fragments.Keep(signal, data, where);
      continue;
    }
    for (const SignalPiece& piece : signal.pieces) {
      whole = esc::CopyBits(data, piece.in_datagram, buffer, std::uint64_t{signal.bit} + piece.in_signal, piece.bits) &&
              whole;
    }
    if (signal.role != SplitSignal::Role::kLast) continue;
    whole = fragments.Complete(signal, where, cycle_ns_, buffer.subspan(signal.bit / 8, 8)) && whole;
  }
  return buffer_;
}

}  // namespace ecaudit::model
