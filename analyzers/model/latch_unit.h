/// in: process data and SDO transfers of one drive.  out: LatchStep, LatchMisuse, LatchNotJudged (latch_events.h).
///
/// Follows the latch control word (20A4h) and the latch status word (20A5h), in process data or by SDO, edge by edge:
///
///   enable 0 -> 1   valid 0 -> 1    position read         enable 1 -> 0
///       armed   ...    valid     ...    read      ...       disarmed     ... armed again
///
/// A control word takes effect behind the frame that carries it; the status word in the same frame is older. That the
/// valid bit falls with the enable bit is not in the manuals, so a value counts as lost only when the valid bit is gone
/// or the edge is armed again; a valid bit that was set when the edge was armed is the old one until it was seen 0.
///
/// Keeps: the last words, one capture an edge, the first kMaxCaptures captures for the report. No allocation a frame.
/// Touch probes (60B8h, 60B9h) have the same life without selectors; in continuous mode only the first capture shows.
///
/// Source: AKD-2010, 4.11; AKD-2011, 4.11; MKD, 4.12; PILZ, 4.9.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "analyzers/model/al_machine.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/process_data.h"
#include "analyzers/model/still_cycle.h"
#include "decoder/base/allowance.h"
#include "decoder/base/event_sink.h"
#include "decoder/device/device_description.h"

namespace ecaudit::model {

struct ProcessCycle;
struct ImagePart;

/// What is known of one edge over the whole capture.
struct LatchEdgeHistory {
  /// Whether the object with its position is in the inputs, at the last capture.
  enum class Mapping : std::uint8_t { kUnknown, kUndocumented, kMapped, kNotMapped };
  std::uint64_t armed = 0;
  std::uint64_t valid = 0;
  std::uint64_t read = 0;
  std::uint64_t lost = 0;  ///< disarmed or armed again unread
  Mapping mapping = Mapping::kUnknown;
  LatchCapture
      first_unread;  ///< the first capture that was valid and not read; valid.seen() tells whether there is one
};

class LatchUnit {
 public:
  static constexpr std::size_t kMaxEdges = 16;
  static constexpr std::size_t kMaxCaptures = 64;
  static constexpr std::size_t kMaxInputs = 4;

  /// Which words are followed.
  enum class Words : std::uint8_t {
    kLatch,       ///< 20A4h and 20A5h, judged by the catalogue's chapter on latches
    kTouchProbe,  ///< 60B8h and 60B9h (CiA 402): captures are told, nothing is judged
  };

  /// @param al, process, sink must outlive this
  /// @param captures what all slaves share for captures; null: no common limit; else must outlive this
  LatchUnit(Words words, SlaveId slave, const AlMachine& al, const ProcessData& process, EventSink& sink,
            Allowance* captures = nullptr)
      : words_(words), slave_(slave), al_(al), process_(process), sink_(sink), allowance_(captures) {}

  /// The family's words; what was learned by another family's is forgotten. A family without: nothing is judged.
  void SetFamily(const device::DeviceDescription& family);
  /// How long the acknowledge may take to follow the selector, in ns.
  void SetAcknowledgeLimit(std::int64_t limit_ns) { ack_limit_ns_ = limit_ns; }

  /// Process data of this slave; outputs of a datagram come before its inputs.
  /// @param watched gets the words on which being still rests
  Still OnCycle(const ProcessCycle& cycle, StillCycle& watched);
  /// A cycle like one that left the unit at Still::kCounts.
  void Repeat(const ProcessCycle& cycle);
  void OnSdo(const mailbox::SdoTransfer& transfer);
  /// The slave leaves the states in which it has process data: its latches begin anew, unjudged.
  void Forget();
  /// The capture has ended.
  void Finish();

  // For reports and rules.
  [[nodiscard]] const device::LatchDescription* description() const { return latch_; }
  [[nodiscard]] const device::LatchEdge& edge(std::size_t n) const { return latch_->edges[n]; }
  [[nodiscard]] bool seen() const { return control_words_ + status_words_ > 0; }
  [[nodiscard]] std::uint64_t control_words() const { return control_words_; }
  [[nodiscard]] std::uint64_t status_words() const { return status_words_; }
  [[nodiscard]] bool control_by_sdo() const { return control_words_ > 0 && !cyclic_control_; }
  [[nodiscard]] bool status_by_sdo() const { return status_words_ > 0 && !cyclic_status_; }
  [[nodiscard]] std::optional<std::uint16_t> control() const { return last_control_; }
  [[nodiscard]] std::optional<std::uint16_t> status() const { return last_status_; }
  [[nodiscard]] std::uint64_t misuses() const { return misuses_; }
  [[nodiscard]] std::size_t edges() const { return edges_.size(); }
  [[nodiscard]] const LatchEdgeHistory& history(std::size_t edge) const { return edges_[edge].history; }
  /// The first captures, in order of arming; `captures_left_out` more were counted only.
  [[nodiscard]] const std::vector<LatchCapture>& captures() const { return captures_; }
  [[nodiscard]] std::uint64_t captures_left_out() const { return captures_left_out_; }
  /// Changes of digital input n + 1 as the status word shows them.
  [[nodiscard]] std::uint64_t input_changes(std::size_t n) const { return input_changes_[n]; }
  /// State of digital input n + 1 in a status word; nothing when the family's word does not hold it.
  [[nodiscard]] std::optional<bool> input(std::size_t n, std::uint16_t status_word) const;
  /// Last status word's frame, to tell how long a value lay unread when the capture ended.
  [[nodiscard]] const FrameRef& last_status_frame() const { return status_frame_; }

