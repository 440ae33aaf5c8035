/// What a drive is: the one type that built-in profiles, user profiles, ESI and ENI files are read into.
///
/// In: text of one of those. Out: facts with their source. A field that a source does not state stays empty or unset;
/// code that needs it reports so instead of guessing.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "decoder/device/al_description.h"
#include "decoder/device/documented_facts.h"
#include "decoder/device/drive_profile.h"
#include "decoder/device/emergency_codes.h"
#include "decoder/device/esi_description.h"
#include "decoder/device/latch_description.h"
#include "decoder/device/mailbox_description.h"
#include "decoder/device/object_bits.h"
#include "decoder/device/object_dictionary.h"
#include "decoder/device/pdo_description.h"
#include "decoder/device/register_bits.h"
#include "decoder/device/register_right.h"
#include "decoder/device/sync_description.h"

namespace ecaudit::device {

/// How a drive of this family is recognised. Without documentation nothing is set, and the note states that.
struct IdentityMatch {
  std::optional<std::uint32_t> vendor_id;
  std::vector<std::uint32_t> product_codes;
  std::optional<std::uint32_t> revision_min;  ///< inclusive
  std::optional<std::uint32_t> revision_max;  ///< inclusive
  /// Beginnings of the model type string (EEPROM category 0x0800, object 1008h).
  std::vector<std::string> models;
  std::string note;
  std::string source;

  /// True when vendor and product code are documented and equal, and the revision is not excluded.
  [[nodiscard]] bool MatchesIdentity(std::uint32_t vendor, std::uint32_t product, std::uint32_t revision) const;
  /// True when `model` begins with one of `models` (case-sensitive).
  [[nodiscard]] bool MatchesModel(std::string_view model) const;
};

class DeviceDescription {
 public:
  // Made in device_description.cpp, once: each of them goes through all that a family may state.
  DeviceDescription();
  DeviceDescription(const DeviceDescription& other);
  DeviceDescription(DeviceDescription&& other) noexcept;
  DeviceDescription& operator=(const DeviceDescription& other);
  DeviceDescription& operator=(DeviceDescription&& other) noexcept;
  ~DeviceDescription();

  std::string id;        ///< name on the command line: "kollmorgen-akd-2010"
  std::string extends;   ///< profile whose facts fill what this one does not state; empty: none
  std::string title;     ///< for people: "Kollmorgen AKD"
  std::string edition;   ///< date of the manual, "2010-10"; candidates are tried newest first
  std::string document;  ///< key of the manual in docs/sources.md
  std::string note;
  IdentityMatch match;
  AlDescription al;
  std::vector<RegisterRight> registers;     ///< sorted by address, not overlapping
  std::vector<RegisterBits> register_bits;  ///< AL control, AL status, AL status code
  std::vector<RegisterBits> event_bits;     ///< AL event mask 0x0204 and AL event request 0x0220
  std::optional<DriveProfile> drive;        ///< unset: no CiA 402 drive
  PdoDescription pdo;
  std::optional<ObjectDictionary> dictionary;  ///< unset: no dictionary documented
  std::vector<ObjectBits> object_bits;         ///< bits of objects other than control and status word
  std::vector<FaultObject> reported_objects;   ///< objects with numbers of faults and warnings, beside drive's
  std::optional<EmergencyTable> emergency;
  std::optional<LatchDescription> latch;
  std::optional<LatchDescription> touch_probe;  ///< 60B8h and 60B9h; no selectors
  SyncDescription sync;
  MailboxDescription mailbox;
  std::vector<EepromFact> eeprom;
  std::vector<FieldbusParameter> fieldbus_parameters;
  std::vector<Limit> limits;
  std::vector<Fact> facts;
  std::optional<EsiDetails> esi;  ///< set when an ESI file took part

  /// The row for a request of `to` in state `from`; null when the family's table lacks the pair.
  [[nodiscard]] const AlTransition* al_transition(esc::AlState from, esc::AlState to) const;
  /// May the master request `to` in state `from`? The current state and INIT may always be requested.
  [[nodiscard]] bool AllowsAl(esc::AlState from, esc::AlState to) const;
  /// The family's entry for an AL status code; null when its list lacks it.
  [[nodiscard]] const AlStatusCode* al_status_code(std::uint16_t code) const;
  /// False only when the family's list claims to be complete and lacks the code.
  [[nodiscard]] bool DocumentsAlStatusCode(std::uint16_t code) const;
  /// The register or buffer that `address` lies in; null when the family's manual does not mention it.
  [[nodiscard]] const RegisterRight* register_right(EscAddress address) const;
  /// What an object is: from the dictionary, else from the standard objects of the drive profile, else null.
  [[nodiscard]] const DictionaryObject* object(std::uint16_t index, std::uint8_t subindex) const;
  /// A name for an object for people: "Control word"; also found in the list of cyclic objects. Empty when unknown.
  /// Texts of the messages in 10F3h, by text ID; null: there is no ESI, or it has none.
  [[nodiscard]] const mailbox::DiagnosisTexts* diagnosis_texts() const {
    return esi && !esi->diagnosis_texts.empty() ? &esi->diagnosis_texts : nullptr;
  }
  [[nodiscard]] std::string_view object_name(std::uint16_t index, std::uint8_t subindex) const;
  /// May the object be mapped in that direction? Asks the dictionary and the list of cyclic objects, which contradict
  /// each other in places; either one's yes is a yes.
  [[nodiscard]] Mappable MappableIn(PdoDirection direction, std::uint16_t index, std::uint8_t subindex) const;
  [[nodiscard]] const EmergencyCode* emergency_code(std::uint16_t code) const;
  /// The code with the drive's own number: "F125". Null where the family's table lacks it.
  [[nodiscard]] const EmergencyCode* emergency_by_id(std::string_view id) const;
  /// The row of an object with a number of a fault or warning: of the drive, else of `reported_objects`, else null.
  [[nodiscard]] const FaultObject* number_object(std::uint16_t index, std::uint8_t subindex) const;
  /// The object of a parameter by its keyword ("FBUS.PARAM05"), in this family's dictionary; null if it has none.
  [[nodiscard]] const DictionaryObject* object_of_keyword(std::string_view keyword) const;
};

}  // namespace ecaudit::device
