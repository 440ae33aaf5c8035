/// in: BusTransaction.  out: Event (events.h) and one SlaveState a slave.
///
/// Resolves which slaves a datagram meant and which of them took part, keeps what each ESC is known to hold, and turns
/// accesses into facts: requests, states, addresses, counts.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "decoder/base/allowance.h"
#include "decoder/bus/slave_set.h"
#include "decoder/bus/transaction.h"
#include "decoder/track/events.h"
#include "decoder/track/mailbox_tracker.h"
#include "decoder/track/slave_state.h"

namespace ecaudit::track {

class Network final : public bus::BusSink, private SiiListener {
 public:
  explicit Network(EventSink& events) : events_(events) {}

  [[nodiscard]] const bus::SlaveSet& slaves() const { return slaves_; }
  [[nodiscard]] const SlaveState& state(SlaveId id) const { return states_[id]; }
  /// Slaves on the bus as the last frame with a position counter showed.
  [[nodiscard]] const Known<std::uint16_t>& slave_count() const { return slave_count_; }

  /// False for a slave behind the last one that answers now, and for one that turned out to be another.
  [[nodiscard]] bool OnBus(SlaveId id) const;
  /// The run of frames that lasts until now.
  [[nodiscard]] const EventFieldRun& event_field() const { return event_field_; }

  /// Changes whenever any sync manager or FMMU may have changed, or a slave was added.
  [[nodiscard]] std::uint64_t mapping_version() const { return mapping_version_; }
  /// The mapping version that the last change of this slave's sync managers or FMMUs made. What rests on the mappings
  /// of all slaves need look again at those only that changed.
  [[nodiscard]] std::uint64_t mapping_changed(SlaveId id) const { return mappings_[id].changed; }
  /// The slave's FMMUs, at least inferred; decoded once after each change.
  [[nodiscard]] const KnownFmmus& fmmus(SlaveId id) const {
    const Mapping& mapping = mappings_[id];
    return mapping.decoded == mapping.changed ? mapping.fmmus : Decode(id);
  }

  void OnFrame(const wire::FrameView&, bus::Direction) override {}
  void OnSent(const wire::FrameView& frame) override;
  void OnTransaction(const bus::BusTransaction& transaction) override;
  void OnDoubtful(const wire::FrameView& sent) override;
  void OnLost(const wire::FrameView& sent, bus::Loss loss, bool followed_by_other) override;
  void OnDuplicate(const wire::FrameView& returned, FrameNo original) override;
  void OnUnusable(const wire::FrameView& frame, bus::Unusable reason, bool own_master) override;
  /// The capture has ended: what is open in mailboxes and EEPROM interfaces is handed out.
  void Finish();

 private:
  struct Datagram;  // both copies of one datagram

  void FollowEventField(const bus::BusTransaction& transaction);
  void ApplyEventField(const bus::BusTransaction& transaction);
  [[nodiscard]] Answered AnswerOf(const Datagram& d, SlaveId slave) const;
  void OnBroadcast(const Datagram& d);
  void OnAddressed(const Datagram& d);
  void OnLogical(const Datagram& d);
  void CountSlaves(const Datagram& d);
  void ReadAlStatusOfAll(const Datagram& d);
  void ForgetReturning(std::uint16_t first_position, const FrameRef& frame);
  void Forget(SlaveId id, const FrameRef& frame);
  void OnHole(const FrameRef& frame, bool certain);
  void BeginRecording(const FrameRef& frame);
  void FollowRun(const Datagram& d);
  void Presume(SlaveId id, bool still_so, const FrameRef& frame);
  void PresumeAll(bool still_so, const FrameRef& frame);
  void FollowLogical(const Datagram& d);
  [[nodiscard]] bool LearnedSince(FrameNo sent, SlaveId slave, EscAddress address, std::size_t length) const;
  [[nodiscard]] std::optional<SlavePos> PositionOf(const Datagram& d) const;
  [[nodiscard]] SlaveId Resolve(const Datagram& d, bool add);
  void Meet(SlaveId id, const FrameRef& frame);
  void Apply(const SlaveAccess& access);
  [[nodiscard]] static Certainty CertaintyOfWrite(const SlaveAccess& access);
  void Learn(SlaveState& state, const SlaveAccess& access, ByteSpan bytes, Certainty certainty);
  void ApplyAddressing(const SlaveAccess& access);
  void OnEepromRead(const EepromRead& event) override;
  void OnEepromWrite(const EepromWrite& event) override;
  void OnEepromError(const EepromError& event) override;
  void MappingChanged(SlaveId slave);
  const KnownFmmus& Decode(SlaveId id) const;
  void TrackMailbox(const SlaveAccess& access);
  MailboxTracker& NeedMailbox(SlaveId slave);
  void UpdateMailboxWindow(SlaveId slave, const FrameRef& frame);
  void ReadMailboxesThroughFmmus(const Datagram& d);
  void FindMappedMailboxes();
  void ApplyAlStatus(SlaveId slave, const FrameRef& frame, std::uint16_t status, std::optional<std::uint16_t> code,
                     bool error_bit_known);

