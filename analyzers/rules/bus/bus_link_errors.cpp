#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/text.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/track/access.h"
#include "decoder/track/events.h"

namespace ecaudit::bus_link_errors {
namespace {

constexpr EscAddress kFirst = 0x0300;
constexpr EscAddress kEnd = 0x0314;

constexpr RuleInfo kInfo{.id = "bus-link-errors",
                         .group = "Frame and bus",
                         .severity = Severity::kWarning,
                         .needs_no_history = true,
                         .subject = Subject::kSlave,
                         .title = "Link-lost or receive-error counters rise, or a link drops",
                         .needs = "two reads of the counters (0x0300-0x0313) or of DL status (0x0110) of one slave",
                         .source = "ESC-2, error counters 0x0300-0x0313 and DL status 0x0110",
                         .doc = R"(
## What it checks
The error counters of each port (invalid frames 0x0300, receive errors 0x0301, forwarded errors 0x0308, lost links
0x0310) and that of the processing unit (0x030C), from one read to the next; and the link bits 4-7 of DL status.

## Why it matters
Rising counters point to the cable or connector where frames are damaged, before machines stop.

## How it is decided
Per slave and counter, between two reads of that slave. Writes clear the counters (TwinCAT does so all the time): after
a write that the slave took, counting starts from 0. Errors that were counted before the first read prove nothing.
Counters stop at 255. What rises at one port is one finding.

## Example
samples/captures/link-errors.pcapng

## What to do
Receive errors at a port come from the link of that port; forwarded errors were made further up the line. Exchange the
cable at the first slave (in frame direction) whose own counters rise.
)"};

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

  /// Behind a hole may stand another capture, of other slaves.
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
      NotEvaluable(static_cast<SlaveId>(s), "neither the error counters nor DL status of the slave were read twice");
    }
  }

 private:
  static constexpr std::size_t kCounters = kEnd - kFirst;
  static constexpr std::size_t kProcessingUnit = 4;  // behind ports 0-3
  static constexpr std::size_t kPlaces = 5;

  struct Slave {
    std::array<std::optional<std::uint8_t>, kCounters> counters{};
    std::array<FrameNo, kCounters> since{};
    std::optional<std::uint8_t> links;
    FrameNo links_since = 0;
    bool compared = false;  ///< two reads of the same counter, or of DL status, were compared
    std::array<bool, kPlaces> told_counters{};
    std::array<bool, kPlaces> told_link{};
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
  static std::string_view NameOf(std::size_t i) {
    if (i < 8) return i % 2 == 0 ? "invalid frame" : "receive error";
    if (i < 12) return "forwarded error";
    return i == 12 ? "bad frame" : "lost link";
  }

  void OnCounters(const track::SlaveAccess& e) {
    // A command that reads and writes gives the counters as they were before it cleared them.
    if (!e.broadcast && !e.read.empty()) OnCounterRead(e);
    // A write whose fate is not known may have cleared them: what then reads higher than before has risen all the more.
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
    std::array<std::string, kPlaces> rises;  // text of each place, empty when nothing rose there
    std::array<FrameNo, kPlaces> since{};
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
      rises[place] += (rises[place].empty() ? "" : ", ") + Count(value[0] - *before, NameOf(i)) + " (" +
                      Hex(kFirst + i) + ": " + std::to_string(*before) + " to " + std::to_string(value[0]) + ")";
      since[place] = read_before;
    }
    for (std::size_t place = 0; place < kPlaces; ++place) {
      if (!rises[place].empty()) TellCounters(slave, e, place, rises[place], since[place]);
    }
  }

  void TellCounters(Slave& slave, const track::SlaveAccess& e, std::size_t place, const std::string& what,
                    FrameNo since) {
    const std::string frames =
        "between frame " + std::to_string(since) + " and frame " + std::to_string(e.frame().number);
    if (const FindingIndex index = Repeat(e.slave, place, e.frame()); index != kNoFinding) {
      Finding& known = context().store[index];
      AddRelated(known, e.frame().number);
      if (!slave.told_counters[place]) known.message += " Errors were counted " + frames + ": " + what + ".";
      slave.told_counters[place] = true;
      return;
    }
    slave.told_counters[place] = true;
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.frame();
    if (place == kProcessingUnit) {
      finding.title = "Processing unit counts bad frames";
      finding.message = "The slave's processing unit counted " + frames + ": " + what +
                        ". Look for the first slave in frame direction whose port counters rise.";
    } else {
      finding.title = "Error counters of port " + std::to_string(place) + " rise";
      finding.message = "The slave counted at port " + std::to_string(place) + " " + frames + ": " + what + ". ";
      finding.message +=
          what.find("receive") == std::string::npos && what.find("invalid") == std::string::npos &&
                  what.find("lost") == std::string::npos
              ? "Forwarded errors were made before this slave: look further up the line."
              : "Check the cable and connectors at that port; if slaves before it count errors too, begin "
                "with the first of them.";
      finding.evidence.push_back(Number("port", static_cast<std::int64_t>(place)));
    }
    finding.evidence.push_back(Text("counted", what));
    AddRelated(finding, since);
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
      if ((*before >> port & 1U) != 0 && (links >> port & 1U) == 0) TellLink(slave, e, port, since);
    }
  }

  void TellLink(Slave& slave, const track::SlaveAccess& e, std::size_t port, FrameNo since) {
    const std::string what = "DL status (0x0110) showed a link at port " + std::to_string(port) + " in frame " +
                             std::to_string(since) + " and shows none in frame " + std::to_string(e.frame().number) +
                             ".";
    if (const FindingIndex index = Repeat(e.slave, port, e.frame()); index != kNoFinding) {
      Finding& known = context().store[index];
      AddRelated(known, e.frame().number);
      if (!slave.told_link[port]) known.message += " " + what;
      slave.told_link[port] = true;
      return;
    }
    slave.told_link[port] = true;
    Finding finding;
    finding.slave = e.slave;
    finding.first = e.frame();
    finding.title = "Link lost at port " + std::to_string(port);
    finding.message = what + " Check the cable at that port and the neighbour's power.";
    finding.evidence.push_back(Number("port", static_cast<std::int64_t>(port)));
    AddRelated(finding, since);
    Report(port, std::move(finding));
  }

  std::vector<Slave> slaves_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<BusLinkErrors>};

}  // namespace
}  // namespace ecaudit::bus_link_errors
