#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <poll.h>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>

#include "decoder/base/system/files.h"

namespace ecaudit::system {
namespace {

FileKind KindOf(mode_t mode) {
  if (S_ISREG(mode)) return FileKind::kRegular;
  if (S_ISDIR(mode)) return FileKind::kFolder;
  if (S_ISLNK(mode)) return FileKind::kLink;
  return S_ISBLK(mode) ? FileKind::kBlockDevice : FileKind::kOther;
}

std::optional<FileStatus> Converted(bool known, const struct stat& info) {
  if (!known) return std::nullopt;
  FileStatus status;
  status.kind = KindOf(info.st_mode);
  status.bytes = static_cast<std::uint64_t>(info.st_size);
  status.modified_ns = static_cast<std::int64_t>(info.st_mtim.tv_sec) * 1'000'000'000 + info.st_mtim.tv_nsec;
  status.node = {info.st_dev, info.st_ino};
  status.foreign = info.st_uid != ::geteuid() && info.st_uid != 0;
  status.writable_by_all = (info.st_mode & S_IWOTH) != 0;
  status.permissions = info.st_mode & 0777U;
  return status;
}

}  // namespace

std::optional<FileStatus> StatusOf(const std::string& path) {
  struct stat info {};
  return Converted(::stat(path.c_str(), &info) == 0, info);
}

std::optional<FileStatus> StatusOfLink(const std::string& path) {
  struct stat info {};
  return Converted(::lstat(path.c_str(), &info) == 0, info);
}

std::optional<FileStatus> StatusOf(int fd) {
  struct stat info {};
  return Converted(::fstat(fd, &info) == 0, info);
}

bool Exists(const std::string& path) {
  return StatusOf(path).has_value();
}

bool IsFile(const std::string& path) {
  const auto status = StatusOf(path);
  return status && status->kind == FileKind::kRegular;
}

bool IsFolder(const std::string& path) {
  const auto status = StatusOf(path);
  return status && status->kind == FileKind::kFolder;
}

std::optional<std::vector<std::string>> NamesIn(const std::string& folder) {
  std::vector<std::string> names;
  std::error_code code;
  std::filesystem::directory_iterator entry(folder, code);
  for (; !code && entry != std::filesystem::directory_iterator(); entry.increment(code)) {
    names.push_back(entry->path().filename().string());
  }
  if (code) {
    errno = code.value();
    return std::nullopt;
  }
  std::sort(names.begin(), names.end());
  return names;
}

bool MakeFolders(const std::string& path) {
  std::error_code code;
  std::filesystem::create_directories(path, code);
  if (!code && !IsFolder(path)) code = std::make_error_code(std::errc::not_a_directory);
  if (code) errno = code.value();
  return !code;
}

int OpenToRead(const std::string& path, Open open) {
  const bool at_once = open == Open::kAtOnce;
  const int fd = ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY | (at_once ? O_NONBLOCK : 0));
  if (fd >= 0 && at_once) ::fcntl(fd, F_SETFL, ::fcntl(fd, F_GETFL) & ~O_NONBLOCK);
  return fd;
}

int OpenToWrite(const std::string& path) {
  return ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
}

bool Close(int fd) {
  return ::close(fd) == 0;
}

std::ptrdiff_t Read(int fd, std::span<std::uint8_t> out) {
  ssize_t got = 0;
  do {
    got = ::read(fd, out.data(), out.size());
  } while (got < 0 && errno == EINTR);
  return got;
}

bool WriteAll(int fd, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(fd, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

bool Rewind(int fd) {
  return ::lseek(fd, 0, SEEK_SET) == 0;
}

bool WaitForBytes(int fd, int ms) {
  pollfd waiting{fd, POLLIN, 0};
  return (::poll(&waiting, 1, ms) != 0 && errno != EINTR) || waiting.revents != 0;
}

int MakeTemporary(std::string& name) {
  return ::mkostemp(name.data(), O_CLOEXEC);
}

Nameless MakeNameless() {
  std::error_code error;
  const std::filesystem::path folder = std::filesystem::temp_directory_path(error);
  if (error) {
    errno = error.value();
    return {-1, "the folder of temporary files"};
  }
  std::string name = (folder / "ecaudit-XXXXXX").string();
  const int fd = MakeTemporary(name);
  if (fd < 0) return {-1, name};
  ::unlink(name.c_str());
  return {fd, "/dev/fd/" + std::to_string(fd)};
}

bool SetPermissions(int fd, unsigned permissions) {
  return ::fchmod(fd, permissions) == 0;
}

unsigned NewFilePermissions() {
  // Asking for the mask sets it for a moment: once is enough.
  static const mode_t mask = [] {
    const mode_t current = ::umask(0);
    ::umask(current);
    return current;
  }();
  return 0666U & ~mask;
}

bool Sync(int fd) {
  return ::fsync(fd) == 0 || errno == EINVAL || errno == ENOSYS;
}

void SyncName(const std::string& path) {
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  const int fd = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_CLOEXEC | O_DIRECTORY);
  if (fd < 0) return;
  ::fsync(fd);
  ::close(fd);
}

bool MoveOver(const std::string& from, const std::string& to) {
  return ::rename(from.c_str(), to.c_str()) == 0;
}

void Remove(const std::string& path) {
  ::unlink(path.c_str());
}

std::string ReasonText(int reason) {
  return std::strerror(reason);
}

}  // namespace ecaudit::system
