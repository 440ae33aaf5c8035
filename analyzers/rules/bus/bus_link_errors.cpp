#include <algorithm>
#include <array>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/track/access.h"
#include "decoder/track/events.h"

namespace ecaudit::bus_link_errors {
namespace {

constexpr EscAddress kFirst = 0x0300;
constexpr EscAddress kEnd = 0x0314;

constexpr FindingKind kCountersRise{
    .name = "counters-rise",
    .title = "Error counters of port {port} rise: {counted}",
    .message = R"(The slave counted {counted} at port {port} between {since_frame} and {frame}.[ Invalid frames
({invalid_frames_register}) rose from {invalid_frames_before} to {invalid_frames_after}.][ Receive errors
({receive_errors_register}) rose from {receive_errors_before} to {receive_errors_after}.][ Forwarded errors
({forwarded_errors_register}) rose from {forwarded_errors_before} to {forwarded_errors_after}.][ Lost links
({lost_links_register}) rose from {lost_links_before} to {lost_links_after}.])",
    .next = R"([{?only_forwarded}Forwarded errors were made upstream of this slave: check the slaves and cables before
it.][{!only_forwarded}Check the cable and connectors at that port. If slaves before this one count errors too, begin with
the first of them.])",
    .identity = "port"};
constexpr FindingKind kBadFrames{
    .name = "bad-frames",
    .title = "Error counter of the processing unit rises: {counted}",
    .message = R"(The processing unit of the slave counted {counted} between {since_frame} and {frame}. Its counter
({bad_frames_register}) rose from {bad_frames_before} to {bad_frames_after}.)",
    .next = "Find the first slave in frame direction whose port counters rise."};
constexpr FindingKind kLinkLost{
    .name = "link-lost",
    .title = "Link lost at port {port}",
    .message = R"(DL status (0x0110) shows a link at port {port} in {since_frame} and no link in {frame}.)",
    .next = "Check the cable at that port and the power of the next slave.",
    .identity = "port"};
constexpr const FindingKind* kKinds[] = {&kCountersRise, &kBadFrames, &kLinkLost};

constexpr NoteKind kCountedLater{
    .name = "counted-later",
    .text = "The slave also counted {counted} at this place between {since_frame} and {shown_frame}."};
constexpr NoteKind kLinkLostLater{
    .name = "link-lost-later",
    .text = "DL status (0x0110) shows a link at port {port} in {since_frame} and no link in {shown_frame}."};
constexpr const NoteKind* kNotes[] = {&kCountedLater, &kLinkLostLater};

constexpr RuleInfo kInfo{.id = "bus-link-errors",
                         .group = "Frame and bus",
                         .severity = Severity::kWarning,
                         .history = History::kNone,
                         .subject = Subject::kSlave,
                         .title = "Link-lost or receive-error counters rise, or a link drops",
                         .needs = "two reads of the counters (0x0300-0x0313) or of DL status (0x0110) of one slave",
                         .source = "ESC-2, error counters 0x0300-0x0313 and DL status 0x0110",
                         .kinds = kKinds,
                         .notes = kNotes,
                         .doc = R"(
## What it checks
The error counters of each port (invalid frames 0x0300, receive errors 0x0301, forwarded errors 0x0308, lost links
0x0310) and that of the processing unit (0x030C), from one read to the next; and the link bits 4-7 of DL status.

## Why it matters
Rising counters show the cable or connector that damages frames, before machines stop.

## How it is decided
For each slave and counter, between two reads of that slave.

- Writes clear the counters, and some masters clear them all the time. After a write that the slave accepted, counting
  starts from 0.
- Errors that were counted before the first read are not reported: they may be old.
- Counters stop at 255.
- All counters that rise at one port are one finding.

## Example
samples/captures/link-errors.pcapng

## What to do
Receive errors at a port come from the link of that port. Forwarded errors were made upstream. Exchange the cable at the
first slave (in frame direction) whose own counters rise.
)"};

constexpr Word kSecondReads{"second-reads", "the error counters or DL status of the slave twice"};
class BusLinkErrors final : public Rule {
 public:
  BusLinkErrors() : Rule(kInfo) {
    Subscribe<track::SlaveAccess>(&BusLinkErrors::On, MemoryRange::Of(0, kEnd));
    Subscribe<track::CaptureGap>(&BusLinkErrors::On);
  }

