/// One slave as its family's manual describes it, fed by the accesses the bus really made.
#pragma once

#include <string>

#include "analyzers/model/al_machine.h"
#include "decoder/device/device_description.h"
#include "decoder/device/eni_reader.h"
#include "decoder/track/events.h"

namespace ecaudit::model {

struct SlaveModel {
  SlaveModel(SlaveId slave, ModelSink& sink) : al(slave, sink) {}

  const device::DeviceDescription* profile = nullptr;  ///< never null once the slave is met
  std::string profile_source;                          ///< how it was chosen, for people
  track::IdentityLearned identity;                     ///< what is known so far; where the capture is silent, the ENI's
  const device::EniSlave* eni = nullptr;               ///< what the ENI says of this slave; null: nothing
  std::string name;                                    ///< from ENI or ESI, else empty (untrusted text)
  AlMachine al;
};

}  // namespace ecaudit::model
