#include <cerrno>
#include <fcntl.h>
#include <io.h>
#include <string_view>

#include "decoder/base/system/files.h"
#include "decoder/base/system/streams.h"
#include "decoder/base/system/windows_support.h"

namespace ecaudit::system {
namespace {

HANDLE HandleOf(std::FILE* stream) {
  return reinterpret_cast<HANDLE>(::_get_osfhandle(::_fileno(stream)));
}

}  // namespace

bool IsTerminal(std::FILE* stream) {
  // Not _isatty(): NUL is a terminal for it.
  DWORD mode = 0;
  return ::GetConsoleMode(HandleOf(stream), &mode) != 0;
}

bool ShowsColors(std::FILE* stream) {
  DWORD mode = 0;
  if (::GetConsoleMode(HandleOf(stream), &mode) == 0) return false;
  return (mode & ENABLE_VIRTUAL_TERMINAL_PROCESSING) != 0 ||
         ::SetConsoleMode(HandleOf(stream), mode | ENABLE_VIRTUAL_TERMINAL_PROCESSING) != 0;
}

std::optional<std::size_t> ColumnsOf(std::FILE* stream) {
  CONSOLE_SCREEN_BUFFER_INFO info{};
  if (::GetConsoleScreenBufferInfo(HandleOf(stream), &info) == 0) return std::nullopt;
  const int columns = info.srWindow.Right - info.srWindow.Left + 1;
  return columns > 0 ? std::optional(static_cast<std::size_t>(columns)) : std::nullopt;
}

bool ReaderHasGone(int reason) {
  // The C library knows ERROR_NO_DATA, a pipe that is being closed, by EINVAL.
  return reason == EPIPE || reason == EINVAL;
}

std::FILE* OpenBytes(std::span<unsigned char> bytes) {
  const int fd = MakeNameless().fd;
  if (fd < 0) return nullptr;
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (!WriteAll(fd, text) || !Rewind(fd)) {
    Close(fd);
    return nullptr;
  }
  return ::_fdopen(fd, "rb");
}

}  // namespace ecaudit::system
