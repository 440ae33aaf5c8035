/// The files that people write and hand on: configuration and baseline. Input: one byte (0 configuration, 1 baseline),
/// then the text.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <sys/mman.h>
#include <unistd.h>

#include "cli/baseline.h"
#include "cli/config.h"
#include "cli/report/fingerprint.h"
#include "decoder/base/text.h"

namespace {

void Check(bool condition) {
  if (!condition) std::abort();
}

/// A file in memory, under a name that can be opened.
class MemoryFile {
 public:
  MemoryFile(const std::uint8_t* data, std::size_t size) : fd_(memfd_create("settings", MFD_CLOEXEC)) {
    Check(fd_ >= 0);
    Check(write(fd_, data, size) == static_cast<ssize_t>(size));
  }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  ~MemoryFile() { close(fd_); }
  [[nodiscard]] std::string path() const { return "/proc/self/fd/" + std::to_string(fd_); }

 private:
  int fd_;
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace ecaudit::cli;
  if (size == 0) return 0;
  const MemoryFile file(data + 1, size - 1);
  if (data[0] % 2 == 0) {
    const auto config = ReadConfig(file.path());
    Check(config || !config.error().message.empty());
    if (config) {
      for (const auto& [name, limit] : config->limits) Check(limit >= 0);
    }
    return 0;
  }
  const auto baseline = ReadBaseline(file.path());
  Check(baseline || !baseline.error().message.empty());
  if (baseline) {
    // What is read and written again is the same.
    for (const Fingerprint& known : *baseline) {
      Check(ecaudit::report::WithoutCounts(ecaudit::report::WithoutCounts(known.title)) ==
            ecaudit::report::WithoutCounts(known.title));
    }
  }
  return 0;
}
