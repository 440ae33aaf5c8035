#include "decoder/device/device_description.h"

#include <algorithm>

namespace ecaudit::device {

DeviceDescription::DeviceDescription() = default;
DeviceDescription::DeviceDescription(const DeviceDescription& other) = default;
DeviceDescription::DeviceDescription(DeviceDescription&& other) noexcept = default;
DeviceDescription& DeviceDescription::operator=(const DeviceDescription& other) {
  return *this = DeviceDescription(other);
}
DeviceDescription& DeviceDescription::operator=(DeviceDescription&& other) noexcept = default;
DeviceDescription::~DeviceDescription() = default;

bool AlStatusCode::AppliesTo(esc::AlState from, esc::AlState to) const {
  if (any_transition) return true;
  return std::ranges::any_of(transitions, [&](const Transition& t) { return t.from == from && t.to == to; });
}

bool AlStatusCode::AppliesIn(esc::AlState state) const {
  return std::ranges::find(states, state) != states.end();
}

const AlTransition* AlDescription::Find(esc::AlState from, esc::AlState to) const {
  const auto key = std::make_pair(from, to);
  const auto it =
      std::lower_bound(transitions.begin(), transitions.end(), key,
                       [](const AlTransition& t, const auto& k) { return std::make_pair(t.from, t.to) < k; });
  return it != transitions.end() && it->from == from && it->to == to ? &*it : nullptr;
}

const AlStatusCode* AlDescription::FindCode(std::uint16_t code) const {
  const auto it = std::ranges::lower_bound(status_codes, code, {}, &AlStatusCode::code);
  return it != status_codes.end() && it->code == code ? &*it : nullptr;
}

bool IdentityMatch::MatchesIdentity(std::uint32_t vendor, std::uint32_t product, std::uint32_t revision) const {
  if (!vendor_id || *vendor_id != vendor) return false;
  if (std::ranges::find(product_codes, product) == product_codes.end()) return false;
  return (!revision_min || revision >= *revision_min) && (!revision_max || revision <= *revision_max);
}

bool IdentityMatch::MatchesModel(std::string_view model) const {
  return std::ranges::any_of(models, [&](const std::string& start) { return model.substr(0, start.size()) == start; });
}

const AlTransition* DeviceDescription::al_transition(esc::AlState from, esc::AlState to) const {
  return al.Find(from, to);
}

bool DeviceDescription::AllowsAl(esc::AlState from, esc::AlState to) const {
  if (from == to || to == esc::AlState::INIT) return true;
  const AlTransition* row = al.Find(from, to);
  return row != nullptr && row->allowed;
}

const AlStatusCode* DeviceDescription::al_status_code(std::uint16_t code) const {
  return al.FindCode(code);
}

bool DeviceDescription::DocumentsAlStatusCode(std::uint16_t code) const {
  if (!al.status_codes_complete) return true;
  if (al.vendor_codes_from && code >= *al.vendor_codes_from) return true;
  return al.FindCode(code) != nullptr;
}

const RegisterRight* DeviceDescription::register_right(EscAddress address) const {
  auto it = std::upper_bound(registers.begin(), registers.end(), address,
                             [](EscAddress wanted, const RegisterRight& r) { return wanted < r.address; });
  if (it == registers.begin()) return nullptr;
  --it;
  return it->Covers(address) ? &*it : nullptr;
}

const EmergencyCode* DeviceDescription::emergency_by_id(std::string_view wanted) const {
  if (!emergency) return nullptr;
  const auto& codes = emergency->codes;
  const auto found = std::ranges::find(codes, wanted, &EmergencyCode::id);
  return found == codes.end() ? nullptr : &*found;
}

const FaultObject* DeviceDescription::number_object(std::uint16_t index, std::uint8_t subindex) const {
  const FaultObject* row = drive ? drive->FindFaultObject(index, subindex) : nullptr;
  if (row != nullptr) return row;
  const auto own =
      std::ranges::find_if(reported_objects, [&](const FaultObject& each) { return each.Holds(index, subindex); });
  return own == reported_objects.end() ? nullptr : &*own;
}

const DictionaryObject* DeviceDescription::object_of_keyword(std::string_view keyword) const {
  if (!dictionary || keyword.empty()) return nullptr;
  const auto& objects = dictionary->objects;
  const auto row = std::ranges::find(objects, keyword, &DictionaryObject::keyword);
  return row == objects.end() ? nullptr : &*row;
}

const DictionaryObject* DeviceDescription::object(std::uint16_t index, std::uint8_t subindex) const {
  if (dictionary) {
    if (const DictionaryObject* found = dictionary->Find(index, subindex)) return found;
  }
  return drive ? FindObject(drive->objects, index, subindex) : nullptr;
}

std::string_view DeviceDescription::object_name(std::uint16_t index, std::uint8_t subindex) const {
  const DictionaryObject* found = object(index, subindex);
  if (found != nullptr && !found->name.empty()) return found->name;
  for (const PdoDirection direction : {PdoDirection::kRx, PdoDirection::kTx}) {
    if (const CyclicObject* cyclic = pdo.FindCyclic(direction, index, subindex)) return cyclic->name;
  }
  return {};
}

Mappable DeviceDescription::MappableIn(PdoDirection direction, std::uint16_t index, std::uint8_t subindex) const {
  if (pdo.FindCyclic(direction, index, subindex) != nullptr) return Mappable::kYes;
  if (pdo.flexible) {
    for (const Padding& padding : pdo.flexible->paddings) {
      if (padding.direction == direction && padding.index == index && subindex >= padding.first_subindex &&
          subindex <= padding.last_subindex) {
        return Mappable::kYes;
      }
    }
  }
  const DictionaryObject* found = dictionary ? dictionary->Find(index, subindex) : nullptr;
  if (found == nullptr) {
    const bool complete = (dictionary && dictionary->complete) || pdo.cyclic_complete;
    return complete ? Mappable::kNo : Mappable::kUnknown;
  }
  if (found->mappable == Mappable::kNo || found->mappable == Mappable::kUnknown) return found->mappable;
  const bool other_way = (found->only && *found->only != direction) ||
                         (direction == PdoDirection::kRx && found->access == Access::kRead) ||
                         (direction == PdoDirection::kTx && found->access == Access::kWrite);
  return other_way ? Mappable::kNo : found->mappable;
}

const EmergencyCode* DeviceDescription::emergency_code(std::uint16_t code) const {
  return emergency ? emergency->Find(code) : nullptr;
}

}  // namespace ecaudit::device
