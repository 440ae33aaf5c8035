/// The bytes of a message or transfer while it is put together.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "decoder/base/allowance.h"
#include "decoder/base/bytes.h"

namespace ecaudit::mailbox {

/// Keeps the first bytes, at most as many as it may; nothing after a byte that was dropped. Takes its memory, not only
/// what is used of it, from what all slaves share.
class MessageBytes {
 public:
  /// @param all null: no common limit; else must outlive this
  explicit MessageBytes(std::size_t most, Allowance* all = nullptr) : most_(most), all_(all) {}
  MessageBytes(const MessageBytes&) = delete;
  MessageBytes& operator=(const MessageBytes&) = delete;

  [[nodiscard]] std::size_t size() const { return bytes_.size(); }
  /// Something was dropped.
  [[nodiscard]] bool full() const { return full_; }
  operator ByteSpan() const { return bytes_; }  // NOLINT(google-explicit-constructor): it is one

  void Append(ByteSpan bytes) {
    const ByteSpan kept = bytes.first(std::min(most_ - bytes_.size(), bytes.size()));
    if (full_ || !Reserve(bytes_.size() + kept.size())) {
      full_ = true;
      return;
    }
    full_ = kept.size() < bytes.size();
    bytes_.insert(bytes_.end(), kept.begin(), kept.end());
  }
  /// Begins again. Memory is kept where the next message will most likely need it, too.
  void Clear() {
    bytes_.clear();
    full_ = false;
    if (bytes_.capacity() <= kKept) return;
    if (all_ != nullptr) all_->GiveBack(bytes_.capacity());
    bytes_ = {};
  }

 private:
  static constexpr std::size_t kKept = 2048;

  bool Reserve(std::size_t size) {
    const std::size_t before = bytes_.capacity();
    if (size <= before) return true;
    const std::size_t wanted = std::max(size, std::min(2 * before, most_));
    if (!TakeFrom(all_, wanted - before)) return false;
    bytes_.reserve(wanted);
    return true;
  }

  std::size_t most_;
  Allowance* all_;
  bool full_ = false;
  std::vector<std::uint8_t> bytes_;
};

}  // namespace ecaudit::mailbox
