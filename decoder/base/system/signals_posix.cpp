#include <array>
#include <csignal>
#include <cstring>
#include <unistd.h>

#include "decoder/base/system/signals.h"

namespace ecaudit::system {
namespace {

constexpr std::array kCrashes{SIGSEGV, SIGBUS, SIGILL, SIGFPE, SIGABRT};

void (*interrupt_handler)() = nullptr;
void (*crash_handler)(unsigned) = nullptr;
/// Recursion without end leaves no room on the stack at hand.
std::array<char, 1U << 16U> handler_stack;

void OnInterrupt(int signal_number) {
  interrupt_handler();
  std::signal(signal_number, SIG_DFL);
}

void OnCrash(int signal_number) {
  crash_handler(static_cast<unsigned>(signal_number));
}

}  // namespace

void ListenForInterrupt(void (*handler)()) {
  interrupt_handler = handler;
  std::signal(SIGINT, OnInterrupt);
  std::signal(SIGTERM, OnInterrupt);
}

void ListenForCrashes(void (*handler)(unsigned)) {
  crash_handler = handler;
  stack_t stack{};
  stack.ss_sp = handler_stack.data();
  stack.ss_size = handler_stack.size();
  ::sigaltstack(&stack, nullptr);
  struct sigaction action {};
  action.sa_handler = OnCrash;
  action.sa_flags = SA_ONSTACK | static_cast<int>(SA_RESETHAND);
  for (const int signal_number : kCrashes) ::sigaction(signal_number, &action, nullptr);
}

void LeaveCrashesAlone() {
  for (const int signal_number : kCrashes) std::signal(signal_number, SIG_DFL);
}

std::string_view CrashWord() {
  return "signal ";
}

unsigned CrashBase() {
  return 10;
}

std::string CrashName(unsigned number) {
  const char* name = ::strsignal(static_cast<int>(number));
  return name == nullptr ? std::string() : std::string(name);
}

void WriteToStandardError(std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(STDERR_FILENO, text.data(), text.size());
    if (written <= 0) return;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
}

void EndAtOnce(int status) {
  ::_exit(status);
}

}  // namespace ecaudit::system
