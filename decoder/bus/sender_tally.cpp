#include "decoder/bus/sender_tally.h"

#include <algorithm>
#include <utility>

#include "decoder/base/time.h"
#include "decoder/base/wrapping.h"
#include "decoder/bus/frame_numbers.h"

namespace ecaudit::bus {

void FrameSigns::Add(const wire::FrameView& frame) noexcept {
  ++(frame.mac_bit() ? bit_set : bit_clear);
  if (frame.flag() == capture::PacketFlag::kInbound) ++flag_in;
  if (frame.flag() == capture::PacketFlag::kOutbound) ++flag_out;
  if (AnyWorkingCounter(frame)) ++counted;
  if (IsExchanged(frame)) ++exchanged;
}

void CopyPairs::Add(const wire::FrameView& frame) noexcept {
  const Open now{true, frame.key(), ProgressOf(frame), PortOf(frame), frame.ref(), frame.mac_bit()};
  if (TakeBackFirst(now)) return;
  const bool counts_slaves = wire::IncrementsAdp(frame[0].command());
  if (now.mac_bit && counts_slaves && frame[0].adp() == 0 && now.progress.counted == 0) ++passed_no_slave;
  const auto before = std::find_if(open_.begin(), open_.end(), [&](const Open& o) {
    if (!o.used || o.key != now.key) return false;
    // A mailbox poll that no slave answered comes back as it was sent.
    const bool untouched = now.progress.counted == 0 && now.progress == o.progress;
    return untouched || Further(now.progress, o.progress);
  });
  if (before == open_.end()) {
    open_[next_] = now;
    next_ = static_cast<std::uint8_t>((next_ + 1U) % open_.size());
    return;
  }
  before->used = false;
  if (!Further(now.progress, before->progress)) return;
  if (pairs == 0) {
    port_out = before->port;
    port_back = now.port;
  }
  ++pairs;
  if (before->port == port_out && now.port == port_back) ++by_port;
  if (before->progress.counted != 0) ++counted;
  if (frame.size() == 1 && counts_slaves) {
    slaves = static_cast<std::uint16_t>(now.progress.positions - before->progress.positions);
  }
}

/// @return true when it is the outbound copy of a return that was stamped before it
bool CopyPairs::TakeBackFirst(const Open& now) noexcept {
  if (now.mac_bit || !now.frame.has_time) return false;
  const auto back = std::find_if(open_.begin(), open_.end(), [&](const Open& o) {
    if (!o.used || !o.mac_bit || o.key != now.key || o.port == now.port || !Further(o.progress, now.progress)) {
      return false;
    }
    const std::int64_t apart = Elapsed(o.frame.time, now.frame.time);
    return apart > 0 && apart <= threshold::kSkewNs;
  });
  if (back == open_.end()) return false;
  back->used = false;
  ++back_first;
  return true;
}

/// Process data may be the same in every cycle; what else a master sends again and again is meant to be answered.
void Repetitions::Add(const wire::FrameView& frame) noexcept {
  std::uint64_t content = frame.key();
  for (const std::uint8_t byte : frame.payload()) {
    content = WrappingProduct(content ^ byte, std::uint64_t{0x100000001B3});
  }
  const std::uint8_t number = NumbersOf(frame).first;
  const bool same = std::exchange(content_, content) == content;
  const bool other_index = std::exchange(index, number) != number;
  const FrameRef before = std::exchange(last, frame.ref());
  was_only_broadcast = IsOnlyBroadcast(frame);
  if (!before.seen()) return;
  const bool pause = !before.has_time || !last.has_time || Elapsed(before.time, last.time) >= threshold::kPauseNs;
  if (other_index) ++index_changes;
  if (pause && same && !wire::IsLogical(frame[0].command())) ++repeated;
}

Likeness::Asked Likeness::AskedBy(const wire::FrameView& frame) noexcept {
  return {WhatIsAsked(frame), frame.key(), frame.ref(), frame[0].index(), IsOnlyBroadcast(frame), IsAccepted(frame)};
}

void Likeness::Compare(const Asked& other, Match& match) noexcept {
  bool echo = false;
  for (const Asked& own : asked_) {
    if (!own.frame.seen()) continue;
    const bool timed = own.frame.has_time && other.frame.has_time;
    const std::int64_t apart = timed ? Elapsed(own.frame.time, other.frame.time) : 0;
    if (own.what == other.what) {
      match.alike = true;
      match.accepted = match.accepted || (own.taken && other.taken);
      match.copy = match.copy || (timed && apart >= -threshold::kAtOnceNs && apart <= threshold::kAtOnceNs);
    }
    const bool same = own.key == other.key || (own.index == other.index && (own.dummy || other.dummy));
    echo = echo || (timed && same && apart <= threshold::kEchoNs);
  }
  if (echo) ++echoes;
  match.echo = match.echo || echo;
}

void Likeness::Add(const Asked& asked, const Match& match) noexcept {
  if (match.alike) ++alike;
  if (match.copy) ++copies;
  if (match.accepted) ++both_accepted;
  if (match.echo) ++echoes;
  asked_[next_] = asked;
  next_ = static_cast<std::uint8_t>((next_ + 1U) % asked_.size());
}

}  // namespace ecaudit::bus
