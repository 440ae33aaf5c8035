#include <algorithm>
#include <vector>

#include "analyzers/core/rule.h"
#include "analyzers/model/bus_model.h"
#include "decoder/base/text.h"

namespace ecaudit {
namespace {

constexpr RuleInfo kInfo{
    .id = "bus-duplicate-address",
    .group = "Frame and bus",
    .severity = Severity::kError,
    .title = "Two slaves have the same configured station address",
    .needs = "position-addressed accesses to register 0x0010",
    .source = "ETG.1000.4, configured station address register 0x0010",
    .doc = R"(
## What it checks
Whether two slaves at different positions hold the same station address (0x0010) when the master begins to use it.

## Why it matters
Both slaves answer each access to that address: reads are mixed, writes reach the wrong drive as well.

## How it is decided
The addresses are those that the slaves took (working counter) or reported. While a master gives out addresses anew, two
slaves may share one for a moment: the rule waits until the address is used (an AL request or a mailbox access to it, or
an access that two slaves answer). Writing 0 to all slaves is how masters clear addresses, and not a duplicate.

## Example
samples/captures/duplicate-address.pcapng

## What to do
Correct the addressing in the master; after hot-connecting a slave scan the bus again before using its address.
)"};

class BusDuplicateAddress final : public Rule {
 public:
  using Rule::On;
  BusDuplicateAddress() : Rule(kInfo) { Subscribe({Topic::kAddressAssigned, Topic::kAnswered}); }

  void On(const track::AddressAssigned& e) override {
    std::erase_if(open_, [&](const Shared& s) { return s.slave == e.slave || s.other == e.slave; });
    if (e.duplicate_of != kNoSlave && open_.size() < 64) open_.push_back({e.slave, e.duplicate_of, e.address, e.frame});
  }

  void On(const track::Answered& e) override {
    if (open_.empty() || !wire::IsNodeAddressed(e.command) || e.command == wire::Command::FRMW) return;
    const auto shared = std::find_if(open_.begin(), open_.end(), [&](const Shared& s) { return s.address == e.adp; });
    if (shared == open_.end()) return;
    const bool both_answer = e.wkc > (e.command == wire::Command::FPRW ? 3 : 1);
    const bool in_use = e.address >= 0x1000 || (e.address <= 0x0120 && e.address + e.length > 0x0120 &&
                                                wire::Writes(e.command));
    if (!both_answer && !in_use) return;
    const std::uint64_t key = static_cast<std::uint64_t>(shared->address);
    if (Repeat(shared->slave, key, e.returned) != kNoFinding) return;
    Finding finding;
    finding.slave = shared->slave;
    finding.first = e.returned;
    finding.title = "Station address " + Hex(shared->address) + " is used by two slaves";
    finding.message = context().Label(shared->other) + " held station address " + Hex(shared->address) + " when " +
                      context().Label(shared->slave) + " was given the same in frame " +
                      std::to_string(shared->frame.number) + "; in frame " + std::to_string(e.returned.number) +
                      " the master uses the address" +
                      (both_answer ? " and both answer (working counter " + std::to_string(e.wkc) + ")" : "") +
                      ". Give every slave an address of its own.";
    finding.evidence.push_back(HexNumber("station_address", shared->address));
    finding.evidence.push_back(Number("working_counter", e.wkc));
    AddRelated(finding, shared->frame.number);
    Report(key, std::move(finding));
  }

 private:
  struct Shared {
    SlaveId slave = kNoSlave;
    SlaveId other = kNoSlave;
    StationAddress address = 0;
    FrameRef frame;
  };
  std::vector<Shared> open_;
};

const RuleRegistration kRegistration{kInfo, MakeRule<BusDuplicateAddress>};

}  // namespace
}  // namespace ecaudit
