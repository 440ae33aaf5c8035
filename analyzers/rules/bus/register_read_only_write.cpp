#include <algorithm>
#include <optional>
#include <utility>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/judge/sync_manager_text.h"
#include "analyzers/model/slave_model.h"
#include "decoder/device/profile_registry.h"
#include "decoder/esc/register_map.h"
#include "decoder/track/access.h"
#include "decoder/track/network.h"

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
constexpr FindingKind kBuffer{
    .name = "buffer",
    .title = "Write to the buffer of SM{sync_manager} ({start}), which only the slave writes",
    .message =
        R"(The master writes {written_begin} to {address} in {frame}. The address is in the buffer of sync manager
{sync_manager} (start {start}, length {length}), which the slave writes and the master reads. The slave refused the
write (working counter 0).)",
    .next = "Write to the buffer of {outputs}, or remove the write.",
    .identity = "sync_manager"};
constexpr const FindingKind* kKinds[] = {&kReadOnly, &kBuffer};

constexpr Word kMailboxOut{"mailbox-out", "the mailbox from the master (SM0)"};
constexpr Word kOutputs{"outputs", "the outputs (SM2)"};
constexpr Word kRight{"register-right", "the access right of a register that was written"};

constexpr RuleInfo kInfo{.id = "register-read-only-write",
                         .group = "Frame and bus",
                         .severity = Severity::kError,
                         .history = History::kNone,
                         .subject = Subject::kSlave,
                         .title = "The master writes a register that is read-only for EtherCAT",
                         .needs = "the register table of the family's manual",
                         .source = "ESC-2, registers",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
Writes to one slave that cover only registers which the manual of its family marks as read-only for EtherCAT, and
writes into the buffer of a sync manager that the slave writes (inputs, mailbox to the master).

## Why it matters
The slave does not store the value, so its configuration is not what the master intended.

## How it is decided
Every byte of the write lies in a read-only register.

- Masters write blocks that also cover writable registers (whole sync managers, FMMUs, the DC unit). These are not
  evaluated.
- Masters clear registers by broadcast when they scan the bus. Broadcasts are not evaluated.
- If a manual contradicts the slave controller on a register (0x0220 is printed R/W), the slave controller decides. The
  finding cites it and names the difference.
- A write into a buffer counts only where the sync manager is on, and the slave refused the write.

## Example
samples/captures/read-only-write.pcapng

## What to do
Remove the write from the master, or write the register that was intended.
)"};

class RegisterReadOnlyWrite final : public Rule {
 public:
  RegisterReadOnlyWrite() : Rule(kInfo) { Subscribe<track::SlaveAccess>(&RegisterReadOnlyWrite::On); }

  void On(const track::SlaveAccess& e) {
    if (e.written.empty() || e.broadcast) return;
    if (e.address >= esc::kProcessRam) {
      if (e.acceptance == track::Acceptance::kRefused && !wire::IsLogical(e.command)) CheckBuffers(e);
      return;
    }
    const device::DeviceDescription& family = *context().slave(e.slave).profile;
    const device::RegisterRight* first = nullptr;
    for (std::size_t i = 0; i < e.written.size(); ++i) {
      const device::RegisterRight* right = family.register_right(static_cast<EscAddress>(e.address + i));
      if (right == nullptr) return NotEvaluable(e.slave, ReasonCode::kNotInProfile, kRight, e.frame().number);
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
  /// Process data and the mailbox to the master: the slave controller refuses what the master writes there.
  void CheckBuffers(const track::SlaveAccess& e) {
    const track::SlaveState& state = context().network().state(e.slave);
    for (std::size_t n = 0; n < esc::kMaxSyncManagers; ++n) {
      const std::optional<KnownSyncManager> known = SyncManagerOf(state, n);
      if (!known || !known->settings.enabled() || !known->settings.ecat_reads() || known->settings.length == 0)
        continue;
      const MemoryRange buffer = MemoryRange::Of(known->settings.start, known->settings.length);
      if (e.range().first < buffer.first || e.range().last > buffer.last) continue;
      const std::uint64_t key = kBufferKey | n;
      if (Repeat(e.slave, key, e.frame()) != kNoFinding) return;
      Finding finding = Found(kBuffer, e.slave, e.frame());
      finding.confidence = known->observed ? Confidence::kObserved : Confidence::kInferred;
      AddRelated(finding, known->since);
      finding.Set("address", arg::Hex(e.address))
          .Set("sync_manager", arg::Number(static_cast<std::int64_t>(n)))
          .Set("start", arg::Hex(known->settings.start))
          .Set("length", arg::Number(known->settings.length))
          .Set("outputs", known->settings.mailbox() ? arg::Of(kMailboxOut) : arg::Of(kOutputs))
          .Set("written_begin", arg::Bytes(e.written.first(std::min<std::size_t>(e.written.size(), 16))));
      finding.reference = ReferenceTo(kSyncManagers);
      Report(key, std::move(finding));
      return;
    }
  }

  /// No address of a register has this bit.
  static constexpr std::uint64_t kBufferKey = 0x10000;
  static constexpr std::string_view kSyncManagers = "ESC-1, sync manager";
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
