#include "decoder/bus/gap_evidence.h"

#include "tests/support/evidence_rows.h"

namespace ecaudit::bus::test {
namespace {

using ecaudit::test::ExpectEachConditionDecides;
using ecaudit::test::ExpectRows;

TEST(GapEvidence, IndicesAndRepetitionsRowByRow) {
  using F = IndexFact;
  using V = GapVerdict;
  ExpectRows<F, V>(
      kGapByIndex,
      {
          {{F::kNext, F::kTimed}, V::kAskTime},
          {{F::kSkips, F::kTimed}, V::kNone},
          {{F::kSkips, F::kTimed, F::kWhole, F::kTimeForSkipped, F::kTimeAtRate, F::kLeftOutNone}, V::kLikelySkip},
          {{F::kSkips, F::kTimed, F::kWhole, F::kTimeForSkipped, F::kTimeAtRate}, V::kMaySkip},
          {{F::kSkips, F::kTimed, F::kWhole, F::kTimeForSkipped}, V::kNumbersSkip},
          {{F::kSkips, F::kTimed, F::kAnyInFlight}, V::kIndicesSkip},
          {{F::kFew, F::kTimed, F::kAnyInFlight}, V::kFewMayMiss},
          {{F::kOrphan, F::kTimed}, V::kCopyMissing},
          {{F::kSentAgain, F::kTimeForRound}, V::kNone},
          {{F::kTimed, F::kSentAgain, F::kTimeForRound}, V::kRoundMayMiss},
          {{F::kTimed, F::kSentAgain}, V::kNone},
          {{F::kTimed, F::kTimeOut, F::kClockJumps}, V::kNone},
          {{F::kTimed, F::kClockJumps, F::kClockBack}, V::kAnotherCapture},
          {{F::kTimed, F::kNext, F::kClockJumps, F::kClockBack}, V::kNone},
          {{F::kTimed}, V::kAskTime},
      });
}

TEST(GapEvidence, SkippedIndicesAreNoGapOnlyIfAllSpeaksAgainstIt) {
  using F = IndexFact;
  for (const F fact : {F::kOrphan, F::kAnyInFlight, F::kTimeForSkipped}) {
    EXPECT_EQ(Decide(kGapByIndex, Facts<F>{F::kSkips, fact}), GapVerdict::kIndicesSkip);
  }
  for (const F fact : {F::kOrphan, F::kAnyInFlight, F::kLongPause}) {
    EXPECT_EQ(Decide(kGapByIndex, Facts<F>{F::kSkips, F::kTimed, F::kWhole, F::kTimeForSkipped, fact}),
              GapVerdict::kIndicesSkip);
  }
}

TEST(GapEvidence, TimeRowByRow) {
  using F = TimeFact;
  using V = GapVerdict;
  ExpectRows<F, V>(kGapByTime, {
                                   {{F::kOrphan, F::kNext, F::kTimeForRound, F::kFewIndices}, V::kSilenceInFlight},
                                   {{F::kOrphan, F::kTimeForRound}, V::kNone},
                                   {{F::kOverdue, F::kNext, F::kFewIndices}, V::kNone},
                                   {{F::kSilent, F::kNext, F::kFewIndices}, V::kNone},
                                   {{F::kSilent, F::kNext, F::kTimeForRound}, V::kNone},
                                   {{F::kSilent, F::kNext, F::kTimeForRound, F::kFewIndices}, V::kSilence},
                                   {{F::kSilent}, V::kSilenceInFlight},
                               });
  EXPECT_EQ(Decide(kGapByTime, Facts<F>{F::kOverdue, F::kNext, F::kTimeForRound, F::kFewIndices, F::kLongSilence}),
            V::kSilenceInFlight);
}

TEST(GapEvidence, NoConditionCanBeLeftOut) {
  ExpectEachConditionDecides(kGapByIndex, IndexFact::kClockBack);
  ExpectEachConditionDecides(kGapByTime, TimeFact::kLongSilence);
}

}  // namespace
}  // namespace ecaudit::bus::test
