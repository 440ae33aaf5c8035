#include "decoder/bus/frame_losses.h"

#include "tests/support/evidence_rows.h"

namespace ecaudit::bus::test {
namespace {

using ecaudit::test::ExpectEachConditionDecides;
using ecaudit::test::ExpectRows;

TEST(FrameLosses, FatesRowByRow) {
  using F = GivenUpFact;
  ExpectRows<F, Fate>(kFates, {
                                  {{F::kMayBeCopy, F::kDoubted, F::kAnswered}, Fate::kCapturedTwice},
                                  {{F::kDoubted, F::kAnswered}, Fate::kDoubted},
                                  {{F::kNoAnswers}, Fate::kNoAnswers},
                                  {{}, Fate::kNoReturns},
                                  {{F::kAnswered}, Fate::kLost},
                              });
}

TEST(FrameLosses, FatesAtTheEndRowByRow) {
  using F = AtEndFact;
  ExpectRows<F, AtEnd>(kFatesAtEnd, {
                                        {{F::kOvertaken, F::kOtherPort}, AtEnd::kOvertaken},
                                        {{F::kOtherPort, F::kManySentLater}, AtEnd::kInFlight},
                                        {{F::kTimed, F::kSomeSentLater, F::kOverdue}, AtEnd::kSilence},
                                        {{F::kSomeSentLater, F::kManySentLater}, AtEnd::kSilence},
                                        {{F::kTimed, F::kSomeSentLater, F::kManySentLater}, AtEnd::kInFlight},
                                    });
}

TEST(FrameLosses, NoConditionCanBeLeftOut) {
  ExpectEachConditionDecides(kFates, GivenUpFact::kNoAnswers);
  ExpectEachConditionDecides(kFatesAtEnd, AtEndFact::kOverdue);
}

}  // namespace
}  // namespace ecaudit::bus::test
