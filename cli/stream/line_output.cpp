#include "cli/stream/line_output.h"

#include <limits>
#include <utility>

namespace ecaudit::cli {
namespace {

/// As much as a pipe takes, and little enough to stay in the processor's cache.
constexpr std::size_t kBufferBytes = std::size_t{64} << 10U;
constexpr std::size_t kRoomForALine = std::size_t{8} << 10U;

}  // namespace

LineOutput LineOutput::ToConsole(Console& console) {
  LineOutput output;
  output.console_ = &console;
  output.limit_ = console.output_is_terminal() ? 1 : kBufferBytes;
  output.buffer_.reserve(kBufferBytes + kRoomForALine);
  return output;
}

Result<LineOutput> LineOutput::ToFile(const std::string& path) {
  Result<OutputFile> file = OutputFile::Create(path);
  if (!file) return file.error();
  LineOutput output;
  output.file_ = std::move(*file);
  output.limit_ = kBufferBytes;
  output.buffer_.reserve(kBufferBytes + kRoomForALine);
  return output;
}

LineOutput LineOutput::ToBuffer() {
  LineOutput output;
  output.limit_ = std::numeric_limits<std::size_t>::max();
  return output;
}

std::string LineOutput::TakeLines() {
  if (!buffer_.empty()) buffer_.pop_back();
  std::string lines = buffer_;
  buffer_.clear();
  return lines;
}

void LineOutput::Flush() {
  if (!closed_ && !buffer_.empty()) {
    error_ = console_ != nullptr ? console_->Write(buffer_) : file_->Write(buffer_);
    closed_ = error_.has_value() || (console_ != nullptr && console_->reader_gone());
  }
  buffer_.clear();
}

std::optional<Error> LineOutput::Finish() {
  Flush();
  if (!error_ && file_) error_ = file_->Finish();
  return error_;
}

}  // namespace ecaudit::cli
