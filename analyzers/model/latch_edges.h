/// in: enable bits, valid bits and readings of one drive's latch edges.  out: LatchStep, LatchMisuse, LatchNotEvaluable
/// (values that are lost or never read).
///
/// keeps: one capture an edge, what each edge was used for, and the first kMaxCaptures captures for the report.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "analyzers/model/latch_events.h"
#include "analyzers/model/latch_places.h"
#include "analyzers/model/latch_reporter.h"
#include "analyzers/model/latch_words.h"
#include "analyzers/model/process_data.h"
#include "decoder/base/allowance.h"

namespace ecaudit::model {

/// What is known of one edge over the whole capture.
struct LatchEdgeHistory {
  /// Whether the object with its position is in the inputs, at the last capture.
  enum class Mapping : std::uint8_t { kUnknown, kUndocumented, kMapped, kNotMapped };
  std::uint64_t armed = 0;
  std::uint64_t valid = 0;
  std::uint64_t read = 0;
  std::uint64_t lost = 0;  ///< disarmed or armed again unread
  LatchCapture first_armed;
  std::uint64_t words_when_armed = 0;  ///< control words up to there
  Mapping mapping = Mapping::kUnknown;
  LatchCapture
      first_unread;  ///< the first capture that was valid and not read; valid.seen() shows whether there is one
};

/// The use of one edge, from enable bit to enable bit.
struct LatchEdgeState {
  static constexpr std::size_t kNotKept = ~std::size_t{0};

  bool enabled = false;
  bool valid = false;
  bool open = false;      ///< `capture` is not complete
  bool stale = false;     ///< the valid bit is the one of the capture before
  bool doubtful = false;  ///< a control word that may have been taken cleared the enable bit
  bool loss_pending = false;
  FrameNo armed_done = 0;  ///< no status word up to this frame can know of the arming
  FrameNo disarmed_done = 0;
  FrameRef released;  ///< the selector went back to 0 after its acknowledge
  LatchCapture capture;
  std::size_t kept = kNotKept;  ///< number in captures()
  LatchEdgeHistory history;
};

class LatchEdges {
 public:
  static constexpr std::size_t kMaxCaptures = 64;

  /// @param control   as it was before the word that is handed over
  /// @param captures  see LatchUnit; all must outlive this
  LatchEdges(const LatchControl& control, const ProcessData& process, LatchReporter& report, Allowance* captures)
      : control_(control), process_(process), report_(report), allowance_(captures) {}

  /// @param latch null: a family without
  void SetFamily(const device::LatchDescription* latch);
  /// The first word came. Edges of drives that do not use them are not made.
  void Need();
  /// They begin again, not evaluated.
  void Forget();
  /// The same where frames may be missing before this one: a position that lies unread may have been read in them.
  void ForgetAtGap(const FrameRef& frame);

  [[nodiscard]] std::size_t size() const { return edges_.size(); }
  [[nodiscard]] const LatchEdgeState& operator[](std::size_t n) const { return edges_[n]; }
  /// Some edge is valid and not read.
  [[nodiscard]] bool any_unread() const { return unread_ != 0; }
  [[nodiscard]] bool unread(std::size_t n) const { return (unread_ >> n & 1U) != 0; }
  [[nodiscard]] const std::vector<LatchCapture>& captures() const { return captures_; }
  [[nodiscard]] std::uint64_t captures_left_out() const { return captures_left_out_; }

  /// The enable bit of edge n in a control word that the drive took.
  /// @param first no control word was known before
  void OnEnable(std::size_t n, bool enabled, const LatchWord& word, bool first);
  /// An upload showed it enabled.
  void FoundEnabled(std::size_t n);
  /// Valid bits that appear in a status word.  @param first no status word was known before
  void OnValid(const LatchWord& word, bool first);
  /// Valid bits that are gone in it.
  void OnInvalid(const LatchWord& word);

  // What the selector makes of edge n.
  void Selected(std::size_t n, const FrameRef& frame);
  void Acknowledged(std::size_t n, const FrameRef& frame);
  void Released(std::size_t n, const FrameRef& frame) { edges_[n].released = frame; }
  void SetPosition(std::size_t n, std::optional<std::int64_t> position) { edges_[n].capture.position = position; }

  /// The position of edge n came to the master.
  void ReadBy(std::size_t n, LatchReading reading, const FrameRef& frame, std::optional<std::int64_t> position);
  /// One came whose edge the manual does not state.
  void ReadStray() { stray_read_ = true; }
  /// The master uploads the status word or a position, valid or not: it has a way to learn of a capture.
  void Asked() { asked_ = true; }
  /// The slave answered an SDO after this time.
  void Answered(std::int64_t ns) { slowest_sdo_ns_ = std::max(slowest_sdo_ns_, ns); }
  /// Inputs of unknown contents: a position may be among them.
  void InputsUnknown(bool unknown) { unknown_inputs_ = unknown; }

  /// The capture ends.
  void Finish(std::size_t n, const LatchStatus& status);

 private:
  void Open(std::size_t n);
  void Keep(const LatchEdgeState& edge);
  void Arm(std::size_t n, const LatchWord& word);
  void Disarm(std::size_t n, const LatchWord& word);
  void Lose(std::size_t n);
  void LearnMapping(std::size_t n);
  void CheckUnreachable(std::size_t n, const LatchStatus& status);
  void Step(LatchStep::Kind kind, std::size_t n, const FrameRef& frame);
  void SetUnread(std::size_t n) { unread_ = static_cast<std::uint16_t>(unread_ | 1U << n); }
  void ClearUnread(std::size_t n) { unread_ = static_cast<std::uint16_t>(unread_ & ~(1U << n)); }

  const LatchControl& control_;
  const ProcessData& process_;
  LatchReporter& report_;
  Allowance* allowance_;
  const device::LatchDescription* latch_ = nullptr;
  std::vector<LatchEdgeState> edges_;
  std::uint16_t unread_ = 0;  // edges that are valid and not read
  bool unknown_inputs_ = false;
  bool stray_read_ = false;
  bool asked_ = false;
  std::int64_t slowest_sdo_ns_ = 0;
  std::vector<LatchCapture> captures_;
  std::uint64_t captures_left_out_ = 0;
};

}  // namespace ecaudit::model
