#include "analyzers/model/process_data.h"

#include <algorithm>
#include <optional>

#include "decoder/base/text.h"
#include "decoder/esc/sii.h"

namespace ecaudit::model {
namespace {

using device::PdoContent;
using device::PdoDirection;

constexpr std::uint8_t kOutputs = 2;  // sync managers of CoE devices
constexpr std::uint8_t kInputs = 3;
constexpr std::uint8_t kSiiOutputs = 3;  // types of sync managers in the EEPROM
constexpr std::uint8_t kSiiInputs = 4;

/// A PDO and the sync manager whose buffer it lies in.
struct AssignedPdo {
  std::uint16_t pdo = 0;
  std::uint8_t sync_manager = 0;
};

/// An entry from any source, with the name that this source gives it.
struct Entry {
  std::uint16_t index = 0;
  std::uint8_t subindex = 0;
  std::uint16_t bits = 0;
  std::string name;
  mailbox::DataType type = mailbox::DataType::kUnknown;
};

/// The PDOs that a description assigns in one direction by itself.
std::vector<AssignedPdo> AssignedBy(const std::vector<PdoContent>& pdos, PdoDirection direction) {
  std::vector<AssignedPdo> assigned;
  for (const PdoContent& pdo : pdos) {
    if (pdo.direction == direction && pdo.sync_manager) assigned.push_back({pdo.index, *pdo.sync_manager});
  }
  return assigned;
}

const PdoContent* FindPdo(const std::vector<PdoContent>& pdos, PdoDirection direction, std::uint16_t index) {
  const auto found = std::find_if(pdos.begin(), pdos.end(), [&](const PdoContent& pdo) {
    return pdo.direction == direction && pdo.index == index;
  });
  return found == pdos.end() ? nullptr : &*found;
}

std::vector<Entry> EntriesOf(const PdoContent& pdo) {
  std::vector<Entry> entries;
  entries.reserve(pdo.entries.size());
  for (const device::PdoEntry& entry : pdo.entries) {
    entries.push_back({entry.index, entry.subindex, entry.bits, entry.name, events::CoeType(entry.type)});
  }
  return entries;
}

/// Names and types for entries that a mapping object gave as numbers.
void NameAfter(const PdoContent& pdo, std::vector<Entry>& entries) {
  for (Entry& entry : entries) {
    for (const device::PdoEntry& described : pdo.entries) {
      if (described.index != entry.index || described.subindex != entry.subindex || described.bits != entry.bits) {
        continue;
      }
      entry.name = described.name;
      entry.type = events::CoeType(described.type);
      break;
    }
  }
}

/// Whether what was seen of an assignment could be a part of this one.
bool Agrees(const process::PdoObject& seen, const std::vector<AssignedPdo>& assigned) {
  const std::uint8_t* count = seen.count.if_known();
  if (count != nullptr && *count != assigned.size()) return false;
  for (const auto& [subindex, pdo] : seen.values) {
    if (subindex == 0) continue;
    if (subindex > assigned.size()) {
      if (count == nullptr) return false;
    } else if (assigned[subindex - 1U].pdo != pdo) {
      return false;
    }
  }
  return true;
}

/// The EEPROM's lists of PDOs, read only when nothing better is known.
class Eeprom {
 public:
  Eeprom(const esc::SiiImage& image, PdoDirection direction) : image_(image), direction_(direction) {}

