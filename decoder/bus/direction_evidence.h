/// How the frames of a sender are read: tables of evidence and verdict over
/// what the look-ahead window holds of it.
///
/// First the senders of which both copies are there, then those beside the main
/// one, at last those with one copy.
#pragma once

#include "decoder/base/evidence.h"

namespace ecaudit::bus {

enum class Reading : std::uint8_t {
  kUnknown,      ///< only before the last table
  kMacBit,       ///< the bit that slaves set distinguishes the copies
  kByPort,       ///< the port of the probe or the interface does
  kByFlag,       ///< the direction that the file records does
  kByPair,       ///< only a frame in flight that matches does
  kAllReturned,  ///< all frames returned
  kAllOutbound,  ///< all frames are on their way out
  kForeign,      ///< no master of this bus
};

enum class BothCopiesFact : std::uint8_t {
  kBothBits,  ///< frames with and without the bit that slaves set
  kPairs,     ///< two copies of nearly every frame
  kPorts,     ///< nearly all pairs run from one port to another one
  kFlags,     ///< the file records both directions
};

inline constexpr auto kReadBothCopies = [] {
  using F = BothCopiesFact;
  return std::to_array<EvidenceRow<F, Reading>>({
      {{F::kBothBits}, {}, Reading::kMacBit},
      {{}, {F::kPairs}, Reading::kUnknown},
      {{F::kPorts}, {}, Reading::kByPort},
      {{F::kFlags}, {}, Reading::kByFlag},
      {{}, {}, Reading::kByPair},
  });
}();

/// What a sender is beside the main one.
enum class Role : std::uint8_t { kOpen, kOtherBus, kOtherEnd };

enum class CopyFact : std::uint8_t {
  kInStep,         ///< it sends what the main sender sends, as often, and slaves take
                   ///< part
  kCopies,         ///< nearly all its frames are sent at once with their like
  kSomeAccepted,   ///< a slave took part in a frame of both
  kManyAccepted,   ///< ... often
  kBothExchange,   ///< both exchange process data
  kPassesNoSlave,  ///< its frames return, and pass no slave
  kSendsDummies,   ///< nearly all its frames are one broadcast under the index of
                   ///< another sender's frame
};

inline constexpr auto kRoleByCopies = [] {
  using F = CopyFact;
  return std::to_array<EvidenceRow<F, Role>>({
      // Two segments with equal programs.
      {{F::kInStep, F::kManyAccepted}, {}, Role::kOtherBus},
      {{F::kInStep, F::kBothExchange}, {F::kCopies}, Role::kOtherBus},
      // While a redundant line is whole, frames of the other end meet the
      // slaves on the way back only.
      {{F::kPassesNoSlave}, {}, Role::kOtherEnd},
      {{F::kSendsDummies}, {}, Role::kOtherEnd},
      {{F::kCopies}, {F::kSomeAccepted}, Role::kOtherEnd},
      {{}, {}, Role::kOpen},
  });
}();

enum class TurnFact : std::uint8_t {
  kTurns,         ///< it sends in turns with others: no second recording
  kTwins,         ///< its frames have twins of other senders, as on a redundant line
  kBothExchange,  ///< it and the main sender exchange process data
  kOtherSlaves,   ///< its frames pass another number of slaves
};

inline constexpr auto kRoleByTurns = [] {
  using F = TurnFact;
  return std::to_array<EvidenceRow<F, Role>>({
      {{}, {F::kTurns}, Role::kOpen},
      {{F::kTwins}, {}, Role::kOpen},
      // Slaves whose process data two masters set up would take those of the
      // last one only.
      {{F::kBothExchange}, {}, Role::kOtherBus},
      {{F::kOtherSlaves}, {}, Role::kOtherBus},
      {{}, {}, Role::kOpen},
  });
}();

/// What a sender with one copy of its frames shows of the whole capture.
enum class Shows : std::uint8_t { kNothing, kReturns, kOutbound, kNoAnswers };

struct OneCopyVerdict {
  Reading reading;
  Shows shows;

  bool operator==(const OneCopyVerdict&) const = default;
};

enum class OneCopyFact : std::uint8_t {
  kOthersHaveBoth,  ///< the bus's master has both copies
  kEndOfOnePort,    ///< it is the other end of a redundant line of which one port
                    ///< was captured
  kCounted,         ///< working counters above 0; masters send 0
  kTimeOuts,        ///< it repeats frames after a time-out, and no slave counts
  kBitClear,        ///< frames without the bit that slaves set
};

inline constexpr auto kReadOneCopy = [] {
  using F = OneCopyFact;
  return std::to_array<EvidenceRow<F, OneCopyVerdict>>({
      {{F::kOthersHaveBoth}, {}, {Reading::kForeign, Shows::kNothing}},
      {{F::kEndOfOnePort}, {}, {Reading::kAllReturned, Shows::kNothing}},
      {{F::kCounted}, {}, {Reading::kAllReturned, Shows::kReturns}},
      {{F::kTimeOuts, F::kBitClear}, {}, {Reading::kMacBit, Shows::kNoAnswers}},
      {{F::kTimeOuts}, {}, {Reading::kAllOutbound, Shows::kNoAnswers}},
      {{F::kBitClear}, {}, {Reading::kMacBit, Shows::kOutbound}},
      {{}, {}, {Reading::kByPair, Shows::kOutbound}},
  });
}();

}  // namespace ecaudit::bus
