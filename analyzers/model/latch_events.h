/// out of model/latch_unit: what happened to the latches of a drive, and what was done wrong with them.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "decoder/base/ids.h"
#include "decoder/device/latch_description.h"

namespace ecaudit::model {

/// How a captured position came to the master.
enum class LatchReading : std::uint8_t {
  kNone,
  kMapped,    ///< its object is in the inputs, and a frame carried it while the valid bit was set
  kSelector,  ///< its read selector was acknowledged
  kSdo,       ///< it was uploaded
};
/// "none", "mapped object", "selector", "SDO".
[[nodiscard]] std::string_view Name(LatchReading reading);

/// One capture of one edge, from enable bit to enable bit. Frames that are not seen() did not happen, or not in the
/// capture file. Control words are cited by the frame that carried them to the drive, status words by the one that
/// brought them back.
struct LatchCapture {
  std::uint8_t edge = 0;  ///< number in LatchDescription::edges
  FrameRef armed;         ///< the enable bit was set
  FrameRef valid;         ///< the valid bit appeared
  FrameRef selected;      ///< its read selector was set
  FrameRef acknowledged;  ///< the selector was acknowledged
  FrameRef read;          ///< the position came to the master first
  FrameRef disarmed;      ///< the enable bit was cleared
  FrameRef rearmed;       ///< the enable bit was set again
  LatchReading reading = LatchReading::kNone;
  std::optional<std::int64_t> position;  ///< as read, where the object that holds it is documented; in drive units
  bool valid_before = false;             ///< the valid bit was set when the capture file began: it may be read already
  bool assumed = false;                  ///< rests on words that the drive may not have accepted
};

struct LatchStep {
  enum class Kind : std::uint8_t { kArmed, kRearmed, kValid, kRead, kDisarmed };
  SlaveId slave = kNoSlave;
  Kind kind = Kind::kArmed;
  FrameRef frame;
  const device::LatchEdge* edge = nullptr;  ///< never null
  std::uint16_t control = 0;                ///< as last known
  std::optional<std::uint16_t> status;      ///< as last known
  LatchCapture capture;                     ///< as it is now
};

/// Something that a rule of the chapter on latches reports, by the rule of that name.
struct LatchMisuse {
  enum class Kind : std::uint8_t {
    kReadBeforeValid,
    kInvalidSelector,
    kReservedBits,
    kRearmWithoutEdge,
    kValueLost,
    kAckMismatch,
    kNotMapped,
    kOutsideOp,
    kTouchProbeConflict,
    kStatusBits,
  };
  /// kStatusBits: what the status word shows although no control word asked for it.
  enum class StatusBits : std::uint8_t {
    kReserved,    ///< bits without a meaning are 1
    kUnarmed,     ///< an edge is valid that was never armed
    kUnselected,  ///< it acknowledges a selector that was never set
  };
  Kind kind = Kind::kReadBeforeValid;
  SlaveId slave = kNoSlave;
  FrameRef frame;
  const device::LatchEdge* edge = nullptr;  ///< null where no single edge is meant
  std::uint16_t control = 0;                ///< the word that did it, or that was in force
  std::uint16_t control_before = 0;         ///< kOutsideOp
  std::optional<std::uint16_t> status;      ///< last one known
  std::uint16_t value = 0;  ///< kReservedBits: the bits; selector rules: the selector; kTouchProbeConflict: 60B8h;
                            ///< kStatusBits: the bits, or the selector
  StatusBits status_bits = StatusBits::kReserved;
  std::uint8_t state = 0;            ///< kOutsideOp: AL state, 0 when several are possible
  std::int64_t waited_ns = 0;        ///< kAckMismatch; kNotMapped: the capture ends so soon after the arming, else 0
  std::int64_t limit_ns = 0;         ///< kAckMismatch; kNotMapped with waited_ns: the slowest SDO of the slave
  std::uint64_t cycles = 0;          ///< kNotMapped with waited_ns: control words since the arming
  bool by_sdo = false;               ///< the word travelled by SDO
  bool inferred = false;             ///< see LatchCapture::assumed
  LatchCapture capture;              ///< where it is about one
  std::array<FrameNo, 4> related{};  ///< 0: none
};
/// "latch-read-before-valid", ...
[[nodiscard]] std::string_view RuleOf(LatchMisuse::Kind kind);

/// A situation that could not be evaluated.
struct LatchNotEvaluable {
  enum class Why : std::uint8_t {
    kValidFromStart,        ///< the valid bit was set before the capture began
    kValidStayed,           ///< the valid bit stayed set when the edge was armed again
    kInputsUnknown,         ///< the contents of the inputs are not known
    kEdgeUndocumented,      ///< a position was read; the manual does not give its edge
    kPositionUndocumented,  ///< the manual does not give the object with the position
    kEndsWhileUnread,       ///< the capture, or its time stamps, end before the position counts as unread
    kEnableBitUncertain,    ///< a control word that cleared the enable bit may not have reached the drive
    kStatusWordMissing,     ///< no status word was seen before the selector was set
    kInputsMissing,         ///< inputs are missing just before the selector was set
    kNoTimeStamps,
    kAlStateUnknown,
    kGap,  ///< control words may be missing in a capture gap
  };
  LatchMisuse::Kind kind = LatchMisuse::Kind::kReadBeforeValid;
  SlaveId slave = kNoSlave;
  FrameRef frame;
  Why why = Why::kInputsUnknown;
};

}  // namespace ecaudit::model
