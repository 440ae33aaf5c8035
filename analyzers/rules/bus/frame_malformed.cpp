#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/base/text.h"
#include "decoder/pipeline.h"
#include "decoder/track/events.h"

namespace ecaudit::frame_malformed {
namespace {

constexpr RuleInfo kInfo{.id = "frame-malformed",
                         .group = "Frame and bus",
                         .severity = Severity::kError,
                         .needs_no_history = true,
                         .title = "EtherCAT lengths, more flag or command do not fit the bytes of the frame",
                         .needs = "nothing",
                         .source = "ETG1000.4, frame and datagram header",
                         .doc = R"(
## What it checks
The length in the EtherCAT header, the length and more flag of each datagram, and the command, against the bytes that
the packet holds.

## Why it matters
Slaves stop processing such a frame, or process it wrongly: a bug in the master, or bits that flipped on the way.

## How it is decided
Packets cut by the snap length are not judged, nor frames of other EtherCAT types, nor frames of senders that are not
this bus's master. What the EtherCAT length covers behind the last datagram is padding, whatever it holds: slaves stop
where the more flag is clear. Findings are folded by kind of problem.

## Example
samples/captures/malformed.pcapng

## What to do
Outbound: correct the master. Returned: look for link errors (0x0300-0x0313); the capture holds no FCS, so the frame may
have been damaged on the last link only.
)"};

class FrameMalformed final : public Rule {
 public:
  FrameMalformed() : Rule(kInfo) { Subscribe<track::FrameUnusable>(&FrameMalformed::On); }

  void On(const track::FrameUnusable& e) {
    if (!e.own_master || e.reason != bus::Unusable::kMalformed || e.frame.kind() != wire::FrameKind::kMalformed) return;
    const auto key = static_cast<std::uint64_t>(e.frame.problem());
    if (FindingIndex index = Repeat(kNoSlave, key, e.frame.ref()); index != kNoFinding) {
      AddRelated(context().store[index], e.frame.ref().number);
      return;
    }
    Finding finding;
    finding.first = e.frame.ref();
    finding.title = "Malformed frame: " + std::string(Describe(e.frame.problem()));
    finding.message = "In frame " + std::to_string(e.frame.ref().number) + " " +
                      std::string(Describe(e.frame.problem())) + "; " + Count(e.frame.size(), "datagram") +
                      " could be read. It is not fed to the slave models.";
    finding.evidence.push_back(Text("problem", std::string(Describe(e.frame.problem()))));
    finding.evidence.push_back(Number("readable_datagrams", static_cast<std::int64_t>(e.frame.size())));
    Report(key, std::move(finding));
  }

  void Finish() override {
    const PipelineStatistics& read = context().statistics();
    if (read.cut_frames > 0)
      NotEvaluable(kNoSlave, "frames that the snap length cut are not judged", read.first_cut.number);
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<FrameMalformed>};

}  // namespace
}  // namespace ecaudit::frame_malformed
