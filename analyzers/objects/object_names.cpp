#include "analyzers/objects/object_names.h"

#include "analyzers/objects/relatives.h"
#include "decoder/base/names.h"
#include "decoder/base/text.h"
#include "decoder/device/profile_registry.h"
#include "decoder/process/pdo_mapping.h"

namespace ecaudit::events {
namespace {

constexpr std::size_t kEntryBytes = 128;  // of a name that is kept, beside its letters

using device::DeviceDescription;
using device::DictionaryObject;

const DeviceDescription* GenericProfile() {
  return device::BuiltinProfile("generic");
}

/// Row of a subindex and, where the object has several, the row that names it as a whole.
struct Rows {
  const DictionaryObject* entry = nullptr;
  const DictionaryObject* head = nullptr;
};

Rows FindIn(const DeviceDescription& profile, std::uint16_t index, std::uint8_t subindex) {
  Rows rows;
  rows.entry = profile.object(index, subindex);
  if (profile.dictionary) rows.head = profile.dictionary->FindIndex(index);
  if (rows.head != nullptr && !rows.head->head) rows.head = nullptr;
  return rows;
}

std::string Joined(std::string_view head, std::string_view entry) {
  if (head.empty() || head == entry) return std::string(entry);
  if (entry.empty()) return std::string(head);
  return std::string(head) + ": " + std::string(entry);
}

/// Fills what is still open from rows of one source.
void Take(const Rows& rows, std::uint8_t subindex, NameSource source, ObjectInfo& info) {
  const std::string_view head = rows.head != nullptr ? std::string_view(rows.head->name) : std::string_view();
  const std::string_view entry = rows.entry != nullptr ? std::string_view(rows.entry->name) : std::string_view();
  if (info.name.empty() && rows.entry != nullptr) {
    info.name = Joined(head, entry);
    if (!info.name.empty()) info.name_source = source;
  }
  if (rows.entry == nullptr || info.type != mailbox::DataType::kUnknown) return;
  info.type = CoeType(rows.entry->TypeOf(subindex));
  if (info.type == mailbox::DataType::kUnknown) return;
  info.type_source = source;
  info.unit = rows.entry->unit;
  info.scale = rows.entry->scale;
  info.pdo_unit = rows.entry->pdo_unit;
  info.pdo_scale = rows.entry->pdo_scale;
}

/// What the manual's list of cyclic objects states, where there is no dictionary.
void TakeCyclic(const DeviceDescription& profile, std::uint16_t index, std::uint8_t subindex, ObjectInfo& info) {
  for (const device::PdoDirection direction : {device::PdoDirection::kRx, device::PdoDirection::kTx}) {
    const device::CyclicObject* cyclic = profile.pdo.FindCyclic(direction, index, subindex);
    if (cyclic == nullptr) continue;
    if (info.name.empty() && !cyclic->name.empty()) {
      info.name = cyclic->name;
      info.name_source = NameSource::kProfile;
    }
    if (info.type == mailbox::DataType::kUnknown && cyclic->type != device::DataType::kUnknown) {
      info.type = CoeType(cyclic->type);
      info.type_source = NameSource::kProfile;
    }
  }
}

/// Objects that are ranges in the standard, so that no dictionary lists them one by one.
void TakeStandardRange(std::uint16_t index, std::uint8_t subindex, ObjectInfo& info) {
  std::string head;
  std::string entry = "Entry " + std::to_string(subindex);
  mailbox::DataType type = mailbox::DataType::kUnsigned32;
  if (process::IsRxMapping(index)) {
    head = "RxPDO mapping";
  } else if (process::IsTxMapping(index)) {
    head = "TxPDO mapping";
  } else if (index >= 0x1C10 && index < 0x1C30) {
    head = "SyncManager " + std::to_string(index - 0x1C10) + " PDO assignment";
    entry = "PDO " + std::to_string(subindex);
    type = mailbox::DataType::kUnsigned16;
  } else {
    return;
  }
  if (subindex == 0) {
    entry = "Number of entries";
    type = mailbox::DataType::kUnsigned8;
  }
  if (info.name.empty()) {
    info.name = Joined(head, entry);
    info.name_source = NameSource::kStandard;
  }
  if (info.type == mailbox::DataType::kUnknown) {
    info.type = type;
    info.type_source = NameSource::kStandard;
  }
}

bool Complete(const ObjectInfo& info) {
  return !info.name.empty() && info.type != mailbox::DataType::kUnknown;
}

}  // namespace

std::string_view Name(NameSource source) {
  static constexpr Named<NameSource> kNames[] = {
      {NameSource::kNone, ""},
      {NameSource::kSlave, "slave"},
      {NameSource::kProfile, "profile"},
      {NameSource::kStandard, "standard"},
      {NameSource::kInferred, "inferred"},
  };
  static_assert(NamesAll(kNames, NameSource::kInferred));
  return NameIn(kNames, source);
}

mailbox::DataType CoeType(device::DataType type) {
  using To = mailbox::DataType;
  switch (type) {
    case device::DataType::kBoolean:
      return To::kBoolean;
    case device::DataType::kInteger8:
      return To::kInteger8;
    case device::DataType::kInteger16:
      return To::kInteger16;
    case device::DataType::kInteger32:
      return To::kInteger32;
    case device::DataType::kInteger64:
      return To::kInteger64;
    case device::DataType::kUnsigned8:
      return To::kUnsigned8;
    case device::DataType::kUnsigned16:
      return To::kUnsigned16;
    case device::DataType::kUnsigned32:
      return To::kUnsigned32;
    case device::DataType::kUnsigned64:
      return To::kUnsigned64;
    case device::DataType::kReal32:
      return To::kReal32;
    case device::DataType::kReal64:
      return To::kReal64;
    case device::DataType::kVisibleString:
      return To::kVisibleString;
    case device::DataType::kOctetString:
      return To::kOctetString;
    case device::DataType::kUnknown:
    case device::DataType::kArray:
    case device::DataType::kRecord:
      break;
  }
  return To::kUnknown;
}

void ObjectNames::Learn(const mailbox::SdoInfo& info) {
  if (info.outcome != mailbox::SdoInfo::Outcome::kCompleted || info.fragment_error || info.malformed) return;
  if (objects_.size() + entries_.size() >= kMaxLearned || !TakeFrom(bytes_, kEntryBytes + info.name.size())) return;
  if (info.kind == mailbox::SdoInfo::Kind::kObject && !info.name.empty()) {
    objects_[info.index] = info.name;
  } else if (info.kind == mailbox::SdoInfo::Kind::kEntry) {
    // Types that only frame a record show nothing of a value.
    const auto type = static_cast<mailbox::DataType>(info.data_type);
    const bool plain = mailbox::BitLength(type) != 0 || type == mailbox::DataType::kVisibleString ||
                       type == mailbox::DataType::kOctetString || type == mailbox::DataType::kUnicodeString;
    entries_[{info.index, info.subindex}] = {std::string(info.name), plain ? type : mailbox::DataType::kUnknown};
  }
}

ObjectInfo ObjectNames::Find(const DeviceDescription* profile, std::uint16_t index, std::uint8_t subindex) const {
  ObjectInfo info;
  const auto object = objects_.find(index);
  if (const auto entry = entries_.find({index, subindex}); entry != entries_.end()) {
    info.name = Joined(object != objects_.end() ? object->second : "", entry->second.name);
    info.type = entry->second.type;
    if (!info.name.empty()) info.name_source = NameSource::kSlave;
    if (info.type != mailbox::DataType::kUnknown) info.type_source = NameSource::kSlave;
  }
  const DeviceDescription* generic = GenericProfile();
  if (profile != nullptr && profile != generic && !Complete(info)) {
    const Rows rows = FindIn(*profile, index, subindex);
    // What the family only inherits is the standard's.
    const DictionaryObject* standard = generic != nullptr ? generic->object(index, subindex) : nullptr;
    const bool inherited = rows.entry != nullptr && standard != nullptr && standard->source == rows.entry->source;
    Take(rows, subindex, inherited ? NameSource::kStandard : NameSource::kProfile, info);
    TakeCyclic(*profile, index, subindex, info);
  }
  if (generic != nullptr && !Complete(info)) {
    Take(FindIn(*generic, index, subindex), subindex, NameSource::kStandard, info);
  }
  if (!Complete(info)) TakeStandardRange(index, subindex, info);
  if (profile != nullptr && !Complete(info)) {
    for (const DeviceDescription* other : RelativesWith(*profile, index)) {
      Take(FindIn(*other, index, subindex), subindex, NameSource::kInferred, info);
    }
  }
  return info;
}

ObjectInfo ObjectNames::FindWhole(const DeviceDescription* profile, std::uint16_t index) const {
  ObjectInfo info;
  if (const auto object = objects_.find(index); object != objects_.end()) {
    info.name = object->second;
    info.name_source = NameSource::kSlave;
    return info;
  }
  const auto head = [&](const DeviceDescription* from, NameSource source) {
    if (from == nullptr || !info.name.empty()) return;
    const DictionaryObject* row = from->dictionary ? from->dictionary->FindIndex(index) : nullptr;
    if (row == nullptr && from->drive) row = device::FindObjectHead(from->drive->objects, index);
    if (row == nullptr) row = from->object(index, 0);
    if (row == nullptr || row->name.empty()) return;
    info.name = row->name;
    info.name_source = source;
  };
  head(profile, NameSource::kProfile);
  head(GenericProfile(), NameSource::kStandard);
  if (info.name.empty()) {
    TakeStandardRange(index, 0, info);
    if (const std::size_t colon = info.name.find(": "); colon != std::string::npos) info.name.resize(colon);
  }
  if (profile != nullptr && info.name.empty()) {
    for (const DeviceDescription* other : RelativesWith(*profile, index)) head(other, NameSource::kInferred);
  }
  info.type = mailbox::DataType::kUnknown;
  info.type_source = NameSource::kNone;
  return info;
}

}  // namespace ecaudit::events
