#include <array>
#include <cstdint>
#include <string_view>
#include <utility>

#include "analyzers/judge/lossy_capture.h"
#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/bus/pairing.h"
#include "decoder/capture/ethercat_traces.h"
#include "decoder/capture/frame_source.h"
#include "decoder/pipeline.h"

namespace ecaudit::capture_truncated {
namespace {

constexpr FindingKind kDamaged{
    .name = "damaged",
    .title = "Capture is damaged: {damage}",
    .message = "Reading stopped: {damage}. All packets up to {last_frame_read} were evaluated.",
    .next = "Stop the capture program before you copy the file, then copy it again."};
constexpr FindingKind kTooMuchWork{
    .name = "too-much-work",
    .title = "Capture not read to its end: its frames need too much work",
    .message =
        R"(Reading stopped after {last_frame_read}. The frames hold very many broadcasts, or process data that very many
slaves share. Evaluating them for each slave would take too long. No real bus needs such frames. A fault after
{last_frame_read} is not in this report.)",
    .next = "Continue after this frame with --from '#{next_frame:number}'."};
constexpr FindingKind kNotEvaluated{
    .name = "not-evaluated",
    .title = "{packets} that may be EtherCAT {packets?was|were} not evaluated",
    .message = R"({packets} of {candidates:number} that are or may be EtherCAT could not be evaluated.[ {marked_bad}
{marked_bad?is|are} marked as damaged by the probe or the capture.][ {flipped_bits} returned with flipped bits.][
{other_link_type} {other_link_type?has|have} a link type that is not read[: {link_type}].][ {cut_before_type}
{cut_before_type?is|are} cut before the EtherType.][ {unread_blocks} {unread_blocks?is|are} in blocks of a type that is not
read.][ {other_masters} {other_masters?is|are} of other masters[, on the bus of interface {other_interface}].][ {dropped}
{dropped?was|were} dropped by the capturing machine.] A fault in these packets is not in this report.)",
    .next = R"([{?damaged}Find what damages frames at the tap. ][{?other_link_type}Capture with link type Ethernet.
][{?cut_before_type}Capture with an unlimited snap length. ][{?unread_blocks}Capture into packet blocks of pcapng.
][{?other_masters}[{?other_interface}Evaluate the other bus with --interface {other_interface}.
][{!other_interface}Capture one bus at a time. ]][{?dropped}Use a larger capture buffer or a faster disk.])"};
constexpr const FindingKind* kKinds[] = {&kDamaged, &kTooMuchWork, &kNotEvaluated};

constexpr RuleInfo kInfo{.id = "capture-truncated",
                         .group = "Capture",
                         .severity = Severity::kWarning,
                         .history = History::kNone,
                         .title = "The capture is damaged, ends early, or many packets are unusable",
                         .needs = "nothing",
                         .source = "PCAPNG, packet blocks; PCAP, packet records",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
Whether the file ends inside a packet or block, or a block is damaged. Further, whether many packets that may be
EtherCAT frames could not be used. These are packets that

- the probe or the capture marked as bad
- have a link type, or are in blocks, that are not read
- are cut before their EtherType
- returned with flipped bits
- other masters sent
- the capturing machine dropped, by its own count

## Why it matters
Packets after the damage, and unusable packets, are not evaluated: a fault in them is not in the report.

## How it is decided
The reader of the file names packet and place of the damage. Unusable packets are counted by reason.

- They are a finding from 100 on, or from one in a hundred of those that may be EtherCAT.
- A single frame that returned with flipped bits is a finding, because the answer in it is lost.
- A packet of another link type may be EtherCAT if its first bytes have EtherType and datagram header.
- Reading ends as well if frames full of broadcasts to many slaves would take far too long.

## Example
samples/captures/truncated.pcapng

## What to do
Stop the capture program before you copy the file, then copy it again. Set the probe to Ethernet, find what damages
frames at the tap, and capture one bus at a time. Against drops use a larger buffer or a faster disk.
)"};

constexpr std::uint64_t kDamage = 0;
constexpr std::uint64_t kUnusable = 1;
constexpr std::uint64_t kWork = 2;
constexpr std::uint64_t kMany = 100;
constexpr std::uint64_t kOneIn = 100;

class CaptureTruncated final : public Rule {
 public:
  CaptureTruncated() : Rule(kInfo) {}
  void Finish() override {
    ReportDamage();
    ReportTooMuchWork();
    ReportUnusable();
  }

 private:
  /// Packets that were not evaluated, for one reason.
  struct Unusable {
    std::uint64_t packets = 0;
    std::string_view name;  ///< of the argument
    FrameRef first;
  };

  void ReportDamage() {
    const capture::CaptureInfo& info = context().source().info();
    if (!info.damage) return;
    Finding finding = Found(kDamaged, kNoSlave, context().statistics().last);
    finding.Set("damage", arg::Text(info.damage->message))
        .Set("last_frame_read", arg::Frame(info.damage->after_frame))
        .Set("file_offset", arg::Number(static_cast<std::int64_t>(info.damage->offset)));
    Report(kDamage, std::move(finding));
  }

  void ReportTooMuchWork() {
    const FrameRef& last = context().statistics().overworked;
    if (!last.seen()) return;
    Finding finding = Found(kTooMuchWork, kNoSlave, last);
    finding.Set("last_frame_read", arg::Frame(last.number)).Set("next_frame", arg::Frame(last.number + 1));
    Report(kWork, std::move(finding));
  }

  void ReportUnusable() {
    const capture::CaptureInfo& info = context().source().info();
    const PipelineStatistics& read = context().statistics();
    const bus::PairingStatistics& pairing = context().pairing();
    // A return whose outbound copy the capture misses may resemble another one with flipped bits.
    const std::uint64_t flipped = MissesAny(pairing) ? 0 : pairing.flipped;
    const std::array<Unusable, 7> reasons{
        {{read.crc_error_frames, "marked_bad", read.first_crc_error},
         {flipped, "flipped_bits", {pairing.first_flipped, 0, false}},
         {read.other_link, "other_link_type", read.first_other_link},
         {read.cut_before_type, "cut_before_type", {}},
         {info.unread_blocks, "unread_blocks", {}},
         {pairing.foreign_ignored(), "other_masters", {pairing.first_foreign, 0, false}},
         {info.dropped(), "dropped", {}}}};
    std::uint64_t sum = 0;
    Finding finding = Found(kNotEvaluated, kNoSlave, {});
    for (const Unusable& reason : reasons) {
      if (reason.packets == 0) continue;
      sum += reason.packets;
      finding.Set(reason.name, arg::Count(reason.packets, "packet"));
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
    finding.Set("packets", arg::Count(sum, "packet"))
        .Set("candidates", arg::Count(may_be_ethercat, "packet"))
        .Set("damaged", arg::Flag(read.crc_error_frames > 0 || flipped > 0));
    if (read.other_link > 0 && read.other_link_interface < info.interfaces.size()) {
      const std::uint16_t link_type = info.interfaces[read.other_link_interface].link_type;
      finding.Set("link_type", arg::Text(capture::LinkTypeText(link_type)));
    }
    if (pairing.other_bus > 0)
      finding.Set("other_interface", arg::Number(static_cast<std::int64_t>(pairing.other_bus_interface)));
    Report(kUnusable, std::move(finding));
  }
};

const RuleRegistration kRegistration{kInfo, MakeRule<CaptureTruncated>};

}  // namespace
}  // namespace ecaudit::capture_truncated
