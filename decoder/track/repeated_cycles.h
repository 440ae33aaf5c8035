/// in: BusTransaction.  out: the same, but for cycles that tell nothing new.
///
/// keeps: a few kinds of frames with what they held when they were last told, and the last that was not told.
///
/// In OP nearly every cycle is like the one before: the same datagrams, states and working counters; only times and
/// positions are others, and nobody looks at those of each frame but who measures times. A frame that came back like
/// the one before, all at rest behind it, is asked about (CycleAtRest): who hears that says what of its data matters,
/// or that every frame does. From then on frames that are the same in what matters are not told in full: FrameRepeated
/// of each is enough, and LogicalRepeated or TimeRepeated of its datagrams. Before anything else is told whoever put
/// something off is asked to do it (RepetitionEnds), and the last of them is told as the cycle that it was, and how
/// many came before it (CyclesSkipped). So whoever looks finds everything as if each had been told.
///
/// Whatever is published besides (EventSink::news()), and any frame that is no cycle, ends that for all.
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
  /// So many equal ones are told in full before.
  static constexpr std::uint32_t kCalm = 2;
  /// Where every frame mattered, so many more are told before it is asked again.
  static constexpr std::uint32_t kAskAgain = 64;

  /// Both must outlive this.
  RepeatedCycles(Network& network, EventSink& events) : network_(network), events_(events) {}

  /// From here on; before, every frame is told.
  void Begin() { skips_ = true; }

  void OnFrame(const wire::FrameView&, bus::Direction) override {}
  void OnSent(const wire::FrameView& frame) override;
  void OnTransaction(const bus::BusTransaction& transaction) override;
  void OnDoubtful(const wire::FrameView& sent) override;
  void OnLost(const wire::FrameView& sent, bus::Loss loss, bool followed_by_other) override;
  void OnDuplicate(const wire::FrameView& returned, FrameNo original) override;
  void OnUnusable(const wire::FrameView& frame, bus::Unusable reason, bool own_master) override;
  /// What was not told is told.
  void Settle();
  /// The bytes of the frames at hand go away: what was not told is copied.
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
    std::vector<Word> words;         ///< those with bits that matter, as told last
    std::size_t size = 0;            ///< bytes of the datagrams
    std::uint64_t source_mac = 0;
    // The last frame that was not told.
    wire::FrameFields last;
    std::vector<std::uint16_t> offsets;
    std::vector<std::uint8_t> kept;

    /// This frame was told. @param anew the mask has changed
    void Take(const wire::FrameView& frame, bool anew);
    [[nodiscard]] bool Matches(const wire::FrameView& frame) const;
    void Skip(const wire::FrameView& frame) { last = frame.fields(); }
    void Keep();
    void Restore(wire::FrameView& view) const { view.Restore(last, offsets.data(), last.bytes_); }
  };
  struct Kind {
    bool used = false;
    std::uint64_t head = 0;  ///< of the first datagram, without its index
    Copy sent, returned;
    std::uint32_t calm = 0;     ///< told in full, one like the other
    bool skips = false;         ///< frames that are the same need not be told
    std::uint64_t skipped = 0;  ///< since the last was told
    std::uint64_t bytes_skipped = 0;
    std::uint64_t order = 0;  ///< of the last one skipped
    std::vector<RepeatedDatagram> datagrams;

    /// Told last like this one, and who gives the time answered.
    [[nodiscard]] bool Repeats(const bus::BusTransaction& t) const;
  };

  [[nodiscard]] static bool MayRepeat(const bus::BusTransaction& transaction);
  [[nodiscard]] Kind* KindOf(const bus::BusTransaction& transaction);
  void Skip(Kind& kind, const bus::BusTransaction& transaction);
  void Tell(Kind* kind, const bus::BusTransaction& transaction);
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
