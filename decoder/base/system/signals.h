/// Requests to end, and the ends that a program does not choose.
#pragma once

#include <string>
#include <string_view>

namespace ecaudit::system {

/// From now on the first Ctrl-C (or SIGTERM) calls `handler`, the second one ends the program. `handler` may set
/// atomic variables and nothing else.
void ListenForInterrupt(void (*handler)());

/// From now on a crash calls `handler` with its number. It may call WriteToStandardError() and EndAtOnce().
void ListenForCrashes(void (*handler)(unsigned number));
/// Ends what ListenForCrashes() began: the parent process sees the crash.
void LeaveCrashesAlone();
/// What stands before the number of a crash ("signal "), and its base.
[[nodiscard]] std::string_view CrashWord();
[[nodiscard]] unsigned CrashBase();
/// "Segmentation fault"; empty where there is no name.
[[nodiscard]] std::string CrashName(unsigned number);

// Without allocation and without streams.
void WriteToStandardError(std::string_view text);
[[noreturn]] void EndAtOnce(int status);

}  // namespace ecaudit::system
