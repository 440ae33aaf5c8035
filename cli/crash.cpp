#include "cli/crash.h"

#include <array>
#include <span>
#include <string_view>

#include "cli/exit_status.h"
#include "cli/version.h"
#include "decoder/base/system/signals.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define ECAUDIT_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define ECAUDIT_SANITIZED 1
#endif
#endif

namespace ecaudit::cli {
namespace {

#ifdef ECAUDIT_SANITIZED
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif

std::atomic<FrameNo> reached = 0;
// Only what a signal handler may call: no allocation, no stdio.

/// Into `room`, at its end.
std::string_view Digits(std::uint64_t number, unsigned base, std::span<char> room) {
  std::size_t at = room.size();
  do {
    room[--at] = "0123456789abcdef"[number % base];
    number /= base;
  } while (number != 0 && at > 0);
  return {room.data() + at, room.size() - at};
}

void OnCrash(unsigned number) {
  std::array<char, 20> digits{};
  system::WriteToStandardError("ecaudit: internal error: ecaudit ");
  system::WriteToStandardError(Version());
  system::WriteToStandardError(" was ended by ");
  system::WriteToStandardError(system::CrashWord());
  system::WriteToStandardError(Digits(number, system::CrashBase(), digits));
  if (const FrameNo frame = reached.load(std::memory_order_relaxed); frame != 0) {
    system::WriteToStandardError(" at packet ");
    system::WriteToStandardError(Digits(frame, 10, digits));
  }
  system::WriteToStandardError("; ");
  system::WriteToStandardError(kPleaseReport);
  system::WriteToStandardError("\n");
  system::EndAtOnce(static_cast<int>(ExitStatus::kInternal));
}

}  // namespace

std::atomic<FrameNo>& ReachedFrame() {
  return reached;
}

void ListenForCrashes() {
  if (!kSanitized) system::ListenForCrashes(OnCrash);
}

void LeaveCrashesAlone() {
  if (!kSanitized) system::LeaveCrashesAlone();
}

std::string DescribeCrash(unsigned number, FrameNo frame) {
  const std::string name = system::CrashName(number);
  std::array<char, 20> digits{};
  std::string text = "ecaudit " + std::string(Version()) + " was ended by ";
  text.append(system::CrashWord()).append(Digits(number, system::CrashBase(), digits));
  if (!name.empty()) text += " (" + name + ")";
  if (frame != 0) text += " at packet " + std::to_string(frame);
  return text;
}

}  // namespace ecaudit::cli
