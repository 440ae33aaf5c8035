#include "analyzers/model/profile_choice.h"

#include <algorithm>
#include <set>

#include "analyzers/model/slave_model.h"
#include "decoder/base/text.h"
#include "decoder/device/profile_registry.h"

namespace ecaudit::model {
namespace {

using device::DeviceDescription;
using track::IdentityLearned;

constexpr std::string_view kGeneric = "generic";

bool Selects(const SlaveSelector& selector, const bus::SlaveAddress& address) {
  const StationAddress* station = address.station.if_known();
  const SlavePos* position = address.position.if_known();
  return selector.by_address ? station != nullptr && *station == selector.value
                             : position != nullptr && *position == selector.value;
}

template <typename T>
bool Differ(const std::optional<T>& a, const std::optional<T>& b) {
  return a && b && *a != *b;
}

/// Another product than the one seen. Revisions and serial numbers change with a spare part.
bool Contradicts(const device::EniSlave& eni, const IdentityLearned& seen) {
  return Differ(eni.vendor_id, seen.vendor_id) || Differ(eni.product_code, seen.product_code);
}

std::string ProductText(std::optional<std::uint32_t> vendor, std::optional<std::uint32_t> product) {
  return "vendor " + (vendor ? Hex(*vendor, 8) : "unknown") + ", product " + (product ? Hex(*product, 8) : "unknown");
}

std::string WhereSeen(const IdentityLearned& identity) {
  if (identity.source == IdentityLearned::Source::kEni) return "the ENI";
  const char* where = identity.source == IdentityLearned::Source::kObject1018 ? "object 1018h" : "the EEPROM";
  return std::string(where) + " (frame " + std::to_string(identity.frame.number) + ")";
}

/// The edition states what is in each of the PDOs that the slave has assigned, or that they are mapped freely.
bool Describes(const DeviceDescription& edition, const process::PdoMapping& seen) {
  for (const std::uint16_t assignment : {process::kRxAssignment, process::kTxAssignment}) {
    for (const std::uint16_t pdo : seen.Assigned(assignment).value_or(std::vector<std::uint16_t>{})) {
      const auto& flexible = edition.pdo.flexible;
      const bool free = flexible && (std::count(flexible->rx_pdos.begin(), flexible->rx_pdos.end(), pdo) > 0 ||
                                     std::count(flexible->tx_pdos.begin(), flexible->tx_pdos.end(), pdo) > 0);
      const device::PdoContent* fixed = edition.pdo.FindFixed(pdo);
      if (!free && (fixed == nullptr || !fixed->known)) return false;
    }
  }
  return true;
}

/// Families of this vendor that are recognised by the model type.
std::vector<const DeviceDescription*> OfModel(const device::ProfileRegistry& families,
                                              const IdentityLearned& identity) {
  std::vector<const DeviceDescription*> fitting;
  if (identity.model.empty()) return fitting;
  for (const DeviceDescription* family : families.MatchModel(identity.model)) {
    if (family->match.vendor_id == identity.vendor_id) fitting.push_back(family);
  }
  return fitting;
}

}  // namespace

const device::EniSlave* ProfileChoice::FindEni(const bus::SlaveAddress& address) const {
  if (!options_.files || !options_.files->eni) return nullptr;
  const device::EniConfig& config = options_.files->eni->content;
  if (const StationAddress* station = address.station.if_known()) {
    if (const device::EniSlave* slave = config.FindByAddress(*station)) return slave;
  }
  const SlavePos* position = address.position.if_known();
  return position != nullptr ? config.FindByPosition(*position) : nullptr;
}

ProfileChoice::EsiMatch ProfileChoice::FindEsi(const IdentityLearned& identity) const {
  EsiMatch match;
  if (!options_.files) return match;
  if (identity.vendor_id && identity.product_code) {
    for (const DeviceFiles::Esi& file : options_.files->esi) {
      if (file.content.vendor_id != *identity.vendor_id) continue;
      const DeviceDescription* device = file.content.Find(*identity.product_code, identity.revision.value_or(0));
      if (device == nullptr) continue;
      const bool same_revision = identity.revision && device->match.revision_min == identity.revision;
      if (match.device == nullptr || same_revision) match = {device, &file.name, false};
      if (same_revision) break;
    }
    return match;
  }
  if (identity.vendor_id || identity.product_code) return match;
  // Nothing is known of the slave. A user who gives the file of one product means it.
  std::set<std::pair<std::uint32_t, std::uint32_t>> products;
  for (const DeviceFiles::Esi& file : options_.files->esi) {
    for (const DeviceDescription& device : file.content.devices) {
      for (const std::uint32_t product : device.match.product_codes) {
        products.emplace(file.content.vendor_id, product);
        if (products.size() > 1) return {};
        match = {file.content.Find(product, 0), &file.name, true};
      }
    }
  }
  return match;
}

const device::ProfileRegistry& ProfileChoice::families() const {
  static const device::ProfileRegistry builtin;
  return options_.files ? options_.files->families : builtin;
}

std::pair<const DeviceDescription*, std::string> ProfileChoice::FindFamily(const bus::SlaveAddress& address,
                                                                           const IdentityLearned& identity,
                                                                           bool with_esi,
                                                                           const process::PdoMapping& seen) const {
  for (const auto& [selector, name] : options_.slave_profiles) {
    if (!Selects(selector, address)) continue;
    if (const DeviceDescription* profile = families().Find(name)) {
      return {profile, "option --profile for this slave"};
    }
  }
  if (!options_.default_profile.empty()) {
    if (const DeviceDescription* profile = families().Find(options_.default_profile)) {
      return {profile, "option --profile"};
    }
  }
  const DeviceDescription* generic = families().Find(kGeneric);
  if (!identity.vendor_id || !identity.product_code) {
    return {generic, "identity not in the capture: evaluated by the EtherCAT standard"};
  }
  auto candidates = OfModel(families(), identity);
  const bool by_model = !candidates.empty();
  if (!by_model) {
    candidates = families().MatchIdentity(*identity.vendor_id, *identity.product_code, identity.revision.value_or(0));
  }
  if (candidates.empty()) {
    return {generic, "no profile for " + ProductText(identity.vendor_id, identity.product_code) +
                         (with_esi ? ": the EtherCAT standard" : ": evaluated by the EtherCAT standard")};
  }
  std::string source = "identity in " + WhereSeen(identity);
  if (by_model) source += ", model type " + Printable(identity.model);
  const DeviceDescription* chosen = candidates.front();
  if (const auto own = families().own().find(chosen->id); own != families().own().end()) {
    source += ", family of " + Printable(own->second.path);
    return {chosen, std::move(source)};
  }
  if (candidates.size() > 1) {
    const auto fits = std::find_if(candidates.begin(), candidates.end(),
                                   [&](const DeviceDescription* edition) { return Describes(*edition, seen); });
    const bool newest = fits == candidates.begin() || fits == candidates.end();
    if (!newest) chosen = *fits;
    source += ", newest of " + Count(candidates.size(), "edition");
    if (!newest) source += " that describes the assigned PDOs";
  }
  return {chosen, std::move(source)};
}

const DeviceDescription* ProfileChoice::Overlay(const DeviceDescription& family, const DeviceDescription& esi) {
  auto& entry = overlays_[{&family, &esi}];
  if (entry == nullptr) {
    DeviceDescription merged = device::WithEsi(family, esi);
    merged.title = family.title;  // what is evaluated by the family's manual is to name that manual
    entry = std::make_unique<const DeviceDescription>(std::move(merged));
  }
  return entry.get();
}

const DeviceDescription* ProfileChoice::WithModules(const DeviceDescription& device, const SlaveModel& slave,
                                                    const std::string& file, std::string& source) {
  const auto idents = slave.modules.Idents();
  if (!idents) return &device;
  auto entry = modular_.find({&device, *idents});
  if (entry == modular_.end()) {
    if (modular_.size() >= kMaxModular) {
      source += ", without its modules: more than " + std::to_string(kMaxModular) + " sets of modules";
      return &device;
    }
    entry = modular_.emplace(std::pair{&device, *idents}, nullptr).first;
    entry->second = std::make_unique<const DeviceDescription>(device::WithModules(device, *idents));
  }
  const auto filled = std::count_if(idents->begin(), idents->end(), [](std::uint32_t ident) { return ident != 0; });
  if (entry->second->esi->modules_known) {
    source += ", " + Count(static_cast<std::uint64_t>(filled), "module") + " in its slots";
    return entry->second.get();
  }
  for (std::size_t slot = 0; slot < idents->size(); ++slot) {
    if ((*idents)[slot] == 0 || device.esi->slot_rules->Find((*idents)[slot]) != nullptr) continue;
    source += ", but module " + Hex((*idents)[slot], 8) + " in slot " + std::to_string(slot + 1) + " is not in " + file;
    break;
  }
  return &device;
}

void ProfileChoice::Choose(const bus::SlaveAddress& address, const IdentityLearned& seen, SlaveModel& slave) {
  slave.identity = seen;
  slave.name.clear();
  slave.eni = FindEni(address);
  const device::EniSlave* other = nullptr;  // what the ENI expects here instead
  if (slave.eni != nullptr && Contradicts(*slave.eni, seen)) std::swap(slave.eni, other);
  if (slave.eni != nullptr) {
    slave.name = slave.eni->name;
    if (!seen.vendor_id || !seen.product_code) slave.identity.source = IdentityLearned::Source::kEni;
    const auto fill = [](auto& to, const auto& from) {
      if (!to) to = from;
    };
    fill(slave.identity.vendor_id, slave.eni->vendor_id);
    fill(slave.identity.product_code, slave.eni->product_code);
    fill(slave.identity.revision, slave.eni->revision);
    if (slave.eni->serial.value_or(0) != 0) fill(slave.identity.serial, slave.eni->serial);  // 0: any
  }

  const EsiMatch esi = FindEsi(slave.identity);
  auto [family, source] = FindFamily(address, slave.identity, esi.device != nullptr, slave.process.seen());
  slave.profile = family;
  if (esi.device != nullptr) {
    slave.profile = Overlay(*family, *esi.device);
    const std::optional<std::uint32_t>& revision = esi.device->match.revision_min;
    if (esi.assumed) {
      source += ", taken for the only product in " + *esi.file;
    } else {
      source += ", with " + *esi.file;
      if (Differ(revision, slave.identity.revision)) {
        source += " (for revision " + Hex(*revision, 8) + ", the slave has " + Hex(*slave.identity.revision, 8) + ")";
      }
    }
    if (slave.profile->esi->slot_rules) slave.profile = WithModules(*slave.profile, slave, *esi.file, source);
    if (slave.name.empty() && !esi.assumed) slave.name = esi.device->title;
  }
  if (other != nullptr) {
    source += "; " + options_.files->eni->name + " expects another device here (" +
              ProductText(other->vendor_id, other->product_code) + ")";
  }
  slave.profile_source = std::move(source);
  slave.given.clear();
  for (const GivenParameter& parameter : options_.parameters) {
    if (!parameter.slave || Selects(*parameter.slave, address)) slave.given[parameter.keyword] = parameter.value;
  }
}

}  // namespace ecaudit::model
