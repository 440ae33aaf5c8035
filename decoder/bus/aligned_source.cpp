#include "decoder/bus/aligned_source.h"

#include <algorithm>
#include <utility>

#include "decoder/base/time.h"
#include "decoder/bus/direction.h"

namespace ecaudit::bus {
namespace {

/// What is apart by much more than others is another frame that looks alike, or, so often in a row, what the clocks
/// have run apart while nothing was sent.
constexpr std::size_t kElsewhere = 8;
/// Two clocks run apart by no more than 200 ppm.
constexpr std::int64_t kDriftOneIn = 5'000;
constexpr std::size_t kWindow = 64;
constexpr std::size_t kMaxComments = 1000;

}  // namespace

AlignedSource::AlignedSource(const ClocksApart& apart, std::unique_ptr<capture::FrameSource> whole,
                             std::unique_ptr<capture::FrameSource> again)
    : apart_(apart), two_(!apart.in_order && again != nullptr) {
  info_ = whole->info();
  info_.comments.clear();
  info_.damage.reset();
  info_.clock_shift = capture::ClockShift{apart.returned, apart.outbound, apart.ahead_ns, apart.pairs, two_};
  parser_.AcceptLengths();  // as when the clocks were compared
  readers_[0].source = std::move(whole);
  readers_[1].source = std::move(again);
  Advance(readers_[0]);
  if (two_) Advance(readers_[1]);
}

void AlignedSource::Advance(Reader& reader) noexcept {
  const bool of_returned = &reader == &readers_[1];
  do {
    reader.status = reader.source->Next(reader.head);
  } while (two_ && reader.status == capture::ReadStatus::kFrame && IsReturned(reader.head) != of_returned);
  reader.key = 0;
  if (reader.status != capture::ReadStatus::kFrame || !reader.head.has_time) return;
  if (reader.last && ClockJumps(*reader.last, reader.head.time)) ++reader.recording;
  reader.last = reader.head.time;
  const wire::FrameView& frame = parser_.Parse(reader.head);
  if (frame.kind() != wire::FrameKind::kEtherCat || frame.empty()) return;
  reader.key = frame.key() ^ frame.sender();
}

/// Whose packet comes next. A return never stands before its frame, whatever the clocks show.
AlignedSource::Reader& AlignedSource::Earliest() noexcept {
  Reader& out = readers_[0];
  Reader& back = readers_[1];
  if (!two_ || back.status != capture::ReadStatus::kFrame) return out;
  if (out.status != capture::ReadStatus::kFrame) return back;
  if (!out.head.has_time) return out;
  if (!back.head.has_time) return back;
  if (out.recording != back.recording) return out.recording < back.recording ? out : back;
  if (back.key != 0 && back.key == out.key) {
    const Sent* const before = SentBefore(back);
    const std::int64_t off = OffIf(out.head.time, back.head.time);
    if (before == nullptr || off < OffIf(before->time, back.head.time)) return out;
  }
  return Elapsed(apart_.ahead_ns, back.head.time) < out.head.time ? back : out;
}

capture::ReadStatus AlignedSource::Next(capture::CapturedFrame& frame) noexcept {
  if (lent_ != nullptr) Advance(*std::exchange(lent_, nullptr));
  Reader& reader = Earliest();
  if (reader.status != capture::ReadStatus::kFrame) {
    TakeInfo(readers_[0], 0);
    return readers_[0].status;
  }
  lent_ = &reader;
  Follow(reader);
  frame = reader.head;
  if (IsReturned(frame) && frame.has_time) {
    frame.time = Elapsed(apart_.ahead_ns, frame.time);
    // It is after the packet before it, however exactly the clocks could be compared.
    if (frame.time < last_ && Difference(frame.time, last_) <= kRoundTripSpreadNs) frame.time = last_;
  }
  if (frame.has_time) last_ = frame.time;
  info_.packets = two_ ? info_.packets + 1 : reader.source->info().packets;
  if (two_) frame.number = info_.packets;
  TakeInfo(reader, frame.number);
  return capture::ReadStatus::kFrame;
}

/// How much the clock would be ahead if `returned` were the return of what was sent then.
std::int64_t AlignedSource::AheadIf(TimeNs sent, TimeNs returned) noexcept {
  return Elapsed(kLeastRoundTripNs, Elapsed(sent, returned));
}

/// How far that is from what it is ahead by.
std::int64_t AlignedSource::OffIf(TimeNs sent, TimeNs returned) const noexcept {
  return Difference(apart_.ahead_ns, AheadIf(sent, returned));
}

/// The one of the frames sent lately that it is the return of, most likely; null: none.
AlignedSource::Sent* AlignedSource::SentBefore(const Reader& back) noexcept {
  Sent* nearest = nullptr;
  for (Sent& sent : sent_) {
    if (sent.key != back.key) continue;
    if (nearest == nullptr || OffIf(sent.time, back.head.time) < OffIf(nearest->time, back.head.time)) nearest = &sent;
  }
  return nearest;
}

/// The frame that it is the return of shows how far the clocks are apart now.
void AlignedSource::Follow(const Reader& reader) noexcept {
  if (reader.key == 0) return;
  if (!IsReturned(reader.head)) {
    sent_[next_sent_] = {reader.key, reader.head.time};
    next_sent_ = (next_sent_ + 1) % kKept;
    return;
  }
  Sent* const sent = SentBefore(reader);
  if (sent == nullptr) return;
  std::int64_t ahead = AheadIf(sent->time, reader.head.time);
  // In a file that is in order it also follows all that was sent before it.
  if (!two_) ahead = std::min(ahead, Elapsed(sent_[(next_sent_ + kKept - 1) % kKept].time, reader.head.time));
  sent->key = 0;
  Measure(ahead, Difference(last_pair_, sent->time));
  last_pair_ = sent->time;
}

/// @param since  the last pair before this one, ns: so long the clocks ran apart
void AlignedSource::Measure(std::int64_t ahead, std::int64_t since) noexcept {
  const std::int64_t off = Difference(apart_.ahead_ns, ahead);
  if (off > kRoundTripSpreadNs + since / kDriftOneIn) {
    elsewhere_ = elsewhere_ > 0 && Difference(elsewhere_ns_, ahead) <= kRoundTripSpreadNs ? elsewhere_ + 1 : 1;
    elsewhere_ns_ = ahead;
    if (elsewhere_ < kElsewhere) return;
  }
  if (off > kRoundTripSpreadNs) {
    apart_.ahead_ns = ahead;
    in_window_ = 0;
  }
  elsewhere_ = 0;
  // No return comes before its frame; that others come later may be the line's.
  apart_.ahead_ns = std::min(apart_.ahead_ns, ahead);
  lowest_ = in_window_ == 0 ? ahead : std::min(lowest_, ahead);
  if (++in_window_ < kWindow) return;
  apart_.ahead_ns = lowest_;
  in_window_ = 0;
}

/// What the file states about itself and this packet. @param number  0: at the end
void AlignedSource::TakeInfo(Reader& reader, FrameNo number) {
  const capture::CaptureInfo& theirs = reader.source->info();
  for (; reader.comments < theirs.comments.size(); ++reader.comments) {
    const capture::Comment& comment = theirs.comments[reader.comments];
    if (number != 0 && comment.frame > reader.head.number) break;
    const bool of_file = comment.frame == 0 && &reader == &readers_[0];
    const bool of_packet = number != 0 && comment.frame == reader.head.number;
    if ((of_file || of_packet) && info_.comments.size() < kMaxComments) {
      info_.comments.push_back({of_packet ? number : 0, comment.text});
    }
  }
  if (&reader != &readers_[0]) return;
  if (number == 0 || info_.interfaces.size() != theirs.interfaces.size()) info_.interfaces = theirs.interfaces;
  info_.unread_blocks = theirs.unread_blocks;
  info_.name_bytes_left_out = theirs.name_bytes_left_out;
  if (number != 0 || !theirs.damage) return;
  info_.damage = theirs.damage;
  if (two_) info_.damage->after_frame = info_.packets;
}

std::uint64_t AlignedSource::bytes_read() const noexcept {
  const std::uint64_t first = readers_[0].source->bytes_read();
  return two_ ? std::min(first, readers_[1].source->bytes_read()) : first;
}

std::uint64_t AlignedSource::bytes_total() const noexcept {
  return readers_[0].source->bytes_total();
}

Result<std::unique_ptr<capture::FrameSource>> OpenAligned(const CaptureOpener& open) {
  Result<std::unique_ptr<capture::FrameSource>> source = open();
  if (!source || (*source)->info().interfaces.size() < 2) return source;
  Result<std::unique_ptr<capture::FrameSource>> looked_at = open();
  if (!looked_at) return source;
  const std::optional<ClocksApart> apart = CompareClocks(**looked_at);
  looked_at->reset();
  if (!apart) return source;
  std::unique_ptr<capture::FrameSource> again;
  if (!apart->in_order) {
    Result<std::unique_ptr<capture::FrameSource>> second = open();
    if (!second) return source;
    again = std::move(*second);
  }
  return std::unique_ptr<capture::FrameSource>(
      std::make_unique<AlignedSource>(*apart, std::move(*source), std::move(again)));
}

}  // namespace ecaudit::bus
