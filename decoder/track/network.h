/// in: BusTransaction.  out: Event (events.h) and one SlaveState a slave.
///
/// Joins what follows the slaves, and hands it accesses in an order that all later stages rely on: which slaves a
/// datagram meant and which of them took part, what each ESC holds from then on, and the facts that follow.
///
///   Addressing        who is meant            AlTracker         requests and states
///   SlaveStates       what registers hold     SlaveMailboxes    messages
///   MappingCache      what is mapped          EepromReporter    EEPROM contents
///   CaptureGaps       what may be outdated    EventFieldTracker the ECAT event field
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "decoder/base/event_sink.h"
#include "decoder/bus/slave_set.h"
#include "decoder/bus/transaction.h"
#include "decoder/track/addressing.h"
#include "decoder/track/al_tracker.h"
#include "decoder/track/capture_gaps.h"
#include "decoder/track/datagram_pair.h"
#include "decoder/track/eeprom_reporter.h"
#include "decoder/track/event_field_tracker.h"
#include "decoder/track/events.h"
#include "decoder/track/mapped_mailboxes.h"
#include "decoder/track/mapping_cache.h"
#include "decoder/track/runs.h"
#include "decoder/track/slave_mailboxes.h"
#include "decoder/track/slave_states.h"

namespace ecaudit::track {

class Network final : public bus::BusSink {
 public:
  explicit Network(EventSink& events)
      : events_(events),
        addressing_(events),
        states_(mappings_),
        mailboxes_(events, states_),
        mapped_mailboxes_(states_, mappings_),
        gaps_(events, addressing_, states_, mailboxes_),
        runs_(events),
        al_(events, addressing_, states_, mailboxes_, gaps_, runs_),
        eeprom_(events, states_),
        event_field_(events) {}
  Network(const Network&) = delete;
  Network& operator=(const Network&) = delete;

  [[nodiscard]] const bus::SlaveSet& slaves() const { return addressing_.slaves(); }
  [[nodiscard]] const SlaveState& state(SlaveId id) const { return states_[id]; }
  /// Slaves on the bus as the last frame with a position counter showed.
  [[nodiscard]] const Known<std::uint16_t>& slave_count() const { return addressing_.slave_count(); }

  /// False for a slave after the last one that answers now, and for one that turned out to be another.
  [[nodiscard]] bool OnBus(SlaveId id) const { return addressing_.OnBus(id); }
  /// The run of frames that lasts until now.
  [[nodiscard]] const EventFieldRun& event_field() const { return event_field_.run(); }

  /// The first frame after the last place where the capture misses frames, or may: no frame was sent for long, and no
  /// index shows why. 0: there was none.
  [[nodiscard]] FrameNo last_gap() const { return gaps_.last(); }
  /// True when such a place follows frame `from`, up to frame `to`.
  [[nodiscard]] bool MayMissBetween(FrameNo from, FrameNo to) const { return gaps_.AnyBetween(from, to); }
  /// The same without the places where only the numbers of the frames skip, or go on after a silence while all frames
  /// are matched: what rests on these is inferred.
  [[nodiscard]] bool MissesBetween(FrameNo from, FrameNo to) const { return gaps_.AnyButSkipsBetween(from, to); }
  /// Only the places where frames are missing, certainly or most likely.
  [[nodiscard]] bool LikelyMissesBetween(FrameNo from, FrameNo to) const { return gaps_.AnyLikelyBetween(from, to); }
  /// Handing broadcasts to every slave has cost more than the frames allow for: the caller stops.
  [[nodiscard]] bool overworked() const { return states_.work().exceeded(); }
  /// Changes whenever any sync manager or FMMU may have changed, or a slave was added.
  [[nodiscard]] std::uint64_t mapping_version() const { return mappings_.version(); }
  /// The mapping version that the last change of this slave's sync managers or FMMUs made. What rests on the mappings
  /// of all slaves need look again at those only that changed.
  [[nodiscard]] std::uint64_t mapping_changed(SlaveId id) const { return mappings_.changed(id); }
  /// The slave's FMMUs and sync managers, at least inferred; decoded once after each change.
  [[nodiscard]] const KnownFmmus& fmmus(SlaveId id) const { return mappings_.fmmus(id, states_[id]); }

  /// So do slaves that were counted and not met: nothing.
  [[nodiscard]] bool unmet_map_nothing() const { return states_.LaterMapNothing(); }

  /// A slave that takes part in process data although no frame addresses it: from the next frame on it is met.
  void Presume(std::optional<SlavePos> position, std::optional<StationAddress> station) {
    presumed_.push_back({position, station});
  }

  void OnFrame(const wire::FrameView&, bus::Direction) override {}
  void OnSent(const wire::FrameView& frame) override { al_.OnSent(frame); }
  void OnTransaction(const bus::BusTransaction& transaction) override;
  void OnDoubtful(const wire::FrameView& sent) override;
  void OnLost(const wire::FrameView& sent, bus::Loss loss, bool followed_by_other) override;
  void OnDuplicate(const wire::FrameView& returned, FrameNo original) override;
  void OnRepeated(const bus::RepeatedFrame& repeated) override;
  void OnUnusable(const wire::FrameView& frame, bus::Unusable reason, bool own_master) override;
  /// The capture has ended: what is open in mailboxes and EEPROM interfaces is handed out.
  void Finish();

 private:
  void OnCounted(const DatagramPair& d);
  void OnBroadcast(const DatagramPair& d);
  void WriteToAll(const DatagramPair& d);
  void OnAddressed(const DatagramPair& d);
  void OnUnknownSlave(const DatagramPair& d);
  void OnLogical(const DatagramPair& d);
  [[nodiscard]] static LogicalAccess LogicalAccessOf(const DatagramPair& d);
  /// @param slave that is addressed  @param d has come back
  [[nodiscard]] Answered AnswerOf(const DatagramPair& d, SlaveId slave) const;
  [[nodiscard]] SlaveId Resolve(const DatagramPair& d, bool add) {
    const SlaveId id = addressing_.Resolve(d, add);
    if (add && id != kNoSlave && id >= states_.size()) Meet(id, d.transaction.any().ref());
    return id;
  }
  void Meet(SlaveId id, const FrameRef& frame);
  void MeetPresumed(const FrameRef& frame);
  void ApplyToAll(const DatagramPair& d, Acceptance acceptance);
  void Apply(const SlaveAccess& access);

  EventSink& events_;
  Addressing addressing_;
  MappingCache mappings_;
  SlaveStates states_;
  SlaveMailboxes mailboxes_;
  MappedMailboxes mapped_mailboxes_;
  CaptureGaps gaps_;
  Runs runs_;
  AlTracker al_;
  EepromReporter eeprom_;
  EventFieldTracker event_field_;
  struct Presumed {
    std::optional<SlavePos> position;
    std::optional<StationAddress> station;
  };
  std::vector<Presumed> presumed_;
};

}  // namespace ecaudit::track