  EventSink& events_;
  bus::SlaveSet slaves_;
  /// The last broadcast read that showed every slave in the state it was known to be in.
  struct Poll {
    std::uint64_t version = 0;  ///< of states_version_
    std::uint8_t status = 0;
    std::vector<SlaveId> slaves;
  };
  Poll poll_;
  std::uint64_t states_version_ = 1;  ///< changes with any AL state, and with who is on the bus
  std::deque<SlaveState> states_;     // grows without moving what rules refer to
  SlaveState everyone_;               // what broadcasts wrote: a slave met later has taken it, too
  Known<std::uint16_t> slave_count_;
  FrameRef last_;            ///< first copy of the last transaction with a time stamp
  bool run_in_use_ = false;  ///< some slave has left INIT in this run, or was to
  EventFieldRun event_field_;
  std::uint64_t mapping_version_ = 0;
  struct Mapping {
    std::uint64_t changed = 0;  ///< mapping version of the last change
    std::uint64_t decoded = 0;  ///< the one that `fmmus` belongs to
    KnownFmmus fmmus;
  };
  mutable std::vector<Mapping> mappings_;  ///< decoded when asked for
  // What a capture could make thousands of slaves keep.
  static constexpr std::size_t kMessageBytes = std::size_t{8} << 20U;
  static constexpr std::size_t kEepromPages = 8192;
  static constexpr std::size_t kRegisterPages = 16'384;
  Allowance message_bytes_{kMessageBytes};
  Allowance eeprom_pages_{kEepromPages};
  Allowance register_pages_{kRegisterPages};
  std::vector<std::unique_ptr<MailboxTracker>> mailboxes_;  // null until there is something to track
  std::vector<std::uint32_t> window_versions_;              // mapping version that each mailbox window rests on
  /// In mailboxes that some FMMU maps into the logical address space, by slave; nearly always none.
  struct MappedMailbox {
    SlaveId slave = kNoSlave;
    esc::Fmmu fmmu;
  };
  std::vector<MappedMailbox> mapped_mailboxes_;
  std::uint64_t mapped_version_ = 0;
  /// Working counter with which a logical datagram came back last. Where the first one behind a hole comes back with
  /// the same, the slaves that were in OP before it still are, and are mapped as before.
  struct Habit {
    wire::Command command = wire::Command::NOP;
    std::uint32_t address = 0;
    std::uint16_t length = 0;
    std::uint16_t wkc = 0;
  };
  std::array<Habit, 8> habits_{};
  std::size_t presumed_ = 0;    // slaves whose state is presumed
  std::uint16_t upstream_ = 0;  // slaves between the master and the tap
  /// What slaves took or gave lately: a frame whose loss shows later leaves that alone.
  struct Recent {
    FrameNo sent = 0;
    SlaveId slave = kNoSlave;
    EscAddress address = 0;
    std::uint16_t length = 0;
  };
  std::array<Recent, 64> recent_{};
  std::size_t next_recent_ = 0;
};

}  // namespace ecaudit::track
