/// in: BusTransaction.  out: the same, but for cycles that show nothing new.
///
/// keeps: a few kinds of frames with what they held when last published, and the last one that was not published.
///
/// In OP nearly every cycle is like the one before: the same datagrams, states and working counters; only times and
/// positions are others, and only time measurements need those of each frame.
///
/// 1. A frame returns like the one before, and nothing changes after it: CycleAtRest asks the subscribers which of its
///    data matter. A subscriber may answer that every frame matters.
/// 2. From then on frames with the same relevant data are not published in full. Each is a FrameRepeated, with a
///    LogicalRepeated or TimeRepeated for its datagrams.
/// 3. Before any other event, RepetitionEnds asks subscribers to do what they deferred. Then the last repeated frame is
///    published in full, and CyclesSkipped gives the number of those before it.
/// So each subscriber has the same state as if every frame had been published.
///
/// Any other published event (EventSink::news()), and any frame that is not cyclic, ends this for all kinds.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "decoder/base/event_sink.h"
#include "decoder/bus/transaction.h"
#include "decoder/track/network.h"

namespace ecaudit::track {

class RepeatedCycles final : public bus::BusSink {
 public:
  /// Masters send one frame a cycle, or a few.
  static constexpr std::size_t kKinds = 8;
  /// Number of equal ones that are published in full before.
  static constexpr std::uint32_t kCalm = 2;
  /// Number of further ones that are published before the next question, if every frame mattered.
  static constexpr std::uint32_t kAskAgain = 64;

  /// Both must outlive this.
  RepeatedCycles(Network& network, EventSink& events) : network_(network), events_(events) {}

  /// From here on; before, every frame is published.
  void Begin() { skips_ = true; }

  void OnFrame(const wire::FrameView&, bus::Direction) override {}
  void OnSent(const wire::FrameView& frame) override;
  void OnTransaction(const bus::BusTransaction& transaction) override;
  void OnDoubtful(const wire::FrameView& sent) override;
  void OnLost(const wire::FrameView& sent, bus::Loss loss, bool followed_by_other) override;
  void OnDuplicate(const wire::FrameView& returned, FrameNo original) override;
  void OnUnusable(const wire::FrameView& frame, bus::Unusable reason, bool own_master) override;
  /// Publishes what was not published.
  void Settle();
  /// The bytes of the current frames become invalid: what was not published is copied.
  void Keep();

 private:
  /// One copy of a frame, and which of its bits matter. The vectors grow to the largest frame, then stay.
  struct Copy {
    /// Eight bytes of the datagrams.
    struct Word {
      std::size_t at = 0;
      std::uint64_t mask = 0, value = 0;
    };
    std::vector<std::uint8_t> mask;  ///< a byte for each of the datagrams
    std::vector<Word> words;         ///< those with bits that matter, as published last
    std::size_t size = 0;            ///< bytes of the datagrams
    std::uint64_t source_mac = 0;
    // The last frame that was not published.
    wire::FrameFields last;
    std::vector<std::uint16_t> offsets;
    std::vector<std::uint8_t> kept;

    /// This frame was published. @param changed the mask has changed
    void Take(const wire::FrameView& frame, bool changed);
    [[nodiscard]] bool Matches(const wire::FrameView& frame) const;
    void Skip(const wire::FrameView& frame) { last = frame.fields(); }
    void Keep();
    void Restore(wire::FrameView& view) const { view.Restore(last, offsets.data(), last.bytes_); }
  };
  struct Kind {
    bool used = false;
    std::uint64_t head = 0;  ///< of the first datagram, without its index
    Copy sent, returned;
    std::uint32_t calm = 0;     ///< published in full, one like the other
    bool skips = false;         ///< frames that are the same need not be published
    std::uint64_t skipped = 0;  ///< since the last was published
    std::uint64_t bytes_skipped = 0;
    std::uint64_t order = 0;  ///< of the last one skipped
    std::vector<RepeatedDatagram> datagrams;

    /// Published last like this one, and the slave that gives the time answered.
    [[nodiscard]] bool Repeats(const bus::BusTransaction& t) const;
  };

  [[nodiscard]] static bool MayRepeat(const bus::BusTransaction& transaction);
  [[nodiscard]] Kind* KindOf(const bus::BusTransaction& transaction);
  void Skip(Kind& kind, const bus::BusTransaction& transaction);
  void PublishInFull(Kind* kind, const bus::BusTransaction& transaction);
  void Ask(Kind& kind, const bus::BusTransaction& transaction);
  void MaskHeaders(Kind& kind, const bus::BusTransaction& transaction);
  void Disturb();

  Network& network_;
  EventSink& events_;
  bool skips_ = false;
  std::array<Kind, kKinds> kinds_;
  std::size_t next_ = 0;      ///< to be given away for another kind of frames
  std::uint64_t orders_ = 0;  ///< frames skipped so far
  std::size_t pending_ = 0;   ///< kinds of which some are
};

}  // namespace ecaudit::track
