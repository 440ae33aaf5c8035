/// What the working counter of a datagram with a logical address must be: from the FMMUs, sync managers and AL state
/// of every slave (esc-reference 2.1: +1 a slave that is read, +2 a slave that is written, once each).
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "analyzers/model/logical_kinds.h"
#include "decoder/track/network.h"

namespace ecaudit::model {

struct SlaveModel;

/// The part of one slave.
struct LogicalShare {
  SlaveId slave = kNoSlave;
  bool inputs = false;   ///< an active read FMMU overlaps: +1
  bool outputs = false;  ///< an active write FMMU overlaps: +2
  /// All that is read is a mailbox, which counts only while a message lies in it.
  bool mailbox_only = false;
  /// Sync managers of process data with one buffer: they count only if the slave has filled or emptied it since the
  /// last access.
  std::optional<std::uint8_t> inputs_one_buffer, outputs_one_buffer;
  /// Numbers of the sync managers after it, where they are known.
  std::optional<std::uint8_t> input_manager, output_manager;
  /// Bytes of the datagram that the slave's process data fill (whole bytes only; 0: none). A slave that takes part
  /// writes its inputs over what the master sent there.
  std::uint16_t input_offset = 0;
  std::uint16_t input_bytes = 0;
};

/// The least and most that the slaves, in the states they may be in now, can count.
struct CounterRange {
  std::uint16_t least = 0;
  std::uint16_t most = 0;
};

struct LogicalExpectation {
  bool mapping_known = false;  ///< of every slave some FMMU is known, and be it that it maps nothing
  bool complete = false;       ///< ... and no slave has one that was not seen, so no slave is left out
  std::vector<LogicalShare> shares;
  std::uint16_t full = 0;     ///< when every slave takes part
  std::uint16_t inputs = 0;   ///< slaves that have inputs in it
  std::uint16_t outputs = 0;  ///< slaves that have outputs in it
  bool fills_bytes = false;   ///< some share has input_bytes

  // Three stages ask for the range in every cycle, and it changes with the states of the slaves only.
  mutable CounterRange range{};
  mutable std::uint64_t range_of = 0;  ///< version of the states that `range` belongs to
};

/// Keeps one expectation for each kind of datagram. Where FMMUs or sync managers change, those slaves are looked at
/// again whose they are.
class LogicalExpectations {
 public:
  LogicalExpectations() = default;
  LogicalExpectations(const LogicalExpectations&) = delete;
  LogicalExpectations& operator=(const LogicalExpectations&) = delete;

  /// Valid until the next call.
  const LogicalExpectation& Find(const track::Network& network, wire::Command command, std::uint32_t address,
                                 std::uint16_t length) {
    const LogicalKind kind{command, address, length};
    const bool again = last_ != nullptr && last_->version == network.mapping_version() && last_kind_ == kind;
    return again ? last_->expectation : Look(network, kind);
  }
  /// What was done since this was asked last, in slaves that were updated.
  [[nodiscard]] std::uint64_t TakeWork() { return std::exchange(work_, 0) / kLooksPerSlave; }

 private:
  /// FMMUs that are looked at in about the time that updating a slave takes.
  static constexpr std::uint64_t kLooksPerSlave = 16;
  /// Of all kinds but the one at hand: thousands of slaves may have a part in each of many.
  static constexpr std::size_t kMaxShares = 8'192;

  struct Entry {
    std::uint64_t version = 0;  ///< track::Network::mapping_version() that it rests on; 0: none
    LogicalExpectation expectation;
  };

  const LogicalExpectation& Look(const track::Network& network, const LogicalKind& kind);
  void MakeRoom(const Entry& kept);
  void Renew(Entry& entry, const track::Network& network, const LogicalKind& kind);

  LogicalKinds<Entry> entries_;
  LogicalKind last_kind_;
  const Entry* last_ = nullptr;  ///< found last: one datagram is asked for several times
  std::uint64_t work_ = 0;
};

/// How far the slaves' states allow an evaluation: a slave that is settled in OP counts in full, any other may count.
[[nodiscard]] CounterRange RangeOf(const LogicalExpectation& expectation, wire::Command command,
                                   const std::deque<SlaveModel>& slaves);

/// Share of one slave in the working counter of `command`.
[[nodiscard]] std::uint16_t WorthOf(const LogicalShare& share, wire::Command command);

}  // namespace ecaudit::model
