/// in: frames with outputs of which each comes one cycle after the last.  out: what they add to the figures of the
/// slaves that they feed, for many frames at once.
///
/// keeps: of a few kinds of frames, those that the slaves have not been updated with so far.
///
/// In OP nearly every frame is like the one before, and at the same place between two pulses of SYNC0. How far apart
/// two of them are is the same for all slaves, and so is by how much a frame is early or late: it is measured once,
/// and each slave is updated with many frames together. That is done only while a frame can only add to figures: the
/// kind that a frame is of begins after one that was looked at for each slave, and ends with the first that is
/// anything else but a further cycle.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "analyzers/sync/cyclic_images.h"
#include "analyzers/sync/dc_unit.h"
#include "analyzers/sync/output_watch.h"
#include "analyzers/sync/time_base.h"
#include "decoder/wire/command.h"

namespace ecaudit::sync {

/// A datagram with process data of the frame at hand; its time may come with a later datagram.
struct ProcessDatagram {
  wire::Command command = wire::Command::NOP;
  std::uint32_t address = 0;
  std::uint16_t length = 0;
  std::uint16_t wkc = 0;
  bool assumed = false;
  SlaveId slave = kNoSlave;  ///< whose memory it addresses; kNoSlave: logical memory

  bool operator==(const ProcessDatagram&) const = default;
};

/// When the frame at hand was sent, and what it takes to reach a slave.
struct FrameWay {
  std::int64_t length_ns = 0;           ///< on the wire; 0 when not known
  std::int64_t reference_delay_ns = 0;  ///< delay register of the reference clock
  bool wide_clock = false;              ///< the reference clock has 64 bit

  bool operator==(const FrameWay&) const = default;
};

class SteadyCycles {
 public:
  /// Masters send one frame a cycle, or a few.
  static constexpr std::size_t kKinds = 4;
  /// Frames that the slaves are updated with at once, at most.
  static constexpr std::size_t kMost = 128;
  /// With more datagrams with process data in a frame, or other cycles for more slaves, each one is delivered.
  static constexpr std::size_t kDatagrams = 4;
  static constexpr std::size_t kRates = 4;
  /// SYNC0 cycles as long as this are evaluated frame by frame: the squares of what is measured shall fit.
  static constexpr std::int64_t kLongestCycle = std::int64_t{1} << 27U;

  /// A slave that a kind of frames feeds.
  struct Fed {
    OutputWatch* watch = nullptr;
    const CyclicImage* image = nullptr;
    std::int64_t sync0_cycle_ns = 0;  ///< 0: its phase is not measured
  };
  /// Where a status word lies in the data of a datagram.
  struct StatusWord {
    OutputWatch* watch = nullptr;
    std::size_t datagram = 0;
    std::size_t at = 0;
  };

  /// The frame is a further cycle of its kind, and that is all there is to it.
  /// @param datagrams  those with process data, their images updated with the frame
  [[nodiscard]] bool Take(std::span<const ProcessDatagram> datagrams, const FrameTime& time, FrameNo sent,
                          const FrameWay& way);
  /// The frames after this one may be taken, if each is a further cycle. It was looked at for each slave.
  /// @param interval  how far it is after the one before
  /// @return whether that can be; slaves of two kinds, or with other clocks, are looked at frame by frame
  bool Begin(std::span<const ProcessDatagram> datagrams, const FrameTime& time, const Interval& interval,
             const FrameWay& way, std::span<const Fed> fed, std::span<const StatusWord> words);
  /// These data have come: the words in them are kept for the frame at hand.
  /// @return whether the datagram belongs to a kind; else the images with a word in it have to be updated
  [[nodiscard]] bool Read(const ProcessDatagram& datagram, ByteSpan data);
  /// A word of this slave is kept here.
  [[nodiscard]] bool Reads(const OutputWatch& watch) const;
  /// Frames of some kind feed this slave.
  [[nodiscard]] bool Feeds(const OutputWatch& watch) const;
  /// The slaves are updated with all frames so far.
  void Deliver();
  /// So they are, and everything comes to them as it is from here on.
  /// @return the frames taken since Begin() of the kind that lasted shortest; 0 when there was none
  std::uint64_t End();

  [[nodiscard]] bool any() const { return used_ > 0; }

 private:
  /// What slaves count their intervals by.
  struct Rate {
    TimeNs nominal = 0;
    IntervalRun run;
  };
  struct Member {
    Fed fed;
    std::size_t rate = 0;
  };
  struct Word {
    StatusWord where;
    std::optional<std::uint16_t> last, now;  ///< of the last frame taken, and of the frame at hand
  };
  class Kind {
   public:
    [[nodiscard]] bool Is(std::span<const ProcessDatagram> datagrams) const;
    [[nodiscard]] bool Begin(std::span<const ProcessDatagram> datagrams, const FrameTime& time,
                             const Interval& interval, const FrameWay& way, std::span<const Fed> fed,
                             std::span<const StatusWord> words);
    [[nodiscard]] bool Take(const FrameTime& time, FrameNo sent, const FrameWay& way);
    [[nodiscard]] bool Read(const ProcessDatagram& datagram, ByteSpan data);
    [[nodiscard]] bool Reads(const OutputWatch* watch) const;
    [[nodiscard]] bool Feeds(const OutputWatch* watch) const;
    void Deliver();
    void End();
    [[nodiscard]] std::uint64_t taken() const { return taken_; }

   private:
    [[nodiscard]] bool Admit(const Fed& fed);
    [[nodiscard]] bool IsNext(const FrameTime& time, TimeNs& gap) const;
    void Open();

    std::size_t count_ = 0;
    std::array<ProcessDatagram, kDatagrams> datagrams_{};
    FrameWay way_;
    std::vector<Member> members_;
    std::vector<Word> words_;
    std::vector<const CyclicImage*> images_;
    std::vector<std::uint64_t> nominal_of_;  ///< of the images, when this began
    std::vector<Rate> rates_;
    TimeBase base_ = TimeBase::kNone;
    TimeNs limit_ = 0;  ///< a longer gap is reported
    bool by_dc_ = false;
    std::int64_t cycle_ = 0;             ///< of SYNC0, 0: no slave's phase is measured
    std::int64_t least_ = 0, most_ = 0;  ///< that shifts may come to
    std::array<std::int32_t, kMost> shifts_{};
    PhaseRun phases_;
    FrameTime last_;
    FrameNo last_sent_ = 0;
    std::uint64_t frames_ = 0;  ///< not delivered so far
    std::uint64_t taken_ = 0;
  };

  std::array<Kind, kKinds> kinds_;
  std::size_t used_ = 0;
};

}  // namespace ecaudit::sync
