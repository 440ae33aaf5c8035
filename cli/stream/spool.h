/// A capture that can be read twice: what comes from a pipe is kept in a temporary file.
#pragma once

#include <memory>
#include <string>

#include "decoder/base/result.h"

namespace ecaudit::cli {

class Spool {
 public:
  /// Reads `path` ("-": standard input) to its end, or to the interrupt signal, into a file without a name.
  [[nodiscard]] static Result<std::unique_ptr<Spool>> Read(const std::string& path);
  /// False for standard input, pipes and the like.
  [[nodiscard]] static bool CanBeReadTwice(const std::string& path);

  Spool(const Spool&) = delete;
  Spool& operator=(const Spool&) = delete;
  ~Spool();

  /// Where the file can be opened while this lives.
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  explicit Spool(int fd);

  int fd_;
  std::string path_;
};

}  // namespace ecaudit::cli
