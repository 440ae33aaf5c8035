#include <cstdint>
#include <string>
#include <vector>

#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/base/text.h"
#include "decoder/bus/pairing.h"
#include "decoder/capture/ethercat_traces.h"
#include "decoder/capture/frame_source.h"
#include "decoder/pipeline.h"

namespace ecaudit::capture_truncated {
namespace {

constexpr RuleInfo kInfo{.id = "capture-truncated",
                         .group = "Capture",
                         .severity = Severity::kWarning,
                         .needs_no_history = true,
                         .title = "The capture is damaged or ends early, or many packets could not be used",
                         .needs = "nothing",
                         .source = "PCAPNG, packet blocks; PCAP, packet records",
                         .doc = R"(
## What it checks
Whether the file ends inside a packet or block, or a block is damaged; and whether many packets that may have been
EtherCAT frames could not be used: marked bad by the probe or the capture, of a link type or in blocks that are not
read, cut before their EtherType, returned with flipped bits, sent by other masters, or dropped by the capturing
machine, by its own count.

## Why it matters
What follows the damage, and what was set aside, is not analysed: a fault in it is not in the report.

## How it is decided
By the reader of the file, which names packet and place. Packets set aside are counted by reason; from 100, or one in a
hundred of those that may have been EtherCAT, they are a finding. A single frame that came back with flipped bits is
one, because it stands for an answer that nobody can read. A packet of another link type may have been EtherCAT where
EtherType and datagram header stand in its first bytes. Reading also ends where frames full of broadcasts to thousands
of slaves would take out of proportion long.

## Example
samples/captures/truncated.pcapng

## What to do
Copy the file again; stop the capturing program properly before copying. Set the probe to Ethernet, look for the cause
of damaged frames at the tap, and capture one bus at a time. Against drops: a larger buffer, a faster disk.
)"};

constexpr std::uint64_t kDamage = 0;
constexpr std::uint64_t kSetAside = 1;
constexpr std::uint64_t kTooMuchWork = 2;
constexpr std::uint64_t kMany = 100;
constexpr std::uint64_t kOneIn = 100;

class CaptureTruncated final : public Rule {
 public:
  CaptureTruncated() : Rule(kInfo) {}
  void Finish() override {
    TellDamage();
    TellTooMuchWork();
    TellSetAside();
  }

 private:
  /// Packets that were not analysed, for one reason.
  struct SetAside {
    std::uint64_t packets = 0;
    const char* name;  ///< of the evidence
    std::string why;   ///< "marked bad by the probe or the capture"
    FrameRef first;
  };

  void TellDamage() {
    const capture::CaptureInfo& info = context().source().info();
    if (!info.damage) return;
    Finding finding;
    finding.first = context().statistics().last;
    finding.title = "Capture is damaged: " + info.damage->message;
    finding.message = "Reading stopped: " + info.damage->message + ". Everything up to frame " +
                      std::to_string(info.damage->after_frame) + " was analysed.";
    finding.evidence.push_back(Number("last_frame_read", static_cast<std::int64_t>(info.damage->after_frame)));
    finding.evidence.push_back(Number("file_offset", static_cast<std::int64_t>(info.damage->offset)));
    Report(kDamage, std::move(finding));
  }

  void TellTooMuchWork() {
    const FrameRef& last = context().statistics().overworked;
    if (!last.seen()) return;
    Finding finding;
    finding.first = last;
    finding.title = "Not read to its end: frames for thousands of slaves at once";
    finding.message = "Reading stopped behind packet " + Grouped(last.number) +
                      ": the frames hold so many broadcasts to so many slaves, or process data that so many slaves "
                      "share, that telling "
                      "every slave of each would take out of proportion long. No real bus needs that. A fault behind "
                      "it is not in this report; --from '#" +
                      std::to_string(last.number + 1) + "' reads on.";
    finding.evidence.push_back(Number("last_frame_read", static_cast<std::int64_t>(last.number)));
    Report(kTooMuchWork, std::move(finding));
  }

  void TellSetAside() {
    const capture::CaptureInfo& info = context().source().info();
    const PipelineStatistics& read = context().statistics();
    const bus::PairingStatistics& pairing = context().pairing();
    std::string link = "of a link type that is not read";
    if (read.other_link > 0 && read.other_link_interface < info.interfaces.size()) {
      link =
          "of " + capture::LinkTypeText(info.interfaces[read.other_link_interface].link_type) + ", which is not read";
    }
    // A return whose outbound copy the capture misses may look like another one with flipped bits.
    const std::uint64_t flipped = MissesAny(pairing) ? 0 : pairing.flipped;
    std::string others = "of other masters";
    if (pairing.other_bus > 0) {
      const std::string interface = std::to_string(pairing.other_bus_interface);
      others += " (interface " + interface + " was at another bus: --interface " + interface + " judges that one)";
    }
    const std::vector<SetAside> reasons{
        {read.crc_error_frames, "marked_bad", "marked bad by the probe or the capture", read.first_crc_error},
        {flipped, "flipped_bits", "returned with flipped bits", {pairing.first_flipped, 0, false}},
        {read.other_link, "other_link_type", link, read.first_other_link},
        {read.cut_before_type, "cut_before_type", "cut before their EtherType", {}},
        {info.unread_blocks, "unread_blocks", "in blocks of a type that is not read", {}},
        {pairing.foreign_ignored(), "other_masters", others, {pairing.first_foreign, 0, false}},
        {info.dropped(), "dropped", "dropped by the capturing machine", {}}};
    std::uint64_t sum = 0;
    std::string list;
    Finding finding;
    for (const SetAside& reason : reasons) {
      if (reason.packets == 0) continue;
      sum += reason.packets;
      list += (list.empty() ? "" : ", ") + Grouped(reason.packets) + " " + reason.why;
      finding.evidence.push_back(Number(reason.name, static_cast<std::int64_t>(reason.packets)));
      if (reason.first.seen() && (!finding.first.seen() || reason.first.number < finding.first.number)) {
        finding.first = reason.first;
      }
    }
    const std::uint64_t unread = read.other_link + read.cut_before_type + info.unread_blocks + info.dropped();
    const std::uint64_t may_be_ethercat = read.ethercat_frames + unread;
    const bool many = sum >= kMany || sum * kOneIn >= may_be_ethercat;
    if (sum == 0 || (!many && flipped == 0)) return;
    if (!finding.first.seen()) finding.first = read.first;
    finding.last = finding.first;
    finding.title = "Not analysed: " + Count(sum, "packet") + " that may have been EtherCAT";
    finding.message = "Of " + Grouped(may_be_ethercat) + " packets that are or may have been EtherCAT frames, " +
                      Grouped(sum) + " could not be used: " + list +
                      ". What they show is not in this report; a fault may hide in them.";
    Report(kSetAside, std::move(finding));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<CaptureTruncated>};

}  // namespace
}  // namespace ecaudit::capture_truncated
