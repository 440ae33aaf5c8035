/// in: a capture of two interfaces whose clocks are apart.  out: CapturedFrame, stamped as by one clock.
///
/// keeps: the last frames that went out, to follow clocks that run at different speed.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <optional>

#include "decoder/base/result.h"
#include "decoder/bus/interface_clocks.h"
#include "decoder/capture/frame_source.h"
#include "decoder/wire/frame_parser.h"

namespace ecaudit::bus {

/// Moves the stamps of returned copies so that each comes after its frame, as soon as they allow. Frames keep
/// their order and number where the file has them in the order of the wire. Else they are put into it and numbered
/// again, as in the file that a copy of all of it becomes: a stamp of an hour ago may stand anywhere, so that the file
/// is read twice, once for each interface.
class AlignedSource final : public capture::FrameSource {
 public:
  /// @param apart   what CompareClocks() found of the same capture
  /// @param whole   at its first packet
  /// @param again   the same capture, at its first packet; needed where the packets do not stand in order
  AlignedSource(const ClocksApart& apart, std::unique_ptr<capture::FrameSource> whole,
                std::unique_ptr<capture::FrameSource> again);

  [[nodiscard]] capture::ReadStatus Next(capture::CapturedFrame& frame) noexcept override;
  [[nodiscard]] const capture::CaptureInfo& info() const noexcept override { return info_; }
  [[nodiscard]] std::uint64_t bytes_read() const noexcept override;
  [[nodiscard]] std::uint64_t bytes_total() const noexcept override;

 private:
  /// Gives the packets of one interface, or those of all others, or all.
  struct Reader {
    std::unique_ptr<capture::FrameSource> source;
    capture::CapturedFrame head;  ///< its next packet
    std::uint64_t key = 0;        ///< of the frame in it; 0: none
    std::optional<TimeNs> last;   ///< stamp of the last packet with one
    std::uint64_t recording = 0;  ///< how often the clock has jumped
    capture::ReadStatus status = capture::ReadStatus::kFrame;
    std::size_t comments = 0;  ///< taken or passed over
  };
  struct Sent {
    std::uint64_t key = 0;
    TimeNs time = 0;
  };

  void Advance(Reader& reader) noexcept;
  [[nodiscard]] bool IsReturned(const capture::CapturedFrame& frame) const {
    return frame.interface_index == apart_.returned;
  }
  [[nodiscard]] Reader& Earliest() noexcept;
  void Follow(const Reader& reader) noexcept;
  void Measure(std::int64_t ahead, std::int64_t since) noexcept;
  [[nodiscard]] static std::int64_t AheadIf(TimeNs sent, TimeNs returned) noexcept;
  [[nodiscard]] std::int64_t OffIf(TimeNs sent, TimeNs returned) const noexcept;
  [[nodiscard]] Sent* SentBefore(const Reader& back) noexcept;
  void TakeInfo(Reader& reader, FrameNo number);

  static constexpr std::size_t kKept = 64;

  ClocksApart apart_;
  std::array<Reader, 2> readers_;
  bool two_;                ///< the packets do not stand in order: one reader for each interface
  Reader* lent_ = nullptr;  ///< whose packet the caller holds
  capture::CaptureInfo info_;
  wire::FrameParser parser_;
  std::array<Sent, kKept> sent_{};
  std::size_t next_sent_ = 0;
  TimeNs last_ = std::numeric_limits<TimeNs>::min();  ///< stamp of the packet before
  TimeNs last_pair_ = 0;                              ///< stamp of the last frame whose return was met
  std::int64_t lowest_ = 0;                           ///< of the pairs of this window
  std::size_t in_window_ = 0;                         ///< pairs
  std::size_t elsewhere_ = 0;                         ///< frames in a row that fit to another distance ...
  std::int64_t elsewhere_ns_ = 0;                     ///< ... this one
};

using CaptureOpener = std::function<Result<std::unique_ptr<capture::FrameSource>>()>;

/// Opens a capture; where it has two interfaces, and their clocks are apart, as an AlignedSource.
/// @param open  opens it at its first packet, each time it is called: once, or up to three times
[[nodiscard]] Result<std::unique_ptr<capture::FrameSource>> OpenAligned(const CaptureOpener& open);

}  // namespace ecaudit::bus
