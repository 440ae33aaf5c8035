#include <array>
#include <optional>
#include <vector>

#include "analyzers/core/rule.h"
#include "analyzers/model/bus_model.h"
#include "decoder/base/text.h"

namespace ecaudit {
namespace {

constexpr EscAddress kFirst = 0x0300;
constexpr EscAddress kEnd = 0x0314;
constexpr EscAddress kDlStatus = 0x0110;

constexpr RuleInfo kInfo{
    .id = "bus-link-errors",
    .group = "Frame and bus",
    .severity = Severity::kWarning,
    .title = "Link-lost or receive-error counters rise, or a link drops",
    .needs = "two reads of the counters (0x0300-0x0313) or of DL status (0x0110) of one slave",
    .source = "Beckhoff ESC data sheet section II, error counters 0x0300-0x0313 and DL status 0x0110",
    .doc = R"(
## What it checks
The error counters of each port - invalid frames (0x0300), receive errors (0x0301), forwarded errors (0x0308), lost links
(0x0310) - and those of the processing unit (0x030C, 0x030D), from one read to the next; and the link bits 4-7 of DL
status.

## Why it matters
Rising counters point to the cable or connector where frames are damaged, before machines stop.

## How it is decided
Per slave and counter, between two reads of that slave. Writes clear the counters (TwinCAT does so all the time): after
a write that the slave took, counting starts from 0. Counters that were already there at the first read prove nothing.
They stop at 255.

## Example
samples/captures/link-errors.pcapng

## What to do
Receive errors at a port come from the link of that port; forwarded errors were made further up the line. Exchange the
cable at the first slave (in frame direction) whose own counters rise.
)"};

class BusLinkErrors final : public Rule {
 public:
  using Rule::On;
  BusLinkErrors() : Rule(kInfo) { Subscribe({Topic::kAccess}); }

  void OnAccess(const track::SlaveAccess& e) override {
    if (e.address >= kEnd) return;
    const std::size_t length = std::max(e.written.size(), e.read.size());
    if (e.address + length > kFirst) OnCounters(e);
    if (!e.broadcast && e.address <= kDlStatus + 1) OnDlStatus(e);
  }

 private:
  struct Slave {
    std::array<std::optional<std::uint8_t>, kEnd - kFirst> counters{};
    std::array<FrameNo, kEnd - kFirst> since{};
    std::optional<std::uint8_t> links;
    FrameNo links_since = 0;
  };

  Slave& Get(SlaveId id) {
    if (id >= slaves_.size()) slaves_.resize(static_cast<std::size_t>(id) + 1);
    return slaves_[id];
  }

  static std::string CounterName(std::size_t i) {
    if (i < 8) return (i % 2 == 0 ? "invalid frames at port " : "receive errors at port ") + std::to_string(i / 2);
    if (i < 12) return "forwarded errors at port " + std::to_string(i - 8);
    if (i == 12) return "processing unit errors";
    if (i == 13) return "PDI errors";
    if (i >= 16) return "lost links at port " + std::to_string(i - 16);
    return {};
  }

  void OnCounters(const track::SlaveAccess& e) {
    Slave& slave = Get(e.slave);
    if (!e.written.empty() && e.acceptance != track::Acceptance::kRefused) {
      // Any write to a group clears the whole group.
      const auto clears = [&](std::size_t first, std::size_t end) {
        if (e.address >= kFirst + end || e.address + e.written.size() <= kFirst + first) return;
        for (std::size_t i = first; i < end; ++i) {
          slave.counters[i] = e.acceptance == track::Acceptance::kAccepted ? std::optional<std::uint8_t>(0) : std::nullopt;
          slave.since[i] = e.frame().number;
        }
      };
      clears(0, 12);
      clears(12, 13);
      clears(13, 14);
      clears(16, 20);
    }
    if (e.broadcast) return;
    for (std::size_t i = 0; i < slave.counters.size(); ++i) {
      const ByteSpan value = e.Covered(e.read, static_cast<EscAddress>(kFirst + i), 1);
      if (value.empty() || i == 14 || i == 15) continue;
      const std::optional<std::uint8_t> before = slave.counters[i];
      const FrameNo since = slave.since[i];
      slave.counters[i] = value[0];
      slave.since[i] = e.frame().number;
      if (!before || value[0] <= *before) continue;
      if (FindingIndex index = Repeat(e.slave, i, e.frame()); index != kNoFinding) {
        AddRelated(context().store[index], e.frame().number);
        continue;
      }
      Finding finding;
      finding.slave = e.slave;
      finding.first = e.frame();
      const std::string name = CounterName(i);
      finding.title = "Counter rises: " + name;
      finding.message = "Register " + Hex(kFirst + i) + " (" + name + ") reads " + std::to_string(value[0]) +
                        " in frame " + std::to_string(e.frame().number) + " after " + std::to_string(*before) +
                        " in frame " + std::to_string(since) +
                        ". Check the cable and connectors at that port, and the slaves further up the line for the "
                        "first whose own counters rise.";
      finding.evidence.push_back(HexNumber("register", kFirst + i));
      finding.evidence.push_back(Number("before", *before));
      finding.evidence.push_back(Number("now", value[0]));
      AddRelated(finding, since);
      Report(i, std::move(finding));
    }
  }

  void OnDlStatus(const track::SlaveAccess& e) {
    const ByteSpan value = e.Covered(e.read, kDlStatus, 1);
    if (value.empty()) return;
    Slave& slave = Get(e.slave);
    const auto links = static_cast<std::uint8_t>(value[0] >> 4U);
    const std::optional<std::uint8_t> before = slave.links;
    const FrameNo since = slave.links_since;
    slave.links = links;
    slave.links_since = e.frame().number;
    if (!before || (*before & ~links) == 0) return;
    for (unsigned port = 0; port < 4; ++port) {
      if ((*before >> port & 1U) == 0 || (links >> port & 1U) != 0) continue;
      const std::uint64_t key = 0x100U + port;
      if (Repeat(e.slave, key, e.frame()) != kNoFinding) continue;
      Finding finding;
      finding.slave = e.slave;
      finding.first = e.frame();
      finding.title = "Link lost at port " + std::to_string(port);
      finding.message = "DL status (0x0110) showed a link at port " + std::to_string(port) + " in frame " +
                        std::to_string(since) + " and shows none in frame " + std::to_string(e.frame().number) +
                        ". Check the cable at that port and the neighbour's power.";
      finding.evidence.push_back(Number("port", port));
      AddRelated(finding, since);
      Report(key, std::move(finding));
    }
  }

  std::vector<Slave> slaves_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<BusLinkErrors>};

}  // namespace
}  // namespace ecaudit
