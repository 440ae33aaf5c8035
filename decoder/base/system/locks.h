/// A folder that several programs write to.
#pragma once

#include <cstdint>
#include <string>

namespace ecaudit::system {

class FolderHold {
 public:
  explicit FolderHold(const std::string& folder);
  FolderHold(const FolderHold&) = delete;
  FolderHold& operator=(const FolderHold&) = delete;
  ~FolderHold();

  enum class Outcome : std::uint8_t { kAlone, kOthers, kUnknown };
  /// Tries to be the only holder; kUnknown where the system cannot do so.
  [[nodiscard]] Outcome TryAlone();
  /// From now on there may be others.
  void Share();

 private:
  std::string folder_;
  std::intptr_t handle_ = -1;
};

}  // namespace ecaudit::system
