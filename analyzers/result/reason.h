/// Why a rule could not be evaluated. A code and what is missing: coverage, advice and verdict switch over these; the
/// sentence comes from cli/report/sentences.h.
#pragma once

#include <cstdint>
#include <string_view>
#include <tuple>

#include "analyzers/result/argument.h"

namespace ecaudit {

enum class ReasonCode : std::uint8_t {
  kNotInCapture,       ///< "{what} is not in the capture"
  kNotRead,            ///< the master did not read {what}
  kCaptureGap,         ///< {what} may have changed in a capture gap
  kMissesPackets,      ///< the capture misses packets; {what}, where given, may be among them
  kNoReturnedFrames,   ///< only frames on their way out
  kNoOutboundFrames,   ///< only frames on their way back
  kNoEtherCat,         ///< no EtherCAT frames at all
  kNoSlave,            ///< no slave is known
  kSnapLength,         ///< packets are cut
  kFamilyUnknown,      ///< the identity of the slave is not in the capture
  kNotInProfile,       ///< no source gives {what}; more of the capture does not help
  kStampsTooCoarse,    ///< time stamps are too coarse[ for {what}]
  kNoStamps,           ///< packets have no time stamps
  kWithinUncertainty,  ///< {what} lies within the uncertainty of the clock
  kTooFew,             ///< too few {what}
  kTooIrregular,       ///< {what} is too irregular
  kCaptureEnds,        ///< the capture ends during {what}
  kNeverReturned,      ///< {what} never returned
  kAmbiguous,          ///< {what} has more than one explanation
  kNotFollowed,        ///< {what} is shown, but no rule evaluates it
  kListFull            ///< there are more {what} than are kept
};

struct Reason {
  ReasonCode code = ReasonCode::kNotInCapture;
  const Word* what = nullptr;

  [[nodiscard]] static Reason Of(ReasonCode code) { return {code, nullptr}; }
  [[nodiscard]] static Reason Of(ReasonCode code, const Word& what) { return {code, &what}; }

  /// By code and what it is about.
  [[nodiscard]] auto Key() const { return std::tuple(code, what == nullptr ? std::string_view() : what->code); }
  [[nodiscard]] bool operator==(const Reason& other) const { return Key() == other.Key(); }
  [[nodiscard]] bool operator<(const Reason& other) const { return Key() < other.Key(); }
};

/// "not-in-capture": public interface.
[[nodiscard]] std::string_view Name(ReasonCode code);

}  // namespace ecaudit
