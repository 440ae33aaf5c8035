/// What is known of the registers 0x0000-0x0FFF of one ESC, byte by byte. Process RAM is not kept here.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <type_traits>

#include "decoder/base/allowance.h"
#include "decoder/base/bytes.h"
#include "decoder/base/ids.h"
#include "decoder/base/known.h"

namespace ecaudit::esc {

/// At most 16 pages of 256 bytes plus as many certainties (8 KiB); a page exists once a byte of it was learned. Copies
/// share their pages until one of them learns something else.
/// Addresses from 0x1000 on are ignored when written and unknown when read.
class RegisterImage {
 public:
  static constexpr std::size_t kSize = 0x1000;
  static constexpr std::size_t kPageSize = 256;

  RegisterImage() = default;
  RegisterImage(RegisterImage&&) noexcept = default;
  RegisterImage& operator=(RegisterImage&&) noexcept = default;
  RegisterImage(const RegisterImage& other) { CopyFrom(other); }
  RegisterImage& operator=(const RegisterImage& other) {
    if (this != &other) CopyFrom(other);
    return *this;
  }
  ~RegisterImage() = default;

  /// Each page is taken from what all slaves share from now on; where nothing is left, what it would hold stays
  /// unknown.
  /// @param pages must outlive this; a copy does not have it
  void Limit(Allowance& pages) { allowance_ = &pages; }

  /// Remembers `bytes` from `address` on, replacing what was known, whatever its certainty.
  void Write(EscAddress address, ByteSpan bytes, Certainty certainty) {
    if (certainty == Certainty::kUnknown) return Forget(address, bytes.size());
    ForEachPage(address, bytes.size(), [&](std::size_t page, std::size_t at, std::size_t offset, std::size_t n) {
      if (!pages_[page]) {
        if (!TakeFrom(allowance_, 1)) return;
        pages_[page] = std::make_shared<Page>();
      }
      const auto first = bytes.begin() + static_cast<std::ptrdiff_t>(offset);
      if (pages_[page].use_count() > 1 && pages_[page]->Holds(at, first, n, certainty)) return;
      Page& own = Own(page);
      std::copy_n(first, n, own.bytes.begin() + at);
      std::fill_n(own.certainty.begin() + at, n, certainty);
    });
  }

  /// Makes the bytes of [address, address + length) unknown.
  void Forget(EscAddress address, std::size_t length) {
    ForEachPage(address, length, [&](std::size_t page, std::size_t at, std::size_t /*offset*/, std::size_t n) {
      if (pages_[page]) std::fill_n(Own(page).certainty.begin() + at, n, Certainty::kUnknown);
    });
  }
  /// Of the pages of [address, address + length) that hold the same in both, only the other's are kept.
  void ShareWith(const RegisterImage& other, EscAddress address, std::size_t length) {
    ForEachPage(address, length,
                [&](std::size_t page, std::size_t /*at*/, std::size_t /*offset*/, std::size_t /*bytes*/) {
                  const auto& theirs = other.pages_[page];
                  if (pages_[page] && theirs && pages_[page] != theirs && *pages_[page] == *theirs) {
                    pages_[page] = theirs;
                  }
                });
  }
  /// Makes everything unknown (another slave at this place).
  void Clear() { ClearFrom(0); }
  /// Makes everything from `address` on unknown. @param address in the first page
  void ClearFrom(std::size_t address) {
    const auto stays = [&](const auto& page) {
      return &page == &pages_[0] && page &&
             std::any_of(page->certainty.begin(), page->certainty.begin() + address,
                         [](Certainty certainty) { return certainty != Certainty::kUnknown; });
    };
    std::size_t dropped = 0;
    for (auto& page : pages_) {
      if (!page || stays(page)) continue;
      page.reset();
      ++dropped;
    }
    if (allowance_ != nullptr) allowance_->GiveBack(dropped);
    Forget(static_cast<EscAddress>(address), kPageSize - address);
  }

