#include <algorithm>
#include <utility>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "decoder/device/profile_registry.h"
#include "decoder/track/access.h"

namespace ecaudit::register_read_only_write {
namespace {

constexpr FindingKind kReadOnly{
    .name = "read-only",
    .title = "Write to read-only register {register}",
    .message = R"(The master writes {written_begin} to {register} in {frame}. This register is read-only for EtherCAT
([{!printed}{manual}][{?printed}{esc}]).[{?printed} {manual} prints {printed}, but the slave controller decides.][{?refused}
The slave refused the write (working counter 0).][{?counted} The slave counted the access, but does not store the
value.][{!refused}[{!counted} The slave does not store the value.]])",
    .next = "Remove the write, or write the register that was intended.",
    .identity = "register"};
constexpr const FindingKind* kKinds[] = {&kReadOnly};

constexpr Word kRight{"register-right", "the access right of a register that was written"};

constexpr RuleInfo kInfo{.id = "register-read-only-write",
                         .group = "Frame and bus",
                         .severity = Severity::kError,
                         .needs_no_history = true,
                         .subject = Subject::kSlave,
                         .title = "The master writes a register that is read-only for EtherCAT",
                         .needs = "the register table of the family's manual",
                         .source = "ESC-2, registers",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
Writes to one slave that cover only registers which the manual of its family marks as read-only for EtherCAT.

## Why it matters
The slave does not store the value, so its configuration is not what the master intended.

## How it is decided
Every byte of the write lies in a read-only register.

- Masters write blocks that also cover writable registers (whole sync managers, FMMUs, the DC unit). These are not
  evaluated.
- Masters clear registers by broadcast when they scan the bus. Broadcasts are not evaluated.
- If a manual contradicts the slave controller on a register (0x0220 is printed R/W), the slave controller decides. The
  finding cites it and names the difference.

## Example
samples/captures/read-only-write.pcapng

## What to do
Remove the write from the master, or write the register that was intended.
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
        NotEvaluable(e.slave, ReasonCode::kNotInProfile, kRight, e.frame().number);
        return;
      }
      if (!right->read_only() || right->buffer) return;
      if (first == nullptr) first = right;
    }
    const std::uint64_t key = e.address;
    if (Repeat(e.slave, key, e.frame()) != kNoFinding) return;
    Finding finding = Found(kReadOnly, e.slave, e.frame());
    const auto begin = [&](std::size_t most) { return arg::Bytes(e.written.first(std::min(e.written.size(), most))); };
    finding.Set("register", arg::Register(e.address, first->name))
        .Set("written", begin(64))
        .Set("written_begin", begin(16))
        .Set("manual", arg::Text(first->source))
        .Set("refused", arg::Flag(e.acceptance == track::Acceptance::kRefused))
        .Set("counted", arg::Flag(e.acceptance == track::Acceptance::kAccepted));
    finding.reference = ReferenceTo(first->source);
    if (!first->printed_ecat.empty()) {
      const device::RegisterRight* standard = StandardRight(first->address);
      finding.Set("printed", arg::Text(first->printed_ecat))
          .Set("esc", arg::Text(standard != nullptr ? std::string_view(standard->source) : kController));
      finding.reference = ReferenceTo(standard != nullptr ? std::string_view(standard->source) : kController);
    }
    finding.confidence = e.acceptance == track::Acceptance::kAssumed ? Confidence::kInferred : Confidence::kObserved;
    Report(key, std::move(finding));
  }

 private:
  static constexpr std::string_view kController = "ESC-2, registers";

  /// What the data sheet of the slave controller has for the register, where a manual prints another right.
  static const device::RegisterRight* StandardRight(EscAddress address) {
    const device::DeviceDescription* standard = device::BuiltinProfile("generic");
    return standard == nullptr ? nullptr : standard->register_right(address);
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<RegisterReadOnlyWrite>};

}  // namespace
}  // namespace ecaudit::register_read_only_write
