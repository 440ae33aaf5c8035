/// One slave as its family's manual describes it, fed by the accesses the bus really made.
#pragma once

#include <string>

#include "analyzers/model/al_machine.h"
#include "decoder/device/device_description.h"
#include "decoder/track/events.h"

namespace ecaudit::model {

struct SlaveModel {
  SlaveModel(SlaveId slave, ModelSink& sink) : al(slave, sink) {}

  const device::DeviceDescription* profile = nullptr;  ///< never null once the slave is met
  std::string profile_source;                          ///< how it was chosen, for people
  bool profile_fixed = false;                          ///< named by the user: an identity does not change it
  track::IdentityLearned identity;                     ///< what is known so far
  AlMachine al;
};

}  // namespace ecaudit::model
