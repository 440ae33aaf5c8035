#include <bit>
#include <utility>
#include <vector>

#include <zlib.h>
#include <zstd.h>

#include "decoder/capture/byte_reader.h"

namespace ecaudit::capture {
namespace {

constexpr std::size_t kInputBytes = std::size_t{128} * 1024;
// The largest that the zstd program itself writes without --long.
constexpr std::size_t kZstdWindowBytes = std::size_t{128} << 20U;

/// Compressed bytes on their way into a decompressor.
class CompressedInput {
 public:
  CompressedInput(std::unique_ptr<ByteReader> source, ByteSpan head)
      : source_(std::move(source)), buffer_(head.begin(), head.end()), end_(head.size()) {
    buffer_.resize(kInputBytes);
  }

  /// What is left in the buffer, filled again when nothing is; empty at the end or when the source failed.
  ByteSpan Available(std::string& error) {
    if (begin_ == end_) {
      begin_ = 0;
      end_ = source_->Read(buffer_, error);
    }
    return {buffer_.data() + begin_, end_ - begin_};
  }
  void Consume(std::size_t count) { begin_ += count; }
  std::uint64_t source_bytes() const { return source_->source_bytes(); }

 private:
  std::unique_ptr<ByteReader> source_;
  std::vector<std::uint8_t> buffer_;
  std::size_t begin_ = 0;
  std::size_t end_;
};

class GzipReader final : public ByteReader {
 public:
  GzipReader(std::unique_ptr<ByteReader> source, ByteSpan head) : input_(std::move(source), head) {
    constexpr int kGzipOnly = 16;
    ready_ = inflateInit2(&state_, MAX_WBITS + kGzipOnly) == Z_OK;
  }
  ~GzipReader() override {
    if (ready_) inflateEnd(&state_);
  }

  std::size_t Read(std::span<std::uint8_t> out, std::string& error) override {
    if (!ready_) {
      if (!failed_) error = "no memory to decompress gzip data";
      failed_ = true;
    }
    if (failed_) return 0;
    state_.next_out = out.data();
    state_.avail_out = static_cast<uInt>(out.size());
    while (state_.avail_out == out.size()) {
      const ByteSpan available = input_.Available(error);
      if (available.empty()) {
        if (error.empty() && in_member_) error = "the gzip data end early";
        failed_ = !error.empty();
        return 0;
      }
      if (!in_member_ && !StartMember(available, error)) continue;
      if (failed_) return 0;
      state_.next_in = const_cast<Bytef*>(available.data());  // zlib does not write there, it only lacks the const
      state_.avail_in = static_cast<uInt>(available.size());
      const int status = inflate(&state_, Z_NO_FLUSH);
      input_.Consume(available.size() - state_.avail_in);
      if (status == Z_STREAM_END) {
        in_member_ = false;
      } else if (status != Z_OK && status != Z_BUF_ERROR) {
        error = "the gzip data are damaged";
        if (state_.msg != nullptr) error += std::string(" (") + state_.msg + ")";
        failed_ = true;
        break;
      }
    }
    return out.size() - state_.avail_out;
  }
  std::uint64_t source_bytes() const override { return input_.source_bytes(); }

 private:
  /// @return true when inflate() is to go on with the input (or failed_ is set), false to check the next input
  bool StartMember(ByteSpan available, std::string& error) {
    if (available[0] == 0 && !first_) {
      input_.Consume(1);
      return false;
    }
    if (!first_ && available[0] != 0x1F) {
      error = "the gzip data are followed by other data";
      failed_ = true;
      return true;
    }
    inflateReset(&state_);
    first_ = false;
    in_member_ = true;
    return true;
  }

  CompressedInput input_;
  z_stream state_{};
  bool ready_ = false;
  bool in_member_ = false;
  bool first_ = true;
  bool failed_ = false;
};

class ZstdReader final : public ByteReader {
 public:
  ZstdReader(std::unique_ptr<ByteReader> source, ByteSpan head)
      : input_(std::move(source), head), state_(ZSTD_createDStream()) {
    if (state_ != nullptr) ZSTD_DCtx_setParameter(state_, ZSTD_d_windowLogMax, std::countr_zero(kZstdWindowBytes));
  }
  ~ZstdReader() override { ZSTD_freeDStream(state_); }

  std::size_t Read(std::span<std::uint8_t> out, std::string& error) override {
    if (state_ == nullptr && !failed_) {
      error = "no memory to decompress zstd data";
      failed_ = true;
    }
    if (failed_) return 0;
    ZSTD_outBuffer target{out.data(), out.size(), 0};
    while (target.pos == 0) {
      const ByteSpan available = input_.Available(error);
      if (available.empty() && (!in_frame_ || !error.empty())) {
        failed_ = !error.empty();
        return 0;
      }
      // With no input left inside a frame this call only hands out what the decompressor still holds.
      ZSTD_inBuffer from{available.data(), available.size(), 0};
      const std::size_t status = ZSTD_decompressStream(state_, &target, &from);
      input_.Consume(from.pos);
      if (ZSTD_isError(status) != 0U) {
        error = std::string("the zstd data are damaged (") + ZSTD_getErrorName(status) + ")";
        failed_ = true;
        break;
      }
      in_frame_ = status != 0;
      if (available.empty() && in_frame_ && target.pos == 0) {
        error = "the zstd data end early";
        failed_ = true;
        break;
      }
    }
    return target.pos;
  }
  std::uint64_t source_bytes() const override { return input_.source_bytes(); }

 private:
  CompressedInput input_;
  ZSTD_DStream* state_;
  bool in_frame_ = false;
  bool failed_ = false;
};

}  // namespace

std::unique_ptr<ByteReader> MakeGzipReader(std::unique_ptr<ByteReader> source, ByteSpan head) {
  return std::make_unique<GzipReader>(std::move(source), head);
}
std::unique_ptr<ByteReader> MakeZstdReader(std::unique_ptr<ByteReader> source, ByteSpan head) {
  return std::make_unique<ZstdReader>(std::move(source), head);
}

}  // namespace ecaudit::capture
