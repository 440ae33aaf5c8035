#include <cerrno>
#include <sys/ioctl.h>
#include <unistd.h>

#include "decoder/base/system/streams.h"

namespace ecaudit::system {

bool IsTerminal(std::FILE* stream) {
  return ::isatty(::fileno(stream)) == 1;
}

bool ShowsColors(std::FILE* stream) {
  return IsTerminal(stream);
}

std::optional<std::size_t> ColumnsOf(std::FILE* stream) {
  winsize size{};
  if (::ioctl(::fileno(stream), TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return std::nullopt;
  return size.ws_col;
}

bool ReaderHasGone(int reason) {
  return reason == EPIPE;
}

std::FILE* OpenBytes(std::span<unsigned char> bytes) {
  return ::fmemopen(bytes.data(), bytes.size(), "rb");
}

}  // namespace ecaudit::system
