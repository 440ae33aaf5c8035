/// Results into files: whole or not at all, and never over a capture.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "cli/report/json_text.h"
#include "decoder/base/result.h"

namespace ecaudit::cli {

/// `path`, or its target if it is a link, also to a file that does not exist yet.
[[nodiscard]] std::string ResolveLinks(const std::string& path);

/// What becomes of a link where a file is to be written.
enum class Links : std::uint8_t {
  kFollow,   ///< its target is replaced, unless another user (not root) made the link
  kReplace,  ///< the link itself is replaced; so are pipes and devices
};

/// Asks, before any work, whether a report can go to `path`: its folder exists, it is no folder itself, no link of
/// another user, and no capture (whatever its name).
/// @return what is in the way, or nothing
[[nodiscard]] std::optional<Error> CheckOutputPath(const std::string& path, Links links = Links::kFollow);

/// A file written piece by piece to a temporary file beside `path`, so that readers see the old one or the whole new
/// one, also after the machine has lost its power. Links are followed; a device or pipe is written directly.
/// Not QSaveFile: it follows every link, takes no name that is not valid text, and leaves the folder unsynced.
class OutputFile {
 public:
  [[nodiscard]] static Result<OutputFile> Create(const std::string& path, Links links = Links::kFollow);
  OutputFile(OutputFile&& other) noexcept;
  OutputFile& operator=(OutputFile&& other) noexcept;
  /// Takes an unfinished file away again.
  ~OutputFile();

  [[nodiscard]] std::optional<Error> Write(std::string_view content);
  /// Puts the file in its place. Nothing may be written afterwards.
  [[nodiscard]] std::optional<Error> Finish();

 private:
  OutputFile() = default;
  void Discard();

  int fd_ = -1;
  std::string path_;       ///< as the user named it
  std::string target_;     ///< the target, links followed
  std::string temporary_;  ///< empty: written directly
  unsigned mode_ = 0;      ///< permissions
};

/// Writes piece by piece what `write` gives its sink, and returns the first error.
[[nodiscard]] std::optional<Error> WriteOutputPieces(const std::string& path,
                                                     const std::function<void(const report::TextSink&)>& write,
                                                     Links links = Links::kFollow);

/// The same in one go.
[[nodiscard]] std::optional<Error> WriteOutputFile(const std::string& path, std::string_view content,
                                                   Links links = Links::kFollow);

}  // namespace ecaudit::cli
