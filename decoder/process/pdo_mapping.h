/// in: SDO transfers of one slave.  out: which PDOs are assigned and what is mapped into them, as far as it was seen.
///
/// Learns from downloads and uploads alike of the assignments 1C12h and 1C13h and the mapping objects 1600h-17FFh and
/// 1A00h-1BFFh, by single subindices or complete access. Nothing is assumed: an object that was not seen is unknown.
///
/// Source: ETG.1000.6 5.6.7.4; esc-reference 9.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "decoder/base/allowance.h"
#include "decoder/base/ids.h"
#include "decoder/base/known.h"
#include "decoder/mailbox/events.h"

namespace ecaudit::process {

inline constexpr std::uint16_t kRxAssignment = 0x1C12;  ///< PDOs of sync manager 2: master to slave
inline constexpr std::uint16_t kTxAssignment = 0x1C13;  ///< PDOs of sync manager 3: slave to master

/// 1600h-17FFh.
[[nodiscard]] constexpr bool IsRxMapping(std::uint16_t index) {
  return index >= 0x1600 && index < 0x1800;
}
/// 1A00h-1BFFh.
[[nodiscard]] constexpr bool IsTxMapping(std::uint16_t index) {
  return index >= 0x1A00 && index < 0x1C00;
}
[[nodiscard]] constexpr bool IsAssignment(std::uint16_t index) {
  return index == kRxAssignment || index == kTxAssignment;
}
[[nodiscard]] constexpr bool IsPdoObject(std::uint16_t index) {
  return IsRxMapping(index) || IsTxMapping(index) || IsAssignment(index);
}

/// One mapping entry: bits 31-16 index, 15-8 subindex, 7-0 length in bits. Index 0 fills a gap.
struct MappingEntry {
  std::uint16_t index = 0;
  std::uint8_t subindex = 0;
  std::uint8_t bits = 0;

  [[nodiscard]] static constexpr MappingEntry FromValue(std::uint32_t value) {
    return {static_cast<std::uint16_t>(value >> 16U), static_cast<std::uint8_t>(value >> 8U),
            static_cast<std::uint8_t>(value)};
  }
  friend constexpr bool operator==(const MappingEntry&, const MappingEntry&) = default;
};

/// One value of a transfer: of a single subindex, or one of those that complete access carries.
struct PdoValue {
  std::uint8_t subindex = 0;
  std::uint32_t value = 0;
};
/// The values that a transfer of an assignment or mapping object writes or reads, whatever its outcome. Complete access
/// from subindex 0 on has the count in two bytes, then the entries without gaps.
[[nodiscard]] std::vector<PdoValue> PdoValuesOf(const mailbox::SdoTransfer& transfer);

/// An assignment or mapping object as last written or read.
struct PdoObject {
  Known<std::uint8_t> count;                     ///< subindex 0
  bool count_lost = false;                       ///< it was written, and whether that was done is not known
  std::map<std::uint8_t, std::uint32_t> values;  ///< subindices 1-255 that were seen
  FrameNo since = 0;                             ///< last frame that changed it

  /// Subindices 1 to count, when all of them are known; the empty list when the count is 0.
  [[nodiscard]] std::optional<std::vector<std::uint32_t>> Contents() const;
  /// The highest subindex that was seen besides subindex 0; 0: none.
  [[nodiscard]] std::uint8_t highest() const { return values.empty() ? std::uint8_t{0} : values.rbegin()->first; }
  /// The lowest subindex below highest() that was not seen; 0: none is left out.
  [[nodiscard]] std::uint8_t left_out() const;
};

class PdoMapping {
 public:
  /// All objects of one slave together; later ones are not kept, so that a capture cannot exhaust memory.
  static constexpr std::size_t kMaxValues = 8192;
  /// PDOs that the slave does not have: later ones are not kept.
  static constexpr std::size_t kMaxMissing = 8;

  /// @param values what all slaves share for objects and values; null: no common limit; else must outlive this
  explicit PdoMapping(Allowance* values = nullptr) : allowance_(values) {}

  /// Takes a transfer that was completed, or that is assumed to be (outbound-only capture, then as inferred), and
  /// uploads that the slave aborted because it has no such PDO.
  /// @return true when an assignment or a mapping changed
  bool Apply(const mailbox::SdoTransfer& transfer);
  /// A download of it may have been done or not.
  /// @param whole all subindices (complete access)  @return true when something was known of it
  bool Forget(std::uint16_t index, std::uint8_t subindex, bool whole);
  /// Another device stands there.
  void Clear();

  /// Null when the object was never seen.
  [[nodiscard]] const PdoObject* Find(std::uint16_t index) const;
  /// PDOs assigned to sync manager 2 (kRxAssignment) or 3, if completely known.
  [[nodiscard]] std::optional<std::vector<std::uint16_t>> Assigned(std::uint16_t assignment) const;
  /// Contents of a mapping object, if completely known.
  [[nodiscard]] std::optional<std::vector<MappingEntry>> Mapped(std::uint16_t pdo) const;
  /// The slave does not have this PDO: the frame in which it aborted an upload of it. Null: not known.
  [[nodiscard]] const FrameNo* MissingSince(std::uint16_t pdo) const;
  /// Changes with everything that is learned.
  [[nodiscard]] std::uint32_t version() const { return version_; }

 private:
  struct Missing {
    std::uint16_t pdo = 0;
    FrameNo aborted = 0;
  };
  bool Set(std::uint16_t index, std::uint8_t subindex, std::uint32_t value, Certainty certainty, FrameNo frame);

  Allowance* allowance_;
  std::map<std::uint16_t, PdoObject> objects_;
  std::vector<Missing> missing_;  ///< at most kMaxMissing
  std::size_t values_ = 0;
  std::uint32_t version_ = 0;
};

}  // namespace ecaudit::process
