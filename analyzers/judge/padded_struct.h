/// in: the layout of process data.  out: where a C compiler puts the same entries in a struct that is not packed.
///
/// A master that copies such a struct writes what follows an 8 bit entry too late, and counts too many bytes.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "analyzers/model/process_data.h"

namespace ecaudit {

class PaddedStruct {
 public:
  /// Nothing if the entries are no members of a struct (single bits), or need no padding.
  [[nodiscard]] static std::optional<PaddedStruct> Of(const model::ProcessLayout& layout, std::uint8_t sync_manager);

  [[nodiscard]] std::uint32_t bytes() const { return bytes_; }
  /// Bytes of padding before the entry with this offset in the mapping; 0: none, or there is no such entry.
  [[nodiscard]] std::uint32_t PaddingBefore(std::uint32_t bit_offset) const;

 private:
  struct Member {
    std::uint32_t packed = 0, padded = 0;  ///< bytes from the begin
  };
  std::vector<Member> members_;
  std::uint32_t bytes_ = 0;
};

}  // namespace ecaudit
