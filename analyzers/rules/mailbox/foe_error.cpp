#include <string>
#include <string_view>
#include <utility>

#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/mailbox_text.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/base/text.h"
#include "decoder/base/wrapping.h"
#include "decoder/mailbox/events.h"
#include "decoder/mailbox/foe.h"
#include "decoder/pipeline.h"

namespace ecaudit::foe_error {
namespace {

constexpr RuleInfo kInfo{.id = "foe-error",
                         .group = "Mailbox and CoE",
                         .severity = Severity::kError,
                         .needs_no_history = true,
                         .title = "A file transfer ends with an error or never ends",
                         .needs = "the FoE messages of both directions",
                         .source = "ETG1000.6, file access over EtherCAT",
                         .doc = R"(
## What it checks
File transfers (FoE) that end with an error message of the slave or of the master, and such that were answered but
never finished: the error code and its meaning, the text the slave sends, the file, and how far the transfer came.

## Why it matters
A firmware or parameter file that was transferred in part leaves the device without it, or in BOOT until somebody
repeats the download.

## How it is decided
An error message (operation 5) ends the transfer; codes with and without the leading 0x8000 mean the same. A transfer
never ends where the next one begins before its last packet was acknowledged, where the slave is sent to INIT before,
or where nothing of it follows for a second before the capture ends (limit `foe-error`). A request that the slave never
answered at all belongs to mailbox-no-response, one that it answers with a mailbox error to mailbox-error-reply. Where
frames are missing in the capture, or its answers, nothing is said of the end.

## Example
tests/rules/foe-error/violates.trace: a download that ends with 0x8002.

## What to do
0x8001 name of the file; 0x8002, 0x8007, 0x800A rights and password; 0x8003, 0x8011 memory of the device; 0x8005
packets that were lost or repeated; 0x8008 bring the slave to BOOT first; 0x800C, 0x800D, 0x8010, 0x8012 the file is not
for this device or is damaged.
)"};

class FoeError final : public Rule {
 public:
  FoeError() : Rule(kInfo) { Subscribe<mailbox::FoeTransfer>(&FoeError::On); }

  void On(const mailbox::FoeTransfer& t) {
    using Outcome = mailbox::FoeTransfer::Outcome;
    const FrameRef& frame = t.last.seen() ? t.last : t.request;
    switch (t.outcome) {
      case Outcome::kCompleted:
      case Outcome::kMailboxError:
        return;
      case Outcome::kNotCaptured:
        NotEvaluable(t.slave, "the answers to a file transfer are not in the capture", frame.number);
        return;
      case Outcome::kGap:
        NotEvaluable(t.slave, "frames are missing from the capture while a file was transferred", frame.number);
        return;
      case Outcome::kCaptureEnd:
        if (t.answered && !Stalled(t, frame)) {
          NotEvaluable(t.slave, "the capture ends while a file is transferred", frame.number);
          return;
        }
        break;
      case Outcome::kError:
      case Outcome::kSuperseded:
      case Outcome::kReset:
        break;
    }
    if (t.outcome != Outcome::kError && !t.answered) return;
    if (t.outcome != Outcome::kError && MissesAny(context().pairing())) {
      NotEvaluable(t.slave, "frames are missing from the capture while a file was transferred", frame.number);
      return;
    }
    Tell(t, frame);
  }

  void Finish() override { (void)NotEvaluableWithoutReturns(); }

 private:
  /// Nothing of it followed although the capture went on.
  [[nodiscard]] bool Stalled(const mailbox::FoeTransfer& t, const FrameRef& frame) const {
    const FrameRef& end = context().statistics().last;
    return frame.has_time && end.has_time && t.answered &&
           end.time - frame.time >= context().Limit(kInfo.id, kMailboxAnswerLimit);
  }

  static std::string CodeText(std::uint32_t code) {
    const std::string_view meaning = mailbox::FoeErrorText(code);
    return Hex(code) +
           (meaning.empty() ? ", a code without a meaning in the standard" : " (" + std::string(meaning) + ")");
  }

  static std::uint64_t KeyOf(const mailbox::FoeTransfer& t) {
    std::uint64_t key = 0xCBF29CE484222325ULL;  // FNV-1a
    const auto add = [&key](std::uint64_t byte) { key = WrappingProduct(key ^ byte, std::uint64_t{0x100000001B3}); };
    for (const char c : t.file_name) add(static_cast<std::uint8_t>(c));
    add(static_cast<std::uint64_t>(t.outcome));
    add(t.write ? 1 : 0);
    for (unsigned i = 0; i < 4; ++i) add(t.error_code >> (8 * i) & 0xFFU);
    return key;
  }

