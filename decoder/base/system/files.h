/// Files by their descriptors, and what a system knows about them. Paths are UTF-8 on Windows, bytes elsewhere.
/// Each header of this folder has one implementation a system (*_posix.cpp, *_windows.cpp); the build chooses.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace ecaudit::system {

inline constexpr int kStandardInput = 0;

enum class FileKind : std::uint8_t { kRegular, kFolder, kLink, kBlockDevice, kOther };

struct FileStatus {
  FileKind kind = FileKind::kOther;
  std::uint64_t bytes = 0;
  std::int64_t modified_ns = 0;                  ///< since 1970
  std::pair<std::uint64_t, std::uint64_t> node;  ///< equal for two names of one file
  bool foreign = false;                          ///< belongs to another user who is not root; false where unknown
  bool writable_by_all = false;
  unsigned permissions = 0;
};

/// Of what `path` names, links followed.
[[nodiscard]] std::optional<FileStatus> StatusOf(const std::string& path);
/// Of the link itself.
[[nodiscard]] std::optional<FileStatus> StatusOfLink(const std::string& path);
[[nodiscard]] std::optional<FileStatus> StatusOf(int fd);

// Links are followed. Not those of std::filesystem, which end at 260 characters on Windows.
[[nodiscard]] bool Exists(const std::string& path);
[[nodiscard]] bool IsFile(const std::string& path);
[[nodiscard]] bool IsFolder(const std::string& path);
/// What lies in a folder, sorted; nothing when it cannot be read, and errno holds the reason.
[[nodiscard]] std::optional<std::vector<std::string>> NamesIn(const std::string& folder);
/// With those above it. False means that errno holds the reason.
[[nodiscard]] bool MakeFolders(const std::string& path);

/// A pipe without a writer: whether opening it waits for one.
enum class Open : std::uint8_t { kAtOnce, kWaits };

// Descriptors below 0 and false mean that errno holds the reason. An interrupted call is repeated.

[[nodiscard]] int OpenToRead(const std::string& path, Open open = Open::kAtOnce);
/// A device, a pipe or an existing file, from its beginning.
[[nodiscard]] int OpenToWrite(const std::string& path);
bool Close(int fd);
/// At most out.size() bytes; 0 at the end, -1 with errno.
[[nodiscard]] std::ptrdiff_t Read(int fd, std::span<std::uint8_t> out);
[[nodiscard]] bool WriteAll(int fd, std::string_view bytes);
[[nodiscard]] bool Rewind(int fd);
/// Waits until something can be read, the end included. False after `ms` without.
[[nodiscard]] bool WaitForBytes(int fd, int ms);

/// Makes a file that only this user may read. @param name  ends with XXXXXX, which become its own
[[nodiscard]] int MakeTemporary(std::string& name);
struct Nameless {
  int fd = -1;
  std::string path;  ///< where it can be opened while fd is open; without fd: the name that was tried
};
/// A file that goes with its descriptor, in the folder of temporary files.
[[nodiscard]] Nameless MakeNameless();

bool SetPermissions(int fd, unsigned permissions);
/// What a new file gets.
[[nodiscard]] unsigned NewFilePermissions();
/// Returns when the content is on the disk. True where the file system has no such request.
[[nodiscard]] bool Sync(int fd);
/// The same for the name of a file, as far as the system can.
void SyncName(const std::string& path);
/// Replaces `to` in one step.
[[nodiscard]] bool MoveOver(const std::string& from, const std::string& to);
void Remove(const std::string& path);

/// What a person reads about a reason (errno).
[[nodiscard]] std::string ReasonText(int reason);

}  // namespace ecaudit::system
