#include <algorithm>
#include <utility>
#include <vector>

#include "analyzers/judge/rule.h"
#include "analyzers/judge/rule_context.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/track/access.h"
#include "decoder/track/events.h"
#include "decoder/track/network.h"

namespace ecaudit::bus_duplicate_address {
namespace {

constexpr FindingKind kShared{
    .name = "shared",
    .title = "Station address {station_address} is used by two slaves",
    .message = R"({earlier_slave} already had station address {station_address} when {later_slave} got it in
{assigned_frame}. In {frame} the master uses the address[{?both_answer}, and both slaves answer (working counter
{working_counter})].)",
    .next = "Give each slave an address of its own."};
constexpr const FindingKind* kKinds[] = {&kShared};

constexpr RuleInfo kInfo{.id = "bus-duplicate-address",
                         .group = "Frame and bus",
                         .severity = Severity::kError,
                         .history = History::kWhole,
                         .title = "Two slaves have the same configured station address",
                         .needs = "position-addressed accesses to register 0x0010",
                         .source = "ETG1000.4, configured station address register 0x0010",
                         .kinds = kKinds,
                         .doc = R"(
## What it checks
Whether two slaves at different positions have the same station address (0x0010) when the master begins to use it.

## Why it matters
Both slaves answer each access to that address: the data of reads are mixed, and writes reach the wrong drive as well.

## How it is decided
The addresses are those that the slaves accepted (working counter) or reported.

- Two slaves that got the same address from the master in one scan are reported as soon as both answer to it.
- A slave that still has an address of an earlier scan may share it while the master assigns new addresses. Then the
  rule waits until the address is used for an AL request, an EEPROM command or the mailbox, or until process data are
  exchanged.
- If only one slave answers to the address, the other one has lost it since then.
- Masters write 0 to all slaves to clear addresses. That is no duplicate.

## Example
samples/captures/duplicate-address.pcapng

## What to do
Correct the addressing in the master. After you connect a slave to a running bus, scan the bus before its address is
used.
)"};

constexpr Word kAddressOfPosition{"address-of-position", "the station address of a slave at a position"};

class BusDuplicateAddress final : public Rule {
 public:
  BusDuplicateAddress() : Rule(kInfo) {
    Subscribe<track::AddressAssigned>(&BusDuplicateAddress::On);
    Subscribe<track::Answered>(&BusDuplicateAddress::On);
    Subscribe<track::SlaveAccess>(&BusDuplicateAddress::On, MemoryRange::Of(esc::kStationAddress, 2));
    Subscribe<track::LogicalAccess>(&BusDuplicateAddress::On);
  }

  void On(const track::SlaveAccess& e) {
    if (e.broadcast || !e.done() || e.Covered(e.written, esc::kStationAddress, 2).empty()) return;
    written_ = {e.slave, e.frame().number};
  }

  void On(const track::AddressAssigned& e) {
    std::erase_if(open_, [&](const Shared& s) { return s.slave == e.slave || s.other == e.slave; });
    const bool by_master = written_ == std::pair(e.slave, e.frame.number);
    if (e.slave >= scan_of_.size()) scan_of_.resize(static_cast<std::size_t>(e.slave) + 1, 0);
    scan_of_[e.slave] = by_master ? scan_ : 0;
    assigned_in_scan_ = true;
    process_data_ = false;
    if (e.duplicate_of == kNoSlave || open_.size() >= kMaxOpen) return;
    const bool given_twice = by_master && e.duplicate_of < scan_of_.size() && scan_of_[e.duplicate_of] == scan_;
    open_.push_back({e.slave, e.duplicate_of, e.address, e.frame, given_twice, false});
  }

  void On(const track::LogicalAccess& e) {
    if (e.wkc > 0 && !e.assumed) process_data_ = true;
  }

  void On(const track::Answered& e) {
    if (!wire::IsNodeAddressed(e.command) || e.command == wire::Command::FRMW) return;
    const bool used = e.address >= 0x1000 || (e.address <= esc::kAlControl && e.address + e.length > esc::kAlControl &&
                                              wire::Writes(e.command));
    const auto shared = std::ranges::find(open_, e.adp, &Shared::address);
    if (shared != open_.end()) {
      const bool both_answer = e.wkc > (e.command == wire::Command::FPRW ? 3 : 1);
      const bool one_answers = e.returned.seen() && e.wkc > 0 && !both_answer;
      if (one_answers) {
        // The other one has lost its address since then: it had no power.
        open_.erase(shared);
      } else if (used ||
                 (both_answer && (shared->given_twice || shared->reported || process_data_ || CommandsEeprom(e))))
        ReportShared(*shared, e, both_answer);
    }
    if (used && assigned_in_scan_) {
      ++scan_;
      assigned_in_scan_ = false;
    }
  }

  void Finish() override {
    if (NotEvaluableWithoutReturns()) return;
    const bus::SlaveSet& slaves = context().network().slaves();
    for (std::size_t s = 0; s < slaves.size(); ++s) {
      if (slaves[static_cast<SlaveId>(s)].position.if_known() != nullptr) return;
    }
    if (slaves.size() > 0) NotEvaluable(kNoSlave, ReasonCode::kNotInCapture, kAddressOfPosition);
  }

 private:
  struct Shared {
    SlaveId slave = kNoSlave;
    SlaveId other = kNoSlave;
    StationAddress address = 0;
    FrameRef frame;
    bool given_twice = false;  ///< by the master, in one scan
    bool reported = false;
  };

  /// Both slaves carry out an EEPROM command, and the words that the master reads then are those of both.
  [[nodiscard]] static bool CommandsEeprom(const track::Answered& e) {
    return wire::Writes(e.command) && e.address <= esc::kEepromControl && e.address + e.length > esc::kEepromControl;
  }

  void ReportShared(Shared& shared, const track::Answered& e, bool both_answer) {
    shared.reported = true;
    const std::uint64_t key = shared.address;
    if (Repeat(shared.slave, key, e.returned) != kNoFinding) return;
    Finding finding = Found(kShared, shared.slave, e.returned);
    finding.Set("station_address", arg::Hex(shared.address))
        .Set("working_counter", arg::Number(e.wkc))
        .Set("earlier_slave", arg::Slave(shared.other, context().Label(shared.other)))
        .Set("later_slave", arg::Slave(shared.slave, context().Label(shared.slave)))
        .Set("assigned_frame", arg::Frame(shared.frame.number))
        .Set("both_answer", arg::Flag(both_answer));
    AddRelated(finding, shared.frame.number);
    Report(key, std::move(finding));
  }

  static constexpr std::size_t kMaxOpen = 64;

  std::vector<Shared> open_;
  std::pair<SlaveId, FrameNo> written_{kNoSlave, 0};  ///< last slave whose address the master wrote
  std::uint32_t scan_ = 1;                            ///< one more when the assigned addresses are used
  std::vector<std::uint32_t> scan_of_;                ///< in which scan the master assigned the address; 0: read only
  bool assigned_in_scan_ = false;
  bool process_data_ = false;  ///< exchanged since the last address was assigned
};

const RuleRegistration kRegistration{kInfo, MakeRule<BusDuplicateAddress>};

}  // namespace
}  // namespace ecaudit::bus_duplicate_address
