/// in: frames with outputs that feed several slaves.  out: the OutputWatch of each, as OutputMeter would leave it.
///
/// Nearly always a frame comes one cycle after the one before, between the next two pulses of SYNC0 of each slave. Then
/// nothing is to be reported, and what it adds is the same for all of them: it is kept once, here, and each slave only
/// counts its phase. Settle() brings the watches up to date: before one is read or changed, it has to Part().
#pragma once

#include <cstdint>
#include <vector>

#include "analyzers/model/al_machine.h"
#include "analyzers/sync/cyclic_images.h"
#include "analyzers/sync/dc_unit.h"
#include "analyzers/sync/frame_at_hand.h"
#include "analyzers/sync/output_rate.h"
#include "analyzers/sync/output_watch.h"

namespace ecaudit::sync {

class FedTogether {
 public:
  /// Begins after a frame that fed each slave by itself. @param image  of its outputs
  void Begin(const CyclicImage& image, const FrameAtHand& at_hand);
  /// A slave that this frame fed. What is passed must outlive this.
  /// @return false: the next frame may be another one for it than for the others, or is to be looked at in full
  [[nodiscard]] bool Join(const model::AlMachine& al, OutputWatch& watch, const DcUnit& dc);
  /// The next frame with data of the image. @return false: it is not as always, and nothing was done
  [[nodiscard]] bool Take(const CyclicImage& image, const FrameAtHand& at_hand);
  /// The watches are as if each slave had been fed by itself; the slaves part.
  void Settle();

 private:
  struct Member {
    const model::AlMachine* al;
    OutputWatch* watch;
    TimeNs phase;  ///< when this began
  };

  std::vector<Member> members_;
  const CyclicImage* image_ = nullptr;
  std::uint64_t nominal_of_ = 0;  ///< of the image
  TimeNs limit_ = 0;              ///< from this length on some slave's gap is reported; 0: none is
  SteadyIntervals intervals_;
  FrameTime last_;
  FrameNo last_sent_ = 0;
  TimeNs cycle_ = 0;  ///< of SYNC0
  TimeNs way_ = 0;    ///< to the last byte, as FrameAtHand has it
  TimeNs late_ = 0;   ///< how much later in its cycle the last frame came than the one that this began with ...
  TimeNs least_ = 0, most_ = 0;  ///< ... and what it may be, for each slave
};

}  // namespace ecaudit::sync
