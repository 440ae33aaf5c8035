/// What the capture tests share: reading a whole source, files to read, and tshark as the second opinion.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "decoder/base/bytes.h"
#include "decoder/base/result.h"
#include "decoder/capture/frame_source.h"

namespace ecaudit::capture {

using Bytes = std::vector<std::uint8_t>;

/// A CapturedFrame that owns its bytes.
struct OwnedFrame {
  FrameNo number = 0;
  TimeNs time = 0;
  bool has_time = false;
  std::uint16_t link_type = 0;
  std::uint16_t interface_index = 0;
  PacketFlag flag = PacketFlag::kNone;
  std::uint32_t original_length = 0;
  Bytes bytes;
};

/// All that a source gives.
struct WholeCapture {
  std::string error;  ///< when it does not open
  std::vector<OwnedFrame> frames;
  ReadStatus end = ReadStatus::kFrame;
  CaptureInfo info;

  [[nodiscard]] std::string damage() const { return info.damage ? info.damage->message : std::string(); }
};

/// Reads to the end, and once more to see that the end stays the end.
WholeCapture ReadAll(Result<std::unique_ptr<FrameSource>> source);
WholeCapture ReadFile(const std::string& path);

Bytes FileBytes(const std::string& path);
Bytes Gzip(ByteSpan bytes);
Bytes Zstd(ByteSpan bytes);

/// Removes itself and all that lies in it.
class TempFolder {
 public:
  TempFolder();
  ~TempFolder();
  TempFolder(const TempFolder&) = delete;
  TempFolder& operator=(const TempFolder&) = delete;

  [[nodiscard]] std::string Path(std::string_view name) const;
  /// Writes `bytes` as `name`; returns its path.
  [[nodiscard]] std::string Write(std::string_view name, ByteSpan bytes) const;

 private:
  std::filesystem::path folder_;
};

/// "lab/dc.pcapng" among the captures beside the project; empty when they are absent.
std::string SharedCapture(const std::string& name);

struct TsharkFrame {
  std::uint64_t number = 0;
  bool has_time = false;
  TimeNs time = 0;
  std::uint32_t length = 0;
  std::uint32_t captured = 0;
};
bool HaveTshark();
/// What tshark reads of `path`, up to damage if there is any.
std::vector<TsharkFrame> TsharkFrames(const std::string& path);

}  // namespace ecaudit::capture
