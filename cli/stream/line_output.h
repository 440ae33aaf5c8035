/// Where the lines of one format go: standard output or a file, through one large buffer.
#pragma once

#include <optional>
#include <string>

#include "cli/console.h"
#include "cli/output_file.h"
#include "decoder/base/result.h"

namespace ecaudit::cli {

class LineOutput {
 public:
  [[nodiscard]] static LineOutput ToConsole(Console& console);
  [[nodiscard]] static Result<LineOutput> ToFile(const std::string& path);
  /// Lines stay until TakeLines().
  [[nodiscard]] static LineOutput ToBuffer();

  /// Lines are appended here.
  [[nodiscard]] std::string& buffer() { return buffer_; }
  /// After each line; hands the buffer on when it is full, or at once where a person waits for it.
  void EndLine() {
    buffer_ += '\n';
    if (buffer_.size() >= limit_) Flush();
  }
  /// The lines since the last call, without the end of the last one.
  [[nodiscard]] std::string TakeLines();
  /// Nothing written from now on can arrive: the reader has gone, or writing failed.
  [[nodiscard]] bool closed() const { return closed_; }
  /// Hands out the rest; a file appears.
  /// @return what went wrong at any time, or nothing
  [[nodiscard]] std::optional<Error> Finish();

 private:
  LineOutput() = default;
  void Flush();

  std::string buffer_;
  std::size_t limit_ = 0;
  Console* console_ = nullptr;  ///< null: a file or the buffer
  std::optional<OutputFile> file_;
  std::optional<Error> error_;
  bool closed_ = false;
};

}  // namespace ecaudit::cli
