// What a working counter shows, by ETG1000.4: one for each slave that is read, two for each that is written by LRW, and
// one by LWR.
#include "analyzers/model/exchange_count.h"

#include "tests/support/evidence_rows.h"

namespace ecaudit::model {
namespace {

using ecaudit::test::ExpectEachConditionDecides;
using ecaudit::test::ExpectRows;

TEST(ExchangeCount, CounterRowByRow) {
  using F = CounterFact;
  using V = CounterReading;
  ExpectRows<F, V>(kReadCounter,
                   {
                       {{F::kNeverReturns, F::kMappingKnown}, V::kTakenAsSent},
                       {{F::kCounted, F::kMappingKnown, F::kPossible}, V::kNothing},
                       {{F::kReturned, F::kMappingKnown, F::kPossible}, V::kNobody},
                       {{F::kReturned, F::kCounted, F::kEniCounter, F::kEniCounterMet, F::kMappingKnown}, V::kAllFit},
                       {{F::kReturned, F::kCounted, F::kEniCounter, F::kMappingKnown, F::kPossible}, V::kNothing},
                       {{F::kReturned, F::kCounted, F::kFull}, V::kAllFit},
                       {{F::kReturned, F::kCounted, F::kPossible}, V::kNothing},
                       {{F::kReturned, F::kCounted, F::kMappingKnown, F::kFull, F::kPossible}, V::kByNumber},
                       {{F::kReturned, F::kCounted, F::kMappingKnown, F::kFull}, V::kNothing},
                   });
}

TEST(ExchangeCount, NoConditionCanBeLeftOut) {
  ExpectEachConditionDecides(kReadCounter, CounterFact::kPossible);
}

TEST(ExchangeCount, NumbersRowByRow) {
  constexpr auto kYes = Exchange::kYes;
  constexpr auto kNo = Exchange::kNo;
  constexpr auto kUnknown = Exchange::kUnknown;
  struct Row {
    const char* what;
    SlavesCounted counted;  // inputs, outputs, step, wkc
    ExchangeOfAll all;
  };
  for (const Row& row : {
           Row{"a drive in OP", {1, 1, 2, 3}, {kYes, kYes}},
           Row{"... in SAFEOP", {1, 1, 2, 1}, {kYes, kNo}},
           Row{"... that takes outputs and gives nothing", {1, 1, 2, 2}, {kNo, kYes}},
           Row{"three in OP", {3, 3, 2, 9}, {kYes, kYes}},
           Row{"the inputs of three, or one in OP beside two that have left", {3, 3, 2, 3}, {kUnknown, kUnknown}},
           Row{"one input is missing", {3, 3, 2, 8}, {kUnknown, kYes}},
           Row{"one output is missing, or two inputs", {3, 3, 2, 7}, {kUnknown, kUnknown}},
           Row{"two inputs, or one output", {3, 3, 2, 2}, {kUnknown, kUnknown}},
           Row{"a terminal with inputs beside a drive, all", {2, 1, 2, 4}, {kYes, kYes}},
           Row{"LRD: all", {2, 0, 1, 2}, {kYes, kYes}},
           Row{"LRD: one of two", {2, 0, 1, 1}, {kUnknown, kYes}},
           Row{"LWR: all", {0, 2, 1, 2}, {kYes, kYes}},
           Row{"LWR: one of two", {0, 2, 1, 1}, {kYes, kUnknown}},
       }) {
    ASSERT_TRUE(row.counted.possible()) << row.what;
    EXPECT_EQ(ByNumber(row.counted), row.all) << row.what;
  }
}

TEST(ExchangeCount, NumbersThatNoSlavesMake) {
  for (const SlavesCounted& counted : {
           SlavesCounted{3, 3, 2, 10},  // more than all
           SlavesCounted{0, 2, 2, 1},   // outputs alone count two each
           SlavesCounted{0, 2, 2, 3},
           SlavesCounted{2, 0, 1, 3},
       }) {
    EXPECT_FALSE(counted.possible()) << counted.wkc;
  }
  EXPECT_TRUE((SlavesCounted{3, 3, 2, 9}.full()));
  EXPECT_TRUE((SlavesCounted{3, 3, 2, 10}.full()));
  EXPECT_FALSE((SlavesCounted{3, 3, 2, 8}.full()));
}

}  // namespace
}  // namespace ecaudit::model
