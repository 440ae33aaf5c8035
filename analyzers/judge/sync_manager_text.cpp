#include "analyzers/judge/sync_manager_text.h"

#include <algorithm>
#include <array>

#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/words/al_text.h"
#include "decoder/base/text.h"
#include "decoder/base/wrapping.h"

namespace ecaudit {
namespace {

using Fault = model::SyncManagerFault;

/// "length 256 instead of 1024", "not enabled".
std::string FaultText(const Fault& fault) {
  return fault.field == Fault::Field::kEnable ? fault.observed : fault.observed + " instead of " + fault.expected;
}

/// "be enabled", "have length 1024".
std::string DemandText(const Fault& fault) {
  switch (fault.field) {
    case Fault::Field::kEnable:
      return "be " + fault.expected;
    case Fault::Field::kMode:
      return "be in " + fault.expected;
    case Fault::Field::kDirection:
      return "have the direction " + fault.expected;
    case Fault::Field::kStart:
      return "begin at " + fault.expected;
    case Fault::Field::kLength:
      return "have length " + fault.expected;
  }
  return {};
}

void AddEvidence(Finding& finding, const Fault& fault) {
  switch (fault.field) {
    case Fault::Field::kEnable:
      finding.evidence.push_back(Number("enabled", 0));
      finding.evidence.push_back(Number("expected_enabled", 1));
      return;
    case Fault::Field::kMode:
      finding.evidence.push_back(Text("mode", fault.observed));
      finding.evidence.push_back(Text("expected_mode", fault.expected));
      return;
    case Fault::Field::kDirection:
      finding.evidence.push_back(Number("direction", fault.observed_value));
      finding.evidence.push_back(Number("expected_direction", fault.expected_value));
      return;
    case Fault::Field::kStart:
      finding.evidence.push_back(HexNumber("start", fault.observed_value));
      finding.evidence.push_back(HexNumber("expected_start", fault.expected_value));
      return;
    case Fault::Field::kLength:
      finding.evidence.push_back(Number("length", fault.observed_value));
      finding.evidence.push_back(Number("expected_length", fault.expected_value));
      return;
  }
}

/// The code with which a slave refuses the transition because of this sync manager; unset where the family leaves it
/// open which of several it is.
std::optional<std::uint16_t> RefusalCode(const device::AlTransition& row, std::size_t manager) {
  constexpr std::array<std::uint16_t, 4> kOfManager{0x0016, 0x0016, 0x001D, 0x001E};
  const std::vector<std::uint16_t>& codes = row.refusal_codes;
  if (manager < kOfManager.size() && std::find(codes.begin(), codes.end(), kOfManager[manager]) != codes.end()) {
    return kOfManager[manager];
  }
  return codes.size() == 1 ? std::optional(codes.front()) : std::nullopt;
}

}  // namespace

std::optional<KnownSyncManager> SyncManagerOf(const track::SlaveState& state, std::size_t number) {
  if (const auto observed = state.sync_manager(number, Certainty::kObserved)) {
    return KnownSyncManager{*observed, true, state.sync_manager_since[number]};
  }
  if (const auto inferred = state.sync_manager(number, Certainty::kInferred)) {
    return KnownSyncManager{*inferred, false, state.sync_manager_since[number]};
  }
  return std::nullopt;
}

std::string SettingsText(const esc::SyncManager& settings) {
  std::string out = "start " + Hex(settings.start) + ", length " + std::to_string(settings.length) + ", control " +
                    Hex(settings.control, 2);
  return out + (settings.enabled() ? ", enabled" : ", not enabled");
}

std::uint64_t SettingsKey(std::size_t number, const esc::SyncManager& settings) {
  return std::uint64_t{settings.start} << 40U | std::uint64_t{settings.length} << 24U |
         std::uint64_t{settings.control} << 16U | std::uint64_t{settings.enabled() ? 1U : 0U} << 8U | number;
}

std::uint64_t KeyOfBoth(std::uint64_t one, std::uint64_t other) {
  constexpr std::uint64_t kSpread = 31;
  return WrappingSum(WrappingProduct(one, kSpread), other);
}

Finding DescribeFaults(const RuleContext& context, const model::AlRequestJudged& e,
                       const model::SyncManagerDemand& demand, const KnownSyncManager& known,
                       const std::vector<Fault>& faults) {
  const model::AlRequestRecord& request = e.request;
  const device::DeviceDescription& family = *context.slave(e.slave).profile;
  const std::string name = "SM" + std::to_string(demand.number);
  const std::string to = esc::StateName(request.control.state());
  std::string wrong;
  for (const Fault& fault : faults) wrong += (wrong.empty() ? "" : ", ") + FaultText(fault);

  Finding finding;
  finding.slave = e.slave;
  finding.first = request.frame;
  finding.title = name + ": " + wrong + " when " + to + " is requested";
  finding.message = "The master requests " + RequestText(request) + " in frame " +
                    std::to_string(request.frame.number) + " while sync manager " + std::to_string(demand.number);
  if (known.since != 0) finding.message += ", last set in frame " + std::to_string(known.since) + ",";
  finding.message += " has " + SettingsText(known.settings) + ". ";
  for (const Fault& fault : faults) {
    finding.message += "By " + fault.source + " it must " + DemandText(fault) + ". ";
    AddEvidence(finding, fault);
  }
  if (const device::AlTransition* row = request.transition) {
    if (!row->requirement.empty()) {
      finding.message += "For this transition the slave needs: " + row->requirement + ". ";
    }
    if (const auto code = RefusalCode(*row, demand.number)) {
      finding.message += "It is to answer with the error bit and AL status code " + CodeText(*code, family) + ". ";
    }
  }
  finding.message +=
      "Write " + name + " as a whole with the right values, after switching it off, before " + to + " is requested.";
  finding.evidence.push_back(Number("sync_manager", demand.number));
  finding.evidence.push_back(HexNumber("al_control", request.control.raw));
  AddRelated(finding, known.since);
  finding.confidence = known.observed && !request.assumed ? Confidence::kObserved : Confidence::kInferred;
  if (finding.confidence == Confidence::kInferred) {
    finding.message += request.assumed ? " Only outbound frames are captured: that the slave took them is assumed."
                                       : " That the slave took the settings is an inference: a broadcast wrote them.";
  }
  if (!demand.reference.empty()) finding.reference = ReferenceTo(demand.reference);
  return finding;
}

}  // namespace ecaudit
