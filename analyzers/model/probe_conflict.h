/// in: the latch control word and the touch probe function (60B8h).  out: LatchMisuse, where both use a capture unit.
///
/// keeps: the last 60B8h, and the conflicts that were reported.
#pragma once

#include <array>
#include <cstdint>

#include "analyzers/model/latch_edges.h"
#include "analyzers/model/latch_reporter.h"
#include "analyzers/model/latch_words.h"

namespace ecaudit::model {

/// Bits of 60B8h that enable touch probe 1 and 2 (CiA 402).
inline constexpr std::array<std::uint16_t, 2> kTouchProbeEnable = {0x0001, 0x0100};

class ProbeConflict {
 public:
  /// @param all must outlive this
  ProbeConflict(const LatchControl& control, const LatchEdges& edges, LatchReporter& report)
      : control_(control), edges_(edges), report_(report) {}

  void SetFamily(const device::LatchDescription* latch);
  void Forget() {
    known_ = false;
    conflict_ = 0;
  }
  /// 60B8h, as the drive took it with `word`.
  void OnProbe(std::uint16_t value, const LatchWord& word) {
    if (known_ && value == probe_) return;
    known_ = true;
    probe_ = value;
    Check(word);
  }
  /// The control word is another one, or 60B8h is.
  void Check(const LatchWord& word);

 private:
  const LatchControl& control_;
  const LatchEdges& edges_;
  LatchReporter& report_;
  const device::LatchDescription* latch_ = nullptr;
  bool known_ = false;
  std::uint16_t probe_ = 0;
  std::array<std::uint16_t, 2> latch_enable_{};  // of the edges that share a capture unit with touch probe 1 and 2
  std::uint16_t conflict_ = 0;                   // touch probes in conflict, a bit each
};

}  // namespace ecaudit::model
