/// The kinds of lines that `events` writes, as in --type and in the key "event".
#pragma once

#include <bitset>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "decoder/base/result.h"

namespace ecaudit::cli {

enum class EventType : std::uint8_t {
  kRegisterWrite,
  kAlRequest,
  kAlState,
  kMailbox,
  kSdo,
  kSdoInfo,
  kPdoMapping,
  kLatch,
  kEmergency,
  kFoe,
  kEoe,
  kSoe,
  kAoe,
  kVoe,
  kEeprom,
  kDc,
  kDriveState,
  kEcatEvent,
  kLeftOut,  ///< no event of the bus: how many lines were not written; always shown
  kCount,
};
inline constexpr std::size_t kEventTypes = static_cast<std::size_t>(EventType::kCount);

/// "register-write", "sdo", ...
[[nodiscard]] std::string_view Name(EventType type);
/// "register-write, al-request, ..."
[[nodiscard]] std::string EventTypeList();

class EventTypes {
 public:
  [[nodiscard]] bool Has(EventType type) const { return set_.test(static_cast<std::size_t>(type)); }
  /// --type names them; false: none was named.
  [[nodiscard]] bool chosen() const { return chosen_; }

  /// Reads --type, given any number of times with one or more names between commas; all types but
  /// ecat-event when never given.
  [[nodiscard]] static Result<EventTypes> Parse(const std::vector<std::string>& options);

 private:
  std::bitset<kEventTypes> set_;
  bool chosen_ = false;
};

}  // namespace ecaudit::cli
