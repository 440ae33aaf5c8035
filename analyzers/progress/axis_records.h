/// What was wanted of an axis and not reached: facts without text, for the rules of rules/drive/ and for the ladder.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "analyzers/progress/lasting.h"
#include "decoder/base/ids.h"
#include "decoder/base/time.h"
#include "decoder/device/drive_profile.h"

namespace ecaudit::progress {

enum class AxisFact : std::uint8_t {
  // The axis does not get to Operation enabled.
  kControlBitMissing,   ///< a: bits of the control word (0 to 2) that are 0 while bit 3 asks for Operation enabled
  kResetStands,         ///< bit 7 stays 1 in Fault: a reset is its rising edge
  kResetMissing,        ///< bit 3 asks for Operation enabled in Fault, and no reset is given
  kFaultStays,          ///< a: resets given; the fault is still there
  kShutdownMissing,     ///< 0x000F in Switch on disabled: Shutdown (bit 0 = 0) has to come first
  kNoVoltage,           ///< bit 4 of the status word is 0
  kNoReaction,          ///< a legal enable word, and nothing shows why not
  kQuickStopStays,      ///< Quick stop active is not left by Enable operation
  kNotReady,            ///< the status word shows Not ready to switch on
  kNotInOp,             ///< a: 1: the master requested OP earlier, and then a lower state; 0: it never requested OP
  kOverwrittenControl,  ///< a: written by SDO, b: in the process data
  kLocalControl,        ///< bit 9 of the status word is 0: the drive is not controlled over the bus
  kHasty,               ///< a: times that bit 3 rose, b: the longest of them in ns
  kStaysDisabled,       ///< Shutdown was sent long enough, and the drive stays in Switch on disabled
  kBytesSwapped,        ///< the control word has the enable sequence in its high byte
  kNoControlWord,       ///< a: values of the low byte of the control word that came while the drive is not enabled
  kDipped,              ///< a: the word that stopped an enabled drive for b ns before the master asked again
  kDropsBack,           ///< a: times that the drive went back to Switch on disabled by itself; last of these
  // It is enabled, and nothing starts the motion.
  kStartMissing,       ///< a: mode; bit 4 stays 0
  kStartStands,        ///< a: mode; bit 4 stays 1
  kNotAcknowledged,    ///< bit 4 rises, bit 12 does not follow
  kHaltStands,         ///< bit 8 stays 1
  kOverwrittenMode,    ///< a: 6060h by SDO, b: in the process data, c: 6061h
  kNoMode,             ///< the set point changes, no mode is selected
  kSetpointNotMapped,  ///< a: mode, b: its set point, c: the object that changes
  kRampBits,           ///< velocity mode (2): bits 4 to 6 of the control word are not all 1
  // It is commanded wrongly.
  kJumpAtEnable,      ///< a: target, b: actual value, c: largest step of the target after that
  kJumpInOperation,   ///< a: target before, b: target after, c: largest step before
  kTargetSpike,       ///< a: target before, b: the far one, c: largest step before
  kTargetEchoes,      ///< a: changes, b: travelled
  kTargetAlternates,  ///< a, b: two targets, c: times that it came back
  kTargetUneven,      ///< a: cycles in motion, b: those without a new target, c: times that the target made up for it
  kTargetSlow,        ///< a: cycles in motion, b: those without a new target, c: cycles from one to the next, at most
  kOutsideLimits,     ///< a: target, b: limit, c: actual value, where it is known
  // It does not follow.
  kFollowingError,  ///< bit 13
  kHomingError,     ///< bit 13 in homing
  kLags,            ///< a: travel of the target, b: travel of the actual value
  kStandsStill,     ///< a: travel of the target, b: travel of the actual value; velocity: the values
  kWrongWay,        ///< likewise
  kZeroLimit,       ///< likewise; c: a limit that is 0
  kOtherScale,      ///< velocities: the actual value is steady, and far from the target in number
  kHomingStands,    ///< homing is started, and the axis neither moves nor reports an end; b: how far it went, c: as
                    ///< kZeroLimit
  kHomingCut,       ///< another mode while homing still moved the axis; b: how far it went
  kHomingRuns,      ///< homing moves the axis for long, and shows no end; b: how far it went
  // The process data are read at a wrong place.
  kModeShifted,  ///< a: 6061h by SDO, b: in the process data
};

/// Which object a fact is about.
enum class Quantity : std::uint8_t {
  kNone,
  kPosition,
  kVelocity,  ///< 60FFh, 606Ch
  kTorque,
  kSpeed,  ///< 6042h, 6044h: of the velocity mode (2)
};
inline constexpr std::size_t kQuantityCount = 4;

/// The values of an axis that matter most, at one moment; target and actual value are those of its mode.
struct AxisMoment {
  FrameRef frame;
  std::optional<std::uint16_t> control, status;
  std::optional<std::int8_t> mode;
  Quantity quantity = Quantity::kNone;
  std::optional<std::int64_t> target, actual;
};

/// What an axis received and showed before something happened.
struct AxisLead {
  AxisMoment last;                    ///< the moment before; its frame is not seen() where there was none
  std::optional<AxisMoment> earlier;  ///< some 50 ms before
};

struct AxisRecord {
  AxisFact fact = AxisFact::kNoReaction;
  FrameRef since;  ///< where it began
  FrameRef frame;  ///< where it was certain
  FrameRef last;   ///< where it was still so, or came again: what was reached after that is not held by it
  std::uint64_t count = 1;
  bool inferred = false;  ///< what came before the capture may be the reason
  bool fault = false;     ///< the drive went into a fault, or showed a following error, because of it
  bool constant = false;  ///< kSetpointNotMapped: the set point of the mode is mapped and stays the same
  bool limited = false;   ///< bit 11 of the status word: an internal limit is active
  bool by_sdo = false;    ///< kZeroLimit, kHomingStands: the limit was written or read by SDO; kNoMode: only 6060h is
                          ///< known, by SDO
  bool new_mode = false;  ///< kJumpAtEnable: the drive was enabled before, in another mode
  std::uint8_t at_switch =
      0;                  ///< a limit switch of 60FDh that is active where the set point goes: 1 negative, 2 positive
  bool solved = false;    ///< of enabling: the drive got to Operation enabled after it
  bool followed = false;  ///< kOutsideLimits: the axis goes there all the same
  bool rests = false;     ///< kLags: then both values rest, and the axis does not make the rest of the way
  bool healthy = false;   ///< a healthy machine may show the same: an info, and no rung is held by it
  std::uint64_t healed = 0;  ///< episodes that ended as AxisRecords::Heal() describes
  FrameRef solved_at;        ///< where it was solved first, or found healthy after all
  std::optional<std::uint16_t> control, status;
  std::optional<device::DriveState> state;
  std::optional<std::int8_t> mode;
  std::optional<std::uint8_t> safety_command;  ///< of the FSoE frame in the outputs
  Quantity quantity = Quantity::kNone;
  TimeNs lasted = 0;  ///< from `since` to `frame`
  std::int64_t a = 0, b = 0, c = 0;
  AxisLead lead;  ///< of jumps and following errors
};

/// The facts of one axis, one record for each fact and quantity; more episodes of it are counted.
class AxisRecords {
 public:
  /// Adds it, or counts it with the one of the same fact and quantity.
  void Add(const AxisRecord& record) {
    for (AxisRecord& known : list_) {
      if (known.fact != record.fact || known.quantity != record.quantity) continue;
      ++known.count;
      known.last = record.frame;
      known.solved = false;
      known.healthy = known.healthy && record.healthy;
      known.solved_at = {};
      return;
    }
    list_.push_back(record);
    list_.back().last = record.frame;
  }
  /// It still holds: the record of it lasts until here.
  void Extend(AxisFact fact, Quantity quantity, const FrameRef& frame) {
    for (AxisRecord& known : list_) {
      const bool same = known.fact == fact || (fact == AxisFact::kStandsStill && known.fact == AxisFact::kZeroLimit);
      if (!same || known.quantity != quantity) continue;
      known.last = frame;
      if (known.count == 1 && known.since.has_time && frame.has_time)
        known.lasted = Elapsed(known.since.time, frame.time);
    }
  }
  /// What has held long enough: true once in each episode, when it is to be added; from then on it is extended.
  /// @param held  as Lasting::Hold() gave it
  [[nodiscard]] bool IsDue(AxisFact fact, Lasting& lasting, TimeNs held, TimeNs limit, const FrameRef& frame,
                           Quantity quantity = Quantity::kNone) {
    if (held < limit) return false;
    if (lasting.Report()) return true;
    Extend(fact, quantity, frame);
    return false;
  }
  /// What was waited for came after all: the master knows how to do it, and had its reasons to wait.
  void Drop(AxisFact fact) {
    std::erase_if(list_, [fact](const AxisRecord& known) { return known.fact == fact; });
  }
  /// What was taken for the reason was none.
  void Rename(AxisFact fact, AxisFact to) {
    if (Find(to) != nullptr) return Drop(fact);
    if (AxisRecord* const known = Find(fact)) known->fact = to;
  }
  /// The drive got to Operation enabled.
  void SolveEnabling(const FrameRef& frame) {
    for (AxisRecord& known : list_) {
      if (known.fact > AxisFact::kDropsBack || known.solved) continue;
      known.solved = true;
      known.solved_at = frame;
    }
  }
  /// What stood still did what was asked of it after all, without another command: healthy if each episode ended so.
  void Heal(AxisFact fact, Quantity quantity, const FrameRef& frame) {
    for (AxisRecord& known : list_) {
      if (known.fact != fact || known.quantity != quantity || ++known.healed != known.count) continue;
      known.healthy = true;
      known.solved_at = frame;
    }
  }
  [[nodiscard]] AxisRecord* Find(AxisFact fact) {
    for (AxisRecord& known : list_) {
      if (known.fact == fact) return &known;
    }
    return nullptr;
  }
  [[nodiscard]] const AxisRecord* Find(AxisFact fact) const {
    for (const AxisRecord& known : list_) {
      if (known.fact == fact) return &known;
    }
    return nullptr;
  }
  template <class Visit>
  void ForEachFrame(Visit visit) {
    for (AxisRecord& known : list_) {
      for (FrameRef* const frame :
           {&known.since, &known.frame, &known.last, &known.solved_at, &known.lead.last.frame}) {
        visit(*frame);
      }
      if (known.lead.earlier) visit(known.lead.earlier->frame);
    }
  }
  [[nodiscard]] auto begin() const { return list_.begin(); }
  [[nodiscard]] auto end() const { return list_.end(); }

 private:
  std::vector<AxisRecord> list_;
};

}  // namespace ecaudit::progress
