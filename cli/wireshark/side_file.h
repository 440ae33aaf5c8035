/// The side file of a capture: what the post-dissector in Wireshark shows for each frame.
///
/// Lines of text with tabs between the fields. They stand in blocks by section, each section in the order of frames; an
/// index of the blocks and a directory follow at the end, so that a reader holds one block of a section at a time:
///
///   ecaudit-side 1
///   ...blocks...
///   index of each section: "FRAME OFFSET LENGTH" of a block, hexadecimal, lines of equal length
///   directory: "capture", "check", "column", "layout", "finding", "mark", "section" lines
///   ecaudit-side-end OFFSET_OF_THE_DIRECTORY
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "cli/output_file.h"
#include "decoder/base/ids.h"
#include "decoder/base/result.h"

namespace ecaudit::cli {

enum class SideSection : std::uint8_t {
  kAl,       ///< FRAME SLAVE STATE CODE: a change; each block begins with the state of all slaves
  kEvents,   ///< FRAME TYPE SLAVE TEXT, and the fields of an SDO transfer
  kClocks,   ///< FRAME SLAVE NANOSECONDS: end of the frame after the last SYNC0
  kSignals,  ///< FRAME LAYOUT COLUMN=VALUE...: the values that differ from those above in the block
};
inline constexpr std::size_t kSideSections = 4;

class SideFile {
 public:
  [[nodiscard]] static Result<SideFile> Create(const std::string& path);

  /// True when the next line begins a block: what the reader must know by then has to stand in it.
  [[nodiscard]] bool begins_block(SideSection section) const { return Of(section).text.empty(); }
  void BeginBlock(SideSection section, FrameNo frame);
  /// A line of an earlier frame that a block begins with, so that it can be read by itself.
  void Context(SideSection section, std::string_view line);
  /// Appends a line, which begins with a frame number that is not below that of the last one.
  void Line(SideSection section, std::string_view line);
  /// After the lines of a frame: hands a full block on.
  void EndFrame(SideSection section);

  /// A line of the directory. Fields must be free of tabs and line ends: SideField().
  void Directory(std::string_view line) { directory_.append(line).push_back('\n'); }

  /// Writes what is left; the file appears.
  [[nodiscard]] std::optional<Error> Finish();
  /// What went wrong so far.
  [[nodiscard]] const std::optional<Error>& error() const { return error_; }

 private:
  struct Block {
    FrameNo frame = 0;
    std::uint64_t offset = 0;
    std::uint64_t length = 0;
  };
  struct Section {
    FrameNo first = 0;
    std::string text;
    std::size_t lines = 0;
    std::size_t context_lines = 0;
    std::vector<Block> blocks;
  };

  explicit SideFile(OutputFile file) : file_(std::move(file)) {}
  [[nodiscard]] Section& Of(SideSection section) { return sections_[static_cast<std::size_t>(section)]; }
  [[nodiscard]] const Section& Of(SideSection section) const { return sections_[static_cast<std::size_t>(section)]; }
  void CloseBlock(Section& section);
  void Write(std::string_view text);

  OutputFile file_;
  std::uint64_t offset_ = 0;
  std::array<Section, kSideSections> sections_;
  std::string directory_;
  std::optional<Error> error_;
};

/// `text` on one line, without tabs.
[[nodiscard]] std::string SideField(std::string_view text);

}  // namespace ecaudit::cli
