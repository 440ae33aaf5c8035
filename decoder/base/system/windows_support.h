/// For the files *_windows.cpp alone: Windows' own texts, paths and reasons.
#pragma once

#ifndef WIN32_LEAN_AND_MEAN
#define WIN32_LEAN_AND_MEAN
#endif
#ifndef NOMINMAX
#define NOMINMAX
#endif
#include <string>
#include <string_view>
#include <windows.h>

namespace ecaudit::system {

/// UTF-8 as UTF-16, and the other way round. What is not valid becomes U+FFFD.
[[nodiscard]] std::wstring Wide(std::string_view text);
[[nodiscard]] std::string Narrow(std::wstring_view text);
/// A path that may be longer than 260 characters.
[[nodiscard]] std::wstring WidePath(const std::string& path);
/// Sets errno from GetLastError(), for functions that return what POSIX would.
void SetReason();

}  // namespace ecaudit::system