  void On(const track::SlaveAccess& e) {
    if (e.address >= kEnd) return;
    const std::size_t length = std::max(e.written.size(), e.read.size());
    if (e.address + length > kFirst) OnCounters(e);
    if (!e.broadcast && e.address <= esc::kDlStatus + 1) OnDlStatus(e);
  }

  /// After a capture gap there may be another capture, of other slaves.
  void On(const track::CaptureGap& e) {
    if (!e.certain) return;
    for (Slave& slave : slaves_) {
      slave.counters = {};
      slave.links.reset();
    }
  }

  void Finish() override {
    if (NotEvaluableWithoutReturns()) return;
    for (std::size_t s = 0; s < context().slave_count(); ++s) {
      if (s < slaves_.size() && slaves_[s].compared) continue;
      NotEvaluable(static_cast<SlaveId>(s), ReasonCode::kNotRead, kSecondReads);
    }
  }

 private:
  static constexpr std::size_t kCounters = kEnd - kFirst;
  static constexpr std::size_t kProcessingUnit = 4;  // after ports 0-3
  static constexpr std::size_t kPlaces = 5;

  struct Slave {
    std::array<std::optional<std::uint8_t>, kCounters> counters{};
    std::array<FrameNo, kCounters> since{};
    std::optional<std::uint8_t> links;
    FrameNo links_since = 0;
    bool compared = false;  ///< two reads of the same counter, or of DL status, were compared
    std::array<bool, kPlaces> reported_counters{};
    std::array<bool, kPlaces> reported_link{};
  };

  Slave& Get(SlaveId id) {
    if (id >= slaves_.size()) slaves_.resize(static_cast<std::size_t>(id) + 1);
    return slaves_[id];
  }

  /// Port that counter `i` (of 0x0300 + i) belongs to; kPlaces for registers that count nothing of the link.
  static std::size_t PlaceOf(std::size_t i) {
    if (i < 8) return i / 2;
    if (i < 12) return i - 8;
    if (i == 12) return kProcessingUnit;
    return i >= 16 ? i - 16 : kPlaces;
  }
  /// What a counter counts, and its arguments.
  struct Counted {
    std::string_view noun, at, before, after;
  };
  static const Counted& CountedBy(std::size_t i) {
    static constexpr Counted kInvalid{"invalid frame", "invalid_frames_register", "invalid_frames_before",
                                      "invalid_frames_after"};
    static constexpr Counted kReceive{"receive error", "receive_errors_register", "receive_errors_before",
                                      "receive_errors_after"};
    static constexpr Counted kForwarded{"forwarded error", "forwarded_errors_register", "forwarded_errors_before",
                                        "forwarded_errors_after"};
    static constexpr Counted kBad{"bad frame", "bad_frames_register", "bad_frames_before", "bad_frames_after"};
    static constexpr Counted kLost{"lost link", "lost_links_register", "lost_links_before", "lost_links_after"};
    if (i < 8) return i % 2 == 0 ? kInvalid : kReceive;
    if (i < 12) return kForwarded;
    return i == 12 ? kBad : kLost;
  }
  static bool IsForwarded(std::size_t i) { return i >= 8 && i < 12; }

  /// Counters of one place that rose between two reads.
  struct Rises {
    std::vector<Value> counted;
    Arguments values;
    FrameNo since = 0;
    bool only_forwarded = true;
  };

  void OnCounters(const track::SlaveAccess& e) {
    // A command that reads and writes gives the counters as they were before it cleared them.
    if (!e.broadcast && !e.read.empty()) OnCounterRead(e);
    // A write without a known result may have cleared them. A counter that is higher afterwards has risen even more.
    if (e.written.empty() || !e.done()) return;
    Slave& slave = Get(e.slave);
    // Any write to a group clears the whole group.
    const auto clears = [&](std::size_t first, std::size_t end) {
      if (e.address >= kFirst + end || e.address + e.written.size() <= kFirst + first) return;
      for (std::size_t i = first; i < end; ++i) {
        slave.counters[i] = std::uint8_t{0};
        slave.since[i] = e.frame().number;
      }
    };
    clears(0, 12);
    clears(12, 13);
    clears(16, 20);
  }

