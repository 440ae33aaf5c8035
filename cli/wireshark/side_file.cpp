#include "cli/wireshark/side_file.h"

#include <algorithm>

#include "cli/report/layout.h"
#include "cli/stream/json_line.h"
#include "decoder/base/text.h"

namespace ecaudit::cli {
namespace {

constexpr std::size_t kBlockLines = 512;
constexpr std::size_t kBlockBytes = std::size_t{32} << 10U;
constexpr std::size_t kTimesContext = 4;
constexpr std::array<std::string_view, kSideSections> kSectionNames = {"al", "events", "clocks", "signals"};
constexpr int kWideDigits = 16;

/// Fixed width without a prefix.
void AppendHex(std::string& out, std::uint64_t value) {
  out += Hex(value, kWideDigits).substr(2);
}

}  // namespace

Result<SideFile> SideFile::Create(const std::string& path) {
  Result<OutputFile> file = OutputFile::Create(path);
  if (!file) return file.error();
  SideFile side(std::move(*file));
  side.Write("ecaudit-side 1\n");
  return side;
}

void SideFile::Write(std::string_view text) {
  if (!error_) error_ = file_.Write(text);
  offset_ += text.size();
}

void SideFile::BeginBlock(SideSection section, FrameNo frame) {
  Of(section).first = frame;
}

void SideFile::Context(SideSection section, std::string_view line) {
  Section& to = Of(section);
  to.text.append(line).push_back('\n');
  ++to.context_lines;
}

void SideFile::Line(SideSection section, std::string_view line) {
  Section& to = Of(section);
  to.text.append(line).push_back('\n');
  ++to.lines;
}

void SideFile::EndFrame(SideSection section) {
  Section& of = Of(section);
  // Where many slaves are repeated at the begin of each block, blocks are longer.
  const bool long_enough = of.lines >= kBlockLines || of.text.size() >= kBlockBytes;
  if (long_enough && of.lines >= kTimesContext * of.context_lines) CloseBlock(of);
}

void SideFile::CloseBlock(Section& section) {
  if (section.text.empty()) return;
  section.blocks.push_back({section.first, offset_, section.text.size()});
  Write(section.text);
  section.text.clear();
  section.lines = section.context_lines = 0;
}

std::optional<Error> SideFile::Finish() {
  for (Section& section : sections_) CloseBlock(section);
  std::string text;
  for (std::size_t i = 0; i < kSideSections; ++i) {
    const std::vector<Block>& blocks = sections_[i].blocks;
    std::string line = "section\t" + std::string(kSectionNames[i]) + "\t";
    AppendNumber(line, offset_);
    line += '\t';
    AppendNumber(line, blocks.size());
    Directory(line);
    for (const Block& block : blocks) {
      AppendHex(text, block.frame);
      text += ' ';
      AppendHex(text, block.offset);
      text += ' ';
      AppendHex(text, block.length);
      text += '\n';
      if (text.size() < kBlockBytes) continue;
      Write(text);
      text.clear();
    }
    Write(text);
    text.clear();
  }
  const std::uint64_t directory = offset_;
  Write(directory_);
  text = "ecaudit-side-end ";
  AppendHex(text, directory);
  text += '\n';
  Write(text);
  return error_ ? error_ : file_.Finish();
}

std::string SideField(std::string_view text) {
  std::string field = report::OneLine(text);
  std::ranges::replace(field, '\t', ' ');
  return field;
}

}  // namespace ecaudit::cli
