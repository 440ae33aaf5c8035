/// Base of the rules about PDO assignment and mapping: what the master downloads to 1C12h, 1C13h and the mapping
/// objects, and what follows from it at the next request of SAFEOP.
///
/// A fault stands until its object is written anew from subindex 0 on. While it stands it explains a wrong length of
/// the sync manager, and a refusal of SAFEOP.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
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
[[nodiscard]] std::string_view DirectionName(device::PdoDirection direction);
/// Of an assignment or mapping object.
[[nodiscard]] device::PdoDirection DirectionOf(std::uint16_t pdo_object);
/// "6040h:0 Control word, 16 bits".
[[nodiscard]] std::string EntryText(std::uint32_t mapping_entry, const device::DeviceDescription& family);

class PdoRule : public Rule {
 public:
  /// What reaching SAFEOP in spite of a standing fault means.
  enum class WhenAccepted : std::uint8_t {
    kStands,      ///< it is a fault all the same
    kBecomesInfo  ///< the drive can do more than its description says
  };
  PdoRule(const RuleInfo& info, WhenAccepted when_accepted);

  void On(const mailbox::SdoTransfer& e);
  void On(const model::AlRequestJudged& e);
  virtual void On(const model::AlAnswered& e);
  /// Points the aborts of refused downloads to their cause.
  void Finish() override;

 protected:
  /// One value of a download.
  struct Write {
    std::uint16_t object = 0;
    std::uint8_t subindex = 0;
    std::uint32_t value = 0;
  };
  /// A download to an assignment or mapping object, before the model takes it.
  virtual void OnDownload(const mailbox::SdoTransfer& /*e*/, const std::vector<Write>& /*writes*/) {}
  /// The master requests SAFEOP in PREOP; the slave takes the request.
  virtual void OnSafeopRequest(const model::AlRequestJudged& /*e*/) {}

  /// Reports a fault of a download, folded by `key`. `finding` needs title and message; the rest is filled in.
  void Tell(const mailbox::SdoTransfer& e, std::uint16_t object, std::uint64_t key, Finding finding);
  /// A fault found when SAFEOP is requested: predicts its refusal.
  void Predict(const model::AlRequestJudged& e, device::PdoDirection direction, FindingIndex finding);
  /// True when the master wrote the assignment, or one of the mapping objects in `pdos`.
  [[nodiscard]] bool WrittenByMaster(SlaveId slave, device::PdoDirection direction,
                                     const std::vector<std::uint16_t>& pdos) const;
  /// " The slave accepted it.", " The slave aborted it with 0x06040041 (...).".
  [[nodiscard]] static std::string OutcomeText(const mailbox::SdoTransfer& e);
  /// The object itself cannot be written: a fixed PDO. Nothing is learned about order or contents.
  [[nodiscard]] static bool AbortedAsReadOnly(const mailbox::SdoTransfer& e) {
    constexpr std::uint32_t kReadOnly = 0x06010002;
    return e.outcome == mailbox::SdoOutcome::kAborted && e.abort_code == kReadOnly;
  }
  [[nodiscard]] static const FrameRef& FrameOf(const mailbox::SdoTransfer& e) {
    return e.request.seen() ? e.request : e.last;
  }

 private:
  struct Standing {
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
  std::vector<Standing> standing_;
  std::vector<Aborted> aborted_;
  std::set<std::pair<SlaveId, std::uint16_t>> written_;
};

/// Refusals of SAFEOP that what is odd about the mapping may explain: an inference, made only when the AL status code
/// names the sync managers or the mapping and nothing better is known.
class MappingSuspicions {
 public:
  /// What is odd in one direction at the time of the request.
  struct Suspect {
    device::PdoDirection direction = device::PdoDirection::kRx;
    std::string text;      ///< "the Rx mapping is 17 bytes long, an odd number"
    bool by_code = false;  ///< out: the code names this direction, or none
  };
  struct Suspicion {
    FrameRef request;
    std::vector<Suspect> suspects;
    std::uint16_t code = 0;  ///< out
    FrameRef shown;          ///< out: the read that showed the code
    FindingIndex refusal = kNoFinding;
  };
  void Add(SlaveId slave, const FrameRef& request, std::vector<Suspect> suspects);
  /// The suspicion that the answer, or the code read later, makes ripe; else nothing.
  std::optional<Suspicion> On(const RuleContext& context, const model::AlAnswered& e);
  std::optional<Suspicion> On(const RuleContext& context, const model::AlErrorCode& e);
  /// Points the refusal to `cause` and remembers to say that this is an inference.
  void Blame(RuleContext& context, const Suspicion& suspicion, FindingIndex cause);
  /// At the end: says it in the refusals.
  void Finish(RuleContext& context) const;

 private:
  std::optional<Suspicion> Ripen(const RuleContext& context, SlaveId slave, const FrameRef& frame, std::uint16_t code);

  std::map<SlaveId, Suspicion> open_;
  std::vector<std::pair<FindingIndex, std::string>> blamed_;
};

}  // namespace ecaudit
