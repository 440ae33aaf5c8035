/// in: the user's limits, what a device asks for, what its master waits.  out: how long a slave may take to change its
/// AL state.
///
/// The user's limit beats all. A device may be given longer than its maker asks for, or the master give up earlier:
/// what the master does counts before what the maker states. Source: esc-reference 5.7; ETG.2000
/// (StateMachine/Timeout); ETG.2100 (InitCmd with Validate).
#pragma once

#include "analyzers/model/al_machine.h"
#include "analyzers/options/options.h"
#include "decoder/device/esi_description.h"

namespace ecaudit::model {

class AlTimeLimits {
 public:
  explicit AlTimeLimits(const AnalysisOptions& options);

  /// Where neither ESI nor ENI is known.
  [[nodiscard]] const AlTimeouts& usual() const { return usual_; }
  /// @param esi what the maker states  @param eni what the master waits
  [[nodiscard]] AlTimeouts For(const device::StateTimeouts& esi, const device::StateTimeouts& eni) const;

 private:
  AlTimeouts usual_;
  bool own_preop_ = false, own_op_ = false, own_down_ = false;  ///< the user set them
};

}  // namespace ecaudit::model
