/// in: SDO transfers, EEPROM, description of one slave.  out: what its process data hold, entry by entry.
///
///   which PDOs   1C12h/1C13h seen > ENI > EEPROM > ESI      (the assignment; where only a part of it was seen, the
///                                                            others count if they agree with that part)
///   what in them 1600h.../1A00h... seen > ENI > manual, ESI > EEPROM   (the contents)
///
/// Source: ETG.1000.6 5.6.7.4; esc-reference 9, 11.1.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "analyzers/objects/object_names.h"
#include "decoder/base/ids.h"
#include "decoder/device/device_description.h"
#include "decoder/device/eni_reader.h"
#include "decoder/process/pdo_mapping.h"
#include "decoder/track/slave_state.h"

namespace ecaudit::model {

/// Where the assignment of PDOs is known from.
enum class LayoutSource : std::uint8_t {
  kUnknown,
  kObserved,  ///< written or read by SDO in the capture
  kDefault,   ///< the drive's own default, by its EEPROM or ESI; nothing in the capture changes it
  kEni,       ///< what the master was configured to use
};
/// "unknown", "observed", "default", "eni".
[[nodiscard]] std::string_view Name(LayoutSource source);

/// One entry of the process data.
struct Signal {
  std::uint16_t pdo = 0;
  std::uint16_t index = 0;  ///< 0: a gap
  std::uint8_t subindex = 0;
  std::uint8_t sync_manager = 0;
  std::uint16_t bits = 0;
  std::uint32_t bit_offset = 0;  ///< from the first bit of the sync manager's buffer
  std::string name;              ///< "Control word"; empty when unknown. May be untrusted text
  bool name_inferred = false;    ///< from another family of the same maker
  mailbox::DataType type = mailbox::DataType::kUnknown;
  bool type_standard = false;  ///< by a standard or a relative: neither the slave nor its description gives the type
  std::string variable;        ///< what the master's configuration (ENI) calls it; empty: nothing. Untrusted text
  std::string unit;            ///< empty: none, or unknown
  std::string scale;           ///< in the process data: "1000:1"; empty: plain number
  bool scaled_by_sdo = false;  ///< a value by SDO has another scale than 1:1, and may be another number

  [[nodiscard]] bool gap() const { return index == 0; }
};

/// The process data of one slave in one direction.
struct ProcessLayout {
  LayoutSource source = LayoutSource::kUnknown;
  /// What is not known, or what contradicts it, for people and without a full stop; empty when it can be relied on.
  std::string reason;
  /// A default (not observed) does not fit the length of the sync manager: another mapping must be in force.
  bool contradicted = false;
  bool assumed = false;             ///< rests on downloads whose answers are not captured
  std::vector<std::uint16_t> pdos;  ///< as assigned, in order; contents may be unknown
  std::vector<Signal> signals;      ///< in order; complete when known()
  std::uint32_t bits = 0;           ///< sum of all signals
  FrameNo since = 0;                ///< last frame that changed assignment or contents; 0: not from the capture

  /// Every bit has its meaning, and nothing contradicts it.
  [[nodiscard]] bool known() const { return source != LayoutSource::kUnknown && reason.empty(); }
  [[nodiscard]] std::uint32_t bytes() const { return (bits + 7) / 8; }
  /// Bytes in the buffer of one sync manager.
  [[nodiscard]] std::uint32_t bytes_of(std::uint8_t sync_manager) const;
  /// Null when the object is not mapped.
  [[nodiscard]] const Signal* Find(std::uint16_t index, std::uint8_t subindex) const;
};

class ProcessData {
 public:
  /// More entries in one direction are not decoded: no drive has as many.
  static constexpr std::size_t kMaxSignals = 2048;

  /// @param state, names must outlive this; a reference to `state` stays valid while slaves are added
  /// @param values what all slaves share for mapping objects; null: no common limit; else must outlive this
  ProcessData(const track::SlaveState& state, const events::ObjectNames& names, Allowance* values = nullptr)
      : state_(state), names_(names), seen_(values) {}

  /// The family's facts, with those of an ESI file where there is one; never null.
  void SetFamily(const device::DeviceDescription& family);
  /// What an ENI file states of this slave, and the whole file for the names of its variables; null: there is none.
  /// Both must stay valid.
  void SetEni(const device::EniSlave* slave, const device::EniConfig* config);
  /// @return true when something changed
  bool Apply(const mailbox::SdoTransfer& transfer);
  /// A download of this object may have been done or not. @return true when something changed
  bool Forget(std::uint16_t index, std::uint8_t subindex, bool whole);
  /// The bus is initialised again: devices may have been without power, and forget what was assigned. A sync manager
  /// that is then set to another length shows that this one did.
  void OnRunBegan();
  /// Another device stands there.
  void OnOtherDevice();
  /// A word of the EEPROM was read or written, or the slave gave the name of an object.
  void OnDescriptionChanged() { ++changes_; }

  /// Assignments and mapping objects as the capture shows them.
  [[nodiscard]] const process::PdoMapping& seen() const { return seen_; }
  [[nodiscard]] const ProcessLayout& rx() const { return Layout(device::PdoDirection::kRx); }
  [[nodiscard]] const ProcessLayout& tx() const { return Layout(device::PdoDirection::kTx); }
  [[nodiscard]] const ProcessLayout& Layout(device::PdoDirection direction) const;
  /// Changes with everything that the layouts rest on.
  [[nodiscard]] std::uint64_t version() const { return changes_ + state_.mapping_version; }

 private:
  struct Cached {
    std::uint64_t version = ~std::uint64_t{0};
    ProcessLayout layout;
  };
  class Computation;  // of a layout

  /// Gives the entries the names of the variables that lie where the master puts them in its process image.
  void NameVariables(device::PdoDirection direction, ProcessLayout& layout) const;

  const track::SlaveState& state_;
  const events::ObjectNames& names_;
  const device::DeviceDescription* family_ = nullptr;
  const device::EniSlave* eni_slave_ = nullptr;
  const device::EniConfig* eni_config_ = nullptr;
  /// The PDOs in it; null where the file describes none, which does not mean that the slave has none.
  const std::vector<device::PdoContent>* eni_ = nullptr;
  process::PdoMapping seen_;
  std::uint64_t changes_ = 0;
  FrameNo doubted_ = 0;  ///< the last frame before the present run that changed seen_; 0: none
  mutable std::array<Cached, 2> cached_;
};

}  // namespace ecaudit::model
