/// A bug that ends the program by a signal still ends it with one line that names the place, and with status 3.
#pragma once

#include <atomic>
#include <string>

#include "decoder/base/ids.h"

namespace ecaudit::cli {

/// Number of the packet at hand; 0 before the first one.
[[nodiscard]] std::atomic<FrameNo>& ReachedFrame();

/// From now on SIGSEGV and its like write that line and end the program with ExitStatus::kInternal. Sanitizers keep
/// their own reports.
void ListenForCrashes();
/// As if ListenForCrashes() had not been called: the parent process sees the signal.
void LeaveCrashesAlone();

/// "ecaudit 0.1.0 was ended by signal 11 (Segmentation fault) at packet 812"
[[nodiscard]] std::string DescribeCrash(unsigned number, FrameNo reached);
/// What a person is asked to do about an internal error.
inline constexpr const char* kPleaseReport =
    "please report it as docs/CONTRIBUTING.md describes, with this line, the output of 'ecaudit --version', the "
    "command line and, "
    "if you may share it, the capture ('ecaudit anonymize' takes names out)";

}  // namespace ecaudit::cli
