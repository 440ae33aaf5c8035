#include <atomic>
#include <csignal>

#include "decoder/base/system/signals.h"
#include "decoder/base/system/windows_support.h"

namespace ecaudit::system {
namespace {

void (*interrupt_handler)() = nullptr;
void (*crash_handler)(unsigned) = nullptr;
std::atomic<bool> interrupted = false;

BOOL WINAPI OnConsole(DWORD event) {
  // A window that is closed, or a session that ends, leaves a few seconds: its request counts as the first.
  if (interrupted.exchange(true)) return FALSE;
  interrupt_handler();
  if (event == CTRL_C_EVENT || event == CTRL_BREAK_EVENT) return TRUE;
  // Windows ends the program as soon as this function returns.
  ::Sleep(INFINITE);
  return TRUE;
}

LONG WINAPI OnException(EXCEPTION_POINTERS* exception) {
  crash_handler(exception->ExceptionRecord->ExceptionCode);
  return EXCEPTION_EXECUTE_HANDLER;
}

/// The number of the exception becomes the exit status. Left to Windows, a debugger or a dialog would come in between.
LONG WINAPI EndWithException(EXCEPTION_POINTERS* exception) {
  ::TerminateProcess(::GetCurrentProcess(), exception->ExceptionRecord->ExceptionCode);
  return EXCEPTION_EXECUTE_HANDLER;
}

void OnAbort(int /*signal_number*/) {
  constexpr unsigned kAbort = 0xC0000409;
  if (crash_handler != nullptr) crash_handler(kAbort);
  ::TerminateProcess(::GetCurrentProcess(), kAbort);
}

}  // namespace

void ListenForInterrupt(void (*handler)()) {
  interrupt_handler = handler;
  interrupted = false;
  ::SetConsoleCtrlHandler(OnConsole, TRUE);
}

void ListenForCrashes(void (*handler)(unsigned)) {
  crash_handler = handler;
  // Recursion without end leaves no room on the stack at hand.
  ULONG reserve = 1UL << 16U;
  ::SetThreadStackGuarantee(&reserve);
  ::SetErrorMode(SEM_FAILCRITICALERRORS | SEM_NOGPFAULTERRORBOX);
  ::SetUnhandledExceptionFilter(OnException);
  std::signal(SIGABRT, OnAbort);
}

void LeaveCrashesAlone() {
  crash_handler = nullptr;
  ::SetUnhandledExceptionFilter(EndWithException);
}

std::string_view CrashWord() {
  return "exception 0x";
}

unsigned CrashBase() {
  return 16;
}

std::string CrashName(unsigned number) {
  switch (number) {
    case EXCEPTION_ACCESS_VIOLATION:
      return "access violation";
    case EXCEPTION_STACK_OVERFLOW:
      return "stack overflow";
    case EXCEPTION_ILLEGAL_INSTRUCTION:
      return "illegal instruction";
    case EXCEPTION_INT_DIVIDE_BY_ZERO:
      return "division by zero";
    case 0xC0000409:
      return "aborted";
    default:
      return {};
  }
}

void WriteToStandardError(std::string_view text) {
  DWORD written = 0;
  ::WriteFile(::GetStdHandle(STD_ERROR_HANDLE), text.data(), static_cast<DWORD>(text.size()), &written, nullptr);
}

void EndAtOnce(int status) {
  ::TerminateProcess(::GetCurrentProcess(), static_cast<UINT>(status));
  __builtin_unreachable();
}

}  // namespace ecaudit::system
