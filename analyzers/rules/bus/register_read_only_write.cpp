#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/text.h"
#include "decoder/track/access.h"

namespace ecaudit::register_read_only_write {
namespace {

constexpr RuleInfo kInfo{.id = "register-read-only-write",
                         .group = "Frame and bus",
                         .severity = Severity::kError,
                         .needs_no_history = true,
                         .subject = Subject::kSlave,
                         .title = "The master writes a register that is read-only for EtherCAT",
                         .needs = "the register table of the family's manual",
                         .source = "ESC-2, registers",
                         .doc = R"(
## What it checks
Writes to one slave that cover nothing but registers which the manual of its family marks read-only for EtherCAT.

## Why it matters
The slave does not take the value. The master believes it configured something.

## How it is decided
Every byte of the write lies in a read-only register. Block writes that also cover writable registers (whole sync
managers, FMMUs, the DC unit) are how masters work, and so are broadcasts that blank registers at scan time; neither is
judged. Where the manuals contradict the standard on a register, the profile says which of them counts.

## Example
samples/captures/read-only-write.pcapng

## What to do
Remove the write from the master, or write the register that was meant.
)"};

class RegisterReadOnlyWrite final : public Rule {
 public:
  RegisterReadOnlyWrite() : Rule(kInfo) { Subscribe<track::SlaveAccess>(&RegisterReadOnlyWrite::On); }

  void On(const track::SlaveAccess& e) {
    if (e.written.empty() || e.broadcast || e.address >= 0x1000) return;
    const device::DeviceDescription& family = *context().slave(e.slave).profile;
    const device::RegisterRight* first = nullptr;
    for (std::size_t i = 0; i < e.written.size(); ++i) {
      const device::RegisterRight* right = family.register_right(static_cast<EscAddress>(e.address + i));
      if (right == nullptr) {
        NotEvaluable(e.slave, "the manual's register table does not say whether a register that was written may be",
                     e.frame().number);
        return;
      }
      if (!right->read_only() || right->buffer) return;
      if (first == nullptr) first = right;
    }
    const std::uint64_t key = e.address;
    if (Repeat(e.slave, key, e.frame()) != kNoFinding) return;
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.frame();
    finding.title = "Write to read-only register " + Hex(e.address) + " (" + first->name + ")";
    finding.message =
        "The master writes " + HexBytes(e.written.first(std::min<std::size_t>(e.written.size(), 16))) + " to " +
        Hex(e.address) + " (" + first->name + "), which is read-only for the master (" + first->source + "). " +
        (e.acceptance == track::Acceptance::kRefused    ? "The slave did not take it (working counter 0). "
         : e.acceptance == track::Acceptance::kAccepted ? "The slave counted the access, but does not take the value. "
                                                        : "The slave does not take the value. ") +
        "Remove the write, or write the register that was meant.";
    finding.evidence.push_back(HexNumber("register", e.address));
    finding.evidence.push_back(Text("written", HexBytes(e.written.first(std::min<std::size_t>(e.written.size(), 64)))));
    finding.reference = ReferenceTo(first->source);
    finding.confidence = e.acceptance == track::Acceptance::kAssumed ? Confidence::kInferred : Confidence::kObserved;
    Report(key, std::move(finding));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<RegisterReadOnlyWrite>};

}  // namespace
}  // namespace ecaudit::register_read_only_write
