/// in: process data and SDO transfers of one drive.  out: LatchStep, LatchMisuse, LatchNotEvaluable (latch_events.h).
///
/// Follows the latch control word (20A4h) and the latch status word (20A5h), in process data or by SDO, edge by edge:
///
///   enable 0 -> 1   valid 0 -> 1    position read         enable 1 -> 0
///       armed   ...    valid     ...    read      ...       disarmed     ... armed again
///
/// A control word takes effect after the frame that carries it; the status word in the same frame is older. That the
/// valid bit falls with the enable bit is not in the manuals, so a value counts as lost only when the valid bit is gone
/// or the edge is armed again; a valid bit that was set when the edge was armed is the old one until it was seen 0.
///
/// keeps: the last words. No allocation a frame. What follows from them is kept by
///
///   LatchPlaces    where the words lie          LatchSelector  the edge that is read
///   LatchEdges     captures, edge by edge       ProbeConflict  touch probes that use the same capture unit
///   LatchReporter  what was reported              LatchUnasked   what no control word asked for
///
/// Touch probes (60B8h, 60B9h) have the same life without selectors; in continuous mode only the first capture shows.
///
/// Source: AKD-2010, 4.11; AKD-2011, 4.11; MKD, 4.12; PILZ, 4.9.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "analyzers/model/al_machine.h"
#include "analyzers/model/latch_edges.h"
#include "analyzers/model/latch_places.h"
#include "analyzers/model/latch_reporter.h"
#include "analyzers/model/latch_selector.h"
#include "analyzers/model/latch_unasked.h"
#include "analyzers/model/latch_words.h"
#include "analyzers/model/model_events.h"
#include "analyzers/model/probe_conflict.h"
#include "analyzers/model/process_data.h"
#include "decoder/base/allowance.h"
#include "decoder/base/event_sink.h"
#include "decoder/device/device_description.h"

namespace ecaudit::model {

class LatchUnit {
 public:
  static constexpr std::size_t kMaxCaptures = LatchEdges::kMaxCaptures;
  static constexpr std::size_t kMaxInputs = 4;

  /// Which words are followed.
  enum class Words : std::uint8_t {
    kLatch,       ///< 20A4h and 20A5h, evaluated by the catalogue's chapter on latches
    kTouchProbe,  ///< 60B8h and 60B9h (CiA 402): captures are reported, nothing is evaluated
  };

  /// @param al, process, sink must outlive this
  /// @param captures what all slaves share for captures; null: no common limit; else must outlive this
  LatchUnit(Words words, SlaveId slave, const AlMachine& al, const ProcessData& process, EventSink& sink,
            Allowance* captures = nullptr)
      : words_(words),
        al_(al),
        report_(slave, words == Words::kLatch, sink),
        edges_(control_, process, report_, captures),
        selector_(control_, status_, edges_, report_),
        probe_(control_, edges_, report_),
        unasked_(control_, status_, report_) {}
  LatchUnit(const LatchUnit&) = delete;
  LatchUnit& operator=(const LatchUnit&) = delete;

  /// The family's words; what was learned by another family's is forgotten. A family without: nothing is evaluated.
  void SetFamily(const device::DeviceDescription& family);
  /// How long the acknowledge may take to follow the selector, in ns.
  void SetAcknowledgeLimit(std::int64_t limit_ns) { selector_.SetAcknowledgeLimit(limit_ns); }

  /// Whether process data of the part with this serial matter: most hold nothing of latches.
  [[nodiscard]] bool Wants(std::uint64_t part, bool inputs) const {
    return latch_ != nullptr && part != idle_[inputs ? 1 : 0];
  }
  /// Process data of this slave that it wants; outputs of a datagram come before its inputs.
  void OnCycle(const ProcessCycle& cycle);
  void OnSdo(const mailbox::SdoTransfer& transfer);
  /// The slave leaves the states in which it has process data: its latches begin again, not evaluated.
  void Forget();
  /// The same where frames may be missing before this one.
  void ForgetAtGap(const FrameRef& frame);
  /// Frames may be missing from the capture before this one.
  void OnGap(FrameNo frame) { unasked_.OnGap(frame); }
  /// The capture has ended.
  void Finish();

