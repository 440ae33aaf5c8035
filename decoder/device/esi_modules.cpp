#include "decoder/device/esi_modules.h"

#include <algorithm>
#include <utility>

#include "decoder/base/sort_by_key.h"
#include "decoder/device/device_description.h"

namespace ecaudit::device {
namespace {

/// PDOs, entries and objects of all modules of a device; real ones stay far below.
constexpr std::size_t kMaxModuleRows = 65'536;

/// An index that a later slot moves; 0 is padding and stays. Nothing where it leaves the 16 bits.
bool Move(std::uint16_t& index, std::size_t slot, std::uint16_t increment) {
  const std::size_t moved = index + slot * increment;
  if (index == 0) return true;
  if (moved > 0xFFFF) return false;
  index = static_cast<std::uint16_t>(moved);
  return true;
}

/// Equal modules have equal names.
std::string SlotText(std::size_t slot) {
  return " (slot " + std::to_string(slot + 1) + ")";
}

void AddPdo(const EsiModule::Pdo& pdo, std::size_t slot, const EsiSlots& slot_rules, PdoDescription& out) {
  PdoContent content = pdo.content;
  const std::string where = SlotText(slot);
  if (pdo.by_slot && !Move(content.index, slot, slot_rules.pdo_increment)) return;
  if (!content.name.empty()) content.name += where;
  for (std::size_t i = 0; i < content.entries.size(); ++i) {
    PdoEntry& entry = content.entries[i];
    if (pdo.entry_by_slot[i] && !Move(entry.index, slot, slot_rules.index_increment)) return;
    if (!entry.name.empty() && pdo.entry_by_slot[i]) entry.name += where;
  }
  if (!out.IsAssignable(content.direction, content.index)) {
    SelectablePdo selectable;
    selectable.direction = content.direction;
    selectable.index = content.index;
    selectable.source = content.source;
    out.selectable.push_back(std::move(selectable));
    SortByKey(out.selectable, [](const SelectablePdo& s) { return s.index; });
  }
  const auto known = std::ranges::find(out.fixed, content.index, &PdoContent::index);
  if (known != out.fixed.end()) {
    *known = std::move(content);
  } else {
    out.fixed.push_back(std::move(content));
    SortByKey(out.fixed, [](const PdoContent& other) { return other.index; });
  }
}

void AddObjects(const EsiModule& module, std::size_t slot, const EsiSlots& slot_rules, DeviceDescription& device) {
  if (module.objects.empty()) return;
  if (!device.dictionary) device.dictionary.emplace();
  std::vector<DictionaryObject> added;
  for (const EsiModule::Object& object : module.objects) {
    DictionaryObject row = object.row;
    if (object.by_slot && !Move(row.index, slot, slot_rules.index_increment)) continue;
    if (object.by_slot && !row.name.empty()) row.name += SlotText(slot);
    const bool known = row.head ? device.dictionary->FindIndex(row.index) != nullptr
                                : device.dictionary->Find(row.index, row.subindex) != nullptr;
    if (!known) added.push_back(std::move(row));
  }
  device.dictionary->objects.insert(device.dictionary->objects.end(), added.begin(), added.end());
  SortObjects(device.dictionary->objects);
}

/// A message names no slot: a text ID that modules use for different texts has none.
class ModuleTexts {
 public:
  void Add(const EsiModule& module) {
    for (const auto& [id, text] : module.diagnosis_texts) {
      const auto [row, added] = texts_.emplace(id, text);
      if (!added && row->second != text) row->second.clear();
    }
  }
  /// What the device states itself comes first.
  void MoveTo(mailbox::DiagnosisTexts& out) {
    for (auto& [id, text] : texts_) {
      if (!text.empty()) out.emplace(id, std::move(text));
    }
  }

 private:
  mailbox::DiagnosisTexts texts_;
};

}  // namespace

const EsiModule* EsiSlots::Find(std::uint32_t ident) const {
  const auto found =
      std::lower_bound(modules->begin(), modules->end(), ident,
                       [](const EsiModule& module, std::uint32_t value) { return module.ident < value; });
  return found != modules->end() && found->ident == ident ? &*found : nullptr;
}

DeviceDescription WithModules(DeviceDescription device, std::span<const std::uint32_t> idents) {
  const EsiSlots slot_rules = *device.esi->slot_rules;
  std::size_t rows = 0;
  for (const std::uint32_t ident : idents) {
    if (ident == 0) continue;
    const EsiModule* module = slot_rules.Find(ident);
    if (module == nullptr) return device;
    rows += module->objects.size() + module->diagnosis_texts.size();
    for (const EsiModule::Pdo& pdo : module->pdos) rows += 1 + pdo.content.entries.size();
  }
  if (rows > kMaxModuleRows) return device;
  ModuleTexts texts;
  for (std::size_t slot = 0; slot < idents.size(); ++slot) {
    const EsiModule* module = idents[slot] == 0 ? nullptr : slot_rules.Find(idents[slot]);
    if (module == nullptr) continue;
    for (const EsiModule::Pdo& pdo : module->pdos) AddPdo(pdo, slot, slot_rules, device.pdo);
    AddObjects(*module, slot, slot_rules, device);
    texts.Add(*module);
  }
  texts.MoveTo(device.esi->diagnosis_texts);
  device.esi->modules_known = true;
  return device;
}

}  // namespace ecaudit::device
