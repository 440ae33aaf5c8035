/// in: read selectors in control words, acknowledges in status words.  out: LatchMisuse, LatchNotEvaluable; the edge
/// that is read.
///
/// keeps: the selector that is set, until another one is.
#pragma once

#include <cstdint>

#include "analyzers/model/latch_edges.h"
#include "analyzers/model/latch_reporter.h"
#include "analyzers/model/latch_words.h"

namespace ecaudit::model {

class LatchSelector {
 public:
  /// @param control, status as they were before the word that is handed over  All must outlive this.
  LatchSelector(const LatchControl& control, const LatchStatus& status, LatchEdges& edges, LatchReporter& report)
      : control_(control), status_(status), edges_(edges), report_(report) {}

  void SetFamily(const device::LatchDescription* latch) { latch_ = latch; }
  /// How long the acknowledge may take to follow the selector, in ns.
  void SetAcknowledgeLimit(std::int64_t limit_ns) { ack_limit_ns_ = limit_ns; }
  void Forget() { asked_ = {}; }

  /// A read selector was set: may the master ask for this value now?
  void Select(const LatchWord& word, std::uint8_t selector);
  /// The selector leaves what it asked for.
  void Deselect(const LatchWord& word);
  /// The edge is armed again: an acknowledge that stays is of old.
  void Armed(std::size_t n) {
    if (asked_.dropped && asked_.edge == n) asked_ = {};
  }
  /// A control word came: the status word of the frame with the selector did not.
  void OnControl(const LatchWord& word) {
    if (asked_.undecided && word.begun != asked_.word.begun) Decide(false, false);
  }
  /// A status word in process data, before anything else is made of it.
  void OnCyclicStatus(const LatchWord& word);
  /// A status word, when the edges know of it.
  void OnStatus(const LatchWord& word) {
    if (asked_.active) CheckAcknowledge(word);
  }
  /// The capture ends.
  void Finish() {
    if (asked_.undecided) Decide(false, false);
  }

  /// The status word of the same frame is awaited.
  [[nodiscard]] bool undecided() const { return asked_.undecided; }
  /// An acknowledge may still come, or be missed.
  [[nodiscard]] bool awaits() const { return asked_.active && !asked_.acknowledged && !asked_.evaluated; }
  /// The word acknowledges a selector that nothing acknowledged so far.
  [[nodiscard]] bool AcknowledgedBy(std::uint16_t status_word) const {
    return asked_.active && !asked_.acknowledged && latch_->Acknowledge(status_word) == asked_.selector;
  }
  /// Meaningful while a selector is set.
  [[nodiscard]] std::size_t edge() const { return asked_.edge; }

 private:
  struct Selection {
    bool active = false;
    std::uint8_t selector = 0;
    std::uint8_t edge = 0;
    LatchWord word;
    bool undecided = false;     ///< the status word of the same frame is awaited
    bool status_known = false;  ///< when it was set
    bool status_gap = false;    ///< likewise
    bool dropped = false;       ///< the control word asks for something else now
    bool expects_ack = false;
    bool acknowledged = false;
    bool evaluated = false;
    std::uint32_t words = 0;  ///< status words since
  };

  void Decide(bool valid_in_same_frame, bool same_frame_known);
  void CheckRearmed(const LatchWord& word);
  void CheckAcknowledge(const LatchWord& word);
  void Complain(const LatchWord& word, std::int64_t waited_ns);

  const LatchControl& control_;
  const LatchStatus& status_;
  LatchEdges& edges_;
  LatchReporter& report_;
  const device::LatchDescription* latch_ = nullptr;
  std::int64_t ack_limit_ns_ = 100'000'000;
  Selection asked_;
};

}  // namespace ecaudit::model
