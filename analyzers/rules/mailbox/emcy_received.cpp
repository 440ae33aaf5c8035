#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/objects/relatives.h"
#include "decoder/base/text.h"
#include "decoder/mailbox/events.h"

namespace ecaudit::emcy_received {
namespace {

constexpr RuleInfo kInfo{.id = "emcy-received",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kError,
                         .needs_no_history = true,
                         .subject = Subject::kCoe,
                         .title = "The slave sends an emergency message",
                         .needs = "what the slave put into its mailbox",
                         .source = "ETG1000.6, emergency; CIA301, emergency error codes; MKD, 5.1",
                         .doc = R"(
## What it checks
CoE emergency messages: a fault or a warning came up in the drive, or went away.

## Why it matters
It is the drive's own account of what is wrong, often before the status word or the AL state shows it.

## How it is decided
Every emergency is reported, folded by error code and error register. A fault is an error; a warning of the drive
(n-codes) is a warning; "error free" (0x0000) is an info. The meaning comes from the family's table of codes. Where its
manual has none, from that of a sister family of the same vendor (marked inferred), else from the classes of the
standard, which do not tell faults from warnings: an error.

## Example
samples/captures/emergency.pcapng: code 0x7305 with error register 0x01 and the manufacturer's bytes 11 22 33 44 55.

## What to do
Look the code up in the drive's manual, by its own number (F..., n...) where it has one, and remove the cause.
)"};

class EmcyReceived final : public Rule {
 public:
  EmcyReceived() : Rule(kInfo) { Subscribe<mailbox::Emergency>(&EmcyReceived::On); }

  void On(const mailbox::Emergency& e) {
    if (e.data.too_short) return;  // mailbox-malformed
    const std::uint64_t key = static_cast<std::uint64_t>(e.data.error_code) << 8U | e.data.error_register;
    if (Repeat(e.slave, key, e.frame) != kNoFinding) return;
    const events::EmergencyInfo known = events::FindEmergency(context().slave(e.slave).profile, e.data.error_code);
    const bool exact = known.code != nullptr && known.code->code == known.code->last_code;
    const std::string meaning = known.code == nullptr ? std::string() : Meaning(*known.code, exact);
    const Severity severity = SeverityOf(e.data.error_code, known.code);
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.frame;
    finding.confidence = known.inferred ? Confidence::kInferred : Confidence::kObserved;
    finding.title = "Emergency " + Hex(e.data.error_code) + (meaning.empty() ? "" : ": " + meaning);
    finding.message = severity == Severity::kInfo ? "The slave says that it is free of errors again: emergency "
                                                  : "The slave reports an emergency with error code ";
    finding.message += Hex(e.data.error_code);
    if (!meaning.empty()) finding.message += " (" + meaning + ")";
    finding.message += ", error register " + Hex(e.data.error_register, 2) + RegisterText(e.data.error_register) +
                       ", manufacturer data " + HexBytes(e.data.data) + ".";
    if (known.inferred) {
      finding.message += " The meaning is that of a sister family (" + known.code->source +
                         "): the manual of this one lists no codes.";
    } else if (known.code == nullptr) {
      finding.message += " No table has this code.";
    }
    if (severity != Severity::kInfo) finding.message += " Look the code up in the drive's manual.";
    finding.evidence.push_back(HexNumber("error_code", e.data.error_code));
    if (known.code != nullptr && !known.code->id.empty()) finding.evidence.push_back(Text("id", known.code->id));
    if (known.code != nullptr) finding.evidence.push_back(Text("meaning", known.code->text));
    finding.evidence.push_back(HexNumber("error_register", e.data.error_register));
    finding.evidence.push_back(Text("data", HexBytes(e.data.data)));
    if (known.code != nullptr) finding.reference = ReferenceTo(known.code->source);
    Report(key, severity, std::move(finding));
  }

  void Finish() override { (void)NotEvaluableWithoutReturns(); }

 private:
  static std::string Meaning(const device::EmergencyCode& code, bool exact) {
    return (code.id.empty() ? "" : code.id + " ") + (exact ? "" : "class ") + code.text;
  }

  static Severity SeverityOf(std::uint16_t code, const device::EmergencyCode* known) {
    if (code == 0) return Severity::kInfo;
    if (known == nullptr) return Severity::kError;
    switch (known->kind) {
      case device::EmergencyKind::kNone:
        return Severity::kInfo;
      case device::EmergencyKind::kWarning:
        return Severity::kWarning;
      case device::EmergencyKind::kFault:
        break;
    }
    return Severity::kError;
  }

  /// Bits of object 1001h.
  static std::string RegisterText(std::uint8_t value) {
    constexpr std::string_view kBits[] = {"generic",       "current",        "voltage",  "temperature",
                                          "communication", "device profile", "reserved", "manufacturer"};
    std::string out;
    for (unsigned bit = 0; bit < 8; ++bit) {
      if ((value >> bit & 1U) != 0) out += (out.empty() ? "" : ", ") + std::string(kBits[bit]);
    }
    return out.empty() ? out : " (" + out + ")";
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<EmcyReceived>};

}  // namespace
}  // namespace ecaudit::emcy_received
