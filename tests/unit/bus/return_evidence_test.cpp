#include "decoder/bus/return_evidence.h"

#include "tests/support/evidence_rows.h"

namespace ecaudit::bus::test {
namespace {

using ecaudit::test::ExpectEachConditionDecides;
using ecaudit::test::ExpectRows;

TEST(ReturnEvidence, ReturnsRowByRow) {
  using F = ReturnFact;
  using V = ReturnVerdict;
  ExpectRows<F, V>(kReturns,
                   {
                       {{F::kFits, F::kOriginal}, V::kAnswers},
                       {{F::kFromOtherEnd, F::kOriginal}, V::kReachedOtherEnd},
                       {{F::kFits, F::kMayBeCopy, F::kOriginal}, V::kCopyOfAnswer},
                       {{F::kFits, F::kMayBeCopy}, V::kAnswers},
                       {{F::kFits, F::kOvertaken, F::kNext, F::kOriginal, F::kOriginalLater}, V::kAnswers},
                       {{F::kFits, F::kOvertaken, F::kOriginal}, V::kAnswers},
                       {{F::kFits, F::kOvertaken, F::kOriginal, F::kOriginalLater, F::kWaitedFor}, V::kAnswersBoth},
                       {{F::kOriginal, F::kOtherPort, F::kMayBeNext}, V::kCapturedTwice},
                       {{F::kFits, F::kOvertaken, F::kOriginal, F::kOriginalLater}, V::kDuplicate},
                       {{F::kOriginal, F::kNext}, V::kUnmatched},
                   });
  EXPECT_EQ(Decide(kReturns, Facts<F>{}), V::kUnmatched);
  EXPECT_EQ(Decide(kReturns, Facts<F>{F::kOriginal, F::kMayBeNext}), V::kUnmatched);
}

TEST(ReturnEvidence, AlteredRowByRow) {
  using F = AlteredFact;
  ExpectRows<F, bool>(kAltered, {
                                    {{F::kFewBits}, false},
                                    {{F::kAlike, F::kFrameBefore}, false},
                                    {{F::kAlike, F::kFrameAfter, F::kLate}, false},
                                    {{F::kAlike, F::kOneIndex}, false},
                                    {{F::kAlike, F::kOneIndex, F::kFewBits, F::kSentBefore}, false},
                                    {{F::kAlike, F::kOneIndex, F::kFewBits}, true},
                                });
  EXPECT_TRUE(Decide(kAltered, Facts<F>{F::kAlike})) << "with a number of its own, many bits may differ";
}

TEST(ReturnEvidence, OfTwoEqualFramesRowByRow) {
  using F = OfTwoFact;
  ExpectRows<F, OfTwo>(kOfTwo, {
                                   {{F::kFirstLong}, OfTwo::kFirst},
                                   {{F::kTimed, F::kFirstLong}, OfTwo::kSecond},
                                   {{F::kTimed, F::kFirstLate, F::kSecondHadTime}, OfTwo::kFirst},
                                   {{F::kTimed, F::kTripKnown, F::kFirstLate, F::kSecondHadTime}, OfTwo::kSecond},
                                   {{F::kTimed, F::kTripKnown, F::kFirstLate}, OfTwo::kFirst},
                               });
}

TEST(ReturnEvidence, NoConditionCanBeLeftOut) {
  ExpectEachConditionDecides(kReturns, ReturnFact::kFromOtherEnd);
  ExpectEachConditionDecides(kAltered, AlteredFact::kSentBefore);
  ExpectEachConditionDecides(kOfTwo, OfTwoFact::kSecondLate);
}

}  // namespace
}  // namespace ecaudit::bus::test
