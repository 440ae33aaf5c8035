#include "decoder/bus/direction_evidence.h"

#include "tests/support/evidence_rows.h"

namespace ecaudit::bus::test {
namespace {

using ecaudit::test::ExpectEachConditionDecides;
using ecaudit::test::ExpectRows;

TEST(DirectionEvidence, BothCopiesRowByRow) {
  using F = BothCopiesFact;
  ExpectRows<F, Reading>(kReadBothCopies, {
                                              {{F::kBothBits, F::kPairs, F::kPorts}, Reading::kMacBit},
                                              {{F::kPorts, F::kFlags}, Reading::kUnknown},
                                              {{F::kPairs, F::kPorts, F::kFlags}, Reading::kByPort},
                                              {{F::kPairs, F::kFlags}, Reading::kByFlag},
                                              {{F::kPairs}, Reading::kByPair},
                                          });
}

TEST(DirectionEvidence, CopiesRowByRow) {
  using F = CopyFact;
  ExpectRows<F, Role>(kRoleByCopies,
                      {
                          {{F::kInStep, F::kCopies, F::kSomeAccepted, F::kManyAccepted}, Role::kOtherBus},
                          {{F::kInStep, F::kBothExchange}, Role::kOtherBus},
                          {{F::kPassesNoSlave, F::kCopies, F::kSomeAccepted}, Role::kOtherEnd},
                          {{F::kSendsDummies}, Role::kOtherEnd},
                          {{F::kInStep, F::kCopies, F::kBothExchange}, Role::kOtherEnd},
                          {{F::kCopies, F::kSomeAccepted}, Role::kOpen},
                      });
}

TEST(DirectionEvidence, TurnsRowByRow) {
  using F = TurnFact;
  ExpectRows<F, Role>(kRoleByTurns, {
                                        {{F::kBothExchange, F::kOtherSlaves}, Role::kOpen},
                                        {{F::kTurns, F::kTwins, F::kOtherSlaves}, Role::kOpen},
                                        {{F::kTurns, F::kBothExchange}, Role::kOtherBus},
                                        {{F::kTurns, F::kOtherSlaves}, Role::kOtherBus},
                                        {{F::kTurns}, Role::kOpen},
                                    });
}

TEST(DirectionEvidence, OneCopyRowByRow) {
  using F = OneCopyFact;
  using V = OneCopyVerdict;
  ExpectRows<F, V>(kReadOneCopy, {
                                     {{F::kOthersHaveBoth, F::kCounted}, {Reading::kForeign, Shows::kNothing}},
                                     {{F::kEndOfOnePort}, {Reading::kAllReturned, Shows::kNothing}},
                                     {{F::kCounted, F::kBitClear}, {Reading::kAllReturned, Shows::kReturns}},
                                     {{F::kTimeOuts, F::kBitClear}, {Reading::kMacBit, Shows::kNoAnswers}},
                                     {{F::kTimeOuts}, {Reading::kAllOutbound, Shows::kNoAnswers}},
                                     {{F::kBitClear}, {Reading::kMacBit, Shows::kOutbound}},
                                     {{}, {Reading::kByPair, Shows::kOutbound}},
                                 });
}

TEST(DirectionEvidence, NoConditionCanBeLeftOut) {
  ExpectEachConditionDecides(kReadBothCopies, BothCopiesFact::kFlags);
  ExpectEachConditionDecides(kRoleByCopies, CopyFact::kSendsDummies);
  ExpectEachConditionDecides(kRoleByTurns, TurnFact::kOtherSlaves);
  ExpectEachConditionDecides(kReadOneCopy, OneCopyFact::kBitClear);
}

}  // namespace
}  // namespace ecaudit::bus::test