  /// Certainty of the least certain byte of [address, address + length); kUnknown for no byte at all.
  [[nodiscard]] Certainty CertaintyOf(EscAddress address, std::size_t length) const {
    if (length == 0 || !Fits(address, length)) return Certainty::kUnknown;
    Certainty least = Certainty::kObserved;
    ForEachPage(address, length, [&](std::size_t page, std::size_t at, std::size_t /*offset*/, std::size_t n) {
      if (!pages_[page]) {
        least = Certainty::kUnknown;
        return;
      }
      const auto first = pages_[page]->certainty.begin() + at;
      least = std::min(least, *std::min_element(first, first + n));
    });
    return least;
  }

  /// Copies the bytes from `address` on into `out`, unknown ones as 0.
  /// @return certainty of the least certain byte
  Certainty Read(EscAddress address, std::span<std::uint8_t> out) const {
    std::ranges::fill(out, std::uint8_t{0});
    ForEachPage(address, out.size(), [&](std::size_t page, std::size_t at, std::size_t offset, std::size_t n) {
      if (!pages_[page]) return;
      for (std::size_t i = 0; i < n; ++i) {
        if (pages_[page]->certainty[at + i] != Certainty::kUnknown) out[offset + i] = pages_[page]->bytes[at + i];
      }
    });
    return CertaintyOf(address, out.size());
  }
  /// N bytes from `address` on; nothing unless each is at least as certain as asked.
  template <std::size_t N>
  [[nodiscard]] std::optional<std::array<std::uint8_t, N>> Read(EscAddress address,
                                                                Certainty at_least = Certainty::kInferred) const {
    std::array<std::uint8_t, N> bytes{};
    const Certainty certainty = Read(address, bytes);
    if (certainty == Certainty::kUnknown || certainty < at_least) return std::nullopt;
    return bytes;
  }
  /// Little-endian register value; nothing unless each byte is at least as certain as asked.
  template <typename T>
  [[nodiscard]] std::optional<T> Value(EscAddress address, Certainty at_least = Certainty::kInferred) const {
    static_assert(std::is_unsigned_v<T>);
    const auto bytes = Read<sizeof(T)>(address, at_least);
    if (!bytes) return std::nullopt;
    return LittleEndian<T>(*bytes, 0);
  }

 private:
  struct Page {
    std::array<std::uint8_t, kPageSize> bytes{};
    std::array<Certainty, kPageSize> certainty{};

    bool operator==(const Page&) const = default;
    [[nodiscard]] bool Holds(std::size_t at, ByteSpan::iterator first, std::size_t n, Certainty all) const {
      return std::equal(first, first + static_cast<std::ptrdiff_t>(n), bytes.begin() + at) &&
             std::all_of(certainty.begin() + at, certainty.begin() + at + n, [all](Certainty c) { return c == all; });
    }
  };

  /// For writing to it: others keep what it held.
  Page& Own(std::size_t page) {
    if (pages_[page].use_count() > 1) pages_[page] = std::make_shared<Page>(*pages_[page]);
    return *pages_[page];
  }

  [[nodiscard]] static constexpr bool Fits(std::size_t address, std::size_t length) {
    return address < kSize && length <= kSize - address;
  }

  /// visit(page, first byte in the page, offset from `address`, bytes) for the part of the range below kSize.
  template <typename Visit>
  static void ForEachPage(std::size_t address, std::size_t length, Visit visit) {
    if (address >= kSize) return;
    length = std::min(length, kSize - address);
    for (std::size_t offset = 0; offset < length;) {
      const std::size_t at = (address + offset) % kPageSize;
      const std::size_t n = std::min(length - offset, kPageSize - at);
      visit((address + offset) / kPageSize, at, offset, n);
      offset += n;
    }
  }

  void CopyFrom(const RegisterImage& other) {
    Clear();
    for (std::size_t i = 0; i < pages_.size(); ++i) {
      if (other.pages_[i] && TakeFrom(allowance_, 1)) pages_[i] = other.pages_[i];
    }
  }

  Allowance* allowance_ = nullptr;
  std::array<std::shared_ptr<Page>, kSize / kPageSize> pages_;
};

}  // namespace ecaudit::esc