  void OnCounterRead(const track::SlaveAccess& e) {
    Slave& slave = Get(e.slave);
    std::array<Rises, kPlaces> rises;
    for (std::size_t i = 0; i < kCounters; ++i) {
      const std::size_t place = PlaceOf(i);
      const ByteSpan value = e.Covered(e.read, static_cast<EscAddress>(kFirst + i), 1);
      if (value.empty() || place == kPlaces) continue;
      const std::optional<std::uint8_t> before = slave.counters[i];
      const FrameNo read_before = slave.since[i];
      slave.counters[i] = value[0];
      slave.since[i] = e.frame().number;
      if (before) slave.compared = true;
      if (!before || value[0] <= *before) continue;
      const Counted& names = CountedBy(i);
      Rises& at = rises[place];
      at.counted.push_back(arg::Count(static_cast<std::uint64_t>(value[0] - *before), names.noun));
      at.values.Set(names.at, arg::Hex(kFirst + i))
          .Set(names.before, arg::Number(*before))
          .Set(names.after, arg::Number(value[0]));
      at.since = read_before;
      at.only_forwarded = at.only_forwarded && IsForwarded(i);
    }
    for (std::size_t place = 0; place < kPlaces; ++place) {
      if (!rises[place].counted.empty()) ReportCounters(slave, e, place, std::move(rises[place]));
    }
  }

  void ReportCounters(Slave& slave, const track::SlaveAccess& e, std::size_t place, Rises rises) {
    const bool first = !std::exchange(slave.reported_counters[place], true);
    Value counted = arg::List(std::move(rises.counted));
    if (const FindingIndex index = Repeat(e.slave, place, e.frame()); index != kNoFinding) {
      Finding& known = context().store[index];
      AddRelated(known, e.frame().number);
      if (!first) return;
      Arguments arguments = std::move(rises.values);
      arguments.Set("counted", std::move(counted))
          .Set("since_frame", arg::Frame(rises.since))
          .Set("shown_frame", arg::Frame(e.frame().number));
      known.Add(kCountedLater, std::move(arguments));
      return;
    }
    Finding finding = Found(place == kProcessingUnit ? kBadFrames : kCountersRise, e.slave, e.frame());
    finding.arguments = std::move(rises.values);
    if (place != kProcessingUnit) finding.Set("port", arg::Number(static_cast<std::int64_t>(place)));
    finding.Set("counted", std::move(counted))
        .Set("since_frame", arg::Frame(rises.since))
        .Set("only_forwarded", arg::Flag(rises.only_forwarded));
    AddRelated(finding, rises.since);
    Report(place, std::move(finding));
  }

  void OnDlStatus(const track::SlaveAccess& e) {
    const ByteSpan value = e.Covered(e.read, esc::kDlStatus, 1);
    if (value.empty()) return;
    Slave& slave = Get(e.slave);
    const auto links = static_cast<std::uint8_t>(value[0] >> 4U);
    const std::optional<std::uint8_t> before = slave.links;
    const FrameNo since = slave.links_since;
    slave.links = links;
    slave.links_since = e.frame().number;
    if (before) slave.compared = true;
    if (!before || (*before & ~links) == 0) return;
    for (std::size_t port = 0; port < 4; ++port) {
      if ((*before >> port & 1U) != 0 && (links >> port & 1U) == 0) ReportLink(slave, e, port, since);
    }
  }

  void ReportLink(Slave& slave, const track::SlaveAccess& e, std::size_t port, FrameNo since) {
    const bool first = !std::exchange(slave.reported_link[port], true);
    const Arguments seen{{"port", arg::Number(static_cast<std::int64_t>(port))}, {"since_frame", arg::Frame(since)}};
    if (const FindingIndex index = Repeat(e.slave, port, e.frame()); index != kNoFinding) {
      Finding& known = context().store[index];
      AddRelated(known, e.frame().number);
      if (!first) return;
      Arguments arguments = seen;
      arguments.Set("shown_frame", arg::Frame(e.frame().number));
      known.Add(kLinkLostLater, std::move(arguments));
      return;
    }
    Finding finding = Found(kLinkLost, e.slave, e.frame());
    finding.arguments = seen;
    AddRelated(finding, since);
    Report(port, std::move(finding));
  }

  std::vector<Slave> slaves_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<BusLinkErrors>};

}  // namespace
}  // namespace ecaudit::bus_link_errors
