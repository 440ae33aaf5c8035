#include <algorithm>
#include <array>
#include <bitset>
#include <set>
#include <utility>

#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/text.h"
#include "decoder/mailbox/events.h"
#include "decoder/process/pdo_mapping.h"

namespace ecaudit::sdo_abort {
namespace {

constexpr RuleInfo kInfo{.id = "sdo-abort",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kError,
                         .needs_no_history = true,
                         .subject = Subject::kCoe,
                         .title = "An SDO transfer is aborted",
                         .needs = "what the slave put into its mailbox",
                         .source = "ETG1000.6, SDO abort codes; CIA301, SDO abort codes",
                         .doc = R"(
## What it checks
SDO transfers that end with an abort, by the slave or by the master, and what the abort code says. Repetitions with the
same object and code count on one finding.

## Why it matters
The value was not written, or not read. A configuration that is aborted half way leaves the drive with a mixture of old
and new settings.

## How it is decided
An aborted download is an error: the master wanted to change something and did not. So is an aborted upload, with one
exception: an upload that is answered by "object does not exist" (0x06020000), "subindex does not exist" (0x06090011) or
"complete access not supported" (0x06010004) is an info. Masters ask like that to find out what a slave offers (SOEM's
slaveinfo, TwinCAT's optional objects); nothing is changed and the master has its answer. And a download with complete
access that the slave does not support is an info once the same PDOs or entries and their number were written one by
one. Where the slave takes the same value later, the text says so.
Where the model knows why the slave had to abort (sdo-write-read-only, sdo-wrong-size, sdo-unknown-object, sdo-toggle),
caused_by names that finding. The command byte of an abort is 0x80 in its top three bits; some slave stacks leave bits
of the request in it, and some put the code four bytes too far back, which the text then says. Aborts of SDO information
services are no SDO transfers.

## Example
samples/captures/sdo-aborts.pcapng: a download of 2 bytes to 60FFh:0 (INT32), aborted with 0x06070013.

## What to do
0x0601xxxx access, 0x0602 and 0x0609 001x the object, 0x0607 the size, 0x0609 003x the value, 0x0800 002x the state of
the drive (many objects can be written in PREOP only, or while the drive is disabled). Single codes mean something else
than their class: 0x06010004 complete access, 0x06010005 longer than the mailbox, 0x06040043 other parameters,
0x06090033 modules, 0x08000023 no dictionary, 0x08000024 no value yet.
)"};

constexpr std::uint32_t kNoObject = 0x06020000;
constexpr std::uint32_t kNoSubindex = 0x06090011;
constexpr std::uint32_t kNoCompleteAccess = 0x06010004;

class SdoAbort final : public Rule {
 public:
  SdoAbort() : Rule(kInfo) { Subscribe<mailbox::SdoTransfer>(&SdoAbort::On); }

  void On(const mailbox::SdoTransfer& t) {
    if (t.outcome == mailbox::SdoOutcome::kCompleted) {
      WrittenSingly(t);
      WrittenLater(t);
    }
    if (t.outcome != mailbox::SdoOutcome::kAborted) return;
    const bool by_slave = t.aborted_by == mailbox::Direction::kIn;
    const std::uint64_t key = static_cast<std::uint64_t>(t.abort_code) | static_cast<std::uint64_t>(t.index) << 32U |
                              static_cast<std::uint64_t>(t.subindex) << 48U |
                              static_cast<std::uint64_t>(t.service) << 56U | (by_slave ? 0U : 1ULL << 60U) |
                              (t.has_object ? 0U : 1ULL << 61U) | (t.complete_access ? 1ULL << 62U : 0U);
    if (const FindingIndex known = Repeat(t.slave, key, t.last); known != kNoFinding) {
      AddRelated(context().store[known], t.request.number);
      MissSingly(t, known);
      Remember(t, known);
      return;
    }
    const std::uint32_t code = t.displaced_abort_code.value_or(t.abort_code);
    const std::string object =
        t.has_object ? ObjectText(t, *context().slave(t.slave).profile) : std::string("an object not in the capture");
    const std::string service = t.service == mailbox::SdoService::kUnknown ? "transfer" : std::string(Name(t.service));
    Finding finding;
    finding.slave = t.slave;
    finding.first = t.last;
    finding.confidence = t.has_object ? ConfidenceOf(t.certainty) : Confidence::kObserved;
    finding.title = "SDO " + service + " of " + object + " aborted: " + CodeText(t.abort_code);
    finding.message = (by_slave ? std::string("The slave aborts the ") : std::string("The master aborts its ")) +
                      service + " of " + object +
                      (t.request.seen() ? " (request in frame " + std::to_string(t.request.number) + ")" : "") +
                      " with " + CodeText(t.abort_code) + ".";
    if (t.displaced_abort_code) {
      finding.message += " Four bytes behind the place of the code stands " + CodeText(*t.displaced_abort_code) +
                         ": the slave put it in the wrong place, and that is what it means.";
    }
    if (IsProbe(t)) {
      finding.message += " Nothing is changed: the master learns that the slave does not have it.";
    } else if (by_slave) {
      finding.message += " " + Advice(code);
    }
    if (by_slave) finding.message += EsiText(t);
    if (t.service == mailbox::SdoService::kDownload) {
      finding.message += " The master wrote " + Count(t.size, "byte") + ValueText(t.data) + ".";
    }
    finding.evidence.push_back(Text("service", service));
    if (t.has_object) {
      finding.evidence.push_back(HexNumber("index", t.index));
      finding.evidence.push_back(Number("subindex", t.subindex));
      finding.evidence.push_back({"complete_access", t.complete_access, Evidence::Notation::kDecimal});
    }
    finding.evidence.push_back(HexNumber("abort_code", t.abort_code));
    if (t.displaced_abort_code) finding.evidence.push_back(HexNumber("displaced_abort_code", *t.displaced_abort_code));
    finding.evidence.push_back(Text("meaning", std::string(mailbox::AbortCodeText(code))));
    finding.evidence.push_back(Text("aborted_by", by_slave ? "slave" : "master"));
    AddRelated(finding, t.request.number);
    const FindingIndex index = Report(key, IsProbe(t) ? Severity::kInfo : Severity::kError, std::move(finding));
    MissSingly(t, index);
    Remember(t, index);
  }

  void Finish() override { (void)NotEvaluableWithoutReturns(); }

 private:
  /// Complete access that was refused: what has to be written singly for the master to have what it wanted.
  struct Whole {
    SlaveId slave = kNoSlave;
    FindingIndex finding = kNoFinding;
    std::uint16_t index = 0;
    std::uint8_t count = 0;               ///< subindex 0
    std::array<std::uint32_t, 16> value;  ///< of subindices 1 to count
    std::bitset<17> missing;              ///< subindices
  };

  /// Values of assignments (two bytes) and mappings (four) behind the count and a byte of padding; others are of sizes
  /// that nobody knows here.
  void MissSingly(const mailbox::SdoTransfer& t, FindingIndex finding) {
    if (finding == kNoFinding || t.service != mailbox::SdoService::kDownload || !t.complete_access ||
        t.abort_code != kNoCompleteAccess || t.subindex != 0 || t.data.size() < 2 || !process::IsPdoObject(t.index)) {
      return;
    }
    const std::size_t bytes = process::IsAssignment(t.index) ? 2 : 4;
    Whole whole{.slave = t.slave, .finding = finding, .index = t.index, .count = t.data[0], .value = {}, .missing = {}};
    if (whole.count > whole.value.size() || t.data.size() < 2 + whole.count * bytes) return;
    for (std::size_t n = 0; n <= whole.count; ++n) {
      whole.missing.set(n);
      if (n > 0)
        whole.value[n - 1] = static_cast<std::uint32_t>(UnsignedOf(t.data.subspan(2 + (n - 1) * bytes, bytes)));
    }
    whole_[next_whole_++ % whole_.size()] = whole;
  }

  void WrittenSingly(const mailbox::SdoTransfer& t) {
    if (t.service != mailbox::SdoService::kDownload || t.complete_access || !t.has_object) return;
    for (Whole& whole : whole_) {
      if (whole.finding == kNoFinding || whole.slave != t.slave || whole.index != t.index) continue;
      if (t.subindex > whole.count || t.data.size() > 4) continue;
      const std::uint32_t wanted = t.subindex == 0 ? whole.count : whole.value[t.subindex - 1U];
      whole.missing.set(t.subindex, UnsignedOf(t.data) != wanted);
      if (whole.missing.any()) continue;
      Finding& finding = context().store[whole.finding];
      finding.message += " Then the master wrote the same entries one by one, the last of them in frame " +
                         std::to_string(t.last.number) + ": nothing is missing.";
      AddRelated(finding, t.last.number);
      context().store.Regrade(whole.finding, Severity::kInfo);
      whole.finding = kNoFinding;
    }
  }

  static std::string CodeText(std::uint32_t code) {
    const std::string_view text = mailbox::AbortCodeText(code);
    return Hex(code, 8) +
           (text.empty() ? ", a code without a meaning in the standard" : " (" + std::string(text) + ")");
  }

  /// What the ESI says of a feature that the transfer needs.
  [[nodiscard]] std::string EsiText(const mailbox::SdoTransfer& t) const {
    const device::DeviceDescription& device = *context().slave(t.slave).profile;
    if (!device.esi || !t.has_object) return {};
    if (t.complete_access && !device.mailbox.complete_access) return " Its ESI does not offer complete access.";
    if (t.service != mailbox::SdoService::kDownload) return {};
    constexpr std::uint16_t kFirstAssignment = 0x1C10, kLastAssignment = 0x1C2F;
    if (t.index >= kFirstAssignment && t.index <= kLastAssignment && device.esi->pdo_assign == false) {
      return " Its ESI says that the PDO assignment is fixed (PdoAssign).";
    }
    const bool mapping = (t.index >= 0x1600 && t.index < 0x1800) || (t.index >= 0x1A00 && t.index < 0x1C00);
    if (mapping && device.esi->pdo_config == false) return " Its ESI says that the PDO mapping is fixed (PdoConfig).";
    return {};
  }

  static bool IsProbe(const mailbox::SdoTransfer& t) {
    // Where the request is not in the capture, it may have been one.
    if (t.service == mailbox::SdoService::kDownload || t.aborted_by != mailbox::Direction::kIn) return false;
    return t.abort_code == kNoObject || t.abort_code == kNoSubindex || t.abort_code == kNoCompleteAccess;
  }

  static std::string ValueText(ByteSpan data) {
    constexpr std::size_t kShown = 8;
    if (data.empty()) return {};
    std::string out = " (" + HexBytes(data.first(std::min(kShown, data.size())));
    if (data.size() > kShown) out += "...";
    return out + ")";
  }

  static std::string Advice(std::uint32_t code) {
    switch (code) {
      case 0x06010003:
        return "Write 0 to subindex 0 first, then the other subindices, then subindex 0.";
      case kNoCompleteAccess:
        return "Transfer the subindices one by one.";
      case 0x06010005:
        return "The object is longer than the mailbox: transfer it in segments or subindex by subindex, or set up "
               "longer "
               "mailboxes where the device has them.";
      case 0x06010006:
        return "The object is mapped into the outputs, which write it in every cycle: take it out of the mapping, or "
               "write it by process data.";
      case 0x06040043:
        return "The value does not go together with other parameters: look at what was written before, and at their "
               "order.";
      case 0x06040047:
        return "The device contradicts itself: look at its own diagnosis, and try again after a power cycle.";
      case 0x06090033:
        return "The modules in the device are not those that the master configures: compare F030h with F050h.";
      case 0x06090036:
        return "Minimum and maximum of the parameter are reversed: write them in another order.";
      case 0x08000021:
        return "The device is under local control: switch that off at the device or in its tool.";
      case 0x08000023:
        return "The device has no dictionary at hand (it makes it from a file, or while it starts): look at its own "
               "diagnosis, and ask again later.";
      case 0x08000024:
        return "There is no value yet: ask again when the device has one.";
      default:
        break;
    }
    switch (code >> 16U) {
      case 0x0503:
        return "Look at the toggle bits of the segments.";
      case 0x0504:
        return "Look at the SDO command, and at what the slave was doing.";
      case 0x0601:
        return "The object does not allow this access; look it up in the dictionary of the drive.";
      case 0x0602:
        return "Check index and firmware: the drive does not have this object.";
      case 0x0604:
        return "Check the PDO mapping against what the drive allows.";
      case 0x0607:
        return "Check the length against the type of the object.";
      case 0x0609:
        return "Check subindex and value against the limits of the object.";
      case 0x0800:
        return "Check the state: AL state, drive enabled, local control.";
      default:
        return "Look the object up in the dictionary of the drive.";
    }
  }
  /// A download that was refused: the master may write the same once more, in a state that allows it.
  struct Refused {
    SlaveId slave = kNoSlave;
    FindingIndex finding = kNoFinding;
    std::uint16_t index = 0;
    std::uint8_t subindex = 0;
    std::uint8_t bytes = 0;
    std::array<std::uint8_t, 8> value{};
  };

  void Remember(const mailbox::SdoTransfer& t, FindingIndex finding) {
    Refused refused{
        .slave = t.slave, .finding = finding, .index = t.index, .subindex = t.subindex, .bytes = 0, .value = {}};
    const bool whole = t.has_object && !t.complete_access && t.size == t.data.size() && t.size <= refused.value.size();
    if (finding == kNoFinding || t.service != mailbox::SdoService::kDownload || !whole || t.data.empty()) return;
    refused.bytes = static_cast<std::uint8_t>(t.data.size());
    std::copy(t.data.begin(), t.data.end(), refused.value.begin());
    refused_[next_refused_++ % refused_.size()] = refused;
  }

  void WrittenLater(const mailbox::SdoTransfer& t) {
    if (t.service != mailbox::SdoService::kDownload || t.complete_access || !t.has_object) return;
    for (Refused& refused : refused_) {
      const bool same =
          refused.finding != kNoFinding && refused.slave == t.slave && refused.index == t.index &&
          refused.subindex == t.subindex &&
          std::equal(t.data.begin(), t.data.end(), refused.value.begin(), refused.value.begin() + refused.bytes);
      if (!same) continue;
      const FindingIndex index = std::exchange(refused.finding, kNoFinding);
      if (told_later_.contains(index)) continue;
      told_later_.insert(index);
      Finding& finding = context().store[index];
      finding.message += " In frame " + std::to_string(t.last.number) + " the slave takes the same value.";
      AddRelated(finding, t.last.number);
    }
  }

  std::array<Refused, 32> refused_{};  // the newest
  std::size_t next_refused_ = 0;
  std::set<FindingIndex> told_later_;
  std::array<Whole, 32> whole_{};  // the newest
  std::size_t next_whole_ = 0;
};

const RuleRegistration kRegistration{kInfo, MakeRule<SdoAbort>};

}  // namespace
}  // namespace ecaudit::sdo_abort
