/// A capture that can be read twice: what comes from a pipe is kept in a temporary file.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "decoder/base/result.h"
#include "decoder/capture/frame_source.h"

namespace ecaudit::cli {

class Spool {
 public:
  /// Reads `path` ("-": standard input) to its end, or to the interrupt signal, into a file without a name.
  [[nodiscard]] static Result<std::unique_ptr<Spool>> Read(const std::string& path);
  /// False for standard input, pipes and the like.
  [[nodiscard]] static bool CanBeReadTwice(const std::string& path);

  Spool(const Spool&) = delete;
  Spool& operator=(const Spool&) = delete;
  ~Spool();

  /// Where the file can be opened while this lives.
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  Spool(int fd, std::string path);

  int fd_;
  std::string path_;
};

/// What one command reads: a capture, or several as one.
class CapturePaths {
 public:
  CapturePaths() = default;
  /// @param interfaces  whose packets are read; empty: those of all
  explicit CapturePaths(std::vector<std::string> paths, std::vector<std::uint16_t> interfaces = {})
      : paths_(std::move(paths)), interfaces_(std::move(interfaces)) {}

  /// Those that cannot be read twice are read into temporary files.
  [[nodiscard]] std::optional<Error> MakeReadableTwice();
  /// From the beginning. Where the clocks of two interfaces of one file are apart its stamps are moved
  /// (bus::OpenAligned()); what can be read only once is taken as it is.
  /// @param stop  once it is set the source ends; null: at the interrupt signal
  [[nodiscard]] Result<std::unique_ptr<capture::FrameSource>> Open(const std::atomic<bool>* stop = nullptr) const;
  /// The captures, or the temporary files in their place.
  [[nodiscard]] const std::vector<std::string>& paths() const { return paths_; }
  /// Users do not know about temporary files: an `error` about one is reported as about the input.
  [[nodiscard]] Error WithoutSpools(Error error) const;

 private:
  std::vector<std::string> paths_;
  std::vector<std::uint16_t> interfaces_;
  std::vector<std::unique_ptr<Spool>> spools_;
};

}  // namespace ecaudit::cli