  // For reports and rules.
  [[nodiscard]] const device::LatchDescription* description() const { return latch_; }
  [[nodiscard]] const device::LatchEdge& edge(std::size_t n) const { return latch_->edges[n]; }
  [[nodiscard]] bool seen() const { return control_.words + status_.words > 0; }
  [[nodiscard]] std::uint64_t control_words() const { return control_.words; }
  [[nodiscard]] std::uint64_t status_words() const { return status_.words; }
  [[nodiscard]] bool control_by_sdo() const { return control_.words > 0 && !control_.cyclic; }
  [[nodiscard]] bool status_by_sdo() const { return status_.words > 0 && !status_.cyclic; }
  [[nodiscard]] std::optional<std::uint16_t> control() const { return report_.control(); }
  [[nodiscard]] std::optional<std::uint16_t> status() const { return report_.status(); }
  [[nodiscard]] std::uint64_t misuses() const { return report_.misuses(); }
  [[nodiscard]] std::size_t edges() const { return edges_.size(); }
  [[nodiscard]] const LatchEdgeHistory& history(std::size_t edge) const { return edges_[edge].history; }
  /// The first captures, in order of arming; `captures_left_out` more were counted only.
  [[nodiscard]] const std::vector<LatchCapture>& captures() const { return edges_.captures(); }
  [[nodiscard]] std::uint64_t captures_left_out() const { return edges_.captures_left_out(); }
  /// Changes of digital input n + 1 as the status word shows them.
  [[nodiscard]] std::uint64_t input_changes(std::size_t n) const { return input_changes_[n]; }
  /// State of digital input n + 1 in a status word; nothing when the family's word does not hold it.
  [[nodiscard]] std::optional<bool> input(std::size_t n, std::uint16_t status_word) const;
  /// Last status word's frame, to show how long a value lay unread when the capture ended.
  [[nodiscard]] const FrameRef& last_status_frame() const { return status_.frame; }

 private:
  [[nodiscard]] const LatchPart& Turn(const ImagePart& image);
  void OnOutputs(const ProcessCycle& cycle, const LatchPart& part);
  void OnInputs(const ProcessCycle& cycle, const LatchPart& part);
  void NoteSent(const ProcessCycle& cycle, const LatchPart& part);
  void TakeOutputs(const ProcessCycle& cycle, const LatchPart& part);
  void TakeInputs(const ProcessCycle& cycle, const LatchPart& part);
  void OnCyclicStatus(const ProcessCycle& cycle, const LatchPart& part);
  void ReadPositions(const ProcessCycle& cycle, const LatchPart& part);
  void OnControl(const LatchWord& word);
  void Doubt(std::uint16_t value);
  void OnStatus(const LatchWord& word);
  void OnUpload(const mailbox::SdoTransfer& transfer, std::uint64_t value);
  void CheckState(const LatchWord& word, std::uint16_t before);

  const Words words_;
  const AlMachine& al_;
  const device::LatchDescription* latch_ = nullptr;
  std::array<std::uint16_t, kMaxInputs> input_masks_{};
  std::uint16_t enable_mask_ = 0;

  LatchControl control_;
  LatchStatus status_;
  std::array<std::uint64_t, kMaxInputs> input_changes_{};
  LatchPlaces places_;
  /// Serials of the parts that came last, outputs and inputs, where nothing in them matters to latches; 0: it does.
  std::array<std::uint64_t, 2> idle_{};
  LatchReporter report_;
  LatchEdges edges_;
  LatchSelector selector_;
  ProbeConflict probe_;
  LatchUnasked unasked_;
};

}  // namespace ecaudit::model
