#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <io.h>
#include <random>
#include <utility>

#include "decoder/base/system/files.h"
#include "decoder/base/system/windows_support.h"

namespace ecaudit::system {
namespace {

/// Files stay readable, writable and removable for other programs while they are open here.
constexpr DWORD kShareAll = FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE;

HANDLE HandleOf(int fd) {
  return reinterpret_cast<HANDLE>(::_get_osfhandle(fd));
}

/// 100 ns since 1601 to ns since 1970.
std::int64_t UnixNs(const FILETIME& time) {
  constexpr std::int64_t kUnixBegin = 116'444'736'000'000'000;
  const std::int64_t ticks = static_cast<std::int64_t>(time.dwHighDateTime) << 32 | time.dwLowDateTime;
  return (ticks - kUnixBegin) * 100;
}

std::optional<FileStatus> StatusOfHandle(HANDLE handle, bool as_link) {
  if (handle == INVALID_HANDLE_VALUE) return std::nullopt;
  FileStatus status;
  status.permissions = 0666;
  const DWORD type = ::GetFileType(handle);
  BY_HANDLE_FILE_INFORMATION info{};
  if (type != FILE_TYPE_DISK || ::GetFileInformationByHandle(handle, &info) == 0) {
    status.kind = FileKind::kOther;
    return status;
  }
  status.kind = (info.dwFileAttributes & FILE_ATTRIBUTE_DIRECTORY) != 0 ? FileKind::kFolder : FileKind::kRegular;
  if (as_link && (info.dwFileAttributes & FILE_ATTRIBUTE_REPARSE_POINT) != 0) {
    FILE_ATTRIBUTE_TAG_INFO tag{};
    if (::GetFileInformationByHandleEx(handle, FileAttributeTagInfo, &tag, sizeof(tag)) != 0 &&
        tag.ReparseTag == IO_REPARSE_TAG_SYMLINK) {
      status.kind = FileKind::kLink;
    }
  }
  status.bytes = static_cast<std::uint64_t>(info.nFileSizeHigh) << 32U | info.nFileSizeLow;
  status.modified_ns = UnixNs(info.ftLastWriteTime);
  status.node = {info.dwVolumeSerialNumber,
                 static_cast<std::uint64_t>(info.nFileIndexHigh) << 32U | info.nFileIndexLow};
  return status;
}

std::optional<FileStatus> StatusOfPath(const std::string& path, bool as_link) {
  // Folders open with BACKUP_SEMANTICS only.
  const DWORD flags = FILE_FLAG_BACKUP_SEMANTICS | (as_link ? FILE_FLAG_OPEN_REPARSE_POINT : 0);
  const HANDLE handle =
      ::CreateFileW(WidePath(path).c_str(), FILE_READ_ATTRIBUTES, kShareAll, nullptr, OPEN_EXISTING, flags, nullptr);
  if (handle == INVALID_HANDLE_VALUE) {
    SetReason();
    return std::nullopt;
  }
  const auto status = StatusOfHandle(handle, as_link);
  ::CloseHandle(handle);
  return status;
}

/// The descriptor of a handle, in binary mode; -1 with errno.
int DescriptorOf(HANDLE handle, int mode) {
  if (handle == INVALID_HANDLE_VALUE) {
    SetReason();
    return -1;
  }
  const int fd = ::_open_osfhandle(reinterpret_cast<std::intptr_t>(handle), mode | _O_BINARY | _O_NOINHERIT);
  if (fd < 0) ::CloseHandle(handle);
  return fd;
}

/// Makes a file under a name that is not taken; XXXXXX at its end become letters.
int MakeUnderNewName(std::string& name, DWORD flags) {
  constexpr std::string_view kLetters = "abcdefghijklmnopqrstuvwxyz0123456789";
  constexpr std::size_t kOwn = 6;
  constexpr int kTries = 100;
  std::random_device random;
  for (int i = 0; i < kTries; ++i) {
    for (std::size_t at = name.size() - kOwn; at < name.size(); ++at) name[at] = kLetters[random() % kLetters.size()];
    const HANDLE handle = ::CreateFileW(WidePath(name).c_str(), GENERIC_READ | GENERIC_WRITE | DELETE, kShareAll,
                                        nullptr, CREATE_NEW, flags, nullptr);
    if (handle != INVALID_HANDLE_VALUE || ::GetLastError() != ERROR_FILE_EXISTS) return DescriptorOf(handle, _O_RDWR);
  }
  errno = EEXIST;
  return -1;
}

/// Whether another program keeps the file from being replaced.
bool IsHeld(const std::wstring& path) {
  // An open file cannot be replaced, whatever its holder shares.
  const HANDLE handle = ::CreateFileW(path.c_str(), DELETE, 0, nullptr, OPEN_EXISTING, 0, nullptr);
  if (handle == INVALID_HANDLE_VALUE) return ::GetLastError() == ERROR_SHARING_VIOLATION;
  ::CloseHandle(handle);
  return false;
}

}  // namespace

std::optional<FileStatus> StatusOf(const std::string& path) {
  return StatusOfPath(path, false);
}

std::optional<FileStatus> StatusOfLink(const std::string& path) {
  return StatusOfPath(path, true);
}

std::optional<FileStatus> StatusOf(int fd) {
  return StatusOfHandle(HandleOf(fd), false);
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
  WIN32_FIND_DATAW entry{};
  const HANDLE search = ::FindFirstFileW(WidePath((folder.empty() ? "." : folder) + "\\*").c_str(), &entry);
  if (search == INVALID_HANDLE_VALUE) {
    SetReason();
    return std::nullopt;
  }
  do {
    std::string name = Narrow(entry.cFileName);
    if (name != "." && name != "..") names.push_back(std::move(name));
  } while (::FindNextFileW(search, &entry) != 0);
  ::FindClose(search);
  std::sort(names.begin(), names.end());
  return names;
}

bool MakeFolders(const std::string& path) {
  if (IsFolder(path)) return true;
  const std::string above = std::filesystem::path(path).parent_path().string();
  if (!above.empty() && above != path && !MakeFolders(above)) return false;
  if (::CreateDirectoryW(WidePath(path).c_str(), nullptr) != 0 || IsFolder(path)) return true;
  SetReason();
  return false;
}

int OpenToRead(const std::string& path, Open /*open*/) {
  // BACKUP_SEMANTICS: a folder opens, too, so that the caller sees what it is.
  return DescriptorOf(::CreateFileW(WidePath(path).c_str(), GENERIC_READ, kShareAll, nullptr, OPEN_EXISTING,
                                    FILE_FLAG_BACKUP_SEMANTICS | FILE_FLAG_SEQUENTIAL_SCAN, nullptr),
                      _O_RDONLY);
}

int OpenToWrite(const std::string& path) {
  return DescriptorOf(
      ::CreateFileW(WidePath(path).c_str(), GENERIC_WRITE, kShareAll, nullptr, OPEN_EXISTING, 0, nullptr), _O_WRONLY);
}

bool Close(int fd) {
  return ::_close(fd) == 0;
}

std::ptrdiff_t Read(int fd, std::span<std::uint8_t> out) {
  constexpr std::size_t kMost = std::size_t{1} << 30U;
  return ::_read(fd, out.data(), static_cast<unsigned>(std::min(out.size(), kMost)));
}

bool WriteAll(int fd, std::string_view bytes) {
  constexpr std::size_t kMost = std::size_t{1} << 26U;
  while (!bytes.empty()) {
    const int written = ::_write(fd, bytes.data(), static_cast<unsigned>(std::min(bytes.size(), kMost)));
    if (written <= 0) {
      if (written == 0) errno = ENOSPC;
      return false;
    }
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return true;
}

bool Rewind(int fd) {
  return ::_lseeki64(fd, 0, SEEK_SET) == 0;
}

bool WaitForBytes(int fd, int ms) {
  constexpr DWORD kStepMs = 5;
  const HANDLE handle = HandleOf(fd);
  const DWORD type = ::GetFileType(handle);
  if (type != FILE_TYPE_PIPE) return true;
  for (const ULONGLONG end = ::GetTickCount64() + static_cast<ULONGLONG>(ms);; ::Sleep(kStepMs)) {
    DWORD available = 0;
    // A pipe whose writer has gone has an end to be read.
    if (::PeekNamedPipe(handle, nullptr, 0, nullptr, &available, nullptr) == 0 || available > 0) return true;
    if (::GetTickCount64() >= end) return false;
  }
}

int MakeTemporary(std::string& name) {
  return MakeUnderNewName(name, FILE_ATTRIBUTE_NORMAL);
}

Nameless MakeNameless() {
  std::array<wchar_t, MAX_PATH + 1> folder{};
  const DWORD length = ::GetTempPathW(static_cast<DWORD>(folder.size()), folder.data());
  std::string name = Narrow({folder.data(), std::min<std::size_t>(length, folder.size())}) + "ecaudit-XXXXXX";
  const int fd = MakeUnderNewName(name, FILE_ATTRIBUTE_TEMPORARY | FILE_FLAG_DELETE_ON_CLOSE);
  return {fd, name};
}

bool SetPermissions(int /*fd*/, unsigned /*permissions*/) {
  return true;  // a file has those of its folder
}

unsigned NewFilePermissions() {
  return 0666;
}

bool Sync(int fd) {
  if (::FlushFileBuffers(HandleOf(fd)) != 0 || ::GetLastError() == ERROR_INVALID_FUNCTION) return true;
  SetReason();
  return false;
}

void SyncName(const std::string& /*path*/) {}  // MoveOver() writes it through

bool MoveOver(const std::string& from, const std::string& to) {
  const std::wstring target = WidePath(to);
  // A scanner may hold a new file for a moment.
  constexpr int kTries = 10;
  constexpr DWORD kPauseMs = 20;
  for (int i = 0; i < kTries; ++i) {
    if (i > 0) ::Sleep(kPauseMs);
    if (::MoveFileExW(WidePath(from).c_str(), target.c_str(), MOVEFILE_REPLACE_EXISTING | MOVEFILE_WRITE_THROUGH) != 0)
      return true;
    const DWORD reason = ::GetLastError();
    if (reason != ERROR_ACCESS_DENIED && reason != ERROR_SHARING_VIOLATION) break;
    ::SetLastError(reason);
  }
  const DWORD reason = ::GetLastError();
  const bool held = IsHeld(target);
  ::SetLastError(held ? ERROR_SHARING_VIOLATION : reason);
  SetReason();
  return false;
}

void Remove(const std::string& path) {
  ::DeleteFileW(WidePath(path).c_str());
}

std::string ReasonText(int reason) {
  if (reason == EBUSY) return "another program has it open";
  return std::strerror(reason);
}

std::wstring Wide(std::string_view text) {
  const int size = static_cast<int>(text.size());
  std::wstring out(static_cast<std::size_t>(::MultiByteToWideChar(CP_UTF8, 0, text.data(), size, nullptr, 0)), L'\0');
  ::MultiByteToWideChar(CP_UTF8, 0, text.data(), size, out.data(), static_cast<int>(out.size()));
  return out;
}

std::string Narrow(std::wstring_view text) {
  const int size = static_cast<int>(text.size());
  const int bytes = ::WideCharToMultiByte(CP_UTF8, 0, text.data(), size, nullptr, 0, nullptr, nullptr);
  std::string out(static_cast<std::size_t>(bytes), '\0');
  ::WideCharToMultiByte(CP_UTF8, 0, text.data(), size, out.data(), bytes, nullptr, nullptr);
  return out;
}

std::wstring WidePath(const std::string& path) {
  // Folders have 12 characters less, for a file of the old form in them.
  constexpr std::size_t kLongestPlain = MAX_PATH - 13;
  std::wstring wide = Wide(path);
  if (wide.starts_with(LR"(\\?\)")) return wide;
  const DWORD length = ::GetFullPathNameW(wide.c_str(), 0, nullptr, nullptr);
  if (length <= kLongestPlain) return wide;
  std::wstring full(length, L'\0');
  full.resize(::GetFullPathNameW(wide.c_str(), length, full.data(), nullptr));
  if (full.starts_with(LR"(\\)")) return LR"(\\?\UNC\)" + full.substr(2);
  return LR"(\\?\)" + full;
}

void SetReason() {
  switch (::GetLastError()) {
    case ERROR_FILE_NOT_FOUND:
    case ERROR_PATH_NOT_FOUND:
    case ERROR_BAD_NETPATH:
    case ERROR_BAD_NET_NAME:
    case ERROR_INVALID_NAME:
    case ERROR_INVALID_DRIVE:
      errno = ENOENT;
      break;
    case ERROR_SHARING_VIOLATION:
    case ERROR_LOCK_VIOLATION:
      errno = EBUSY;
      break;
    case ERROR_ACCESS_DENIED:
    case ERROR_WRITE_PROTECT:
      errno = EACCES;
      break;
    case ERROR_FILE_EXISTS:
    case ERROR_ALREADY_EXISTS:
      errno = EEXIST;
      break;
    case ERROR_DISK_FULL:
    case ERROR_HANDLE_DISK_FULL:
      errno = ENOSPC;
      break;
    case ERROR_BROKEN_PIPE:
    case ERROR_NO_DATA:
      errno = EPIPE;
      break;
    case ERROR_FILENAME_EXCED_RANGE:
      errno = ENAMETOOLONG;
      break;
    case ERROR_NOT_ENOUGH_MEMORY:
    case ERROR_OUTOFMEMORY:
      errno = ENOMEM;
      break;
    case ERROR_TOO_MANY_OPEN_FILES:
      errno = EMFILE;
      break;
    default:
      errno = EIO;
  }
}

}  // namespace ecaudit::system
