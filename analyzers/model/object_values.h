/// in: SDO transfers of one slave.  out: the last value of each object that was written or read.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <utility>

#include "decoder/base/allowance.h"
#include "decoder/base/bytes.h"
#include "decoder/base/ids.h"
#include "decoder/base/known.h"
#include "decoder/mailbox/events.h"

namespace ecaudit::model {

/// One subindex as last seen. Values longer than eight bytes (texts, records) are not kept.
struct ObjectValue {
  std::uint64_t raw = 0;  ///< little endian, without sign extension
  std::uint8_t bytes = 0;
  bool written = false;  ///< by a download; else read by an upload
  Certainty certainty = Certainty::kObserved;
  FrameNo since = 0;  ///< frame of the answer, or of the request where no answers are captured

  /// As two's complement of its size.
  [[nodiscard]] std::int64_t as_signed() const { return SignExtend(raw, 8U * bytes); }
};

class ObjectValues {
 public:
  /// Later objects are not kept, so that a capture cannot exhaust memory.
  static constexpr std::size_t kMaxObjects = 4096;

  /// @param objects what all slaves share; null: no common limit; else must outlive this
  explicit ObjectValues(Allowance* objects = nullptr) : objects_(objects) {}

  /// Takes a completed transfer of a single subindex, or a download whose answer cannot be in the capture (then as
  /// inferred). Others change nothing.
  void Apply(const mailbox::SdoTransfer& transfer);
  /// What was known of it may not be true any more.
  void Forget(std::uint16_t index, std::uint8_t subindex);
  void Clear();
  /// Null when it was never seen.
  [[nodiscard]] const ObjectValue* Find(std::uint16_t index, std::uint8_t subindex) const;

 private:
  Allowance* objects_;
  std::map<std::pair<std::uint16_t, std::uint8_t>, ObjectValue> values_;
};

}  // namespace ecaudit::model