  /// Nothing unless the EEPROM was read to its end mark, so that no PDO can be missing, and it is the EEPROM that
  /// shows.
  [[nodiscard]] std::optional<std::vector<AssignedPdo>> Assigned() {
    if (!Contents().Complete(Category()) || LeftToCoe()) return std::nullopt;
    std::vector<AssignedPdo> assigned;
    for (const esc::SiiPdo& pdo : Pdos()) {
      if (pdo.sync_manager != 0xFF) assigned.push_back({pdo.index, pdo.sync_manager});
    }
    return assigned;
  }
  /// Read to its end mark without any PDO, of a slave that may show them by CoE: masters ask for 1C12h and 1C13h
  /// instead of reading these lists (esc-reference 9). A slave without CoE, or without a sync manager for them, has
  /// none.
  [[nodiscard]] bool LeftToCoe() {
    const esc::SiiContents& contents = Contents();
    if (!contents.Complete(esc::SiiCategoryType::RX_PDO) || !contents.Complete(esc::SiiCategoryType::TX_PDO) ||
        !contents.rx_pdos.empty() || !contents.tx_pdos.empty()) {
      return false;
    }
    if (contents.header.protocols && (*contents.header.protocols & esc::kSiiCoe) == 0) return false;
    if (contents.header.standard_receive && contents.header.standard_receive->size == 0) return false;
    const std::uint8_t type = direction_ == PdoDirection::kRx ? kSiiOutputs : kSiiInputs;
    return !contents.Complete(esc::SiiCategoryType::SYNC_MANAGER) || contents.sync_managers.empty() ||
           std::any_of(contents.sync_managers.begin(), contents.sync_managers.end(),
                       [type](const esc::SiiSyncManager& manager) { return manager.type == type; });
  }
  [[nodiscard]] std::optional<std::vector<Entry>> EntriesOf(std::uint16_t index) {
    for (const esc::SiiPdo& pdo : Pdos()) {
      if (pdo.index != index || pdo.entries.empty()) continue;
      std::vector<Entry> entries;
      entries.reserve(pdo.entries.size());
      for (const esc::SiiPdoEntry& entry : pdo.entries) {
        entries.push_back({entry.index, entry.subindex, entry.bits, std::string(Contents().String(entry.name_string)),
                           static_cast<mailbox::DataType>(entry.data_type)});
      }
      return entries;
    }
    return std::nullopt;
  }

 private:
  [[nodiscard]] const esc::SiiContents& Contents() {
    if (!contents_) contents_ = esc::ParseSii(image_);
    return *contents_;
  }
  [[nodiscard]] const std::vector<esc::SiiPdo>& Pdos() {
    return direction_ == PdoDirection::kRx ? Contents().rx_pdos : Contents().tx_pdos;
  }
  [[nodiscard]] esc::SiiCategoryType Category() const {
    return direction_ == PdoDirection::kRx ? esc::SiiCategoryType::RX_PDO : esc::SiiCategoryType::TX_PDO;
  }

  const esc::SiiImage& image_;
  PdoDirection direction_;
  std::optional<esc::SiiContents> contents_;
};

}  // namespace

std::string_view Name(LayoutSource source) {
  switch (source) {
    case LayoutSource::kUnknown:
      return "unknown";
    case LayoutSource::kObserved:
      return "observed";
    case LayoutSource::kDefault:
      return "default";
    case LayoutSource::kEni:
      return "eni";
  }
  return "";
}

std::uint32_t ProcessLayout::bytes_of(std::uint8_t sync_manager) const {
  std::uint32_t sum = 0;
  for (const Signal& signal : signals) {
    if (signal.sync_manager == sync_manager) sum += signal.bits;
  }
  return (sum + 7) / 8;
}

const Signal* ProcessLayout::Find(std::uint16_t index, std::uint8_t subindex) const {
  for (const Signal& signal : signals) {
    if (signal.index == index && signal.subindex == subindex) return &signal;
  }
  return nullptr;
}

void ProcessData::SetFamily(const device::DeviceDescription& family) {
  if (family_ != &family) ++changes_;
  family_ = &family;
}

void ProcessData::SetEni(const device::EniSlave* slave, const device::EniConfig* config) {
  if (eni_slave_ != slave || eni_config_ != config) ++changes_;
  eni_slave_ = slave;
  eni_config_ = config;
  eni_ = slave != nullptr && !slave->pdos.empty() ? &slave->pdos : nullptr;
}

bool ProcessData::Apply(const mailbox::SdoTransfer& transfer) {
  if (!seen_.Apply(transfer)) return false;
  ++changes_;
  return true;
}

bool ProcessData::Forget(std::uint16_t index, std::uint8_t subindex, bool whole) {
  if (!seen_.Forget(index, subindex, whole)) return false;
  ++changes_;
  return true;
}

void ProcessData::OnRunBegan() {
  for (const auto direction : {PdoDirection::kRx, PdoDirection::kTx}) {
    const ProcessLayout& layout = Layout(direction);
    if (layout.source == LayoutSource::kObserved) doubted_ = std::max(doubted_, layout.since);
  }
  ++changes_;
}

void ProcessData::OnOtherDevice() {
  seen_.Clear();
  doubted_ = 0;
  ++changes_;
}

void ProcessData::NameVariables(PdoDirection direction, ProcessLayout& layout) const {
  if (eni_slave_ == nullptr || eni_config_ == nullptr) return;
  const bool rx = direction == PdoDirection::kRx;
  // One run of bits in the image is one sync manager's buffer. The file does not state which of several is which.
  const std::vector<device::EniImagePart>& parts = rx ? eni_slave_->outputs : eni_slave_->inputs;
  const std::uint8_t manager = rx ? kOutputs : kInputs;
  if (parts.size() != 1 || parts[0].bit_length / 8 != layout.bytes_of(manager)) return;
  for (Signal& signal : layout.signals) {
    if (signal.gap() || signal.sync_manager != manager) continue;
    const std::uint32_t at = parts[0].bit_start + signal.bit_offset;
    if (rx) {
      signal.variable = eni_config_->OutputAt(at, signal.bits);
    } else if (const device::EniVariable* variable = eni_config_->inputs.Find(at, signal.bits)) {
      signal.variable = variable->name;
    }
  }
}

/// Which PDOs, then what is in each, then whether the sync managers agree.
class ProcessData::Computation {
 public:
  Computation(const ProcessData& data, PdoDirection direction)
      : data_(data),
        direction_(direction),
        assignment_(direction == PdoDirection::kRx ? process::kRxAssignment : process::kTxAssignment),
        eeprom_(data.state_.sii.image(), direction) {}

