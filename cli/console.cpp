#include "cli/console.h"

#include <algorithm>
#include <cerrno>

#include "cli/report/layout.h"
#include "decoder/base/system/files.h"
#include "decoder/base/system/program.h"
#include "decoder/base/system/streams.h"

namespace ecaudit::cli {
namespace {

/// no-color.org: any value but the empty one switches colours off.
bool ColorForbidden() {
  return !system::Environment("NO_COLOR").empty() || system::Environment("TERM") == "dumb";
}

}  // namespace

Console::Console(std::FILE* out, std::FILE* err)
    : out_(out),
      err_(err),
      color_(!ColorForbidden() && system::ShowsColors(out)),
      output_is_terminal_(system::IsTerminal(out)),
      error_is_terminal_(system::ShowsColors(err)) {}

std::optional<std::size_t> Console::width() const {
  // Narrower than this nothing reads well; wider, the eye loses the line.
  constexpr std::size_t kLeast = 40;
  constexpr std::size_t kMost = 120;
  const std::optional<std::size_t> columns = output_is_terminal_ ? system::ColumnsOf(out_) : std::nullopt;
  return columns ? std::optional(std::clamp(*columns, kLeast, kMost)) : std::nullopt;
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
  if (system::ReaderHasGone(reason)) {
    reader_gone_ = true;
    return std::nullopt;
  }
  return ecaudit::Error{"cannot write to standard output: " + system::ReasonText(reason)};
}

ExitStatus Fail(Console& console, const ecaudit::Error& error) {
  console.Error(error.message);
  return ExitStatus::kUsage;
}

}  // namespace ecaudit::cli
