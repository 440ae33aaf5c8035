#include "decoder/bus/retransmissions.h"

#include "decoder/bus/frame_likeness.h"

namespace ecaudit::bus {
namespace {

bool HasWaited(const PairingContext& context, const FrameRef& before, const FrameRef& now) {
  return AreTimed(before, now) && context.trip.HasWaited(Elapsed(before, now));
}

bool IsTimeOut(const PairingContext& context, const SentFrame& sent, const SentFrame& again) {
  return HasWaited(context, sent.ref(), again.ref()) && Elapsed(sent.ref(), again.ref()) <= threshold::kTimeOutNs;
}

/// True when the time between both is a time-out, and not the one between all frames.
bool BrokeRhythm(const PairingContext& context, const SentFrame& sent, const SentFrame& again) {
  const SendingRhythm& rhythm = context.senders[sent.sender].rhythm;
  return IsTimeOut(context, sent, again) && rhythm.known() && Elapsed(sent.ref(), again.ref()) / 2 > rhythm.mean_ns();
}

}  // namespace

Repeats RepeatsLast(PairingContext& context, std::uint8_t number, const wire::FrameView& frame,
                    ByteSpan kept) noexcept {
  const Sender& sender = context.senders[number];
  // Slots of answered frames are used again after that.
  if (sender.newest == 0 || sender.newest + threshold::kRecentFrames <= context.sent.end()) return Repeats::kNo;
  const SentFrame& before = context.sent[sender.newest - 1];
  if ((!before.is_open() && !before.is_answered()) || before.key != frame.key()) return Repeats::kNo;
  const bool all = before.HoldsBytes(kept);
  if (before.is_open()) return all ? Repeats::kAll : Repeats::kIndex;
  // Masters that do not number their frames send the same again and again. What came between shows that they went on,
  // also if it is only a return.
  const FrameRef& last = sender.rhythm.last;
  const bool again = all && last.number == before.ref().number && sender.rhythm.indices.was_next() &&
                     HasWaited(context, last, frame.ref()) && Elapsed(last, frame.ref()) <= threshold::kTimeOutNs;
  return again ? Repeats::kAnswered : Repeats::kNo;
}

bool MayBeCopy(PairingContext& context, const wire::FrameView& frame, ByteSpan kept) noexcept {
  if (context.sent.empty()) return false;
  const SentFrame& before = context.sent.last();
  if (!before.is_open() || before.ref().number + 1 != frame.ref().number) return false;
  if (!AreTimed(before.ref(), frame.ref())) return false;
  const std::int64_t apart = Elapsed(before.ref(), frame.ref());
  if (apart < -threshold::kCopyNs || apart > threshold::kCopyNs) return false;
  // Equal stamps that are too coarse for round trips cannot distinguish a copy from a repetition.
  if (apart == 0 && !context.trip.IsFine()) return false;
  return before.HoldsBytes(kept);
}

bool IsRepeatedSince(PairingContext& context, const SentFrame& sent) noexcept {
  bool again = false;
  for (std::uint64_t s = sent.sequence + 1; s < context.sent.end(); ++s) {
    const SentFrame& later = context.sent[s];
    if (later.sender != sent.sender) continue;
    if (later.key != sent.key || later.may_be_copy() || later.bytes != sent.bytes) return false;
    again = true;
  }
  return again;
}

bool WasWaitedFor(PairingContext& context, const SentFrame& sent, const SentFrame& again) noexcept {
  if (sent.overtaken != 1 || again.sender != sent.sender || again.bytes != sent.bytes) return false;
  for (std::uint64_t s = sent.sequence + 1; s < again.sequence; ++s) {
    if (context.sent[s].sender == sent.sender) return false;
  }
  return BrokeRhythm(context, sent, again) ||
         (!context.senders[sent.sender].rhythm.known() && IsTimeOut(context, sent, again));
}

void ReportWaitedFor(PairingContext& context, const SentFrame& sent, const SentFrame& again) noexcept {
  if (!BrokeRhythm(context, sent, again)) return;
  context.sink.OnRepeated({.frame = sent.view,
                           .before = sent.ref(),
                           .again = again.ref(),
                           .returned = again.returned,
                           .usual_ns = context.trip.typical_ns()});
}

void ReportRepetition(PairingContext& context, const SentFrame& again, const wire::FrameView& returned) noexcept {
  const bool in_flight = again.sent_as == SentAs::kAgainInFlight;
  if (!in_flight && again.sent_as != SentAs::kAgainAnswered) return;
  const SentFrame* before =
      context.sent.NewestRecent(again.sequence, [&](const SentFrame& frame) { return frame.sender == again.sender; });
  if (before == nullptr || !before->is_answered() || before->key != again.key) return;
  // If the first one returned after it was sent again, its answer was late: as both returned, it is not that of this
  // one.
  if (in_flight) {
    const bool shows = context.IndicesOf(again).was_next() ? HasWaited(context, before->ref(), again.ref())
                                                           : BrokeRhythm(context, *before, again);
    if (!shows || before->bytes != again.bytes || before->returned.number <= again.ref().number) return;
  }
  // What only reads may be a poll, which brings other data in the end.
  const bool news = !in_flight && OnlyReads(returned) && !before->Returned(returned.payload());
  context.sink.OnRepeated({.frame = again.view,
                           .before = before->ref(),
                           .again = again.ref(),
                           .returned = before->returned,
                           .usual_ns = context.trip.typical_ns(),
                           .may_miss_round_of = in_flight ? 0 : again.round,
                           .brought_news = news});
}

}  // namespace ecaudit::bus
