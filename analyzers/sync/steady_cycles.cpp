#include "analyzers/sync/steady_cycles.h"

#include <algorithm>
#include <cstdlib>

#include "decoder/base/bytes.h"
#include "decoder/base/wrapping.h"

namespace ecaudit::sync {

bool SteadyCycles::Kind::Is(std::span<const ProcessDatagram> datagrams) const {
  return std::equal(datagrams.begin(), datagrams.end(), datagrams_.begin(),
                    datagrams_.begin() + static_cast<std::ptrdiff_t>(count_));
}

bool SteadyCycles::Kind::Feeds(const OutputWatch* watch) const {
  return std::any_of(members_.begin(), members_.end(), [&](const Member& m) { return m.fed.watch == watch; });
}

bool SteadyCycles::Kind::Begin(std::span<const ProcessDatagram> datagrams, const FrameTime& time,
                               const Interval& interval, const FrameWay& way, std::span<const Fed> fed,
                               std::span<const StatusWord> words) {
  count_ = std::min(datagrams.size(), datagrams_.size());
  std::copy_n(datagrams.begin(), count_, datagrams_.begin());
  way_ = way;
  base_ = interval.base;
  by_dc_ = time.dc.has_value();
  last_ = time;
  limit_ = 0;
  cycle_ = 0;
  taken_ = 0;
  members_.clear();
  words_.clear();
  images_.clear();
  nominal_of_.clear();
  rates_.clear();
  for (const Fed& one : fed) {
    if (!Admit(one)) return false;
  }
  for (const StatusWord& word : words) words_.push_back({word, word.watch->status_word, word.watch->status_word});
  Open();
  return cycle_ == 0 || least_ <= most_;
}

/// What is asked of each frame from here on is asked for this slave as well.
bool SteadyCycles::Kind::Admit(const Fed& fed) {
  const OutputWatch& watch = *fed.watch;
  if (Feeds(fed.watch) || watch.last.frame.number != last_.frame.number || !watch.rate.IsCalm(base_)) return false;
  if (std::find(images_.begin(), images_.end(), fed.image) == images_.end()) {
    images_.push_back(fed.image);
    nominal_of_.push_back(fed.image->nominal_of);
  }
  const TimeNs nominal = watch.rate.nominal();
  const auto rate = std::find_if(rates_.begin(), rates_.end(), [&](const Rate& r) { return r.nominal == nominal; });
  const auto index = static_cast<std::size_t>(rate - rates_.begin());
  if (rate == rates_.end()) {
    if (rates_.size() == kRates) return false;
    rates_.push_back({nominal, {}});
  }
  if (const TimeNs limit = watch.GapLimit(fed.image); limit > 0) limit_ = limit_ == 0 ? limit : std::min(limit_, limit);
  if (fed.sync0_cycle_ns != 0) {
    if (fed.sync0_cycle_ns >= kLongestCycle || base_ != TimeBase::kDc) return false;
    if (cycle_ != 0 && cycle_ != fed.sync0_cycle_ns) return false;
    cycle_ = fed.sync0_cycle_ns;
  }
  members_.push_back({fed, index});
  return true;
}

/// Nothing is taken that was not delivered.
void SteadyCycles::Kind::Open() {
  frames_ = 0;
  for (Rate& rate : rates_) rate.run = {};
  phases_ = {};
  phases_.cycle_ns = cycle_;
  least_ = -cycle_;
  most_ = cycle_;
  for (const Member& member : members_) {
    if (member.fed.sync0_cycle_ns == 0) continue;
    const auto [least, most] = member.fed.watch->phase.MayShift(cycle_);
    least_ = std::max(least_, least);
    most_ = std::min(most_, most);
  }
}

/// @param gap to the frame before
bool SteadyCycles::Kind::IsNext(const FrameTime& time, TimeNs& gap) const {
  gap = images_.front()->gap.ns;
  for (std::size_t i = 0; i < images_.size(); ++i) {
    const CyclicImage& image = *images_[i];
    if (image.last.frame.number != time.frame.number || image.gap_from != last_.frame.number) return false;
    if (image.gap.base != base_ || image.gap.ns != gap || image.nominal_of != nominal_of_[i]) return false;
  }
  return (limit_ == 0 || gap < limit_) &&
         std::all_of(rates_.begin(), rates_.end(), [&](const Rate& r) { return OutputRate::IsOne(gap, r.nominal); });
}

bool SteadyCycles::Kind::Take(const FrameTime& time, FrameNo sent, const FrameWay& way) {
  TimeNs gap = 0;
  if (time.frame.number <= last_.frame.number || time.dc.has_value() != by_dc_ || !(way == way_)) return false;
  if (!IsNext(time, gap)) return false;
  if (cycle_ != 0) {
    // So far after the next pulse that it is not after the last one, and not further ahead.
    const std::int64_t before = frames_ == 0 ? 0 : shifts_[frames_ - 1];
    const std::int64_t shift = before + gap - cycle_;
    if (shift < least_ || shift > most_ || gap >= cycle_ + cycle_ / 2) return false;
    shifts_[frames_] = static_cast<std::int32_t>(shift);
    phases_.sum += shift;
    phases_.squares += shift * shift;
    if (frames_ == 0 || shift < phases_.least.shift_ns) phases_.least = {shift, time.frame};
    if (frames_ == 0 || shift > phases_.most.shift_ns) phases_.most = {shift, time.frame};
  }
  for (Rate& rate : rates_) {
    const TimeNs off = std::abs(gap - rate.nominal);
    rate.run.ns += gap;
    rate.run.off += off;
    rate.run.most_off = std::max(rate.run.most_off, off);
  }
  for (Word& word : words_) word.last = word.now;
  last_ = time;
  last_sent_ = sent;
  ++taken_;
  if (++frames_ == kMost) Deliver();
  return true;
}

bool SteadyCycles::Kind::Read(const ProcessDatagram& datagram, ByteSpan data) {
  const auto end = datagrams_.begin() + static_cast<std::ptrdiff_t>(count_);
  const auto found = std::find(datagrams_.begin(), end, datagram);
  if (found == end) return false;
  const auto index = static_cast<std::size_t>(found - datagrams_.begin());
  for (Word& word : words_) {
    if (word.where.datagram == index && Fits(data, word.where.at, 2)) {
      word.now = LittleEndian<std::uint16_t>(data, word.where.at);
    }
  }
  return true;
}

bool SteadyCycles::Kind::Reads(const OutputWatch* watch) const {
  return std::any_of(words_.begin(), words_.end(), [&](const Word& word) { return word.where.watch == watch; });
}

/// Each slave is updated with the frames as if with each of them.
void SteadyCycles::Kind::Deliver() {
  if (frames_ == 0) return;
  for (Rate& rate : rates_) {
    rate.run.count = frames_;
    rate.run.last = last_.frame;
  }
  phases_.shifts_ns = std::span(shifts_).first(frames_);
  phases_.last = last_.frame;
  for (const Member& member : members_) {
    OutputWatch& watch = *member.fed.watch;
    watch.rate.AddRun(rates_[member.rate].run);
    if (member.fed.sync0_cycle_ns != 0) watch.phase.AddRun(phases_);
    watch.AddRun(frames_, last_, last_sent_);
  }
  for (const Word& word : words_) word.where.watch->last_status_word = word.last;
  Open();
}

void SteadyCycles::Kind::End() {
  Deliver();
  for (const Word& word : words_) word.where.watch->status_word = word.now;
  count_ = 0;
  members_.clear();
  words_.clear();
}

bool SteadyCycles::Take(std::span<const ProcessDatagram> datagrams, const FrameTime& time, FrameNo sent,
                        const FrameWay& way) {
  const auto end = kinds_.begin() + static_cast<std::ptrdiff_t>(used_);
  const auto kind = std::find_if(kinds_.begin(), end, [&](const Kind& k) { return k.Is(datagrams); });
  return kind != end && kind->Take(time, sent, way);
}

bool SteadyCycles::Begin(std::span<const ProcessDatagram> datagrams, const FrameTime& time, const Interval& interval,
                         const FrameWay& way, std::span<const Fed> fed, std::span<const StatusWord> words) {
  if (used_ == kKinds || datagrams.size() > kDatagrams || fed.empty()) return false;
  const auto end = kinds_.begin() + static_cast<std::ptrdiff_t>(used_);
  const bool shared = std::any_of(kinds_.begin(), end, [&](const Kind& kind) {
    return std::any_of(fed.begin(), fed.end(), [&](const Fed& one) { return kind.Feeds(one.watch); }) ||
           std::any_of(words.begin(), words.end(), [&](const StatusWord& word) { return kind.Reads(word.watch); });
  });
  if (shared || !kinds_[used_].Begin(datagrams, time, interval, way, fed, words)) return false;
  ++used_;
  return true;
}

bool SteadyCycles::Read(const ProcessDatagram& datagram, ByteSpan data) {
  const auto end = kinds_.begin() + static_cast<std::ptrdiff_t>(used_);
  return std::any_of(kinds_.begin(), end, [&](Kind& kind) { return kind.Read(datagram, data); });
}

bool SteadyCycles::Reads(const OutputWatch& watch) const {
  const auto end = kinds_.begin() + static_cast<std::ptrdiff_t>(used_);
  return std::any_of(kinds_.begin(), end, [&](const Kind& kind) { return kind.Reads(&watch); });
}

bool SteadyCycles::Feeds(const OutputWatch& watch) const {
  const auto end = kinds_.begin() + static_cast<std::ptrdiff_t>(used_);
  return std::any_of(kinds_.begin(), end, [&](const Kind& kind) { return kind.Feeds(&watch); });
}

void SteadyCycles::Deliver() {
  for (std::size_t i = 0; i < used_; ++i) kinds_[i].Deliver();
}

std::uint64_t SteadyCycles::End() {
  std::uint64_t least = 0;
  for (std::size_t i = 0; i < used_; ++i) {
    const std::uint64_t taken = kinds_[i].taken();
    least = i == 0 ? taken : std::min(least, taken);
    kinds_[i].End();
  }
  used_ = 0;
  return least;
}

}  // namespace ecaudit::sync
