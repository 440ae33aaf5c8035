#include <cstdint>
#include <utility>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/pipeline.h"
#include "decoder/track/events.h"

namespace ecaudit::frame_malformed {
namespace {

constexpr FindingKind kMalformed{
    .name = "malformed",
    .title = "Malformed frame: {problem}",
    .message = R"(In {frame} {problem}. {readable_datagrams} could be read. The frame is not evaluated any further.)",
    .next = R"(If the frame is outbound, correct the master. If it returned, check the link error counters
(0x0300-0x0313).)",
    .identity = "problem"};
constexpr FindingKind kWrongByteOrder{
    .name = "wrong-byte-order",
    .title = "Frame is big-endian, but EtherCAT is little-endian",
    .message =
        R"(The EtherCAT header in {frame} is big-endian: read so, the frame is whole, datagram by datagram. Read as
little-endian, it is not. Slaves read little-endian and do not process such a frame.)",
    .next =
        R"(Correct the byte order in the master: it has to write the EtherCAT header, and the addresses and lengths of
datagrams, as little-endian.)"};
constexpr const FindingKind* kKinds[] = {&kMalformed, &kWrongByteOrder};

/// How the lengths, flags and commands of a frame contradict its bytes.
const Word& WordOf(wire::FrameProblem problem) {
  static constexpr Word kNone{"none", "no part is wrong"};
  static constexpr Word kNoHeader{"no-header", "the EtherCAT header is incomplete"};
  static constexpr Word kLengthBeyondFrame{"length-beyond-frame", "the EtherCAT length exceeds the frame"};
  static constexpr Word kDatagramBeyondLength{"datagram-beyond-length", "a datagram exceeds the EtherCAT length"};
  static constexpr Word kMoreWithoutDatagram{"more-without-datagram",
                                             "no datagram follows the one whose more flag is set"};
  static constexpr Word kUnknownCommand{"unknown-command", "a datagram has an undefined command"};
  static constexpr Word kNoDatagram{"no-datagram", "the EtherCAT length is too short for a datagram"};
  static constexpr Word kByteOrder{"byte-order", "the EtherCAT header is big-endian"};
  switch (problem) {
    case wire::FrameProblem::kNone:
      return kNone;
    case wire::FrameProblem::kNoHeader:
      return kNoHeader;
    case wire::FrameProblem::kLengthBeyondFrame:
      return kLengthBeyondFrame;
    case wire::FrameProblem::kDatagramBeyondLength:
      return kDatagramBeyondLength;
    case wire::FrameProblem::kMoreWithoutDatagram:
      return kMoreWithoutDatagram;
    case wire::FrameProblem::kUnknownCommand:
      return kUnknownCommand;
    case wire::FrameProblem::kNoDatagram:
      return kNoDatagram;
    case wire::FrameProblem::kByteOrder:
      return kByteOrder;
  }
  return kNone;
}

constexpr RuleInfo kInfo{.id = "frame-malformed",
                         .group = "Frame and bus",
                         .severity = Severity::kError,
                         .history = History::kNone,
                         .title = "EtherCAT length, more flag or command contradict the bytes of the frame",
                         .needs = "nothing",
                         .source = "ETG1000.4, frame and datagram header",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
The length in the EtherCAT header, the length and more flag of each datagram, and the command, against the bytes that
the packet holds.

## Why it matters
Slaves stop processing such a frame, or process it wrongly. The cause is a bug in the master, or bits flipped on the
way.

## How it is decided
Not evaluated are packets that the snap length cut, frames of other EtherCAT types, and frames of foreign senders. Bytes
that the EtherCAT length covers after the last datagram are padding, whatever they are: slaves stop where the more flag
is clear. A length that exceeds the frame is no problem if slaves take part in such frames, or if the master sends no
others. Findings are folded by kind of problem. The byte order is wrong if the frame is whole, datagram by datagram,
once its header, or that and the lengths, are read as big-endian.

## Example
samples/captures/malformed.pcapng

## What to do
If the frame is outbound, correct the master. If it returned, check the link error counters (0x0300-0x0313). The capture
has no FCS, so the frame may have been damaged on the last link only.
)"};

class FrameMalformed final : public Rule {
 public:
  FrameMalformed() : Rule(kInfo) { Subscribe<track::FrameUnusable>(&FrameMalformed::On); }

  void On(const track::FrameUnusable& e) {
    if (e.reason != bus::Unusable::kMalformed || e.frame.kind() != wire::FrameKind::kMalformed) return;
    // A sender of nothing that slaves can read does not count as a master, but it is one that wants to be.
    if (!e.own_master && e.frame.problem() != wire::FrameProblem::kByteOrder) return;
    const auto key = static_cast<std::uint64_t>(e.frame.problem());
    if (FindingIndex index = Repeat(kNoSlave, key, e.frame.ref()); index != kNoFinding) {
      AddRelated(context().store[index], e.frame.ref().number);
      return;
    }
    if (e.frame.problem() == wire::FrameProblem::kByteOrder) {
      Report(key, Found(kWrongByteOrder, kNoSlave, e.frame.ref()));
      return;
    }
    Finding finding = Found(kMalformed, kNoSlave, e.frame.ref());
    finding.Set("problem", arg::Of(WordOf(e.frame.problem())))
        .Set("readable_datagrams", arg::Count(e.frame.size(), "datagram"));
    Report(key, std::move(finding));
  }

  void Finish() override {
    const PipelineStatistics& read = context().statistics();
    if (read.cut_frames > 0) NotEvaluable(kNoSlave, ReasonCode::kSnapLength, read.first_cut.number);
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<FrameMalformed>};

}  // namespace
}  // namespace ecaudit::frame_malformed
