#include <cerrno>
#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include "decoder/base/system/locks.h"

namespace ecaudit::system {

FolderHold::FolderHold(const std::string& folder)
    : folder_(folder), handle_(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {}

FolderHold::~FolderHold() {
  if (handle_ >= 0) ::close(static_cast<int>(handle_));
}

FolderHold::Outcome FolderHold::TryAlone() {
  if (handle_ < 0) return Outcome::kUnknown;
  if (::flock(static_cast<int>(handle_), LOCK_EX | LOCK_NB) == 0) return Outcome::kAlone;
  return errno == EWOULDBLOCK ? Outcome::kOthers : Outcome::kUnknown;
}

void FolderHold::Share() {
  while (handle_ >= 0 && ::flock(static_cast<int>(handle_), LOCK_SH) != 0 && errno == EINTR) {
  }
}

}  // namespace ecaudit::system
