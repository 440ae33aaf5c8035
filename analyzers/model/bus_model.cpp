#include "analyzers/model/bus_model.h"

#include "decoder/base/text.h"
#include "decoder/device/profile_registry.h"

namespace ecaudit::model {
namespace {

constexpr std::string_view kGeneric = "generic";
constexpr EscAddress kEscConfiguration = 0x0141;  // bit 0: device emulation

}  // namespace

BusModel::BusModel(const track::Network& network, const AnalysisOptions& options, ModelSink& sink)
    : network_(network), options_(options), sink_(sink) {
  const auto limit = [&](std::string_view name, std::int64_t& value) {
    const auto found = options.limits.find(name);
    if (found != options.limits.end()) value = found->second;
  };
  limit("al-timeout.preop", timeouts_.to_preop_ns);
  limit("al-timeout.safeop-op", timeouts_.to_safeop_or_op_ns);
  limit("al-timeout.down", timeouts_.downwards_ns);
}

const LogicalExpectation& BusModel::Expect(const track::LogicalAccess& access) const {
  return expectations_.Find(network_, access.command, access.address, access.length);
}

void BusModel::Apply(const track::SlaveFound& event) {
  slaves_.emplace_back(event.slave, sink_);
  slaves_.back().al.SetTimeouts(timeouts_);
  slaves_.back().identity.slave = event.slave;
  ChooseProfile(event.slave);
}

void BusModel::Apply(const track::AddressAssigned& event) {
  ChooseProfile(event.slave);
}

void BusModel::Apply(const track::IdentityLearned& event) {
  track::IdentityLearned& known = slaves_[event.slave].identity;
  const auto take = [](auto& to, const auto& from) {
    if (from) to = from;
  };
  take(known.vendor_id, event.vendor_id);
  take(known.product_code, event.product_code);
  take(known.revision, event.revision);
  take(known.serial, event.serial);
  known.frame = event.frame;
  known.source = event.source;
  ChooseProfile(event.slave);
}

void BusModel::ChooseProfile(SlaveId id) {
  SlaveModel& slave = slaves_[id];
  const auto use = [&](const device::DeviceDescription* profile, std::string source) {
    if (profile == nullptr) return false;
    slave.profile = profile;
    slave.profile_source = std::move(source);
    slave.al.SetFamily(*profile);
    return true;
  };
  const bus::SlaveAddress& address = network_.slaves()[id];
  for (const auto& [selector, name] : options_.slave_profiles) {
    const StationAddress* station = address.station.if_known();
    const SlavePos* position = address.position.if_known();
    const bool selected = selector.by_address ? station != nullptr && *station == selector.value
                                              : position != nullptr && *position == selector.value;
    if (selected && use(device::BuiltinProfile(name), "option --profile for this slave")) return;
  }
  if (!options_.default_profile.empty() && use(device::BuiltinProfile(options_.default_profile), "option --profile")) {
    return;
  }
  const track::IdentityLearned& identity = slave.identity;
  if (identity.vendor_id && identity.product_code) {
    const auto candidates =
        device::MatchIdentity(*identity.vendor_id, *identity.product_code, identity.revision.value_or(0));
    const char* where = identity.source == track::IdentityLearned::Source::kObject1018 ? "object 1018h" : "EEPROM";
    if (!candidates.empty()) {
      std::string source =
          "identity in the " + std::string(where) + " (frame " + std::to_string(identity.frame.number) + ")";
      if (candidates.size() > 1) source += ", newest of " + Count(candidates.size(), "edition");
      use(candidates.front(), std::move(source));
      return;
    }
    use(device::BuiltinProfile(kGeneric), "no profile for vendor " + Hex(*identity.vendor_id, 8) + ", product " +
                                              Hex(*identity.product_code, 8) + ": judged by the EtherCAT standard");
    return;
  }
  use(device::BuiltinProfile(kGeneric), "identity not in the capture: judged by the EtherCAT standard");
}

void BusModel::Apply(const track::AlRequest& event) {
  slaves_[event.slave].al.OnRequest(event);
}
void BusModel::Apply(const track::AlStatusRead& event) {
  slaves_[event.slave].al.OnStatus(event);
}
void BusModel::Apply(const track::AlStatusCodeRead& event) {
  slaves_[event.slave].al.OnStatusCode(event);
}
void BusModel::Apply(const track::AlStateForgotten& event) {
  slaves_[event.slave].al.Forget(event.frame);
}

void BusModel::Apply(const track::SlaveAccess& access) {
  const ByteSpan configuration = access.Covered(access.read, kEscConfiguration, 1);
  if (!configuration.empty() && !access.broadcast) {
    slaves_[access.slave].al.SetDeviceEmulation((configuration[0] & 1U) != 0);
  }
}

void BusModel::ApplyAlRequestSent(SlaveId slave, const FrameRef& frame, esc::AlWord control) {
  if (slave < slaves_.size()) slaves_[slave].al.OnRequestSent(frame, control);
}

}  // namespace ecaudit::model
