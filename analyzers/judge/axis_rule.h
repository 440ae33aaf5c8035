/// What the rules about axes share: each reports some facts of the progress model (progress/axis_records.h), one kind
/// of finding for each.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "analyzers/judge/rule.h"
#include "analyzers/model/drive_events.h"
#include "analyzers/progress/axis_watch.h"

namespace ecaudit {

namespace what {
inline constexpr Word kMode{"mode", "the mode of operation (6060h, 6061h)"};
}  // namespace what

class AxisRule : public Rule {
 public:
  struct Row {
    progress::AxisFact fact;
    const FindingKind* kind;
  };

  /// @param rows  static
  AxisRule(const RuleInfo& info, std::span<const Row> rows);

  void On(const model::DriveFaultExplained& e);
  void Finish() override;

 protected:
  /// Sets the arguments that are not common to all: control_word, status_word, state, mode, shown_frame, lasted_ms.
  virtual void Describe(Finding& finding, const progress::AxisRecord& record, const progress::AxisWatch& axis) = 0;
  /// A kind of its own for what the row of its fact does not name.
  [[nodiscard]] virtual const FindingKind& KindOf(const progress::AxisRecord&, const FindingKind& kind) const {
    return kind;
  }
  /// Why the rule could not be evaluated for an axis; nothing where it could.
  [[nodiscard]] virtual std::optional<Reason> Unevaluated(const progress::AxisWatch& axis) const;
  /// The object of CiA 402 with its name, as the axis at hand has it.
  [[nodiscard]] Value ObjectOf(std::int64_t index) const;
  [[nodiscard]] Value ModeOf(std::int64_t mode) const;
  /// Bytes by which the master writes an object of the axis at hand too late, if it copies a struct that is not packed.
  [[nodiscard]] std::uint32_t PaddingBefore(std::uint16_t index) const;
  /// The unit of an object of the axis at hand in the inputs; empty: not mapped, or not known.
  [[nodiscard]] std::string UnitOf(std::uint16_t index) const;

 private:
  void ReportOf(SlaveId slave, std::uint8_t number, const progress::AxisWatch& axis, const progress::AxisRecord& record,
                const FindingKind& kind);
  void SetFault(Finding& finding, SlaveId slave, std::uint8_t number, const progress::AxisWatch& axis) const;

  std::span<const Row> rows_;
  std::map<std::pair<SlaveId, std::uint8_t>, model::DriveFaultExplained> explained_;  ///< the last of each axis
  SlaveId slave_ = kNoSlave;                                                          ///< whose axis is at hand
  std::uint8_t axis_ = 0;
};

}  // namespace ecaudit
