/// in: SDO transfers of one drive.  out: PllMeasured, where it reported how far its PLL is from where it should be.
///
/// keeps: how often it did, and how often that was outside the window.
#pragma once

#include <cstdint>
#include <optional>

#include "analyzers/model/slave_model.h"
#include "analyzers/result/dc_summary.h"
#include "analyzers/sync/sync_events.h"
#include "decoder/mailbox/events.h"

namespace ecaudit::sync {

class PllWatch {
 public:
  /// @param evaluated        it is in OP with SYNC0 on
  /// @param frames_in_op  with outputs for it: the PLL may still be pulling in
  std::optional<PllMeasured> On(const mailbox::SdoTransfer& transfer, const model::SlaveModel& slave, bool evaluated,
                                std::uint64_t frames_in_op);
  /// The transfer reads the object that holds SYNCACT in this family.
  [[nodiscard]] static bool Concerns(const mailbox::SdoTransfer& transfer, const model::SlaveModel& slave);
  /// Unset where nothing is known.
  [[nodiscard]] std::optional<PllSummary> Summary(const model::SlaveModel& slave) const;

 private:
  std::uint64_t reads_ = 0, outside_ = 0;  // of SYNCACT
};

}  // namespace ecaudit::sync
