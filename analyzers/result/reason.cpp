#include "analyzers/result/reason.h"

#include "decoder/base/names.h"

namespace ecaudit {

std::string_view Name(ReasonCode code) {
  static constexpr Named<ReasonCode> kNames[] = {
      {ReasonCode::kNotInCapture, "not-in-capture"},
      {ReasonCode::kNotRead, "not-read"},
      {ReasonCode::kCaptureGap, "capture-gap"},
      {ReasonCode::kMissesPackets, "misses-packets"},
      {ReasonCode::kNoReturnedFrames, "no-returned-frames"},
      {ReasonCode::kNoOutboundFrames, "no-outbound-frames"},
      {ReasonCode::kNoEtherCat, "no-ethercat"},
      {ReasonCode::kNoSlave, "no-slave"},
      {ReasonCode::kSnapLength, "snap-length"},
      {ReasonCode::kFamilyUnknown, "family-unknown"},
      {ReasonCode::kNotInProfile, "not-in-profile"},
      {ReasonCode::kStampsTooCoarse, "stamps-too-coarse"},
      {ReasonCode::kNoStamps, "no-stamps"},
      {ReasonCode::kWithinUncertainty, "within-uncertainty"},
      {ReasonCode::kTooFew, "too-few"},
      {ReasonCode::kTooIrregular, "too-irregular"},
      {ReasonCode::kCaptureEnds, "capture-ends"},
      {ReasonCode::kNeverReturned, "never-returned"},
      {ReasonCode::kAmbiguous, "ambiguous"},
      {ReasonCode::kNotFollowed, "not-followed"},
      {ReasonCode::kListFull, "list-full"},
  };
  static_assert(NamesAll(kNames, ReasonCode::kListFull));
  return NameIn(kNames, code);
}

}  // namespace ecaudit
