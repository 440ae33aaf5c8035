/// One slave as its family's manual describes it, fed by the accesses the bus really made.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>

#include "analyzers/model/al_machine.h"
#include "analyzers/model/diagnosis_history.h"
#include "analyzers/model/drive_axes.h"
#include "analyzers/model/entry_port.h"
#include "analyzers/model/latch_unit.h"
#include "analyzers/model/mailbox_unit.h"
#include "analyzers/model/object_values.h"
#include "analyzers/model/process_data.h"
#include "analyzers/model/set_up_facts.h"
#include "analyzers/model/slot_modules.h"
#include "analyzers/objects/object_names.h"
#include "decoder/base/allowance.h"
#include "decoder/base/event_sink.h"
#include "decoder/device/device_description.h"
#include "decoder/device/eni_reader.h"
#include "decoder/track/events.h"
#include "decoder/track/slave_state.h"

namespace ecaudit::model {

/// How the process data of one direction were exchanged.
struct ProcessTraffic {
  std::uint64_t exchanged = 0;  ///< datagrams in which the slave took or gave them
  std::uint64_t missed = 0;     ///< in which it did not
  FrameRef first, last;         ///< of those exchanged

  /// The same since the master last requested SAFEOP or a lower state.
  struct SinceRequest {
    FrameNo request = 0;  ///< 0: the capture does not show one
    std::uint64_t exchanged = 0;
    std::uint64_t missed = 0;
    std::uint64_t missed_by_lrw = 0;
    FrameNo last_missed = 0;
  };
  SinceRequest since;
};

/// What all slaves together may keep, many times what a real bus needs.
struct SharedLimits {
  Allowance objects{65'536};
  Allowance name_bytes{std::size_t{8} << 20U};
  Allowance mapping_values{16'384};
  Allowance latch_captures{16'384};
};

struct SlaveModel {
  /// @param state what is known of its ESC; must outlive the model, as must `limits`
  SlaveModel(SlaveId slave, const track::SlaveState& state, SharedLimits& limits, EventSink& sink)
      : al(slave, sink),
        mailbox(slave, state, sink),
        objects(&limits.objects),
        names(&limits.name_bytes),
        process(state, names, &limits.mapping_values),
        drives(slave, al, sink),
        latch(LatchUnit::Words::kLatch, slave, al, process, sink, &limits.latch_captures),
        touch_probe(LatchUnit::Words::kTouchProbe, slave, al, process, sink, &limits.latch_captures) {}
  SlaveModel(const SlaveModel&) = delete;  // units refer to one another
  SlaveModel& operator=(const SlaveModel&) = delete;

  /// The slave leaves the states in which it has process data.
  void ForgetLatches() {
    latch.Forget();
    touch_probe.Forget();
  }

  /// Frames are missing from the capture before this one, or may be.
  /// @param forget control words may be among them
  void NoteLatchGap(const FrameRef& frame, bool forget) {
    for (LatchUnit* unit : {&latch, &touch_probe}) {
      if (forget) unit->ForgetAtGap(frame);
      unit->OnGap(frame.number);
    }
  }

  const device::DeviceDescription* profile = nullptr;  ///< never null once the slave is met
  std::string profile_source;                          ///< how it was chosen, for people
  track::IdentityLearned identity;                     ///< what is known so far; where the capture is silent, the ENI's
  const device::EniSlave* eni = nullptr;               ///< what the ENI states of this slave; null: nothing
  std::string name;                                    ///< from ENI or ESI, else empty (untrusted text)
  AlMachine al;
  MailboxUnit mailbox;
  EntryPort entry_port;  ///< at which frames enter
  SetUpFacts set_up;
  /// Parameters that the user gave, by keyword.
  std::map<std::string, std::int64_t, std::less<>> given;
  ObjectValues objects;        ///< dictionary: last value of each object seen
  events::ObjectNames names;   ///< what the slave itself calls its objects
  DiagnosisHistory diagnosis;  ///< its own messages, as the master read them
  SlotModules modules;         ///< what is in the slots of a modular device
  ProcessData process;         ///< PDO assignment and mapping
  ProcessTraffic outputs, inputs;
  DriveAxes drives;  ///< CiA 402 state machines, where the family has one
  LatchUnit latch;
  LatchUnit touch_probe;
};

}  // namespace ecaudit::model
