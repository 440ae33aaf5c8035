/// Slaves that the ENI names and the capture did not show: what is known of their process data is the ENI's.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

#include "analyzers/model/profile_choice.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/event_sink.h"
#include "decoder/track/slave_state.h"

namespace ecaudit::model {

class EniSlaves {
 public:
  /// @param choice decides what they are; must outlive this
  /// @param eni null: none; must outlive this
  EniSlaves(ProfileChoice& choice, const device::EniConfig* eni) : choice_(choice), eni_(eni) {}

  /// The slave with this number in the ENI, made when it is first asked for. Valid as long as this.
  [[nodiscard]] const SlaveModel& Of(std::size_t number);

 private:
  struct Unmet {
    std::unique_ptr<track::SlaveState> state;
    std::unique_ptr<SlaveModel> model;
  };

  ProfileChoice& choice_;
  const device::EniConfig* eni_;
  EventSink no_events_;
  SharedLimits limits_;
  std::vector<Unmet> unmet_;  ///< by number
};

}  // namespace ecaudit::model
