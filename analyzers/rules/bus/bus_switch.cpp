#include <array>
#include <cstdint>
#include <optional>
#include <utility>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/words/address_text.h"
#include "decoder/pipeline.h"

namespace ecaudit::bus_switch {
namespace {

constexpr FindingKind kSwitch{
    .name = "switch",
    .title = "A switch is connected to the bus ({protocol})",
    .message = R"({sender} sends {protocol}: {frames} from {frame} to {last_frame}. Only switches send that, and no
master of this bus has this address. The switch is between master and slaves, or at an open port of a slave. It may delay
EtherCAT frames, change their order or drop them, and its own frames occupy the line.)",
    .next = "Connect the master to the first slave without a switch. Leave unused ports of the slaves open.",
    .identity = "protocol"};
constexpr const FindingKind* kKinds[] = {&kSwitch};

constexpr Word kStp{"spanning-tree", "spanning tree"};
constexpr Word kPerVlan{"spanning-tree-per-vlan", "spanning tree per VLAN"};
constexpr Word kLldp{"lldp-of-bridge", "LLDP with the bridge capability"};
constexpr Word kCapabilities{"lldp-capabilities", "the system capabilities of a sender of LLDP", true};

constexpr RuleInfo kInfo{.id = "bus-switch",
                         .group = "Frame and bus",
                         .severity = Severity::kInfo,
                         .history = History::kWhole,
                         .subject = Subject::kOtherPackets,
                         .title = "A switch is connected to the bus",
                         .needs = "packets of other protocols on the interface of the bus",
                         .source = "ETG1000.4, frame processing",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
Whether a device on the line of the slaves sends what only switches send: spanning tree, or LLDP with the bridge
capability.

## Why it matters
A switch stores frames before it forwards them, and it may change their order. The jitter of the set points grows,
frames time out, and other devices at the switch reach the slaves.

## How it is decided
- The frames are on the same capture interface as the EtherCAT frames.
- The address of the sender is that of no master of the bus: the computer of the master may bridge its own interfaces.
- A capture without any packet of another protocol may have been filtered: the rule does not apply.
- LLDP without system capabilities does not show what its sender is: the rule is not evaluated.

## Example
tests/rules/bus-switch/violates.trace

## What to do
Connect the master to the first slave directly. If the capture comes from a mirror port of a switch, use a tap: such a
port changes stamps and order.
)"};

class BusSwitch final : public Rule {
 public:
  BusSwitch() : Rule(kInfo) { Subscribe<OtherPacket>(&BusSwitch::On); }

  void On(const OtherPacket& e) {
    if (e.bridge == wire::BridgeFrame::kLldpOfAnyDevice) {
      if (!unclear_) unclear_ = Sender{e.packet.source_mac(), e.packet.interface_index(), e.bridge, {}, {}, 0};
      if (!unclear_->first.seen()) unclear_->first = e.packet.ref();
      return;
    }
    for (std::optional<Sender>& sender : senders_) {
      if (!sender) sender = Sender{e.packet.source_mac(), e.packet.interface_index(), e.bridge, e.packet.ref(), {}, 0};
      if (sender->mac != e.packet.source_mac() || sender->interface_index != e.packet.interface_index() ||
          sender->bridge != e.bridge) {
        continue;
      }
      sender->last = e.packet.ref();
      ++sender->frames;
      return;
    }
  }

  void Finish() override {
    for (const std::optional<Sender>& sender : senders_) {
      if (sender && IsOnBus(*sender)) return ReportSwitch(*sender);
    }
    if (unclear_ && IsOnBus(*unclear_)) {
      NotEvaluable(kNoSlave, ReasonCode::kNotInCapture, kCapabilities, unclear_->first.number);
    }
  }

 private:
  struct Sender {
    std::uint64_t mac = 0;
    std::uint16_t interface_index = 0;
    wire::BridgeFrame bridge = wire::BridgeFrame::kNone;
    FrameRef first, last;
    std::uint64_t frames = 0;
  };

  [[nodiscard]] bool IsOnBus(const Sender& sender) const {
    const PipelineStatistics& read = context().statistics();
    constexpr std::uint64_t kSetBySlaves = std::uint64_t{1} << 41U;
    return read.ethercat_frames > 0 && sender.interface_index == read.ethercat_interface &&
           (sender.mac & ~kSetBySlaves) != read.ethercat_sender;
  }

  void ReportSwitch(const Sender& sender) {
    Finding finding = Found(kSwitch, kNoSlave, sender.first);
    finding.last = sender.last;
    finding.count = sender.frames;
    const Word& protocol = sender.bridge == wire::BridgeFrame::kSpanningTree          ? kStp
                           : sender.bridge == wire::BridgeFrame::kSpanningTreePerVlan ? kPerVlan
                                                                                      : kLldp;
    finding.Set("sender", arg::Text(AddressText(sender.mac)))
        .Set("protocol", arg::Of(protocol))
        .Set("frames", arg::Count(sender.frames, "frame"));
    (void)Report(0, std::move(finding));
  }

  std::array<std::optional<Sender>, 4> senders_;
  std::optional<Sender> unclear_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<BusSwitch>};

}  // namespace
}  // namespace ecaudit::bus_switch
