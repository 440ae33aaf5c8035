#include <bit>

#include "analyzers/judge/drive_knowledge.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/progress/progress_model.h"
#include "analyzers/words/drive_text.h"
#include "analyzers/words/what.h"

namespace ecaudit::drive_reserved_bits {
namespace {

constexpr FindingKind kControl{
    .name = "control-word",
    .title = "Reserved {bit_count?bit|bits} {bits} {bit_count?is|are} set in control word {control_word}",
    .message =
        "The master sends control word {control_word} in {frame}, in OP. Its {bit_count?bit|bits} {bits} "
        "{bit_count?is|are} reserved[ in mode {mode}].",
    .next =
        "Check whether the control word is mapped where the master writes it: a mapping that is shifted looks like "
        "this.",
    .identity = "bits"};

constexpr FindingKind kStatus{
    .name = "status-word-level",
    .title = "Bit {bit} ({name}) of status word {status_word} is {shown}, not {level}",
    .message =
        R"(The status word is {status_word} in {frame}, in OP. By the manual ({source}) bit {bit} ({name}) is always
{level}. Either the drive gives another meaning to it, or the word is no status word.)",
    .next = "Compare the PDO mapping with what the master reads, and check what bit {bit} means in this firmware.",
    .identity = "bit"};

constexpr const FindingKind* kKinds[] = {&kControl, &kStatus};

constexpr RuleInfo kInfo{.id = "drive-reserved-bits",
                         .group = "Drive profile (DS402)",
                         .severity = Severity::kInfo,
                         .title = "Bits of control or status word differ from the level in the manual",
                         .needs = "control word 6040h and status word 6041h; the AL state",
                         .source = "CIA402, control word and status word",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
The bits of the control word that the manual of the family, or else the standard, calls reserved: in every mode, or
(bits 4 to 6) in the mode that the drive shows while it is enabled.

Further, the bits of the status word that the manual binds to a level: bit 9 (remote) of an AKD is always 1.

## Why it matters
A mapping that is shifted by some bytes puts other values there. This shows itself here first.

## How it is decided
The first control word in OP in which a reserved bit is 1, and the first status word in OP with a state and another
level than the manual prints.

## Example
tests/rules/drive-reserved-bits/violates.trace

## What to do
Compare the PDO mapping of the slave with the layout that the master uses.
)"};

class DriveReservedBits final : public Rule {
 public:
  DriveReservedBits() : Rule(kInfo) {}

  void Finish() override {
    context().progress().ForEachAxis([&](SlaveId slave, std::uint8_t number, const progress::AxisWatch& axis) {
      if (axis.now().in_op == progress::InOp::kUnknown && !axis.seen_in_op()) {
        NotEvaluable(slave, ReasonCode::kNotInCapture, what::kAlState);
      }
      ReportOf(slave, number, axis.reserved_control());
      ReportStatus(slave, number, axis.odd_status());
    });
    NotEvaluableFor([](const model::SlaveModel& slave) { return DriveWordsMissing(slave, false); });
  }

 private:
  /// Where the manual calls the bits reserved.
  static const std::string& SourceOf(const progress::AxisWatch::Reserved& reserved, const device::DriveProfile& drive) {
    if (reserved.mode) {
      const device::ModeBits* const row = BitsOfMode(drive, reserved.mode);
      return row != nullptr ? row->source : drive.source;
    }
    for (const device::WordBit& row : drive.control_bits) {
      if ((row.reserved & reserved.bits) != 0) return row.source;
    }
    return drive.source;
  }

  void ReportOf(SlaveId slave, std::uint8_t number, const progress::AxisWatch::Reserved& reserved) {
    if (reserved.bits == 0) return;
    Finding finding = Found(kControl, slave, reserved.frame);
    finding.Set("control_word", arg::Hex(reserved.word));
    finding.Set("bits", arg::Bits(reserved.bits)).Set("bit_count", arg::Number(std::popcount(reserved.bits)));
    const device::DeviceDescription& family = *context().slave(slave).profile;
    if (reserved.mode) finding.Set("mode", ModeValue(family, *reserved.mode));
    if (family.drive) finding.reference = ReferenceTo(SourceOf(reserved, *family.drive));
    NameAxis(finding, number);
    (void)Report(AxisKey(number), std::move(finding));
  }

  void ReportStatus(SlaveId slave, std::uint8_t number, const progress::AxisWatch::Reserved& odd) {
    const auto& drive = context().slave(slave).profile->drive;
    if (odd.bits == 0 || !drive) return;
    for (const device::WordBit& row : drive->status_bits) {
      if (!row.level || (odd.bits >> row.bit & 1U) == 0) continue;
      Finding finding = Found(kStatus, slave, odd.frame);
      finding.Set("status_word", arg::Hex(odd.word))
          .Set("bit", arg::Number(row.bit))
          .Set("name", arg::Text(row.name))
          .Set("shown", arg::Number(*row.level == 0 ? 1 : 0))
          .Set("level", arg::Number(*row.level))
          .Set("source", arg::Text(row.source));
      finding.reference = ReferenceTo(row.source);
      NameAxis(finding, number);
      (void)Report(AxisKey(number) | 0x100U | row.bit, std::move(finding));
    }
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<DriveReservedBits>};

}  // namespace
}  // namespace ecaudit::drive_reserved_bits
