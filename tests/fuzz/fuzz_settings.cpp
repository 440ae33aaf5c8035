/// The files that people write and hand on: configuration and baseline. Input: one byte (0 configuration, 1 baseline),
/// then the text.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

#include "cli/baseline.h"
#include "cli/config.h"
#include "cli/report/fingerprint.h"
#include "tests/fuzz/memory_file.h"

namespace {

void Check(bool condition) {
  if (!condition) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace ecaudit::cli;
  if (size == 0) return 0;
  const ecaudit::fuzz::MemoryFile file(std::string_view(reinterpret_cast<const char*>(data) + 1, size - 1));
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
    for (const auto& [fingerprint, acceptance] : *baseline) {
      Check(acceptance.expires.empty() || acceptance.expires.size() == 10);
    }
  }
  return 0;
}
