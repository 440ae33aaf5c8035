/// How far the work is, on a terminal, once it has lasted a second.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

#include "cli/console.h"

namespace ecaudit::cli {

class Progress {
 public:
  /// @param label  what is being read; may hold untrusted text
  Progress(const Console& console, std::string label);
  ~Progress() { Clear(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Shows share, rate and time left, at most five times a second. `bytes_total` 0: unknown.
  void Update(std::uint64_t bytes_done, std::uint64_t bytes_total, std::uint64_t frames);
  /// Another label from the next line on; may hold untrusted text.
  void Relabel(std::string_view label);
  /// Takes the line away.
  void Clear();

  /// The line for these numbers, for example "a.pcap  45 %  1,234,567 frames, 2.1 M frames/s, 12 s left".
  [[nodiscard]] static std::string Describe(const std::string& label, double seconds, std::uint64_t bytes_done,
                                            std::uint64_t bytes_total, std::uint64_t frames);

 private:
  using Clock = std::chrono::steady_clock;

  std::string label_;
  std::FILE* stream_;
  bool enabled_;
  bool shown_ = false;
  Clock::time_point start_ = Clock::now();
  Clock::time_point next_ = start_ + std::chrono::seconds(1);
};

}  // namespace ecaudit::cli
