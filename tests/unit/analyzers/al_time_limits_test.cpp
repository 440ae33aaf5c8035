// How long a slave may take: the user's limit, else what its master waits (ENI), else what its maker asks for (ESI),
// else the usual limits of esc-reference 5.7: 3 s to PREOP, 10 s to SAFEOP and OP, 5 s down.
#include "analyzers/model/al_time_limits.h"

#include <gtest/gtest.h>

namespace ecaudit::model {
namespace {

constexpr TimeNs kSecond = 1'000'000'000;

TEST(AlTimeLimits, SourcesRowByRow) {
  struct Row {
    const char* what;
    std::optional<TimeNs> own, eni, esi;  // of SAFEOP and OP
    TimeNs limit;
  };
  for (const Row& row : {
           Row{"nothing is stated", {}, {}, {}, 10 * kSecond},
           Row{"the maker's", {}, {}, 9 * kSecond, 9 * kSecond},
           Row{"the master waits for less", {}, 2 * kSecond, 9 * kSecond, 2 * kSecond},
           Row{"the master waits for longer", {}, 20 * kSecond, 9 * kSecond, 20 * kSecond},
           Row{"0 is no limit", {}, 0, 9 * kSecond, 9 * kSecond},
           Row{"the user's", 4 * kSecond, 2 * kSecond, 9 * kSecond, 4 * kSecond},
       }) {
    AnalysisOptions options;
    if (row.own) options.limits["al-timeout.safeop-op"] = *row.own;
    const AlTimeouts timeouts = AlTimeLimits(options).For({.safeop_op = row.esi}, {.safeop_op = row.eni});
    EXPECT_EQ(timeouts.to_safeop_or_op_ns, row.limit) << row.what;
    EXPECT_EQ(timeouts.to_preop_ns, 3 * kSecond) << row.what;
    EXPECT_EQ(timeouts.downwards_ns, 5 * kSecond) << row.what;
  }
}

TEST(AlTimeLimits, EachStepHasItsOwn) {
  AnalysisOptions options;
  options.limits["al-timeout.preop"] = 1 * kSecond;
  options.limits["al-timeout.down"] = 2 * kSecond;
  const AlTimeLimits limits(options);
  EXPECT_EQ(limits.usual().to_preop_ns, 1 * kSecond);
  EXPECT_EQ(limits.usual().to_safeop_or_op_ns, 10 * kSecond);
  EXPECT_EQ(limits.usual().downwards_ns, 2 * kSecond);
  const AlTimeouts timeouts =
      AlTimeLimits({}).For({.preop = 6 * kSecond, .back_to_init = 8 * kSecond}, {.back_to_init = 7 * kSecond});
  EXPECT_EQ(timeouts.to_preop_ns, 6 * kSecond);
  EXPECT_EQ(timeouts.to_safeop_or_op_ns, 10 * kSecond);
  EXPECT_EQ(timeouts.downwards_ns, 7 * kSecond);
}

}  // namespace
}  // namespace ecaudit::model
