#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/base/text.h"
#include "decoder/capture/frame_source.h"
#include "decoder/pipeline.h"

namespace ecaudit::capture_truncated {
namespace {

constexpr RuleInfo kInfo{.id = "capture-truncated",
                         .group = "Capture",
                         .severity = Severity::kWarning,
                         .needs_no_history = true,
                         .title = "The capture file is damaged or ends early",
                         .needs = "nothing",
                         .source = "PCAPNG, packet blocks; PCAP, packet records",
                         .doc = R"(
## What it checks
Whether the file ends inside a packet or block, or a block is damaged.

## Why it matters
What follows the damage is not analysed; the report covers only what stands before it.

## How it is decided
By the reader of the file, which names packet and place.

## Example
samples/captures/truncated.pcapng

## What to do
Copy the file again; stop the capturing program properly before copying.
)"};

class CaptureTruncated final : public Rule {
 public:
  CaptureTruncated() : Rule(kInfo) {}
  void Finish() override {
    const capture::CaptureInfo& info = context().source().info();
    if (!info.damage) return;
    Finding finding;
    finding.first = context().statistics().last;
    finding.title = "Capture is damaged: " + info.damage->message;
    finding.message = "Reading stopped: " + info.damage->message + ". Everything up to frame " +
                      std::to_string(info.damage->after_frame) + " was analysed.";
    finding.evidence.push_back(Number("last_frame_read", static_cast<std::int64_t>(info.damage->after_frame)));
    finding.evidence.push_back(Number("file_offset", static_cast<std::int64_t>(info.damage->offset)));
    Report(0, std::move(finding));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<CaptureTruncated>};

}  // namespace
}  // namespace ecaudit::capture_truncated
