/// out of model/: what the slave models conclude. Rules turn these into findings; nothing here is text.
#pragma once

#include <bit>
#include <cstdint>
#include <optional>
#include <span>

#include "analyzers/model/drive_events.h"
#include "analyzers/model/latch_events.h"
#include "decoder/base/ids.h"
#include "decoder/base/known.h"
#include "decoder/device/al_description.h"
#include "decoder/esc/al.h"
#include "decoder/track/access.h"

namespace ecaudit::model {

/// A set of AL states, bit n for the state with value n; empty means nothing is known.
class StateSet {
 public:
  constexpr StateSet() = default;
  static constexpr StateSet Of(std::uint8_t state) {
    return StateSet(static_cast<std::uint16_t>(1U << (state & 0xFU)));
  }

  [[nodiscard]] constexpr bool empty() const { return bits_ == 0; }
  [[nodiscard]] constexpr bool contains(std::uint8_t state) const { return (bits_ >> (state & 0xFU) & 1U) != 0; }
  [[nodiscard]] constexpr bool Meets(StateSet other) const { return (bits_ & other.bits_) != 0; }
  [[nodiscard]] constexpr bool IsWithin(StateSet other) const { return (bits_ & ~other.bits_) == 0; }
  /// The only member; 0 when there is none or more than one.
  [[nodiscard]] constexpr std::uint8_t single() const {
    if (bits_ == 0 || (bits_ & (bits_ - 1U)) != 0) return 0;
    return static_cast<std::uint8_t>(std::countr_zero(bits_));
  }
  constexpr void Add(std::uint8_t state) { bits_ = static_cast<std::uint16_t>(bits_ | 1U << (state & 0xFU)); }
  constexpr void Add(StateSet other) { bits_ = static_cast<std::uint16_t>(bits_ | other.bits_); }
  constexpr void Clear() { bits_ = 0; }
  [[nodiscard]] friend constexpr bool operator==(StateSet, StateSet) = default;

