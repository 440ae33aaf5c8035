/// Standard output carries the result only, standard error everything else.
#pragma once

#include <cstddef>
#include <cstdio>
#include <optional>
#include <string_view>

#include "cli/exit_status.h"
#include "decoder/base/result.h"

namespace ecaudit::cli {

class Console {
 public:
  /// @param out, err  streams that outlive the console
  Console(std::FILE* out, std::FILE* err);

  /// "ecaudit: MESSAGE" as one line on standard error; `message` may hold untrusted text.
  void Error(std::string_view message);
  /// "ecaudit: warning: MESSAGE"
  void Warning(std::string_view message);

  /// Writes `text` to standard output. A reader that has gone (closed pipe) is no error; a full disk is.
  [[nodiscard]] std::optional<ecaudit::Error> Write(std::string_view text);

  /// The reader of standard output has gone: what is written there from now on is lost.
  [[nodiscard]] bool reader_gone() const { return reader_gone_; }

  /// Colours are wanted on standard output: it is a terminal, and neither NO_COLOR nor TERM=dumb forbids them.
  [[nodiscard]] bool color() const { return color_; }
  /// Columns of the terminal that standard output is, within reason; nothing where it is none.
  [[nodiscard]] std::optional<std::size_t> width() const;
  /// Standard output is a terminal: a person waits for each line.
  [[nodiscard]] bool output_is_terminal() const { return output_is_terminal_; }
  /// Standard error is a terminal that understands escape sequences, so progress may be shown there.
  [[nodiscard]] bool error_is_terminal() const { return error_is_terminal_; }
  [[nodiscard]] std::FILE* error_stream() const { return err_; }

 private:
  std::FILE* out_;
  std::FILE* err_;
  bool color_;
  bool output_is_terminal_;
  bool error_is_terminal_;
  bool reader_gone_ = false;
};

/// Reports why the command cannot do what was asked. @return ExitStatus::kUsage
[[nodiscard]] ExitStatus Fail(Console& console, const ecaudit::Error& error);

}  // namespace ecaudit::cli
