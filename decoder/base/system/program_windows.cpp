#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <cwchar>
#include <fcntl.h>
#include <io.h>

#include "decoder/base/system/program.h"
#include "decoder/base/system/windows_support.h"
// After windows.h, which it needs.
#include <shellapi.h>

// std::filesystem::path makes UTF-16 of text with this function of the C library, which Windows' own one does by the
// code page. Here text is UTF-8. Letters of four bytes are two units: the first one takes three bytes, and `state`
// keeps the rest. What is not valid becomes U+FFFD.
extern "C" std::size_t mbrtowc(wchar_t* out, const char* text, std::size_t size, std::mbstate_t* state) {
  constexpr int kHalf = 0x100;
  constexpr unsigned kNotValid = 0xFFFD;
  static thread_local std::mbstate_t own{};
  std::mbstate_t& half = state != nullptr ? *state : own;
  const auto byte = [text](std::size_t i) { return static_cast<unsigned>(static_cast<unsigned char>(text[i])); };
  const auto low = [&byte](std::size_t i) { return byte(i) & 0x3FU; };
  const auto follows = [&](std::size_t i) { return i < size && (byte(i) & 0xC0U) == 0x80; };
  const auto give = [out](unsigned unit, std::size_t bytes) {
    if (out != nullptr) *out = static_cast<wchar_t>(unit);
    return unit == 0 ? 0 : bytes;
  };
  if (text == nullptr) {
    half = 0;
    return 0;
  }
  if (size == 0) return static_cast<std::size_t>(-2);
  const unsigned first = byte(0);
  if (half != 0) {
    const unsigned unit = 0xDC00U | (static_cast<unsigned>(half) & 0xFU) << 6U | low(0);
    half = 0;
    return give(unit, 1);
  }
  if (first < 0x80) return give(first, 1);
  if (first >= 0xC2 && first < 0xE0 && follows(1)) return give((first & 0x1FU) << 6U | low(1), 2);
  if (first >= 0xE0 && first < 0xF0 && follows(1) && follows(2)) {
    return give((first & 0xFU) << 12U | low(1) << 6U | low(2), 3);
  }
  if (first >= 0xF0 && first < 0xF5 && follows(1) && follows(2) && follows(3)) {
    const unsigned point = (first & 0x7U) << 18U | low(1) << 12U | low(2) << 6U | low(3);
    if (point >= 0x10000 && point <= 0x10FFFF) {
      half = kHalf | static_cast<int>(low(2) & 0xFU);
      return give(0xD800U + ((point - 0x10000U) >> 10U), 3);
    }
  }
  return give(kNotValid, 1);
}

// What stands beside it in the C library, so that nothing asks for that one.

extern "C" std::size_t mbrlen(const char* text, std::size_t size, std::mbstate_t* state) {
  static thread_local std::mbstate_t own{};
  return mbrtowc(nullptr, text, size, state != nullptr ? state : &own);
}

extern "C" std::size_t mbsrtowcs(wchar_t* out, const char** text, std::size_t size, std::mbstate_t* state) {
  constexpr std::size_t kLongest = 4;
  const char* at = *text;
  for (std::size_t units = 0;; ++units) {
    if (out != nullptr && units == size) {
      *text = at;
      return units;
    }
    wchar_t unit = 0;
    const std::size_t bytes = mbrtowc(&unit, at, ::strnlen(at, kLongest - 1) + 1, state);
    if (out != nullptr) out[units] = unit;
    if (bytes == 0) {
      if (out != nullptr) *text = nullptr;
      return units;
    }
    at += bytes;
  }
}

namespace ecaudit::system {
namespace {

UINT page_before = 0;

void RestorePage() {
  ::SetConsoleOutputCP(page_before);
}

}  // namespace

std::vector<std::string> Arguments(int /*argc*/, char** /*argv*/) {
  // Those of main() are in the code page of the system.
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
