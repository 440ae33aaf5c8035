/// Modules of a modular device as an ESI file describes them, and the device with modules in its slots.
/// Source: ETG.2000 (Modules, Slots), ETG.5001.1 (F030h, F050h).
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "decoder/device/object_dictionary.h"
#include "decoder/device/pdo_description.h"
#include "decoder/mailbox/diagnosis_message.h"

namespace ecaudit::device {

class DeviceDescription;

/// One module. What depends on the slot is as in the first one; in a later slot its index is higher.
struct EsiModule {
  struct Pdo {
    PdoContent content;
    bool by_slot = false;             ///< the PDO's own index depends on the slot
    std::vector<bool> entry_by_slot;  ///< of each entry: its index does
  };
  struct Object {
    DictionaryObject row;
    bool by_slot = false;
  };
  std::uint32_t ident = 0;
  std::string name;  ///< untrusted text
  std::vector<Pdo> pdos;
  std::vector<Object> objects;
  mailbox::DiagnosisTexts diagnosis_texts;  ///< of object 10F3h (Profile/DiagMessages)
};

/// The slots of a device.
struct EsiSlots {
  std::uint16_t pdo_increment = 0;    ///< of a PDO's index from slot to slot
  std::uint16_t index_increment = 0;  ///< of an object's index from slot to slot
  bool download_idents = false;       ///< the master has to write the list of modules (F030h)
  /// All modules of the file, by ident; shared by its devices. Never null.
  std::shared_ptr<const std::vector<EsiModule>> modules;

  /// Null: the file has no such module.
  [[nodiscard]] const EsiModule* Find(std::uint32_t ident) const;
};

/// `device` with PDOs, objects and diagnosis texts of the modules in its slots.
/// @param device  has esi->slot_rules
/// @param idents  what is in each slot, the first slot first; 0: it is empty
/// A slot whose module the file does not have leaves the device as it is: its process data are then not known by it.
[[nodiscard]] DeviceDescription WithModules(DeviceDescription device, std::span<const std::uint32_t> idents);

}  // namespace ecaudit::device
