#include "cli/progress.h"

#include <cmath>

#include "cli/report/layout.h"
#include "decoder/base/text.h"

namespace ecaudit::cli {
namespace {

std::string Rate(double frames_per_second) {
  if (frames_per_second >= 1e6) return Fixed(frames_per_second / 1e6, 1) + " M frames/s";
  if (frames_per_second >= 1e3) return Fixed(frames_per_second / 1e3, 0) + " k frames/s";
  return Fixed(frames_per_second, 0) + " frames/s";
}

}  // namespace

Progress::Progress(const Console& console, std::string label)
    : label_(report::OneLine(label)), stream_(console.error_stream()), enabled_(console.error_is_terminal()) {}

void Progress::Update(std::uint64_t bytes_done, std::uint64_t bytes_total, std::uint64_t frames) {
  if (!enabled_) return;
  const Clock::time_point now = Clock::now();
  if (now < next_) return;
  next_ = now + std::chrono::milliseconds(200);
  const double seconds = std::chrono::duration<double>(now - start_).count();
  const std::string line = "\r\x1b[K" + Describe(label_, seconds, bytes_done, bytes_total, frames);
  std::fwrite(line.data(), 1, line.size(), stream_);
  std::fflush(stream_);
  shown_ = true;
}

void Progress::Relabel(std::string_view label) {
  label_ = report::OneLine(label);
}

void Progress::Clear() {
  if (!shown_) return;
  std::fputs("\r\x1b[K", stream_);
  std::fflush(stream_);
  shown_ = false;
}

std::string Progress::Describe(const std::string& label, double seconds, std::uint64_t bytes_done,
                               std::uint64_t bytes_total, std::uint64_t frames) {
  std::string text = label + "  ";
  const bool share_known = bytes_total > 0 && bytes_done <= bytes_total;
  const double share = share_known ? static_cast<double>(bytes_done) / static_cast<double>(bytes_total) : 0.0;
  if (share_known) text += Fixed(std::floor(share * 100), 0) + " %  ";
  text += Grouped(frames) + " frames";
  if (seconds > 0) text += ", " + Rate(static_cast<double>(frames) / seconds);
  if (share > 0) text += ", " + Fixed(std::ceil(seconds * (1 - share) / share), 0) + " s left";
  return text;
}

}  // namespace ecaudit::cli