  ProcessLayout Run() {
    if (!Assign()) return std::move(layout_);
    for (const AssignedPdo& pdo : assigned_) {
      layout_.pdos.push_back(pdo.pdo);
      if (layout_.reason.empty()) Add(pdo);
    }
    if (!layout_.reason.empty()) return std::move(layout_);
    data_.NameVariables(direction_, layout_);
    if (layout_.source != LayoutSource::kObserved || layout_.since <= data_.doubted_) CompareLengths();
    return std::move(layout_);
  }

 private:
  bool Assign();
  [[nodiscard]] std::string WhyUnassigned(bool partly);
  void Add(const AssignedPdo& pdo);
  [[nodiscard]] std::optional<std::vector<Entry>> EntriesOf(std::uint16_t pdo);
  void Add(const AssignedPdo& pdo, Entry& entry);
  void Name(Signal& signal, Entry& entry) const;
  void CompareLengths();

  const ProcessData& data_;
  const PdoDirection direction_;
  const std::uint16_t assignment_;
  Eeprom eeprom_;
  std::vector<AssignedPdo> assigned_;
  std::array<std::uint32_t, esc::kMaxSyncManagers> offset_{};  // bits in the buffer of each
  ProcessLayout layout_;
};

/// @return false: which PDOs is not known, and layout_.reason gives the reason
bool ProcessData::Computation::Assign() {
  const process::PdoObject* object = data_.seen_.Find(assignment_);
  if (const auto observed = data_.seen_.Assigned(assignment_)) {
    layout_.source = LayoutSource::kObserved;
    layout_.since = object->since;
    layout_.assumed = object->count.certainty() == Certainty::kInferred;
    const std::uint8_t manager = direction_ == PdoDirection::kRx ? kOutputs : kInputs;
    for (const std::uint16_t pdo : *observed) assigned_.push_back({pdo, manager});
    return true;
  }
  const auto& by_esi = data_.family_->pdo.fixed;
  if (data_.eni_ != nullptr) {
    layout_.source = LayoutSource::kEni;
    assigned_ = AssignedBy(*data_.eni_, direction_);
  } else if (auto by_eeprom = eeprom_.Assigned()) {
    layout_.source = LayoutSource::kDefault;
    assigned_ = std::move(*by_eeprom);
  } else if (data_.family_->esi && !data_.family_->esi->misses_modules() && !AssignedBy(by_esi, direction_).empty()) {
    layout_.source = LayoutSource::kDefault;
    assigned_ = AssignedBy(by_esi, direction_);
  } else {
    layout_.reason = WhyUnassigned(object != nullptr);
    return false;
  }
  if (object == nullptr || Agrees(*object, assigned_)) return true;
  layout_ = {};
  layout_.reason = WhyUnassigned(true);
  return false;
}

std::string ProcessData::Computation::WhyUnassigned(bool partly) {
  const std::string object = "the assignment " + ObjectName(assignment_);
  if (partly) return "only a part of " + object + " is in the capture";
  if (eeprom_.LeftToCoe()) {
    return object + " is not in the capture, and the EEPROM lists no PDO, which leaves them to CoE";
  }
  if (data_.family_->esi && data_.family_->esi->misses_modules()) {
    return object + " is not in the capture, and neither is which modules are in the slots (F030h or F050h)";
  }
  return object + " is not in the capture, and neither the EEPROM nor an ESI or ENI file gives the default";
}

void ProcessData::Computation::Add(const AssignedPdo& pdo) {
  if (pdo.sync_manager >= offset_.size()) {
    layout_.reason = "PDO " + ObjectName(pdo.pdo) + " belongs to a sync manager that no ESC has";
    return;
  }
  auto entries = EntriesOf(pdo.pdo);
  if (!entries) {
    layout_.reason = "what PDO " + ObjectName(pdo.pdo) + " contains is not in the capture";
    return;
  }
  for (Entry& entry : *entries) {
    if (layout_.signals.size() == kMaxSignals) {
      layout_.reason = "more than " + std::to_string(kMaxSignals) + " entries are assigned";
      return;
    }
    Add(pdo, entry);
  }
}

/// The mapping object as the capture shows it, else a description, else the EEPROM.
std::optional<std::vector<Entry>> ProcessData::Computation::EntriesOf(std::uint16_t pdo) {
  std::optional<std::vector<Entry>> entries;
  if (const auto mapped = data_.seen_.Mapped(pdo)) {
    entries.emplace();
    for (const process::MappingEntry& entry : *mapped) {
      entries->push_back({entry.index, entry.subindex, entry.bits, {}, mailbox::DataType::kUnknown});
    }
    const process::PdoObject* mapping = data_.seen_.Find(pdo);
    layout_.since = std::max(layout_.since, mapping->since);
    layout_.assumed |= mapping->count.certainty() == Certainty::kInferred;
  }
  const PdoContent* described = data_.eni_ != nullptr ? FindPdo(*data_.eni_, direction_, pdo) : nullptr;
  if (described == nullptr) described = FindPdo(data_.family_->pdo.fixed, direction_, pdo);
  if (entries && described != nullptr) NameAfter(*described, *entries);
  if (!entries && described != nullptr && described->known) entries = model::EntriesOf(*described);
  if (!entries) entries = eeprom_.EntriesOf(pdo);
  return entries;
}

void ProcessData::Computation::Add(const AssignedPdo& pdo, Entry& entry) {
  Signal signal;
  signal.pdo = pdo.pdo;
  signal.index = entry.index;
  signal.subindex = entry.subindex;
  signal.sync_manager = pdo.sync_manager;
  signal.bits = entry.bits;
  signal.bit_offset = offset_[pdo.sync_manager];
  signal.type = entry.type;
  offset_[pdo.sync_manager] += entry.bits;
  layout_.bits += entry.bits;
  if (!signal.gap()) Name(signal, entry);
  layout_.signals.push_back(std::move(signal));
}

void ProcessData::Computation::Name(Signal& signal, Entry& entry) const {
  events::ObjectInfo info = data_.names_.Find(data_.family_, entry.index, entry.subindex);
  const bool inferred = info.name_source == events::NameSource::kInferred;
  if (!entry.name.empty() && (info.name.empty() || inferred)) {
    signal.name = std::move(entry.name);
  } else {
    signal.name = std::move(info.name);
    signal.name_inferred = inferred;
  }
  if (signal.type == mailbox::DataType::kUnknown) {
    signal.type = info.type;
    signal.type_standard =
        info.type_source == events::NameSource::kStandard || info.type_source == events::NameSource::kInferred;
  }
  signal.unit = std::move(info.pdo_unit.empty() ? info.unit : info.pdo_unit);
  signal.scaled_by_sdo = !info.scale.empty() && info.scale != "1:1";
  signal.scale = std::move(info.pdo_scale.empty() ? info.scale : info.pdo_scale);
}

/// A default need not be what is in force.
void ProcessData::Computation::CompareLengths() {
  for (std::size_t n = 0; n < offset_.size(); ++n) {
    const auto manager = data_.state_.sync_manager(n, Certainty::kInferred);
    if (offset_[n] == 0 || !manager || !manager->enabled() || manager->length == (offset_[n] + 7) / 8) continue;
    layout_.contradicted = true;
    layout_.reason = (layout_.source == LayoutSource::kObserved ? "the PDOs of the run before" : "the default PDOs") +
                     std::string(" fill ") + Count((offset_[n] + 7) / 8, "byte") + ", but sync manager " +
                     std::to_string(n) + " is set to " + Count(manager->length, "byte");
    return;
  }
}

const ProcessLayout& ProcessData::Layout(PdoDirection direction) const {
  Cached& cached = cached_[direction == PdoDirection::kRx ? 0 : 1];
  if (cached.version != version()) {
    cached.version = version();
    cached.layout = Computation(*this, direction).Run();
  }
  return cached.layout;
}

}  // namespace ecaudit::model
