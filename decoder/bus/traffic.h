/// in: packets and the result of Pairing for each.  out: the same once more, later and in another thread.
///
/// Keeps the calls to a BusSink for some packets, so that pairing can continue while earlier packets are processed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "decoder/bus/pairing.h"
#include "decoder/bus/transaction.h"

namespace ecaudit::bus {

class Traffic {
 public:
  /// Forgets everything, but keeps the room.
  void Clear();

  /// Steps: one a packet, and one for what the end of the capture means.
  [[nodiscard]] std::size_t size() const { return steps_.size(); }
  /// Bytes kept.
  [[nodiscard]] std::size_t bytes() const {
    return steps_.size() * sizeof(Step) + calls_.size() * sizeof(Call) + kept_.size() * sizeof(Kept) + bytes_.size() +
           offsets_.size() * sizeof(std::uint16_t) + incidents_.size() * sizeof(PairingIncidents);
  }
  /// Packet of step `i`; valid as long as nothing is added. Without number at the end of the capture. Of packets that
  /// are no EtherCAT frames only the fields are there, no bytes.
  void Restore(std::size_t i, wire::FrameView& packet) const { Restore(kept_[steps_[i].kept], packet); }
  /// Repeats the calls of step `i` to `sink`.
  /// @param packet as Restore() gave it  @param before likewise of step `i` - 1, which spares to restore it once more:
  ///               most frames come back at once
  void Replay(std::size_t i, const wire::FrameView& packet, BusSink& sink,
              const wire::FrameView* before = nullptr) const;
  /// The counters of Pairing after step `i`.
  [[nodiscard]] PairingStatistics StatisticsAfter(std::size_t i) const;

 private:
  friend class TrafficRecorder;
  /// Where the two views of a call lie among those kept.
  using Place = std::uint32_t;
  static constexpr Place kNone = ~Place{0};

  enum class Kind : std::uint8_t { kSent, kTransaction, kDoubtful, kLost, kDuplicate, kUnusable };
  struct Call {
    Kind kind = Kind::kSent;
    std::uint8_t what = 0;  ///< Loss, Unusable or GapBefore
    bool flag = false;      ///< assumed, followed_by_other or own_master
    bool other_end = false;
    Place first = kNone;   ///< the only frame, or the one sent
    Place second = kNone;  ///< the one returned
    FrameNo original = 0;
  };
  struct Kept {
    /// Built where it stays: else it is cleared first for every packet.
    Kept(const wire::FrameFields& of, std::size_t bytes, std::size_t count, std::size_t offsets)
        : fields(of), bytes_at(bytes), length(count), offsets_at(offsets) {}
    wire::FrameFields fields;
    std::size_t bytes_at;
    std::size_t length;
    std::size_t offsets_at;
  };
  struct Step {
    Place kept = kNone;                  ///< the packet
    Place incidents = 0;                 ///< what Pairing counted after it lies there
    std::optional<Direction> direction;  ///< of a frame: OnFrame() comes before all other calls
    std::size_t calls_end = 0;           ///< its calls begin where those of the step before end
    PairingProgress progress;
  };

  Place Keep(const wire::FrameView& frame, ByteSpan bytes);
  static void Deliver(const Call& call, const wire::FrameView* first, const wire::FrameView& packet, BusSink& sink);
  [[gnu::noinline]] void DeliverEarlier(const Call& call, const wire::FrameView& packet, BusSink& sink) const;
  void Restore(const Kept& kept, wire::FrameView& frame) const {
    frame.Restore(kept.fields, offsets_.data() + kept.offsets_at, ByteSpan(bytes_).subspan(kept.bytes_at, kept.length));
  }

  std::vector<Step> steps_;
  std::vector<Call> calls_;
  std::vector<Kept> kept_;
  std::vector<std::uint8_t> bytes_;
  std::vector<std::uint16_t> offsets_;       ///< of datagrams
  std::vector<PairingIncidents> incidents_;  ///< kept when they change: the other thread's processor reads all of this
};

/// Writes down the results of Pairing.
class TrafficRecorder final : public BusSink {
 public:
  /// What follows goes there.
  void SetTarget(Traffic& traffic) { to_ = &traffic; }
  /// What follows up to EndStep() belongs to this packet; to the end of the capture when it has no number.
  void BeginStep(const wire::FrameView& packet);
  /// @param incidents  Pairing::incidents()
  void EndStep(const PairingStatistics& statistics, std::uint64_t incidents);

  void OnFrame(const wire::FrameView& frame, Direction direction) override;
  void OnSent(const wire::FrameView& frame) override;
  void OnTransaction(const BusTransaction& transaction) override;
  void OnDoubtful(const wire::FrameView& sent) override;
  void OnLost(const wire::FrameView& sent, Loss loss, bool followed_by_other) override;
  void OnDuplicate(const wire::FrameView& returned, FrameNo original) override;
  void OnUnusable(const wire::FrameView& frame, Unusable reason, bool own_master) override;

 private:
  /// Where `frame` is kept; it is if it is new.
  Traffic::Place PlaceOf(const wire::FrameView& frame);
  /// One more of this step. @param first the frame it is about, or the one sent; null: there is none
  Traffic::Call& AddCall(Traffic::Kind kind, const wire::FrameView* first);

  Traffic* to_ = nullptr;
  std::uint64_t incidents_ = 0;  ///< as of the last step
};

}  // namespace ecaudit::bus