  static std::string EndText(const mailbox::FoeTransfer& t) {
    using Outcome = mailbox::FoeTransfer::Outcome;
    if (t.outcome == Outcome::kSuperseded) return "was not finished when the next one began";
    if (t.outcome == Outcome::kReset) return "was not finished when the slave was sent to INIT";
    return "was not finished, and nothing of it follows until the capture ends";
  }

  void Tell(const mailbox::FoeTransfer& t, const FrameRef& frame) {
    const std::uint64_t key = KeyOf(t);
    if (const FindingIndex known = Repeat(t.slave, key, frame); known != kNoFinding) {
      AddRelated(context().store[known], t.request.number);
      return;
    }
    const bool failed = t.outcome == mailbox::FoeTransfer::Outcome::kError;
    const bool by_slave = t.error_by == mailbox::Direction::kIn;
    const std::string kind = t.write ? "Download" : "Upload";
    const std::string file = t.file_name.empty() ? std::string("a file whose name is not in the capture")
                                                 : '"' + Printable(t.file_name) + '"';
    const std::string so_far = Count(t.bytes, "byte") + " in " + Count(t.packets, "packet");
    Finding finding;
    finding.slave = t.slave;
    finding.first = frame;
    finding.confidence = ConfidenceOf(t.certainty);
    finding.title = kind + " of " + file + (failed ? " ends with error " + CodeText(t.error_code) : " never ends");
    finding.message =
        "The file transfer" +
        (t.request.seen() ? " that frame " + std::to_string(t.request.number) + " requests" : std::string()) + " (" +
        (t.write ? "to" : "from") + " the slave, " + file + ") ";
    if (failed) {
      finding.message +=
          std::string("is ended by the ") + (by_slave ? "slave" : "master") + " with error " + CodeText(t.error_code);
      if (!t.error_text.empty()) finding.message += ", text \"" + Printable(t.error_text) + '"';
    } else {
      finding.message += EndText(t);
    }
    finding.message += ", after " + so_far;
    if (t.busy > 0) finding.message += ", busy " + Count(t.busy, "time");
    if (t.packet_errors > 0) {
      finding.message += ", " + Count(t.packet_errors, "packet number") + " out of order (first in frame " +
                         std::to_string(t.packet_error.number) + ")";
      AddRelated(finding, t.packet_error.number);
    }
    finding.message += ". " + (failed ? Advice(t.error_code)
                                      : "Finish it, or end it by an error message, before anything "
                                        "else is done with the slave.");
    finding.evidence.push_back(Text("service", t.write ? "write" : "read"));
    if (!t.file_name.empty()) finding.evidence.push_back(Text("file_name", Printable(t.file_name)));
    finding.evidence.push_back(Number("bytes", static_cast<std::int64_t>(t.bytes)));
    finding.evidence.push_back(Number("packets", t.packets));
    if (failed) {
      finding.evidence.push_back(HexNumber("error_code", t.error_code));
      finding.evidence.push_back(Text("error_by", by_slave ? "slave" : "master"));
    }
    AddRelated(finding, t.request.number);
    Report(key, std::move(finding));
  }

  static std::string Advice(std::uint32_t code) {
    switch (code & ~std::uint32_t{0x8000}) {
      case 1:
      case 0xF:
        return "Check the name of the file: many devices take only the names that their manual lists.";
      case 2:
      case 7:
      case 0xA:
        return "Check the password of the request, and whether the device is locked.";
      case 3:
      case 0x11:
        return "The device cannot store it: look at the size of the file, and at its memory.";
      case 4:
        return "The device does not offer this operation for this file.";
      case 5:
        return "Look at the packet numbers: one was lost or sent twice.";
      case 6:
        return "Delete the file first, or take another name.";
      case 8:
        return "Bring the slave to BOOT first.";
      case 9:
        return "Bring the slave to PREOP first: this file is not taken in BOOT.";
      case 0xC:
      case 0xD:
      case 0x10:
      case 0x12:
        return "The file is damaged, or not made for this device: compare its version and checksum.";
      default:
        return "Look the code up in the manual of the device.";
    }
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<FoeError>};

}  // namespace
}  // namespace ecaudit::foe_error