 private:
  struct Where {
    std::uint32_t bit = 0;
    std::uint16_t bits = 0;  ///< 0: not here
  };
  /// What of an ImagePart matters here.
  struct Part {
    std::uint64_t serial = 0;
    bool used = false;
    bool unknown_layout = false;
    bool incomplete = false;  ///< see ImagePart
    Where control, status, probe;
    std::array<Where, kMaxEdges> positions{};
    bool any_position = false;
    bool stray_position = false;  ///< a latch position of which the manual does not say whose it is
  };
  struct Edge {
    bool enabled = false;
    bool valid = false;
    bool open = false;      ///< `capture` is under way
    bool stale = false;     ///< the valid bit is the one of the capture before
    bool doubtful = false;  ///< a control word that may have been taken cleared the enable bit
    bool loss_pending = false;
    FrameNo armed_done = 0;  ///< no status word up to this frame can know of the arming
    FrameNo disarmed_done = 0;
    FrameRef released;  ///< the selector went back to 0 behind its acknowledge
    LatchCapture capture;
    std::size_t kept = kNotKept;  ///< number in captures_
    LatchEdgeHistory history;
  };
  /// A word as it came.
  struct Word {
    std::uint16_t value = 0;
    FrameRef frame;     ///< to cite
    FrameNo begun = 0;  ///< control: sent; status: no older than this
    FrameNo done = 0;   ///< control: in force behind this; status: known to the master from here on
    bool by_sdo = false;
    bool inferred = false;
  };
  struct Selection {
    bool active = false;
    std::uint8_t selector = 0;
    std::uint8_t edge = 0;
    Word word;
    bool undecided = false;     ///< the status word of the same frame is awaited
    bool status_known = false;  ///< when it was set
    bool status_gap = false;    ///< likewise
    bool dropped = false;       ///< the control word asks for something else now
    bool expects_ack = false;
    bool acknowledged = false;
    bool judged = false;
    std::uint32_t words = 0;  ///< status words since
  };
  static constexpr std::size_t kParts = 8;
  static constexpr std::size_t kNotKept = ~std::size_t{0};

  const Part& PartOf(const ImagePart& part);
  void Learn(Part& part, const ImagePart& from) const;
  Still OnOutputs(const ProcessCycle& cycle, const Part& part, StillCycle& watched);
  Still OnInputs(const ProcessCycle& cycle, const Part& part, StillCycle& watched);
  void NeedEdges();
  void OnControl(const Word& word);
  void OnStatus(const Word& word);
  void OnProbe(std::uint16_t value, const Word& word);
  void Select(const Word& word, std::uint8_t selector);
  void Decide(bool valid_in_same_frame, bool same_frame_known);
  void Deselect(const Word& word);
  void Arm(std::size_t n, const Word& word);
  void Disarm(std::size_t n, const Word& word);
  void ReadBy(std::size_t n, LatchReading reading, const FrameRef& frame, std::optional<std::int64_t> position);
  void Lose(std::size_t n);
  void Open(std::size_t n);
  void Keep(const Edge& edge);
  void JudgeAcknowledge(const Word& word);
  void JudgeState(const Word& word, std::uint16_t before);
  void JudgeProbe(const Word& word);
  void LearnMapping(Edge& edge, std::size_t n) const;
  void Step(LatchStep::Kind kind, std::size_t n, const FrameRef& frame);
  [[nodiscard]] LatchMisuse Misuse(LatchMisuse::Kind kind, const Word& word) const;
  void Emit(const LatchMisuse& misuse);
  void NotJudged(LatchMisuse::Kind kind, const FrameRef& frame, std::string_view reason);

  const Words words_;
  SlaveId slave_;
  const AlMachine& al_;
  const ProcessData& process_;
  EventSink& sink_;
  Allowance* allowance_;
  const device::LatchDescription* latch_ = nullptr;
  std::int64_t ack_limit_ns_ = 100'000'000;

  // Both are empty in the many slaves that have no such words, or do not use them.
  std::vector<Part> parts_;
  std::size_t next_part_ = 0;
  std::vector<Edge> edges_;
  std::array<std::uint16_t, kMaxInputs> input_masks_{};
  std::uint16_t enable_mask_ = 0;

  bool control_known_ = false;
  std::uint16_t control_ = 0;
  bool control_doubt_ = false;    ///< a word of which it is not known whether it was taken came since
  std::uint16_t doubt_zero_ = 0;  ///< bits that were 0 in it
  bool doubt_selector_ = false;   ///< its selector was another
  bool cyclic_control_ = false;
  bool status_known_ = false;
  std::uint16_t status_ = 0;
  FrameRef status_frame_;
  FrameNo status_begun_ = 0;
  bool status_gap_ = false;  ///< inputs are missing since
  bool cyclic_status_ = false;
  bool unknown_inputs_ = false;  ///< inputs of unknown contents: a position may be among them
  bool stray_read_ = false;      ///< a position came of which the manual does not say whose it is
  std::uint16_t unread_ = 0;     ///< edges that are valid and not read
  Selection selection_;
  bool probe_known_ = false;
  std::uint16_t probe_ = 0;
  std::uint16_t conflict_ = 0;  ///< capture units in conflict

  std::optional<std::uint16_t> last_control_, last_status_;
  std::uint64_t control_words_ = 0;
  std::uint64_t status_words_ = 0;
  std::uint64_t misuses_ = 0;
  std::array<std::uint64_t, kMaxInputs> input_changes_{};
  std::vector<LatchCapture> captures_;
  std::uint64_t captures_left_out_ = 0;
};

}  // namespace ecaudit::model
