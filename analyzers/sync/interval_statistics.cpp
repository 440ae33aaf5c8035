#include "analyzers/sync/interval_statistics.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace ecaudit::sync {
namespace {

constexpr unsigned kSubBits = 9;
constexpr std::size_t kSub = std::size_t{1} << kSubBits;
constexpr unsigned kFirstOctave = 10;
constexpr unsigned kLastOctave = 35;
constexpr std::size_t kBins = (kLastOctave - kFirstOctave + 1) * kSub;
/// Bins of a report: neighbours are joined until no more are in use.
constexpr std::size_t kReportedBins = 100;

std::size_t BinOf(TimeNs ns) {
  const auto value = static_cast<std::uint64_t>(std::max<TimeNs>(ns, 0));
  if (value < (std::uint64_t{1} << kFirstOctave)) return 0;
  const auto octave = static_cast<unsigned>(std::bit_width(value) - 1);
  if (octave > kLastOctave) return kBins - 1;
  return (octave - kFirstOctave) * kSub + ((value >> (octave - kSubBits)) & (kSub - 1));
}

TimeNs LowerEnd(std::size_t bin) {
  const auto octave = static_cast<unsigned>(bin / kSub) + kFirstOctave;
  return static_cast<TimeNs>((kSub + bin % kSub) << (octave - kSubBits));
}

TimeNs Middle(std::size_t bin) {
  return (LowerEnd(bin) + LowerEnd(bin + 1)) / 2;
}

/// No part of Add(), which nearly always does without.
[[gnu::cold, gnu::noinline]] void MakeBins(std::vector<std::uint32_t>& bins) {
  bins.resize(kBins);
}

}  // namespace

bool IntervalHistogram::Add(TimeNs ns) {
  if (count_ == 0) [[unlikely]] {
    MakeBins(bins_);
    min_ = ns;
    max_ = ns - 1;
  }
  ++count_;
  std::uint32_t& bin = bins_[BinOf(ns)];
  if (bin != UINT32_MAX) ++bin;
  if (ns < min_) min_ = ns;
  if (ns <= max_) return false;
  max_ = ns;
  return true;
}

void IntervalStatistics::Add(TimeNs ns, const FrameRef& from, const FrameRef& to) {
  if (IntervalHistogram::Add(ns)) {
    longest_from_ = from;
    longest_to_ = to;
  }
  // Welford: numerically stable in one pass.
  const auto value = static_cast<double>(ns);
  const double delta = value - mean_;
  mean_ += delta / static_cast<double>(static_cast<std::int64_t>(count_));  // signed: one instruction
  sum_of_squares_ += delta * (value - mean_);
}

TimeNs IntervalHistogram::Percentile(double share) const {
  if (count_ == 0) return 0;
  const auto wanted = static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(count_)));
  std::uint64_t seen = 0;
  for (std::size_t bin = 0; bin < bins_.size(); ++bin) {
    seen += bins_[bin];
    if (seen >= wanted && bins_[bin] > 0) return std::clamp(Middle(bin), min_, max_);
  }
  return max_;
}

CycleSummary IntervalStatistics::Summary() const {
  CycleSummary summary;
  if (count_ == 0) return summary;
  summary.cycles = count_;
  summary.mean_us = mean_ / 1e3;
  summary.min_us = static_cast<double>(min_) / 1e3;
  summary.max_us = static_cast<double>(max_) / 1e3;
  summary.stddev_us = std::sqrt(sum_of_squares_ / static_cast<double>(count_)) / 1e3;
  const TimeNs median = Percentile(0.5);
  summary.median_us = static_cast<double>(median) / 1e3;
  summary.p1_us = static_cast<double>(Percentile(0.01)) / 1e3;
  summary.p99_us = static_cast<double>(Percentile(0.99)) / 1e3;
  summary.p999_us = static_cast<double>(Percentile(0.999)) / 1e3;
  summary.longest_from = longest_from_;
  summary.longest_to = longest_to_;

  for (std::size_t bin = 0; bin < bins_.size(); ++bin) {
    if (bins_[bin] == 0) continue;
    const TimeNs middle = Middle(bin);
    // Stamps may hold anything: a median of centuries has no triple.
    if (median > 0 && middle - median > median / 2)
      summary.missing += bins_[bin] * static_cast<std::uint64_t>((middle + median / 2) / median - 1);
    if (middle * 4 < median) summary.bursts += bins_[bin];
  }
  std::size_t join = 1;
  std::vector<CycleBin> bins;
  do {
    bins.clear();
    for (std::size_t first = 0; first < bins_.size(); first += join) {
      std::uint64_t count = 0;
      for (std::size_t bin = first; bin < std::min(first + join, bins_.size()); ++bin) count += bins_[bin];
      if (count > 0) {
        bins.push_back(
            {static_cast<double>(LowerEnd(first)) / 1e3, static_cast<double>(LowerEnd(first + join)) / 1e3, count});
      }
    }
    join *= 2;
  } while (bins.size() > kReportedBins);
  summary.histogram = std::move(bins);
  return summary;
}

}  // namespace ecaudit::sync
