#include "analyzers/result/reason.h"

namespace ecaudit {

std::string_view Name(ReasonCode code) {
  switch (code) {
    case ReasonCode::kNotInCapture:
      return "not-in-capture";
    case ReasonCode::kNotRead:
      return "not-read";
    case ReasonCode::kCaptureGap:
      return "capture-gap";
    case ReasonCode::kMissesPackets:
      return "misses-packets";
    case ReasonCode::kNoReturnedFrames:
      return "no-returned-frames";
    case ReasonCode::kNoOutboundFrames:
      return "no-outbound-frames";
    case ReasonCode::kNoEtherCat:
      return "no-ethercat";
    case ReasonCode::kNoSlave:
      return "no-slave";
    case ReasonCode::kSnapLength:
      return "snap-length";
    case ReasonCode::kFamilyUnknown:
      return "family-unknown";
    case ReasonCode::kNotInProfile:
      return "not-in-profile";
    case ReasonCode::kStampsTooCoarse:
      return "stamps-too-coarse";
    case ReasonCode::kNoStamps:
      return "no-stamps";
    case ReasonCode::kWithinUncertainty:
      return "within-uncertainty";
    case ReasonCode::kTooFew:
      return "too-few";
    case ReasonCode::kTooIrregular:
      return "too-irregular";
    case ReasonCode::kCaptureEnds:
      return "capture-ends";
    case ReasonCode::kNeverReturned:
      return "never-returned";
    case ReasonCode::kAmbiguous:
      return "ambiguous";
    case ReasonCode::kNotFollowed:
      return "not-followed";
    case ReasonCode::kListFull:
      return "list-full";
  }
  return {};
}

}  // namespace ecaudit
