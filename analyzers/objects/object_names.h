/// What an object of one slave is called and of which type it is, from the best source there is.
///
/// Sources, best first: what the slave itself reported (SDO information), its family's manual, the objects that all CoE
/// devices share, and another family of the same maker. The last one is an inference: families differ.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "decoder/base/allowance.h"
#include "decoder/device/device_description.h"
#include "decoder/mailbox/coe_types.h"
#include "decoder/mailbox/events.h"

namespace ecaudit::events {

enum class NameSource : std::uint8_t {
  kNone,
  kSlave,     ///< SDO information
  kProfile,   ///< the family's manual
  kStandard,  ///< objects of every CoE device: ETG.1000.6, ETG.1020
  kInferred,  ///< another family of the same maker
};
/// "slave", "profile", "standard", "inferred"; "" for kNone.
[[nodiscard]] std::string_view Name(NameSource source);

struct ObjectInfo {
  std::string name;  ///< "Identity: Vendor ID"; empty when unknown. May be untrusted text
  NameSource name_source = NameSource::kNone;
  mailbox::DataType type = mailbox::DataType::kUnknown;
  NameSource type_source = NameSource::kNone;
  std::string unit;       ///< empty: none
  std::string scale;      ///< by SDO: "1000:1"; empty: plain number
  std::string pdo_unit;   ///< in the process data, if it is another one; else empty
  std::string pdo_scale;  ///< likewise
};

class ObjectNames {
 public:
  /// Objects and entries of all indices that one slave may list; later ones are not kept.
  static constexpr std::size_t kMaxLearned = 16384;

  /// @param bytes what all slaves share for names; null: no common limit; else must outlive this
  explicit ObjectNames(Allowance* bytes = nullptr) : bytes_(bytes) {}

  /// Takes a completed object or entry description.
  void Learn(const mailbox::SdoInfo& info);
  /// @param profile the slave's family; null: only what all families share
  [[nodiscard]] ObjectInfo Find(const device::DeviceDescription* profile, std::uint16_t index,
                                std::uint8_t subindex) const;
  /// Name of the whole object, for complete access: "Identity".
  [[nodiscard]] ObjectInfo FindWhole(const device::DeviceDescription* profile, std::uint16_t index) const;

 private:
  struct Learned {
    std::string name;
    mailbox::DataType type = mailbox::DataType::kUnknown;
  };
  Allowance* bytes_;
  std::map<std::uint16_t, std::string> objects_;
  std::map<std::pair<std::uint16_t, std::uint8_t>, Learned> entries_;
};

/// The same type as number of the CoE object dictionary.
[[nodiscard]] mailbox::DataType CoeType(device::DataType type);

}  // namespace ecaudit::events
