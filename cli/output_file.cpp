#include "cli/output_file.h"

#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <sys/stat.h>
#include <system_error>
#include <unistd.h>
#include <utility>

#include "decoder/capture/capture_reader.h"

namespace ecaudit::cli {
namespace {

namespace fs = std::filesystem;

Error CannotWrite(const std::string& path, int reason) {
  return Error{"cannot write " + path + ": " + std::strerror(reason)};
}

/// First bytes of pcap (all byte orders and resolutions) and pcapng files, of gzip and of zstd.
enum class Magic { kOther, kCapture, kCompressed };

Magic ReadMagic(const std::string& path) {
  std::array<std::uint8_t, 4> bytes{};
  const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (fd < 0) return Magic::kOther;
  const ssize_t n = read(fd, bytes.data(), bytes.size());
  close(fd);
  if (n >= 2 && bytes[0] == 0x1F && bytes[1] == 0x8B) return Magic::kCompressed;
  if (n < 4) return Magic::kOther;
  const std::uint32_t big = static_cast<std::uint32_t>(bytes[0]) << 24U | static_cast<std::uint32_t>(bytes[1]) << 16U |
                            static_cast<std::uint32_t>(bytes[2]) << 8U | bytes[3];
  switch (big) {
    case 0xA1B2C3D4:
    case 0xD4C3B2A1:
    case 0xA1B23C4D:
    case 0x4D3CB2A1:
    case 0xA1B2CD34:  // pcap with the fields of Kuznetzov's patch
    case 0x34CDB2A1:
    case 0x0A0D0D0A:  // pcapng
      return Magic::kCapture;
    case 0x28B52FFD:
      return Magic::kCompressed;
    default:
      return Magic::kOther;
  }
}

bool IsCapture(const std::string& path) {
  switch (ReadMagic(path)) {
    case Magic::kCapture:
      return true;
    case Magic::kCompressed:
      return capture::OpenCapture(path).has_value();
    case Magic::kOther:
      break;
  }
  return false;
}

std::optional<Error> WriteAll(int fd, std::string_view content, const std::string& path) {
  while (!content.empty()) {
    const ssize_t n = write(fd, content.data(), content.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return CannotWrite(path, errno);
    content.remove_prefix(static_cast<std::size_t>(n));
  }
  return std::nullopt;
}

/// A link on the way to the file that another user made: the user did not choose its target.
std::optional<Error> ForeignLink(const std::string& path) {
  constexpr int kMostLinks = 40;
  fs::path at = path;
  std::error_code code;
  for (int i = 0; i < kMostLinks; ++i) {
    struct stat info {};
    if (lstat(at.c_str(), &info) != 0 || !S_ISLNK(info.st_mode)) return std::nullopt;
    if (info.st_uid != geteuid() && info.st_uid != 0) {
      return Error{"cannot write " + path + ": it is a link that another user made"};
    }
    const fs::path target = fs::read_symlink(at, code);
    if (code) return std::nullopt;
    at = target.is_absolute() ? target : at.parent_path() / target;
  }
  return std::nullopt;
}

/// What stands in a folder is on the disk once the folder is. A file system that cannot do so has done what it can.
void SyncFolder(const std::string& file) {
  const fs::path folder = fs::path(file).parent_path();
  const int fd = open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_CLOEXEC | O_DIRECTORY);
  if (fd < 0) return;
  fsync(fd);
  close(fd);
}

/// Permissions a new file gets: as the old one had, else what the umask leaves.
mode_t ModeFor(const struct stat* existing) {
  if (existing != nullptr) return existing->st_mode & 0777U;
  // Asking for the mask sets it for a moment: once is enough.
  static const mode_t mask = [] {
    const mode_t current = umask(0);
    umask(current);
    return current;
  }();
  return 0666U & ~mask;
}

}  // namespace

std::string ResolveLinks(const std::string& path) {
  constexpr int kMostLinks = 40;  // as the kernel
  fs::path resolved = path;
  std::error_code code;
  for (int i = 0; i < kMostLinks && fs::is_symlink(resolved, code); ++i) {
    const fs::path target = fs::read_symlink(resolved, code);
    if (code) break;
    resolved = target.is_absolute() ? target : resolved.parent_path() / target;
  }
  return resolved.string();
}

std::optional<Error> CheckOutputPath(const std::string& path, Links links) {
  if (path.empty()) return Error{"the name of an output file is empty"};
  if (path == "-") return Error{"a file is needed here, - is standard output; a file of that name is ./-"};
  struct stat info {};
  const bool follow = links == Links::kFollow;
  if (follow) {
    if (auto error = ForeignLink(path)) return error;
  }
  if ((follow ? stat(path.c_str(), &info) : lstat(path.c_str(), &info)) == 0) {
    if (S_ISDIR(info.st_mode)) return Error{"cannot write " + path + ": it is a directory"};
    if (S_ISREG(info.st_mode) && IsCapture(path)) {
      return Error{path + " is a capture and will not be overwritten; name another output file"};
    }
    return std::nullopt;
  }
  const fs::path folder = fs::path(ResolveLinks(path)).parent_path();
  std::error_code ignored;
  if (!folder.empty() && !fs::is_directory(folder, ignored)) {
    return Error{"cannot write " + path + ": there is no directory " + folder.string()};
  }
  return std::nullopt;
}

Result<OutputFile> OutputFile::Create(const std::string& path, Links links) {
  OutputFile file;
  file.path_ = path;
  struct stat info {};
  const bool follow = links == Links::kFollow;
  if (follow) {
    if (auto error = ForeignLink(path)) return *error;
  }
  const bool exists =
      follow ? stat(path.c_str(), &info) == 0 : lstat(path.c_str(), &info) == 0 && S_ISREG(info.st_mode);
  if (exists && !S_ISREG(info.st_mode)) {
    file.fd_ = open(path.c_str(), O_WRONLY | O_CLOEXEC);
    if (file.fd_ < 0) return CannotWrite(path, errno);
    return file;
  }
  // The file itself, not a link to it, is replaced.
  std::error_code ignored;
  const fs::path resolved = !follow ? fs::path() : exists ? fs::canonical(path, ignored) : fs::path(ResolveLinks(path));
  file.target_ = resolved.empty() ? path : resolved.string();
  file.mode_ = ModeFor(exists ? &info : nullptr);
  std::string temporary = file.target_ + ".XXXXXX";
  file.fd_ = mkostemp(temporary.data(), O_CLOEXEC);
  if (file.fd_ < 0) return CannotWrite(path, errno);
  file.temporary_ = std::move(temporary);
  return file;
}

OutputFile::OutputFile(OutputFile&& other) noexcept {
  *this = std::move(other);
}

OutputFile& OutputFile::operator=(OutputFile&& other) noexcept {
  if (this == &other) return *this;
  Discard();
  fd_ = std::exchange(other.fd_, -1);
  path_ = std::move(other.path_);
  target_ = std::move(other.target_);
  temporary_ = std::exchange(other.temporary_, {});
  mode_ = other.mode_;
  return *this;
}

OutputFile::~OutputFile() {
  Discard();
}

void OutputFile::Discard() {
  if (fd_ >= 0) close(fd_);
  fd_ = -1;
  if (!temporary_.empty()) unlink(temporary_.c_str());
  temporary_.clear();
}

std::optional<Error> OutputFile::Write(std::string_view content) {
  return WriteAll(fd_, content, path_);
}

std::optional<Error> OutputFile::Finish() {
  std::optional<Error> error;
  const bool direct = temporary_.empty();
  if (!direct && fchmod(fd_, mode_) != 0) error = CannotWrite(path_, errno);
  // A name that the disk has and content that it has not would be half a report after a loss of power.
  if (!direct && !error && fsync(fd_) != 0 && errno != EINVAL && errno != ENOSYS) error = CannotWrite(path_, errno);
  if (close(std::exchange(fd_, -1)) != 0 && !error) error = CannotWrite(path_, errno);
  if (!direct && !error) {
    if (rename(temporary_.c_str(), target_.c_str()) != 0) {
      error = CannotWrite(path_, errno);
    } else {
      temporary_.clear();
      SyncFolder(target_);
    }
  }
  Discard();
  return error;
}

std::optional<Error> WriteOutputFile(const std::string& path, std::string_view content, Links links) {
  Result<OutputFile> file = OutputFile::Create(path, links);
  if (!file) return file.error();
  if (auto error = file->Write(content)) return error;
  return file->Finish();
}

std::optional<Error> WriteOutputPieces(const std::string& path,
                                       const std::function<void(const report::TextSink&)>& write, Links links) {
  Result<OutputFile> file = OutputFile::Create(path, links);
  if (!file) return file.error();
  std::optional<Error> error;
  write([&](std::string_view piece) {
    if (!error) error = file->Write(piece);
  });
  return error ? error : file->Finish();
}

}  // namespace ecaudit::cli
