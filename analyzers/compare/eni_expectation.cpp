#include "analyzers/compare/eni_expectation.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "analyzers/compare/startup_registers.h"
#include "decoder/esc/al.h"
#include "decoder/esc/register_addresses.h"

namespace ecaudit::startup {
namespace {

/// A transition on the way up, and the state of the slave before it.
struct Transition {
  std::string_view name;
  std::uint8_t from;
};
constexpr std::array<Transition, 3> kUpwards{{{"IP", 1}, {"PS", 2}, {"SO", 4}}};

bool Belongs(const std::vector<device::EniTransition>& transitions, std::string_view wanted) {
  return std::ranges::find(transitions, wanted) != transitions.end();
}

bool WritesRegisters(wire::Command command) {
  return wire::Writes(command) && command != wire::Command::LWR && command != wire::Command::LRW;
}

void AddWrite(const device::EniInitCommand& command, std::uint8_t state, std::vector<ExpectedStep>& steps) {
  if (!WritesRegisters(command.command) || command.data.empty()) return;
  if (command.ado == esc::kAlControl) {
    ExpectedStep& step = steps.emplace_back();
    step.key.kind = StartupKey::Kind::kRequest;
    step.key.address = esc::AlWord{command.data[0]}.state();
    step.succeeds = true;
    step.phase = StartupPhase::kSafeopToOp;
    if (step.key.address <= static_cast<std::uint32_t>(esc::AlState::SAFEOP)) step.phase = StartupPhase::kPreopToSafeop;
    if (step.key.address <= static_cast<std::uint32_t>(esc::AlState::PREOP)) step.phase = StartupPhase::kInitToPreop;
    return;
  }
  if (!Configures(command.ado, command.data, state)) return;
  CutIntoUnits(command.ado, command.data, [&](EscAddress address, ByteSpan data) {
    ExpectedStep step;
    step.key.address = address;
    step.phase = PhaseOfWrite(address, data, state);
    step.name = command.comment;
    if (!IsVolatile(address, data.size())) step.data.emplace(data.begin(), data.end());
    // A command that a master sends again right away is one step, as the recorder sees it.
    if (!steps.empty() && steps.back().key == step.key && steps.back().data == step.data) return;
    steps.push_back(std::move(step));
  });
}

void AddSdo(const device::EniSdoCommand& command, std::uint8_t state, std::vector<ExpectedStep>& steps) {
  if (command.disabled) return;
  ExpectedStep& step = steps.emplace_back();
  step.key = {command.upload ? StartupKey::Kind::kUpload : StartupKey::Kind::kDownload, command.complete_access,
              command.subindex, command.index};
  step.phase = state >= static_cast<std::uint8_t>(esc::AlState::SAFEOP) ? StartupPhase::kSafeopToOp
                                                                        : StartupPhase::kPreopParameters;
  step.name = command.comment;
  if (!command.upload && !command.data.empty()) step.data = command.data;
  step.succeeds = !command.upload;
}

}  // namespace

Expectation ExpectationOf(const device::EniConfig& eni, std::string name) {
  Expectation expectation;
  expectation.name = std::move(name);
  expectation.separate_mailbox = true;
  for (std::size_t s = 0; s < eni.slaves.size(); ++s) {
    const device::EniSlave& slave = eni.slaves[s];
    ExpectedSlave& expected = expectation.slaves.emplace_back();
    expected.position = slave.position().value_or(static_cast<SlavePos>(s));
    expected.vendor_id = slave.vendor_id;
    expected.product_code = slave.product_code;
    // The revision in an ENI is the one it was made for; masters accept newer ones.
    expected.name = slave.name;
    for (const Transition& transition : kUpwards) {
      for (const device::EniInitCommand& command : slave.init_commands) {
        if (!Belongs(command.transitions, transition.name) || wire::IsBroadcast(command.command)) continue;
        AddWrite(command, transition.from, expected.steps);
      }
      for (const device::EniSdoCommand& command : slave.sdo_commands) {
        if (Belongs(command.transitions, transition.name)) AddSdo(command, transition.from, expected.steps);
      }
    }
  }
  return expectation;
}

}  // namespace ecaudit::startup
