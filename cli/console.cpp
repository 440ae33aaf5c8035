#include "cli/console.h"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <sys/ioctl.h>
#include <unistd.h>

#include "cli/report/layout.h"

namespace ecaudit::cli {
namespace {

bool IsTerminal(std::FILE* stream) {
  return isatty(fileno(stream)) == 1;
}

/// no-color.org: any value but the empty one switches colours off.
bool ColorForbidden() {
  const char* no_color = std::getenv("NO_COLOR");
  const char* term = std::getenv("TERM");
  return (no_color != nullptr && *no_color != '\0') || (term != nullptr && std::strcmp(term, "dumb") == 0);
}

}  // namespace

Console::Console(std::FILE* out, std::FILE* err)
    : out_(out),
      err_(err),
      color_(IsTerminal(out) && !ColorForbidden()),
      output_is_terminal_(IsTerminal(out)),
      error_is_terminal_(IsTerminal(err)) {}

std::optional<std::size_t> Console::width() const {
  // Narrower than this nothing reads well; wider, the eye loses the line.
  constexpr std::size_t kLeast = 40;
  constexpr std::size_t kMost = 120;
  winsize size{};
  if (!output_is_terminal_ || ioctl(fileno(out_), TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return std::nullopt;
  return std::clamp<std::size_t>(size.ws_col, kLeast, kMost);
}

void Console::Error(std::string_view message) {
  const std::string line = "ecaudit: " + report::OneLine(message) + "\n";
  std::fwrite(line.data(), 1, line.size(), err_);
  std::fflush(err_);
}

void Console::Warning(std::string_view message) {
  Error("warning: " + std::string(message));
}

std::optional<ecaudit::Error> Console::Write(std::string_view text) {
  const bool written = std::fwrite(text.data(), 1, text.size(), out_) == text.size();
  if (written && std::fflush(out_) == 0) return std::nullopt;
  const int reason = errno;
  std::clearerr(out_);
  if (reason == EPIPE) {
    reader_gone_ = true;
    return std::nullopt;
  }
  return ecaudit::Error{std::string("cannot write to standard output: ") + std::strerror(reason)};
}

ExitStatus Fail(Console& console, const ecaudit::Error& error) {
  console.Error(error.message);
  return ExitStatus::kUsage;
}

}  // namespace ecaudit::cli
