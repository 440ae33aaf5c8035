#include <map>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "decoder/base/text.h"
#include "decoder/device/profile_registry.h"
#include "tests/unit/device/reference_tables.h"

namespace ecaudit::device {
namespace {

using esc::AlState;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr AlState kStates[] = {AlState::INIT, AlState::PREOP, AlState::BOOT, AlState::SAFEOP, AlState::OP};

AlState State(const std::string& letter) {
  static const std::map<std::string, AlState> kLetters = {
      {"I", AlState::INIT}, {"P", AlState::PREOP}, {"B", AlState::BOOT}, {"S", AlState::SAFEOP}, {"O", AlState::OP}};
  return kLetters.at(letter);
}

TEST(AlProfile, EveryProfileHasEveryPairOfStates) {
  for (const std::string& name : BuiltinProfileNames()) {
    const DeviceDescription* profile = BuiltinProfile(name);
    ASSERT_NE(profile, nullptr) << name;
    EXPECT_EQ(profile->al.transitions.size(), 25U) << name;
    for (const AlState from : kStates) {
      for (const AlState to : kStates) {
        const AlTransition* row = profile->al_transition(from, to);
        ASSERT_NE(row, nullptr) << name;
        EXPECT_FALSE(row->source.empty());
        if (from == to || to == AlState::INIT) {
          EXPECT_TRUE(row->allowed) << name;
        }
        EXPECT_EQ(profile->AllowsAl(from, to), row->allowed) << name;
      }
    }
  }
}

TEST(AlProfile, TransitionsAreThoseOfTheManuals) {
  ECAUDIT_NEEDS_TABLE("al_transitions");
  for (const Family& family : Families()) {
    SCOPED_TRACE(family.profile);
    const DeviceDescription* profile = BuiltinProfile(family.profile);
    ASSERT_NE(profile, nullptr);
    std::size_t requests = 0;
    for (const test::CsvRow& row : Table("al_transitions", family)) {
      SCOPED_TRACE(row.at("from") + " to " + row.at("to"));
      if (row.at("requirements_side_effects").find("drive-initiated") != std::string::npos) {
        ASSERT_EQ(profile->al.spontaneous.size(), 1U);
        EXPECT_THAT(profile->al.spontaneous[0].codes, ElementsAre(Number(row.at("al_status_code_if_refused"))));
        continue;
      }
      ++requests;
      const AlTransition* found = profile->al_transition(State(row.at("from")), State(row.at("to")));
      ASSERT_NE(found, nullptr);
      EXPECT_EQ(found->allowed, row.at("allowed") == "yes");
      EXPECT_EQ(found->basis, row.at("basis") == "printed" ? Basis::kPrinted : Basis::kInferred);
      EXPECT_EQ(found->source, CitationOf(row.at("source")));
      std::string codes;
      for (const std::uint16_t code : found->refusal_codes) {
        codes += (codes.empty() ? "0x00" : " or 0x00") + std::string(code == 0x1A ? "1A" : Hex(code, 2).substr(2));
      }
      EXPECT_EQ(codes, row.at("al_status_code_if_refused"));
    }
    EXPECT_EQ(profile->al.transitions.size(), requests);
  }
}

TEST(AlProfile, StatusCodesAreThoseOfTheManuals) {
  ECAUDIT_NEEDS_TABLE("al_status_codes");
  for (const Family& family : Families()) {
    SCOPED_TRACE(family.profile);
    const DeviceDescription* profile = BuiltinProfile(family.profile);
    ASSERT_NE(profile, nullptr);
    const auto rows = Table("al_status_codes", family);
    EXPECT_EQ(profile->al.status_codes.size(), rows.size());
    EXPECT_TRUE(profile->al.status_codes_complete);
    for (const test::CsvRow& row : rows) {
      const auto number = static_cast<std::uint16_t>(Number(row.at("code")));
      const AlStatusCode* code = profile->al_status_code(number);
      ASSERT_NE(code, nullptr) << row.at("code");
      EXPECT_EQ(code->name, row.at("name"));
      EXPECT_EQ(code->result, row.at("resulting_state"));
      EXPECT_EQ(code->source, CitationOf(row.at("source")));
      std::string applies = code->any_transition ? "all" : "";
      const auto letter = [](AlState state) { return std::string(1, esc::StateName(state)[0]); };
      for (const AlState state : code->states) applies += (applies.empty() ? "" : "; ") + letter(state);
      for (const auto& t : code->transitions) {
        applies += (applies.empty() ? "" : "; ") + letter(t.from) + "->" + letter(t.to);
      }
      EXPECT_EQ(applies, row.at("applies_to_transitions"));
      EXPECT_TRUE(profile->DocumentsAlStatusCode(number));
    }
  }
}

TEST(AlProfile, KollmorgenKnowsThreeCodesAndPilzOneMore) {
  const DeviceDescription* akd = BuiltinProfile("kollmorgen-akd-2011");
  ASSERT_NE(akd, nullptr);
  EXPECT_TRUE(akd->DocumentsAlStatusCode(0x0000));
  EXPECT_TRUE(akd->DocumentsAlStatusCode(0x0011));
  EXPECT_TRUE(akd->DocumentsAlStatusCode(0x0017));
  EXPECT_FALSE(akd->DocumentsAlStatusCode(0x001A));
  EXPECT_FALSE(akd->DocumentsAlStatusCode(0x001D));  // what a real AKD answered
  EXPECT_TRUE(akd->al_status_code(0x0017)->AppliesTo(AlState::INIT, AlState::PREOP));
  EXPECT_FALSE(akd->al_status_code(0x0017)->AppliesTo(AlState::SAFEOP, AlState::OP));

  const DeviceDescription* pilz = BuiltinProfile("pilz-pmcprotego-d");
  ASSERT_NE(pilz, nullptr);
  EXPECT_FALSE(pilz->al_status_code(0x0017)->AppliesTo(AlState::INIT, AlState::PREOP));
  EXPECT_TRUE(pilz->al_status_code(0x0017)->AppliesTo(AlState::SAFEOP, AlState::OP));
  const AlStatusCode* lost = pilz->al_status_code(0x001A);
  ASSERT_NE(lost, nullptr);
  EXPECT_TRUE(lost->AppliesIn(AlState::OP));
  EXPECT_TRUE(lost->AppliesTo(AlState::SAFEOP, AlState::OP));
  EXPECT_EQ(lost->resulting_state, AlState::SAFEOP);
}

// The manuals accept a request for BOOT without saying what it does; drives without a bootstrap mode answer 0x0013.
TEST(AlProfile, KollmorgenAcceptsBootWithoutPerformingIt) {
  for (const char* name : {"kollmorgen-akd-2010", "kollmorgen-akd-2011", "kollmorgen-mkd-c", "kollmorgen-mkd-n"}) {
    const AlTransition* boot = BuiltinProfile(name)->al_transition(AlState::INIT, AlState::BOOT);
    ASSERT_NE(boot, nullptr);
    EXPECT_TRUE(boot->allowed);
    EXPECT_FALSE(boot->performed);
    EXPECT_THAT(boot->refusal_codes, IsEmpty());
    EXPECT_THAT(boot->tolerated_codes, ElementsAre(0x0013));
    EXPECT_NE(boot->note, "");
  }
  EXPECT_TRUE(BuiltinProfile("pilz-pmcprotego-d")->al_transition(AlState::INIT, AlState::BOOT)->performed);
}

TEST(AlProfile, GenericFollowsTheStandard) {
  const DeviceDescription* generic = BuiltinProfile("generic");
  ASSERT_NE(generic, nullptr);
  EXPECT_TRUE(generic->AllowsAl(AlState::OP, AlState::PREOP));
  EXPECT_TRUE(generic->AllowsAl(AlState::INIT, AlState::BOOT));
  for (const auto& [from, to] : {std::pair{AlState::INIT, AlState::SAFEOP},
                                 {AlState::INIT, AlState::OP},
                                 {AlState::PREOP, AlState::OP},
                                 {AlState::PREOP, AlState::BOOT},
                                 {AlState::SAFEOP, AlState::BOOT},
                                 {AlState::OP, AlState::BOOT},
                                 {AlState::BOOT, AlState::PREOP},
                                 {AlState::BOOT, AlState::SAFEOP},
                                 {AlState::BOOT, AlState::OP}}) {
    EXPECT_FALSE(generic->AllowsAl(from, to)) << esc::StateName(from) << " to " << esc::StateName(to);
    EXPECT_THAT(generic->al_transition(from, to)->refusal_codes, ElementsAre(0x0011));
  }
  EXPECT_TRUE(generic->DocumentsAlStatusCode(0x001D));
  EXPECT_FALSE(generic->DocumentsAlStatusCode(0x1234));
  EXPECT_TRUE(generic->DocumentsAlStatusCode(0x8001));  // the vendor's own
}

// The names are listed in two places of the program; they must not drift apart.
TEST(AlProfile, GenericCodesAllHaveAName) {
  for (const AlStatusCode& code : BuiltinProfile("generic")->al.status_codes) {
    EXPECT_NE(code.name, "") << Hex(code.code);
    EXPECT_TRUE(code.any_transition || !code.transitions.empty() || !code.states.empty()) << Hex(code.code);
    if (code.code != 0x0005) {
      EXPECT_NE(esc::AlStatusCodeName(code.code), "") << Hex(code.code);
    }
  }
}

}  // namespace
}  // namespace ecaudit::device
