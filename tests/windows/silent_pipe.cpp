// silent_pipe FILE PROGRAM [ARGUMENT...]: the program reads FILE from a pipe of Windows, which then stays open and
// silent. wine gives a program the pipes of Linux as they are, and those cannot be asked whether a byte has come.
#include <cstdio>
#include <string>
#include <windows.h>

int wmain(int count, wchar_t** words) {
  if (count < 3) return 99;
  HANDLE from = nullptr;
  HANDLE to = nullptr;
  constexpr DWORD kRoom = 1U << 20U;
  std::FILE* const file = ::_wfopen(words[1], L"rb");
  if (file == nullptr || ::CreatePipe(&from, &to, nullptr, kRoom) == 0) return 99;
  ::SetHandleInformation(from, HANDLE_FLAG_INHERIT, HANDLE_FLAG_INHERIT);

  std::wstring line;
  for (int i = 2; i < count; ++i) line += (i > 2 ? L" \"" : L"\"") + std::wstring(words[i]) + L"\"";
  STARTUPINFOW start{};
  start.cb = sizeof start;
  start.dwFlags = STARTF_USESTDHANDLES;
  start.hStdInput = from;
  start.hStdOutput = ::GetStdHandle(STD_OUTPUT_HANDLE);
  start.hStdError = ::GetStdHandle(STD_ERROR_HANDLE);
  PROCESS_INFORMATION program{};
  if (::CreateProcessW(nullptr, line.data(), nullptr, nullptr, TRUE, 0, nullptr, nullptr, &start, &program) == 0)
    return 99;

  char bytes[4096];
  for (std::size_t got = 0; (got = std::fread(bytes, 1, sizeof bytes, file)) > 0;) {
    DWORD written = 0;
    ::WriteFile(to, bytes, static_cast<DWORD>(got), &written, nullptr);
  }
  DWORD left = 1;
  while (left > 0 && ::PeekNamedPipe(from, nullptr, 0, nullptr, &left, nullptr) != 0) ::Sleep(10);
  std::puts("read");
  std::fflush(stdout);
  ::WaitForSingleObject(program.hProcess, INFINITE);
  DWORD status = 0;
  ::GetExitCodeProcess(program.hProcess, &status);
  return static_cast<int>(status);
}
