#include <utility>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/pipeline.h"

namespace ecaudit::capture_snaplen {
namespace {

constexpr FindingKind kCut{
    .name = "cut",
    .title = "{cut_frames} {cut_frames?was|were} cut by the snap length",
    .message =
        R"({cut_frames} of {ethercat_frames:number} {cut_frames?is|are} longer on the wire than in the file. Bytes
after the cut are unknown.)",
    .next = "Capture again with an unlimited snap length (tcpdump -s 0)."};
constexpr const FindingKind* kKinds[] = {&kCut};

constexpr RuleInfo kInfo{.id = "capture-snaplen",
                         .group = "Capture",
                         .severity = Severity::kWarning,
                         .history = History::kNone,
                         .title = "Packets were cut by the snap length",
                         .needs = "nothing",
                         .source = "PCAPNG, packet blocks; PCAP, packet records",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
Whether EtherCAT packets are longer on the wire than in the file.

## Why it matters
Datagrams after the cut are missing, and of the datagram that is cut its data and working counter too. They are not
evaluated.

## How it is decided
From the two lengths that the file has for each packet.

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
    Finding finding = Found(kCut, kNoSlave, read.first_cut);
    finding.last = read.last_cut;
    finding.count = read.cut_frames;
    finding.Set("cut_frames", arg::Count(read.cut_frames, "EtherCAT frame"))
        .Set("ethercat_frames", arg::Count(read.ethercat_frames, "EtherCAT frame"));
    Report(0, std::move(finding));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<CaptureSnaplen>};

}  // namespace
}  // namespace ecaudit::capture_snaplen
