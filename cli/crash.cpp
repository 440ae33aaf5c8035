#include "cli/crash.h"

#include <array>
#include <csignal>
#include <cstring>
#include <string_view>
#include <unistd.h>

#include "cli/exit_status.h"
#include "cli/version.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define ECAUDIT_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define ECAUDIT_SANITIZED 1
#endif
#endif

namespace ecaudit::cli {
namespace {

constexpr std::array kCrashes{SIGSEGV, SIGBUS, SIGILL, SIGFPE, SIGABRT};
#ifdef ECAUDIT_SANITIZED
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif

std::atomic<FrameNo> reached = 0;
/// Recursion without end leaves no room on the stack at hand.
std::array<char, 1U << 16U> handler_stack;

// Only what a signal handler may call: no allocation, no stdio.

void Put(std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(STDERR_FILENO, text.data(), text.size());
    if (written <= 0) return;
    text.remove_prefix(static_cast<std::size_t>(written));
  }
}

void PutNumber(std::uint64_t number) {
  std::array<char, 20> digits{};
  std::size_t at = digits.size();
  do {
    digits[--at] = static_cast<char>('0' + number % 10);
    number /= 10;
  } while (number != 0);
  Put({digits.data() + at, digits.size() - at});
}

void OnCrash(int signal_number) {
  Put("ecaudit: internal error: ecaudit ");
  Put(Version());
  Put(" was ended by signal ");
  PutNumber(static_cast<std::uint64_t>(signal_number));
  if (const FrameNo frame = reached.load(std::memory_order_relaxed); frame != 0) {
    Put(" at packet ");
    PutNumber(frame);
  }
  Put("; ");
  Put(kPleaseReport);
  Put("\n");
  ::_exit(static_cast<int>(ExitStatus::kInternal));
}

}  // namespace

std::atomic<FrameNo>& ReachedFrame() {
  return reached;
}

void ListenForCrashes() {
  if (kSanitized) return;
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
  if (kSanitized) return;
  for (const int signal_number : kCrashes) std::signal(signal_number, SIG_DFL);
}

std::string DescribeCrash(int signal_number, FrameNo frame) {
  const char* name = ::strsignal(signal_number);
  std::string text = "ecaudit " + std::string(Version()) + " was ended by signal " + std::to_string(signal_number);
  if (name != nullptr) text += " (" + std::string(name) + ")";
  if (frame != 0) text += " at packet " + std::to_string(frame);
  return text;
}

}  // namespace ecaudit::cli
