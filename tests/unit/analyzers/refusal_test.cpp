// What an AL status code asks about (names of the codes: ETG.1020), and the tables that weigh what is found.
#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "analyzers/judge/refusal/code_table.h"
#include "analyzers/judge/refusal/evidence.h"
#include "decoder/esc/al.h"
#include "tests/support/evidence_rows.h"

namespace ecaudit::refusal::test {
namespace {

using ecaudit::test::ExpectEachConditionDecides;
using ecaudit::test::ExpectRows;

bool IsAbout(std::uint16_t code, const StartupKey& key) {
  const std::vector<SettingRange> settings = SettingsOfRefusal(code, 0);
  return std::any_of(settings.begin(), settings.end(), [&](const SettingRange& r) { return r.Holds(key, 1); });
}

TEST(RefusalCodes, EachIsAStandardOneAndStandsInOneRow) {
  const std::vector<std::uint16_t> codes = CodesWithReasons();
  for (const std::uint16_t code : codes) {
    EXPECT_FALSE(esc::AlStatusCodeName(code).empty()) << code;
    EXPECT_EQ(std::count(codes.begin(), codes.end(), code), 1) << code;
    ASSERT_NE(RowOf(code), nullptr) << code;
    EXPECT_NE(RowOf(code)->checks[0], nullptr) << code;
  }
  EXPECT_EQ(RowOf(0x0000), nullptr) << "no error";
  EXPECT_EQ(RowOf(0x0001), nullptr) << "unspecified error";
}

TEST(RefusalCodes, ARowIsAboutWhatItsNameSays) {
  using Kind = StartupKey::Kind;
  struct Expected {
    std::uint16_t code;  ///< the name is in ETG.1020
    StartupKey its_own, not_its;
  };
  const auto reg = [](std::uint32_t address) { return StartupKey{.kind = Kind::kWrite, .address = address}; };
  const auto object = [](std::uint32_t index) { return StartupKey{.kind = Kind::kDownload, .address = index}; };
  const auto word = [](std::uint32_t address) { return StartupKey{.kind = Kind::kEeprom, .address = address}; };
  for (const Expected& row : {
           Expected{0x0015, reg(0x0800), reg(0x0810)},        // invalid mailbox configuration (BOOT): SM0, not SM2
           Expected{0x0015, word(0x0014), object(0x1C12)},    // ... bootstrap mailbox
           Expected{0x0016, reg(0x0808), reg(0x0818)},        // invalid mailbox configuration (PREOP): SM1, not SM3
           Expected{0x0016, word(0x0018), reg(0x0980)},       // ... standard mailbox
           Expected{0x0017, reg(0x0818), reg(0x0420)},        // invalid sync manager configuration: SM3
           Expected{0x0018, reg(0x0818), reg(0x0810)},        // no valid inputs
           Expected{0x0019, reg(0x0810), reg(0x0818)},        // no valid outputs
           Expected{0x001B, reg(0x0600), reg(0x0818)},        // sync manager watchdog: FMMUs bring the outputs
           Expected{0x001D, object(0x1C12), object(0x1C13)},  // invalid output configuration
           Expected{0x001E, object(0x1C13), object(0x1C12)},  // invalid input configuration
           Expected{0x001F, reg(0x0420), reg(0x0980)},        // invalid watchdog configuration
           Expected{0x0024, object(0x1A00), object(0x1600)},  // invalid input mapping
           Expected{0x0025, object(0x1600), object(0x1A00)},  // invalid output mapping
           Expected{0x0027, object(0x1C32), reg(0x0800)},     // free run not supported
           Expected{0x0028, object(0x1C32), reg(0x0800)},     // synchronisation not supported
           Expected{0x002B, reg(0x0818), reg(0x0800)},        // no valid inputs and outputs
           Expected{0x002C, reg(0x0910), reg(0x0810)},        // fatal sync error: the clock
           Expected{0x002D, reg(0x0981), reg(0x0810)},        // no sync error: SYNC0 was never seen
           Expected{0x0030, reg(0x0981), reg(0x0810)},        // invalid DC SYNC configuration
           Expected{0x0035, reg(0x09A0), reg(0x0810)},        // DC invalid sync cycle time
           Expected{0x0036, reg(0x09A0), reg(0x0810)},        // DC SYNC0 cycle time
           Expected{0x0050, reg(0x0500), reg(0x0810)},        // EEPROM no access
           Expected{0x0070, object(0xF030), reg(0x0810)},     // detected module identification list does not match
       }) {
    EXPECT_TRUE(IsAbout(row.code, row.its_own)) << row.code << ' ' << row.its_own.address;
    EXPECT_FALSE(IsAbout(row.code, row.not_its)) << row.code << ' ' << row.not_its.address;
  }
}

// An ESC ignores start, length and control of an enabled sync manager (esc-reference 6.1).
TEST(RefusalEvidence, IgnoredWritesRowByRow) {
  using F = IgnoredFact;
  using V = IgnoredVerdict;
  ExpectRows<F, V>(kIgnoredWrites, {
                                       {{F::kNeedKnown, F::kKeptFits, F::kKeptShown, F::kWrittenFits}, V::kNo},
                                       {{F::kNeedKnown}, V::kNo},
                                       {{F::kNeedKnown, F::kKeptShown, F::kWrittenFits}, V::kYes},
                                       {{F::kKeptShown}, V::kMayBe},
                                   });
  EXPECT_EQ(Decide(kIgnoredWrites, Facts<F>{F::kNeedKnown, F::kWrittenFits}), V::kMayBe)
      << "a slave controller that is programmed may have taken it";
}

// Working counters of a slave that takes part count 1 for a read, 1 or 2 for a write (ETG1000.4).
TEST(RefusalEvidence, ExchangeRowByRow) {
  using F = ExchangeFact;
  using V = ExchangeVerdict;
  ExpectRows<F, V>(kExchanges, {
                                   {{F::kRequested, F::kExchanged}, V::kRight},
                                   {{F::kRequested, F::kExchanged, F::kMissed}, V::kNothing},
                                   {{F::kRequested, F::kMissed}, V::kNotCounted},
                                   {{F::kRequested, F::kNotSent}, V::kNotSent},
                                   {{F::kRequested}, V::kNothing},
                               });
  EXPECT_EQ(Decide(kExchanges, Facts<F>{F::kExchanged}), V::kNothing) << "it had them until it left its state";
}

// Bit 0 of 0x0981 activates the SYNC unit, bit 1 SYNC0.
TEST(RefusalEvidence, PulsesRowByRow) {
  using F = PulseFact;
  using V = PulseVerdict;
  ExpectRows<F, V>(kPulses, {
                                {{F::kNeverSet, F::kMayBeReason}, V::kMayBeUnset},
                                {{F::kMayBeReason}, V::kNothing},
                                {{F::kKnown, F::kMayBeReason}, V::kOff},
                                {{F::kKnown, F::kMayBeReason, F::kAnySync}, V::kMayBeOff},
                                {{F::kKnown}, V::kNothing},
                                {{F::kKnown, F::kRuns, F::kMayBeReason, F::kWrittenActive, F::kWasOff}, V::kRight},
                                {{F::kKnown, F::kRuns, F::kShownAfter, F::kWrittenActive, F::kWasOff}, V::kLate},
                                {{F::kKnown, F::kRuns, F::kShownAfter, F::kWrittenActive}, V::kMayBeLate},
                                {{F::kKnown, F::kRuns, F::kShownAfter}, V::kNothing},
                            });
}

TEST(RefusalEvidence, RatesRowByRow) {
  using F = RateFact;
  using V = RateVerdict;
  ExpectRows<F, V>(kRates, {
                               {{F::kNoMultiple, F::kSlower, F::kMayBeReason, F::kOtherReason}, V::kDiffers},
                               {{F::kNoMultiple, F::kFaster}, V::kNothing},
                               {{F::kSame, F::kSlower, F::kMayBeReason}, V::kRight},
                               {{F::kFaster, F::kMayBeReason}, V::kSeveralFrames},
                               {{F::kSlower, F::kMayBeReason, F::kNoTimeToShow}, V::kSeveralPulses},
                               {{F::kSlower, F::kMayBeReason}, V::kNothing},
                           });
  EXPECT_EQ(Decide(kRates, Facts<F>{F::kSlower, F::kNoTimeToShow, F::kSync1}), V::kNothing)
      << "SYNC1 gives one pulse for each frame";
}

TEST(RefusalEvidence, NoConditionCanBeLeftOut) {
  ExpectEachConditionDecides(kIgnoredWrites, IgnoredFact::kWrittenFits);
  ExpectEachConditionDecides(kExchanges, ExchangeFact::kNotSent);
  ExpectEachConditionDecides(kPulses, PulseFact::kWasOff);
  ExpectEachConditionDecides(kRates, RateFact::kOtherReason);
}

}  // namespace
}  // namespace ecaudit::refusal::test