 private:
  explicit constexpr StateSet(std::uint16_t bits) : bits_(bits) {}
  std::uint16_t bits_ = 0;
};

/// What the model expects of a request for an AL state.
enum class AlVerdict : std::uint8_t {
  kLegal,             ///< the family allows it from the state the slave is in
  kIllegal,           ///< not allowed from any state the slave may be in
  kInvalid,           ///< the requested value is no state
  kNeedsAcknowledge,  ///< the error bit is set, the request does not acknowledge: the slave will ignore it
  kUnknown,           ///< the slave's state is not known
};

/// One request as the machine remembers it.
struct AlRequestRecord {
  esc::AlWord control;
  std::optional<esc::AlWord> before;  ///< AL Control as the slave took it before, where that is known
  FrameRef frame;                     ///< first time it was written
  FrameRef last;                      ///< last repetition
  std::uint32_t repetitions = 0;
  AlVerdict verdict = AlVerdict::kUnknown;
  std::uint8_t from = 0;                             ///< state before, 0 unless exactly one is possible
  StateSet possible;                                 ///< states the slave may have been in; empty when nothing is known
  const device::AlTransition* transition = nullptr;  ///< the family's row, where from is known and the value is a state
  bool assumed = false;                              ///< outbound-only capture
  bool over_gap = false;  ///< it stayed open while the capture missed packets: another may be among them
};

struct AlRequestJudged {
  SlaveId slave = kNoSlave;
  AlRequestRecord request;
  FrameNo from_since = 0;   ///< frame that showed the state before
  FrameNo error_since = 0;  ///< kNeedsAcknowledge: frame that showed the error bit
  bool broadcast = false;
};

struct AlAnswered {
  enum class Outcome : std::uint8_t {
    kReached,          ///< the requested state, no error
    kRefused,          ///< the error bit
    kAcceptedIllegal,  ///< the requested state although the family forbids the transition
  };
  SlaveId slave = kNoSlave;
  Outcome outcome = Outcome::kReached;
  AlRequestRecord request;
  FrameRef frame;  ///< the status read that shows it
  esc::AlWord status;
  std::optional<std::uint16_t> code;  ///< where the same read covered 0x0134
  bool state_before_known = true;     ///< false: the error bit may be older than the request
};

/// AL Status shows the error bit after a request that acknowledges, and nothing was known of the slave before: it may
/// be the error that is acknowledged, or the answer.
struct AlAnswerUnclear {
  SlaveId slave = kNoSlave;
  FrameRef frame;
};

/// AL Status still shows the error that was reported before.
struct AlErrorRepeated {
  SlaveId slave = kNoSlave;
  FrameRef frame;
  esc::AlWord status;
};

/// The state fell or the error bit appeared without a request that explains it.
struct AlChangedByItself {
  SlaveId slave = kNoSlave;
  FrameRef frame;
  esc::AlWord before;
  esc::AlWord status;
  FrameNo before_since = 0;       ///< last frame that showed the state before
  FrameNo before_first = 0;       ///< first frame that showed it
  bool before_requested = false;  ///< the state before was requested in `before_since` and never read
  bool after_pause = false;       ///< since then the master was silent, and the capture may have a gap there
  bool error_of_some = false;     ///< a broadcast: the error bit of one slave at least is set, whose is not certain
  bool may_be_asked = false;      ///< the request that explains it may lie before the capture
  FrameNo rose_unasked = 0;       ///< it rose there without a request before: the capture does not hold all requests
  std::optional<std::uint16_t> code;
};

/// The AL status code of an error reported before (kRefused or AlChangedByItself), read later.
struct AlErrorCode {
  SlaveId slave = kNoSlave;
  FrameRef frame;
  std::uint16_t code = 0;
};

/// The error bit is gone again.
struct AlErrorCleared {
  SlaveId slave = kNoSlave;
  FrameRef frame;
  bool echo = false;  ///< what looked like one was the echo of an acknowledge
};

/// The error bit is set when AL Status of the slave is first read; reported again when it becomes certain.
struct AlErrorStands {
  SlaveId slave = kNoSlave;
  FrameRef frame;
  esc::AlWord status;
  std::optional<std::uint16_t> code;  ///< where the same read covered 0x0134
  bool certain = false;               ///< false: it may be the echo of an acknowledge
  FrameNo well_until = 0;             ///< it was seen without error up to there, and then not at all; 0: it never was
};

/// A master that asks for a lower state so long after the request has given it up.
inline constexpr std::int64_t kGivenUpNs = 200'000'000;
/// ... and has looked so often.
inline constexpr std::uint64_t kGivenUpPolls = 3;

/// Neither the state nor an error appeared within the limit although the master kept reading.
struct AlOverdue {
  SlaveId slave = kNoSlave;
  AlRequestRecord request;
  FrameRef frame;  ///< the read that is past the limit
  esc::AlWord status;
  std::int64_t waited_ns = 0;
  std::int64_t limit_ns = 0;
  std::uint64_t polls = 0;
};

/// The master read AL Status for a while, saw neither the state nor an error, and asked for a lower state instead.
struct AlGivenUp {
  SlaveId slave = kNoSlave;
  AlRequestRecord request;  ///< that was not followed
  FrameRef frame;           ///< the last read
  FrameRef next;            ///< the request that ended the wait
  std::uint8_t shown = 0;   ///< state in these reads
  std::int64_t waited_ns = 0;
  std::uint64_t polls = 0;
};

/// Broadcasts that all slaves counted for show that some slave fell, or set its error bit, without a request; no slave
/// showed it by itself.
struct BusAlChanged {
  FrameRef frame;                     ///< the first that shows it
  FrameRef last;                      ///< the last before it was gone, a request came or the capture ended
  esc::AlWord before;                 ///< OR of all
  esc::AlWord status;                 ///< OR of all, and of all reads since
  esc::AlWord unexplained;            ///< of its bits those that no slave showed
  FrameNo before_since = 0;           ///< last frame that showed it as before
  std::uint16_t slaves = 0;           ///< who counted
  FrameNo rose_unasked = 0;           ///< see AlChangedByItself
  bool after_pause = false;           ///< see AlChangedByItself
  std::span<const SlaveId> excluded;  ///< were read by themselves and showed none of it
};

/// Some slave answered a request by its error bit, as broadcasts show: no slave had it set before, no request
/// acknowledged anything that could be echoed, and no slave was read by itself since.
struct BusAlRefused {
  FrameRef frame;            ///< the first that shows it
  FrameRef last;             ///< the last before the next request or the end of the capture
  FrameRef request;          ///< the last one before
  esc::AlWord control;       ///< of that request
  esc::AlWord status;        ///< OR of all
  std::uint16_t slaves = 0;  ///< who counted
  std::uint64_t reads = 0;
};

/// Broadcasts do not show the state that was asked for, and the limit is over or the master gave up; no slave was read
/// by itself then.
struct BusAlOverdue {
  FrameRef frame;            ///< the first read past the limit; the last one where the master gave up
  FrameRef last;             ///< the last before the next request, or before the state was reached
  FrameRef request;          ///< the last of those that asked for it, the repeated ones apart
  esc::AlWord control;       ///< of these
  esc::AlWord status;        ///< OR of all
  std::uint16_t slaves = 0;  ///< who counted
  bool all_asked = false;    ///< else some were, and no slave shows it
  bool given_up = false;     ///< the limit is not over: the master asked for a lower state before
  bool over_gap = false;     ///< the capture missed packets since the request: another request may be among them
  std::int64_t waited_ns = 0;
  std::int64_t limit_ns = 0;
  std::uint64_t polls = 0;
};

/// A slave of the ENI exchanges process data, as the working counter shows, and no frame addressed it so far.
struct SlavePresumed {
  std::optional<SlavePos> position;
  std::optional<StationAddress> station;
};

/// A model foretold what the slave does with an access, and the capture shows what it did.
struct Predicted {
  enum class Kind : std::uint8_t { kMailbox };
  Kind kind = Kind::kMailbox;
  SlaveId slave = kNoSlave;
  FrameRef frame;
  bool held = false;  ///< it did
};

/// A bit of the ECAT event field (0x0210) appeared or went.
struct EventBitChanged {
  std::uint8_t bit = 0;  ///< 0-15
  bool set = false;
  FrameRef frame;               ///< the first frame with it, or the first without
  SlaveId slave = kNoSlave;     ///< whose it is; kNoSlave: that does not show
  bool slave_inferred = false;  ///< it went when the master read what answers this event at this slave alone
  // When it went:
  std::uint64_t frames = 0;  ///< that carried it
  FrameRef first, last;      ///< of them
};

}  // namespace ecaudit::model
