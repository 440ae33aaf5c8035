/// Base of the rules about PDO assignment and mapping: what the master downloads to 1C12h, 1C13h and the mapping
/// objects, and what follows from it at the next request of SAFEOP.
///
/// A fault is active until its object is written again from subindex 0 on. While it is active, it explains a wrong
/// length of the sync manager and a refusal of SAFEOP.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "analyzers/judge/refusal_predictions.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/model_events.h"
#include "decoder/device/device_description.h"
#include "decoder/mailbox/events.h"

namespace ecaudit {

/// "Rx" (master to slave), "Tx".
[[nodiscard]] Value PdoDirectionValue(device::PdoDirection direction);
/// The PDOs of a list: "1600h and 1601h".
[[nodiscard]] Value PdosValue(const std::vector<std::uint16_t>& pdos);
/// Of an assignment or mapping object.
[[nodiscard]] device::PdoDirection DirectionOf(std::uint16_t pdo_object);
/// What a mapping entry maps: "6040h:0 Control word".
[[nodiscard]] Value MappedValue(std::uint32_t mapping_entry, const device::DeviceDescription& family);

class PdoRule : public Rule {
 public:
  /// What it means if the slave reaches SAFEOP in spite of an active fault.
  enum class WhenAccepted : std::uint8_t {
    kStays,       ///< it is still a fault
    kBecomesInfo  ///< the drive offers more than its description
  };
  PdoRule(const RuleInfo& info, WhenAccepted when_accepted);

  void On(const mailbox::SdoTransfer& e);
  void On(const model::AlRequestJudged& e);
  virtual void On(const model::AlAnswered& e);
  /// Links the aborts of refused downloads to their cause.
  void Finish() override;

 protected:
  /// One value of a download.
  struct Write {
    std::uint16_t object = 0;
    std::uint8_t subindex = 0;
    std::uint32_t value = 0;
  };
  /// A download to an assignment or mapping object, before the model applies it.
  virtual void OnDownload(const mailbox::SdoTransfer& /*e*/, const std::vector<Write>& /*writes*/) {}
  /// The master requests SAFEOP in PREOP, and the slave accepts the request.
  virtual void OnSafeopRequest(const model::AlRequestJudged& /*e*/) {}

  /// Reports a fault of a download, folded by `key`. Sets {outcome} and {abort_code}, for sentences like
  /// "{outcome}[ with {abort_code}]."
  void ReportDownload(const mailbox::SdoTransfer& e, std::uint16_t object, std::uint64_t key, Finding finding);
  /// A fault found when SAFEOP is requested: predicts its refusal.
  void Predict(const model::AlRequestJudged& e, device::PdoDirection direction, FindingIndex finding);
  /// True when the master wrote the assignment, or one of the mapping objects in `pdos`.
  [[nodiscard]] bool WrittenByMaster(SlaveId slave, device::PdoDirection direction,
                                     const std::vector<std::uint16_t>& pdos) const;
  /// The object itself cannot be written: a fixed PDO. This shows nothing about order or contents.
  [[nodiscard]] static bool AbortedAsReadOnly(const mailbox::SdoTransfer& e) {
    constexpr std::uint32_t kReadOnly = 0x06010002;
    return e.outcome == mailbox::SdoOutcome::kAborted && e.abort_code == kReadOnly;
  }
  [[nodiscard]] static const FrameRef& FrameOf(const mailbox::SdoTransfer& e) {
    return e.request.seen() ? e.request : e.last;
  }

 private:
  struct Active {
    SlaveId slave = kNoSlave;
    std::uint16_t object = 0;
    FindingIndex finding = kNoFinding;
  };
  struct Aborted {
    SlaveId slave = kNoSlave;
    FrameNo frame = 0;
    FindingIndex cause = kNoFinding;
  };
  static constexpr std::size_t kMaxRemembered = 1000;

  void Forget(SlaveId slave, std::uint16_t object);

  WhenAccepted when_accepted_;
  RefusalPredictions predictions_;
  std::vector<Active> active_;
  std::vector<Aborted> aborted_;
  std::set<std::pair<SlaveId, std::uint16_t>> written_;
};

/// Refusals of SAFEOP that an unusual mapping may explain: an inference, made only if the AL status code names the sync
/// managers or the mapping and no better cause is known.
class MappingSuspicions {
 public:
  /// What is unusual in one direction at the time of the request.
  struct Suspect {
    device::PdoDirection direction = device::PdoDirection::kRx;
    const NoteKind* note = nullptr;  ///< for the refusal
    Arguments arguments;             ///< of the note
    bool by_code = false;            ///< out: the code names this direction, or none
  };
  struct Suspicion {
    FrameRef request;
    std::vector<Suspect> suspects;
    std::uint16_t code = 0;  ///< out
    FrameRef shown;          ///< out: the read that showed the code
    FindingIndex refusal = kNoFinding;
  };
  void Add(SlaveId slave, const FrameRef& request, std::vector<Suspect> suspects);
  /// The suspicion that the answer, or the code read later, confirms; else nothing.
  std::optional<Suspicion> On(const RuleContext& context, const model::AlAnswered& e);
  std::optional<Suspicion> On(const RuleContext& context, const model::AlErrorCode& e);
  /// Links the refusal to `cause` and adds the notes to it.
  static void Blame(RuleContext& context, const Suspicion& suspicion, FindingIndex cause);

 private:
  std::optional<Suspicion> Confirm(const RuleContext& context, SlaveId slave, const FrameRef& frame,
                                   std::uint16_t code);

  std::map<SlaveId, Suspicion> open_;
};

}  // namespace ecaudit
