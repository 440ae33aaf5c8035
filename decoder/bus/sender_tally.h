/// in: the frames of one sender in the look-ahead window.  out: counts, a part for each question that is asked of them.
/// DirectionLearner decides by them.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "decoder/bus/frame_progress.h"
#include "decoder/bus/thresholds.h"
#include "decoder/wire/frame_view.h"

namespace ecaudit::bus {

/// Which way do they run, by what each shows by itself?
struct FrameSigns {
  std::uint32_t bit_clear = 0, bit_set = 0;  ///< the bit that slaves set
  std::uint32_t flag_in = 0, flag_out = 0;   ///< the direction that the file records
  std::uint32_t counted = 0;                 ///< a working counter above 0
  std::uint32_t exchanged = 0;               ///< process data that slaves took part in

  void Add(const wire::FrameView& frame) noexcept;
  [[nodiscard]] std::uint32_t frames() const { return bit_clear + bit_set; }
  /// True when all but a few of the frames are among `part`.
  [[nodiscard]] bool NearlyAll(std::uint32_t part) const {
    return part >= frames() || (frames() - part) * threshold::kNoCopyOneIn <= frames();
  }
  [[nodiscard]] bool Exchanges() const { return exchanged >= threshold::kTurns; }
};

/// Does each come past twice, before and after the slaves, and where?
struct CopyPairs {
  std::uint32_t pairs = 0;                    ///< frames that have come further than an earlier copy
  std::uint32_t by_port = 0;                  ///< ... from port_out to port_back
  std::uint32_t counted = 0;                  ///< ... whose earlier copy had a working counter above 0
  std::uint32_t port_out = 0, port_back = 0;  ///< of the first pair
  std::uint32_t back_first = 0;               ///< returns on another interface, stamped shortly before they were sent
  std::uint32_t passed_no_slave = 0;          ///< broadcasts that came back and counted no slave
  std::optional<std::uint16_t> slaves;        ///< that a frame has passed on its way back

  void Add(const wire::FrameView& frame) noexcept;
  /// True when enough of `frames` are in pairs to show that both copies are there; unanswered polls form none.
  [[nodiscard]] bool AreEnough(std::uint32_t frames) const {
    return frames > 1 && pairs * threshold::kPairsOneIn >= frames;
  }
  [[nodiscard]] bool RunFromPortToPort() const {
    return port_out != port_back && (pairs - by_port) * threshold::kOtherPortOneIn <= pairs;
  }
  /// The tap sits downstream of slaves. With a single one there, most of what others are asked passes it uncounted.
  [[nodiscard]] bool ComeFromSlaves() const {
    return counted >= threshold::kCountedFrames && counted * threshold::kCountedOneIn >= pairs;
  }

 private:
  /// A frame whose other copy has not come.
  struct Open {
    bool used = false;
    std::uint64_t key = 0;
    Progress progress;
    std::uint32_t port = 0;
    FrameRef frame;
    bool mac_bit = false;
  };
  [[nodiscard]] bool TakeBackFirst(const Open& now) noexcept;

  std::array<Open, 32> open_{};  ///< a ring
  std::uint8_t next_ = 0;
};

/// Does it send the same again, because no slave answers?
struct Repetitions {
  FrameRef last;                    ///< the frame before,
  std::uint8_t index = 0;           ///< the index of its first datagram
  bool was_only_broadcast = false;  ///< a broadcast was all that it held
  std::uint32_t repeated = 0;       ///< frames like the one before, after a pause
  std::uint32_t index_changes = 0;  ///< frames with another index than the one before

  void Add(const wire::FrameView& frame) noexcept;
  /// True when enough of `frames` are repeated for slaves that do not answer.
  [[nodiscard]] bool AreTimeOuts(std::uint32_t frames) const {
    return repeated >= threshold::kRepeatedFrames && repeated * threshold::kRepeatedOneIn >= frames &&
           index_changes >= threshold::kIndexChanges;
  }
  /// True when the index changes often enough in `frames` for a master that numbers them.
  [[nodiscard]] bool AreNumbered(std::uint32_t frames) const {
    return index_changes * threshold::kNumberedOneIn >= frames;
  }

 private:
  std::uint64_t content_ = 0;  ///< of the last frame
};

/// What do they have in common with those of other senders?
struct Likeness {
  /// What a frame asks for, whatever its index.
  struct Asked {
    std::uint64_t what = 0;
    std::uint64_t key = 0;
    FrameRef frame;
    std::uint8_t index = 0;
    bool dummy = false;  ///< one broadcast and nothing else
    bool taken = false;  ///< each slave that it names took part
  };
  /// One frame and the last ones of others.
  struct Match {
    bool alike = false;     ///< another sender has asked for the same lately
    bool copy = false;      ///< ... at once
    bool accepted = false;  ///< ... lately or at once, and each slave named took part in both
    bool echo = false;      ///< it has the index of one, within a round trip: the same, or one is a broadcast
  };

  std::uint32_t turns = 0;          ///< frames directly after one of another sender
  std::uint32_t twins = 0;          ///< frames that another sender has sent just before
  std::uint32_t alike = 0;          ///< see Match
  std::uint32_t copies = 0;         ///< see Match
  std::uint32_t both_accepted = 0;  ///< see Match
  std::uint32_t echoes = 0;         ///< frames with an echo, those that are one among them
  std::uint32_t dummies = 0;        ///< broadcasts alone under the index of another sender's frame, at once

  [[nodiscard]] static Asked AskedBy(const wire::FrameView& frame) noexcept;
  /// Adds to `match` what the frame of another sender has in common with the last ones of this.
  void Compare(const Asked& other, Match& match) noexcept;
  void Add(const Asked& asked, const Match& match) noexcept;

 private:
  std::array<Asked, 16> asked_{};  ///< a ring
  std::uint8_t next_ = 0;
};

}  // namespace ecaudit::bus
