/// in: decoder events.  out: model events.  One SlaveModel a slave, and what is expected of the bus as a whole.
#pragma once

#include <deque>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "analyzers/model/al_time_limits.h"
#include "analyzers/model/bus_al.h"
#include "analyzers/model/bus_al_wait.h"
#include "analyzers/model/event_unit.h"
#include "analyzers/model/logical_expectation.h"
#include "analyzers/model/process_image.h"
#include "analyzers/model/profile_choice.h"
#include "analyzers/model/seen_identity.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/options/options.h"
#include "analyzers/wiring/event_bus.h"
#include "decoder/track/events.h"
#include "decoder/track/network.h"

namespace ecaudit::model {

class BusModel final : private ProcessSink {
 public:
  /// @param bus  whence the decoder's events come (Stage::kModel) and where what is concluded goes
  /// All arguments must outlive the model.
  BusModel(const track::Network& network, const AnalysisOptions& options, EventBus& bus);

  [[nodiscard]] const track::Network& network() const { return network_; }
  [[nodiscard]] std::size_t size() const { return slaves_.size(); }
  [[nodiscard]] const SlaveModel& slave(SlaveId id) const { return *by_id_[id]; }
  /// What the slaves signalled to the master.
  [[nodiscard]] const EventUnit& signalled() const { return signalled_; }
  /// What the slaves' AL states are together.
  [[nodiscard]] const BusAlUnit& al() const { return al_; }
  [[nodiscard]] const BusAlWait& al_wait() const { return al_wait_; }
  /// What the working counter of this logical access must be.
  [[nodiscard]] const LogicalExpectation& Expect(const track::LogicalAccess& access) const {
    return Expect(access.command, access.address, access.length);
  }
  [[nodiscard]] const LogicalExpectation& Expect(wire::Command command, std::uint32_t address,
                                                 std::uint16_t length) const {
    return expectations_.Find(network_, command, address, length);
  }

  /// The least and most it can be with the slaves in the states they may be in.
  /// @param expectation as Expect() gave it, for the same command
  [[nodiscard]] CounterRange RangeFor(const LogicalExpectation& expectation, wire::Command command) const {
    if (expectation.range_of != states_version_) {
      expectation.range = RangeOf(expectation, command, slaves_);
      expectation.range_of = states_version_;
    }
    return expectation.range;
  }

  void On(const track::SlaveFound& event);
  void On(const track::AddressAssigned& event);
  void On(const track::IdentityLearned& event);
  void On(const track::EventFieldChanged& event) { signalled_.OnField(event); }
  void On(const track::AlRequest& event);
  void On(const track::AlStatusRead& event);
  /// Takes it, unless a subscriber needs the event of each slave, or some slave has to be updated singly.
  void On(const track::AlPoll& poll);
  void On(const track::AlRequestOfAll& event);
  void On(const track::AlStatusOfAll& read) {
    al_.On(read);
    al_wait_.On(read);
    if (al_.refused()) al_wait_.Refused();
  }
  void On(const track::AlStatusCodeRead& event);
  void On(const track::RunBegan& event);
  void On(const track::AlStateForgotten& event);
  void On(const track::CaptureGap& event);
  /// Hands the process data in it to the units of the slaves.
  void On(const track::LogicalAccess& access);
  /// Process data in a frame that never came back: it is unknown whether the slaves took them.
  void On(const track::FrameLost& event);
  void On(const track::SlaveAccess& access);
  void On(const track::EepromRead& event);
  void On(const track::EepromWrite& event);
  void On(const mailbox::SdoTransfer& transfer);
  void On(const mailbox::SdoUnexpected& answer);
  void On(const mailbox::SdoInfo& info);
  /// The capture has ended.
  void Finish();
  void On(const mailbox::Emergency& emergency);
  void On(const track::AlRequestSent& request);

 private:
  void ChooseProfile(SlaveId id);
  void DoubtSettings(SlaveId id);
  void DoubtLayouts(SlaveId id);
  void ForgetObject(SlaveId id, std::uint16_t index, std::uint8_t subindex, bool whole);
  void DescriptionChanged(SlaveId slave);
  /// Looks for the model type in the EEPROM once more was read of it.
  void TakeModel(SlaveId id);
  /// Describes a modular slave again once the list of its modules is there.
  void TakeModules(SlaveId id);
  void Presume(const ProcessCycle& cycle);
  void On(const ProcessCycle& cycle) override;

  const track::Network& network_;
  EventSink& events_;
  AlTimeLimits al_limits_;
  std::int64_t latch_acknowledge_ns_ = 100'000'000;
  DriveLimits drive_limits_;
  ProfileChoice choice_;
  SharedLimits limits_;
  std::deque<SlaveModel> slaves_;
  std::vector<SlaveModel*> by_id_;       ///< the same: found without the deque's arithmetic, for every datagram
  std::deque<SeenIdentity> identities_;  ///< of each slave
  mutable LogicalExpectations expectations_;
  std::uint64_t states_version_ = 1;  ///< changes whenever a slave may have settled in OP, or left it
  ProcessImage image_;
  EventUnit signalled_;
  BusAlUnit al_;
  bool asked_of_all_ = false;  ///< a broadcast requested a state
  BusAlWait al_wait_;
  std::vector<const device::EniSlave*> presumed_;
};

}  // namespace ecaudit::model
