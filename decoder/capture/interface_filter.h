/// in: a FrameSource.  out: the packets of some of its interfaces, with the numbers that they have in the file.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "decoder/capture/frame_source.h"

namespace ecaudit::capture {

class InterfaceFilter final : public FrameSource {
 public:
  /// @param interfaces  as CapturedFrame counts them; those that the file does not have give nothing
  InterfaceFilter(std::unique_ptr<FrameSource> source, std::vector<std::uint16_t> interfaces)
      : source_(std::move(source)), interfaces_(std::move(interfaces)) {}

  [[nodiscard]] ReadStatus Next(CapturedFrame& frame) noexcept override {
    ReadStatus status = source_->Next(frame);
    while (status == ReadStatus::kFrame && !IsWanted(frame.interface_index)) status = source_->Next(frame);
    return status;
  }
  [[nodiscard]] const CaptureInfo& info() const noexcept override { return source_->info(); }
  [[nodiscard]] std::uint64_t bytes_read() const noexcept override { return source_->bytes_read(); }
  [[nodiscard]] std::uint64_t bytes_total() const noexcept override { return source_->bytes_total(); }

 private:
  [[nodiscard]] bool IsWanted(std::uint16_t interface) const {
    return std::ranges::find(interfaces_, interface) != interfaces_.end();
  }

  std::unique_ptr<FrameSource> source_;
  std::vector<std::uint16_t> interfaces_;
};

}  // namespace ecaudit::capture
