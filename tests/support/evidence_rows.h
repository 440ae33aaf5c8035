/// Checks tables of evidence and verdict row by row (decoder/base/evidence.h).
#pragma once

#include <vector>

#include <gtest/gtest.h>

#include "decoder/base/evidence.h"

namespace ecaudit::test {

/// Evidence, and the verdict that it has to lead to.
template <class Fact, class Verdict>
struct Example {
  Facts<Fact> facts;
  Verdict verdict;
};

/// Expects one example for each row, in the order of the table: that row, and none above it, decides.
template <class Fact, class Verdict, std::size_t Rows>
void ExpectRows(const std::array<EvidenceRow<Fact, Verdict>, Rows>& table,
                const std::vector<Example<Fact, Verdict>>& examples) {
  ASSERT_EQ(examples.size(), Rows);
  for (std::size_t row = 0; row < Rows; ++row) {
    EXPECT_EQ(RowFor(table, examples[row].facts), row);
    EXPECT_EQ(Decide(table, examples[row].facts), examples[row].verdict) << "row " << row;
  }
}

/// Expects that no condition of a row can be left out: for each there is evidence that it alone decides on.
/// @param last the last one of the facts
template <class Fact, class Verdict, std::size_t Rows>
void ExpectEachConditionDecides(const std::array<EvidenceRow<Fact, Verdict>, Rows>& table, Fact last) {
  const auto facts = static_cast<unsigned>(last) + 1U;
  const auto set_of = [&](unsigned mask) {
    Facts<Fact> set{};
    for (unsigned fact = 0; fact < facts; ++fact) set.Set(static_cast<Fact>(fact), (mask >> fact & 1U) != 0);
    return set;
  };
  for (std::size_t row = 0; row + 1 < Rows; ++row) {
    for (unsigned fact = 0; fact < facts; ++fact) {
      const Facts<Fact> one{static_cast<Fact>(fact)};
      if (!table[row].all.HasAny(one) && !table[row].none.HasAny(one)) continue;
      bool decides = false;
      for (unsigned mask = 0; !decides && mask < 1U << facts; ++mask) {
        decides = RowFor(table, set_of(mask)) == row && Decide(table, set_of(mask ^ 1U << fact)) != table[row].verdict;
      }
      EXPECT_TRUE(decides) << "row " << row << ", fact " << fact;
    }
  }
}

}  // namespace ecaudit::test
