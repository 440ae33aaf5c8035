/// The captures that laws are tried on, and sources that present one of them differently.
#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include "decoder/capture/frame_source.h"

namespace ecaudit::test {

/// Captures in a folder, sorted; without files that repeat one run in other containers, and those that are no captures.
/// Empty when there is no such folder.
[[nodiscard]] std::vector<std::filesystem::path> CapturesIn(const std::filesystem::path& folder);

/// Hands out `packets` numbered anew from 1; the rest is as in `inner`.
class RewrittenSource final : public capture::FrameSource {
 public:
  /// One packet, with its bytes to be changed. Return false to leave it out.
  using Rewrite = std::function<bool(capture::CapturedFrame& frame, std::vector<std::uint8_t>& bytes)>;

  /// @param before packets of another protocol put in front, stamped like the first one
  /// @param until last packet of `inner` that is handed out; 0: all
  RewrittenSource(capture::FrameSource& inner, std::size_t before, FrameNo until, Rewrite rewrite)
      : inner_(inner), before_(before), until_(until), rewrite_(std::move(rewrite)) {}

  [[nodiscard]] capture::ReadStatus Next(capture::CapturedFrame& frame) noexcept override;
  [[nodiscard]] const capture::CaptureInfo& info() const noexcept override { return inner_.info(); }

 private:
  capture::FrameSource& inner_;
  std::size_t before_;
  FrameNo until_;
  Rewrite rewrite_;
  FrameNo number_ = 0;
  bool has_first_ = false;
  bool ended_ = false;
  capture::ReadStatus first_status_ = capture::ReadStatus::kEnd;
  capture::CapturedFrame first_{};
  std::vector<std::uint8_t> first_bytes_;
  std::vector<std::uint8_t> bytes_;
};

}  // namespace ecaudit::test
