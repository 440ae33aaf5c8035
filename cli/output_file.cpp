#include "cli/output_file.h"

#include <array>
#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <system_error>
#include <utility>

#include "decoder/base/system/files.h"
#include "decoder/capture/capture_reader.h"

namespace ecaudit::cli {
namespace {

namespace fs = std::filesystem;

using system::FileKind;
using system::FileStatus;

Error CannotWrite(const std::string& path, int reason) {
  return Error{"cannot write " + path + ": " + system::ReasonText(reason)};
}

/// First bytes of pcap (all byte orders and resolutions) and pcapng files, of gzip and of zstd.
enum class Magic { kOther, kCapture, kCompressed };

Magic ReadMagic(const std::string& path) {
  std::array<std::uint8_t, 4> bytes{};
  const int fd = system::OpenToRead(path);
  if (fd < 0) return Magic::kOther;
  const std::ptrdiff_t n = system::Read(fd, bytes);
  system::Close(fd);
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

/// A link on the way to the file that another user made: the user did not choose its target.
std::optional<Error> ForeignLink(const std::string& path) {
  constexpr int kMostLinks = 40;
  fs::path at = path;
  std::error_code code;
  for (int i = 0; i < kMostLinks; ++i) {
    const std::optional<FileStatus> link = system::StatusOfLink(at.string());
    if (!link || link->kind != FileKind::kLink) return std::nullopt;
    if (link->foreign) return Error{"cannot write " + path + ": it is a link that another user made"};
    const fs::path target = fs::read_symlink(at, code);
    if (code) return std::nullopt;
    at = target.is_absolute() ? target : at.parent_path() / target;
  }
  return std::nullopt;
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
  const bool follow = links == Links::kFollow;
  if (follow) {
    if (auto error = ForeignLink(path)) return error;
  }
  if (const auto status = follow ? system::StatusOf(path) : system::StatusOfLink(path)) {
    if (status->kind == FileKind::kFolder) return Error{"cannot write " + path + ": it is a directory"};
    if (status->kind == FileKind::kRegular && IsCapture(path)) {
      return Error{path + " is a capture and will not be overwritten; name another output file"};
    }
    return std::nullopt;
  }
  const std::string folder = fs::path(ResolveLinks(path)).parent_path().string();
  if (!folder.empty() && !system::IsFolder(folder)) {
    return Error{"cannot write " + path + ": there is no directory " + folder};
  }
  return std::nullopt;
}

Result<OutputFile> OutputFile::Create(const std::string& path, Links links) {
  OutputFile file;
  file.path_ = path;
  const bool follow = links == Links::kFollow;
  if (follow) {
    if (auto error = ForeignLink(path)) return *error;
  }
  const std::optional<FileStatus> status = follow ? system::StatusOf(path) : system::StatusOfLink(path);
  const bool regular = status && status->kind == FileKind::kRegular;
  if (follow && status && !regular) {
    file.fd_ = system::OpenToWrite(path);
    if (file.fd_ < 0) return CannotWrite(path, errno);
    return file;
  }
  // The file itself, not a link to it, is replaced.
  std::error_code ignored;
  const fs::path resolved = !follow   ? fs::path()
                            : regular ? fs::canonical(path, ignored)
                                      : fs::path(ResolveLinks(path));
  file.target_ = resolved.empty() ? path : resolved.string();
  file.mode_ = regular ? status->permissions : system::NewFilePermissions();
  std::string temporary = file.target_ + ".XXXXXX";
  file.fd_ = system::MakeTemporary(temporary);
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
  if (fd_ >= 0) system::Close(fd_);
  fd_ = -1;
  if (!temporary_.empty()) system::Remove(temporary_);
  temporary_.clear();
}

std::optional<Error> OutputFile::Write(std::string_view content) {
  if (!system::WriteAll(fd_, content)) return CannotWrite(path_, errno);
  return std::nullopt;
}

std::optional<Error> OutputFile::Finish() {
  std::optional<Error> error;
  const bool direct = temporary_.empty();
  if (!direct && !system::SetPermissions(fd_, mode_)) error = CannotWrite(path_, errno);
  // A name that the disk has and content that it has not would be half a report after a loss of power.
  if (!direct && !error && !system::Sync(fd_)) error = CannotWrite(path_, errno);
  if (!system::Close(std::exchange(fd_, -1)) && !error) error = CannotWrite(path_, errno);
  if (!direct && !error) {
    if (!system::MoveOver(temporary_, target_)) {
      error = CannotWrite(path_, errno);
    } else {
      temporary_.clear();
      system::SyncName(target_);
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
