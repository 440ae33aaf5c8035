#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/base/text.h"
#include "decoder/pipeline.h"

namespace ecaudit::capture_snaplen {
namespace {

constexpr RuleInfo kInfo{.id = "capture-snaplen",
                         .group = "Capture",
                         .severity = Severity::kWarning,
                         .needs_no_history = true,
                         .title = "Packets were cut by the snap length",
                         .needs = "nothing",
                         .source = "PCAPNG, packet blocks; PCAP, packet records",
                         .doc = R"(
## What it checks
EtherCAT packets that are longer on the wire than in the file.

## Why it matters
Datagrams behind the cut are missing; working counters and data of the cut one too. Nothing is concluded from them.

## How it is decided
From the two lengths that the file keeps for each packet.

## Example
samples/captures/snaplen.pcapng

## What to do
Capture again with a snap length of 0 or 262144 (tcpdump -s 0).
)"};

class CaptureSnaplen final : public Rule {
 public:
  CaptureSnaplen() : Rule(kInfo) {}
  void Finish() override {
    const PipelineStatistics& read = context().statistics();
    if (read.cut_frames == 0) return;
    Finding finding;
    finding.first = read.first_cut;
    finding.last = read.last_cut;
    finding.count = read.cut_frames;
    finding.title = Count(read.cut_frames, "EtherCAT frame") + " cut by the snap length";
    finding.message =
        Count(read.cut_frames, "EtherCAT frame") + " of " + Grouped(read.ethercat_frames) +
        " are longer on the wire than in the file. What lies behind the cut is treated as unknown. Capture "
        "again with an unlimited snap length (tcpdump -s 0).";
    finding.evidence.push_back(Number("cut_frames", static_cast<std::int64_t>(read.cut_frames)));
    Report(0, std::move(finding));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<CaptureSnaplen>};

}  // namespace
}  // namespace ecaudit::capture_snaplen
