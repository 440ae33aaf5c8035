/// in: control words and 60B8h as the master sent them, latch status words.  out: LatchMisuse (kStatusBits).
///
/// What the drive shows although the master never asked for it: another object may lie there, or another master asked.
/// A frame that never returned is known only later, and the drive may have accepted it. So valid bits and acknowledges
/// are reported when the capture ends, unless the capture shows an earlier word that asked for them.
///
/// keeps: what the words since SAFEOP asked for; the first and last occasion of each valid bit and acknowledge.
#pragma once

#include <cstdint>
#include <vector>

#include "analyzers/model/latch_reporter.h"
#include "analyzers/model/latch_words.h"

namespace ecaudit::model {

class LatchUnasked {
 public:
  /// @param all must outlive this
  LatchUnasked(const LatchControl& control, const LatchStatus& status, LatchReporter& report)
      : control_(control), status_(status), report_(report) {}

  void SetFamily(const device::LatchDescription* latch);
  /// The slave leaves the states in which it has process data.
  void Forget();
  /// Frames are missing before this one, control words perhaps among them.
  void OnGap(FrameNo frame);
  /// The master sent this control word, accepted or not.
  void OnControl(std::uint16_t word, FrameNo frame);
  /// The master sent this 60B8h, accepted or not, or the drive shows it.
  void OnProbe(std::uint16_t value, FrameNo frame);
  /// @param first    no status word was known before
  /// @param changed  bits that are not as in the word before
  void OnStatus(const LatchWord& word, bool first, std::uint16_t changed);
  /// The capture ends.
  void Finish();

 private:
  /// Waits for the end of the capture.
  struct Occasion {
    LatchMisuse first, last;
    std::uint64_t count = 0;
    bool gap = false;  ///< frames are missing before it
  };

  [[nodiscard]] bool Armed(const device::LatchEdge& edge) const;
  [[nodiscard]] bool Selected(std::uint16_t selector) const;
  [[nodiscard]] bool AskedFor(const LatchMisuse& misuse) const;
  [[nodiscard]] LatchMisuse Misuse(const LatchWord& word, LatchMisuse::StatusBits bits, std::uint16_t value) const;
  void Hold(const LatchMisuse& misuse);
  void DropWhatWasAskedFor(FrameNo frame);

  /// In the first status words a value may be left from before.
  static constexpr std::uint64_t kSettledWords = 3;

  const LatchControl& control_;
  const LatchStatus& status_;
  LatchReporter& report_;
  const device::LatchDescription* latch_ = nullptr;
  std::uint16_t armed_ = 0;     ///< bits that were 1 in a control word since the slave went to SAFEOP
  std::uint32_t selected_ = 0;  ///< bit n: selector n was in one
  std::uint16_t probed_ = 0;    ///< bits that were 1 in 60B8h
  bool gap_ = false;            ///< control words may be missing since
  std::vector<Occasion> held_;
};

}  // namespace ecaudit::model
