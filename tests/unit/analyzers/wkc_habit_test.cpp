// Working counters of a capture that starts in operation: what was constant is the expectation (too long for a .trace).
#include <gtest/gtest.h>

#include "analyzers/analysis.h"
#include "analyzers/judge/wkc/evidence.h"
#include "tests/support/evidence_rows.h"
#include "tests/support/trace_builder.h"

namespace ecaudit::test {
namespace {

const Finding* Mismatch(const AnalysisResult& result) {
  for (const Finding& finding : result.findings) {
    if (finding.rule == "wkc-mismatch") return &finding;
  }
  return nullptr;
}

/// `constant` frames with working counter 6, then `low` with 3.
Trace InOperation(int constant, int low) {
  Trace trace;
  trace.Slaves(2);
  for (int i = 0; i < constant; ++i) trace.After(1000).Lrw(0x10000, {1, 0, 2, 0}, {1, 7, 2, 7});
  for (int i = 0; i < low; ++i)
    trace.After(1000).Lrw(0x10000, {1, 0, 2, 0}, {1, 7, 2, 0}).Wkc(3).Mark(i == 0 ? "low" : "");
  return trace;
}

TEST(WkcHabit, DropBelowAConstantValueIsAnInferredWarning) {
  const Trace trace = InOperation(250, 3);
  const AnalysisResult result = Analyse(*trace.Source(), {});
  const Finding* finding = Mismatch(result);
  ASSERT_NE(finding, nullptr);
  EXPECT_EQ(finding->severity, Severity::kWarning);
  EXPECT_EQ(finding->confidence, Confidence::kInferred);
  EXPECT_EQ(finding->first.number, trace.Returned("low"));
  EXPECT_EQ(finding->count, 3U);
  EXPECT_EQ(finding->slave, kNoSlave);
}

TEST(WkcHabit, TooFewFramesAreNoHabit) {
  EXPECT_EQ(Mismatch(Analyse(*InOperation(100, 3).Source(), {})), nullptr);
}

TEST(WkcHabit, RiseIsNoMismatch) {
  Trace trace;
  trace.Slaves(2);
  for (int i = 0; i < 250; ++i) trace.After(1000).Lrw(0x10000, {1, 0, 2, 0}, {1, 7, 2, 0}).Wkc(3);
  for (int i = 0; i < 250; ++i) trace.After(1000).Lrw(0x10000, {1, 0, 2, 0}, {1, 7, 2, 7});
  EXPECT_EQ(Mismatch(Analyse(*trace.Source(), {})), nullptr);
}

TEST(WkcHabit, StateRequestEndsTheHabit) {
  Trace trace;
  trace.Slaves(2);
  trace.After(1000).Fprd(0x1001, 0x0130, {8, 0});
  for (int i = 0; i < 250; ++i) trace.After(1000).Lrw(0x10000, {1, 0, 2, 0}, {1, 7, 2, 7});
  trace.After(1000).Fpwr(0x1001, 0x0120, {4, 0});
  for (int i = 0; i < 3; ++i) trace.After(1000).Lrw(0x10000, {1, 0, 2, 0}, {1, 7, 2, 0}).Wkc(4);
  EXPECT_EQ(Mismatch(Analyse(*trace.Source(), {})), nullptr);
}

// A slave counts 1 for a read, and 1 (LWR) or 2 (LRW) for a write (ETG1000.4): what all known ones count is the least,
// and if all are known the most.
TEST(WkcEvidence, CountersRowByRow) {
  using F = wkc::CounterFact;
  using V = wkc::CounterVerdict;
  ExpectRows<F, V>(wkc::kCounters, {
                                       {{F::kAbove, F::kSetUpMissed}, V::kByHabit},
                                       {{F::kBelow}, V::kByHabit},
                                       {{F::kAllKnown, F::kAbove, F::kOneValue, F::kSetUpMissed}, V::kNotEvaluable},
                                       {{F::kAllKnown}, V::kByHabitOfAll},
                                       {{F::kAllKnown, F::kOneValue}, V::kFits},
                                       {{F::kAllKnown, F::kBelow, F::kOneValue}, V::kMismatch},
                                   });
  EXPECT_EQ(Decide(wkc::kCounters, Facts<F>{F::kBelow, F::kHeld}), V::kMismatch) << "known slaves have counted";
  EXPECT_EQ(Decide(wkc::kCounters, Facts<F>{F::kAllKnown, F::kAbove}), V::kMismatch);
  ExpectEachConditionDecides(wkc::kCounters, F::kSetUpMissed);
}

}  // namespace
}  // namespace ecaudit::test
