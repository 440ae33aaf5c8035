/// in: what was written to AL Control and read of AL Status.  out: AlRequest, AlStatusRead, AlStatusCodeRead,
/// AlStateForgotten; polls of all slaves.
///
/// keeps: the last broadcast read that showed every slave in the state it was known to be in.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "decoder/base/event_sink.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/track/addressing.h"
#include "decoder/track/capture_gaps.h"
#include "decoder/track/datagram_pair.h"
#include "decoder/track/events.h"
#include "decoder/track/runs.h"
#include "decoder/track/slave_mailboxes.h"
#include "decoder/track/slave_states.h"

namespace ecaudit::track {

class AlTracker {
 public:
  AlTracker(EventSink& events, const Addressing& addressing, SlaveStates& states, SlaveMailboxes& mailboxes,
            CaptureGaps& gaps, Runs& runs)
      : events_(events), addressing_(addressing), states_(states), mailboxes_(mailboxes), gaps_(gaps), runs_(runs) {}

  /// What an outbound frame will request of slaves.
  void OnSent(const wire::FrameView& frame);
  /// Whether OnSent() makes anything of it.
  [[nodiscard]] static bool AsksForState(const wire::FrameView& frame);
  [[nodiscard]] static bool Concerns(EscAddress address, std::size_t length) {
    return address < esc::kAlStatusCode + 2 && address + length > esc::kAlControl;
  }
  /// An access of one slave that Concerns().
  void OnAccess(const SlaveAccess& access);
  /// A broadcast wrote AL Control. Slaves that are met later have taken it like those that are known.
  void OnBroadcastRequest(const DatagramPair& d, Acceptance acceptance);
  /// A new slave: what a broadcast requested before it was met, it was asked for as well.
  void OnMet(SlaveId slave);
  /// A broadcast read of AL Status came back, and at least one slave counted. The result is the OR of all slaves. One
  /// state bit and every slave counted: all are in that state. A state that is not in the result is the state of no
  /// slave that counted.
  void OnBroadcastRead(const DatagramPair& d);

 private:
  /// AL Status to AL Status Code.
  static constexpr std::size_t kShown = 6;
  /// As std::has_single_bit(), which calls a function where the processor need not count bits by itself.
  [[nodiscard]] static bool IsOneBit(unsigned bits) { return bits != 0 && (bits & (bits - 1)) == 0; }
  struct Answer {  // of all slaves
    const FrameRef& frame;
    const FrameRef& sent;  // the frame that asked
    ByteSpan data;         // from AL Status on
    std::uint64_t sender = 0;
    std::uint8_t status = 0;

    /// All slaves are in it.
    [[nodiscard]] bool one_state() const { return IsOneBit(states()); }
    [[nodiscard]] std::uint8_t states() const { return status & 0x0FU; }
    [[nodiscard]] bool error() const { return (status & 0x10U) != 0; }
  };

  /// What all slaves were last seen to be, where the same once more shows nothing new.
  struct Poll {
    std::uint64_t sender = 0;   ///< whose slaves they are
    std::uint64_t version = 0;  ///< of who is on the bus and of the AL states; 0: none
    std::array<std::uint8_t, kShown> shown{};
    std::size_t length = 0;       ///< of `shown`: the first byte, and all of it where a single slave shows more
    std::vector<SlaveId> slaves;  ///< of which it reported; none where only some error bit is theirs
  };

  void OnWritten(const SlaveAccess& access);
  void OnRead(const SlaveAccess& access);
  [[nodiscard]] SlaveId OnlySlave() const;
  [[nodiscard]] bool ConcernsAny(const DatagramPair& d) const;
  [[nodiscard]] bool TakesAgain(const Answer& answer, ByteSpan shown, SlaveId only);
  [[gnu::noinline]] void CompareAll(const DatagramPair& d, const Answer& answer, ByteSpan shown, SlaveId only);
  /// @return false: something of the slave had to be reported
  bool Compare(SlaveId id, const Answer& answer);
  bool CompareOnly(SlaveId id, const Answer& answer);
  void Apply(const AlStatusRead& read);
  [[nodiscard]] std::uint64_t Version() const { return addressing_.version() + states_.al_version(); }

  EventSink& events_;
  const Addressing& addressing_;
  SlaveStates& states_;
  SlaveMailboxes& mailboxes_;
  CaptureGaps& gaps_;
  Runs& runs_;
  Poll poll_;
};

}  // namespace ecaudit::track
