#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fcntl.h>
#include <io.h>

#include "decoder/base/system/program.h"
#include "decoder/base/system/windows_support.h"
// After windows.h, which it needs.
#include <shellapi.h>

namespace ecaudit::system {
namespace {

UINT page_before = 0;

void RestorePage() {
  ::SetConsoleOutputCP(page_before);
}

}  // namespace

std::vector<std::string> Arguments(int /*argc*/, char** /*argv*/) {
  // Those of main() are in the code page of the system, and their wildcards are expanded.
  int count = 0;
  wchar_t** const wide = ::CommandLineToArgvW(::GetCommandLineW(), &count);
  std::vector<std::string> arguments;
  for (int i = 1; i < count; ++i) arguments.push_back(Narrow(wide[i]));
  ::LocalFree(wide);
  return arguments;
}

void PrepareProgram() {
  for (std::FILE* stream : {stdin, stdout, stderr}) ::_setmode(::_fileno(stream), _O_BINARY);
  // To a console the C library writes byte by byte, which takes letters of several bytes apart.
  constexpr std::size_t kBuffer = std::size_t{1} << 16U;
  for (std::FILE* stream : {stdout, stderr}) std::setvbuf(stream, nullptr, _IOFBF, kBuffer);
  // A console shows UTF-8 from now on; the shell gets its own code page back.
  DWORD mode = 0;
  page_before = ::GetConsoleOutputCP();
  const bool console = ::GetConsoleMode(::GetStdHandle(STD_OUTPUT_HANDLE), &mode) != 0 ||
                       ::GetConsoleMode(::GetStdHandle(STD_ERROR_HANDLE), &mode) != 0;
  if (console && page_before != CP_UTF8 && ::SetConsoleOutputCP(CP_UTF8) != 0) std::atexit(RestorePage);
}

std::string ProgramPath() {
  std::wstring path(MAX_PATH, L'\0');
  for (;;) {
    const DWORD length = ::GetModuleFileNameW(nullptr, path.data(), static_cast<DWORD>(path.size()));
    if (length < path.size()) return Narrow(path.substr(0, length));
    path.resize(2 * path.size());
  }
}

std::string Environment(const char* name) {
  const std::wstring wide = Wide(name);
  std::wstring value(::GetEnvironmentVariableW(wide.c_str(), nullptr, 0), L'\0');
  if (value.empty()) return {};
  value.resize(::GetEnvironmentVariableW(wide.c_str(), value.data(), static_cast<DWORD>(value.size())));
  return Narrow(value);
}

std::int64_t ZoneSeconds(std::int64_t moment) {
  const __time64_t seconds = moment;
  std::tm local{};
  return ::_localtime64_s(&local, &seconds) != 0 ? 0 : ::_mkgmtime64(&local) - seconds;
}

}  // namespace ecaudit::system
