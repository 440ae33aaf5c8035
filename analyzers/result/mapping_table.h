/// A PDO mapping of one direction that went wrong, entry by entry: what the master wanted, what the slave accepted, and
/// where each entry lies in the process data. Plain data.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "decoder/base/ids.h"

namespace ecaudit {

/// One subindex of 1C12h, 1C13h or of a mapping object.
struct MappingRow {
  enum class Answer : std::uint8_t {
    kAccepted,
    kAborted,
    kOther,    ///< an upload shows another value than was written
    kOnlyRead  ///< the master did not write it
  };
  std::uint16_t list = 0;
  std::uint8_t subindex = 0;
  Answer answer = Answer::kAccepted;
  std::string wanted;                       ///< "6077h:0, 32 bit", "1A00h", "3 entries"; empty: not written
  std::string slave;                        ///< "accepted", "aborted (0x06040041)", "reads 16 bit"
  std::optional<std::uint32_t> wanted_bit;  ///< first bit in the process data, as the master wants it; absent: none
  std::optional<std::uint32_t> slave_bit;   ///< ... by what the slave accepted
  /// slave_bit rests on an assumption: on the type of an object that the slave let the master map otherwise, or on
  /// that the slave has no older entry where it aborted one.
  bool doubtful = false;
  bool shifted = false;  ///< the master reads or writes it at wanted_bit, and the slave has it at slave_bit
  FrameNo frame = 0;     ///< of the write; 0: none
};

struct MappingTable {
  static constexpr std::size_t kMaxRows = 64;

  std::uint8_t sync_manager = 0;
  bool outputs = false;
  bool as_wanted = false;    ///< the sync manager is as long as the master wants: it uses the wanted places
  bool of_each_pdo = false;  ///< the assignment is not known: places count from the start of each PDO
  std::optional<std::uint32_t> wanted_bits;
  std::optional<std::uint32_t> slave_bits;
  std::optional<std::uint32_t> manager_bytes;  ///< length of the sync manager, as the master set it
  FrameNo manager_frame = 0;
  std::vector<MappingRow> rows;
  std::size_t rows_left_out = 0;
};

/// "accepted", "aborted", "other", "only-read": public interface.
[[nodiscard]] constexpr std::string_view Name(MappingRow::Answer answer) {
  constexpr std::array<std::string_view, 4> kNames{"accepted", "aborted", "other", "only-read"};
  return kNames[static_cast<std::size_t>(answer)];
}

}  // namespace ecaudit
