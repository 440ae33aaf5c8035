#include <string>

#include <gtest/gtest.h>

#include "decoder/device/profile_registry.h"
#include "tests/unit/device/reference_tables.h"

namespace ecaudit::device {
namespace {

std::string Printed(Access access) {
  switch (access) {
    case Access::kRead:
      return "R/O";
    case Access::kWrite:
      return "W/O";
    case Access::kReadWrite:
      return "R/W";
    default:
      return "";
  }
}

std::string Range(unsigned first, unsigned last) {
  return first == last ? std::to_string(first) : std::to_string(first) + "-" + std::to_string(last);
}

TEST(BitsProfile, AlRegisterBitsAreThoseOfTheManuals) {
  ECAUDIT_NEEDS_TABLE("al_control_status_bits");
  for (const Family& family : Families()) {
    SCOPED_TRACE(family.profile);
    const auto rows = Table("al_control_status_bits", family);
    const auto& bits = BuiltinProfile(family.profile)->register_bits;
    ASSERT_EQ(bits.size(), rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      EXPECT_EQ(bits[i].address, Number(rows[i].at("register")));
      const std::string high_first = bits[i].first == bits[i].last
                                         ? std::to_string(bits[i].first)
                                         : std::to_string(bits[i].last) + "-" + std::to_string(bits[i].first);
      EXPECT_EQ(high_first, rows[i].at("bits"));
      const std::string& value = rows[i].at("value");
      EXPECT_EQ(bits[i].value.has_value(), !value.empty());
      if (!value.empty()) {
        EXPECT_EQ(bits[i].value, Number(value));
      }
      EXPECT_EQ(bits[i].name, rows[i].at("name"));
      if (!NamesATable(rows[i].at("meaning"))) {
        EXPECT_EQ(bits[i].meaning, rows[i].at("meaning"));
      }
      EXPECT_EQ(Printed(bits[i].drive), rows[i].at("drive_access"));
      EXPECT_EQ(Printed(bits[i].ecat), rows[i].at("ecat_access"));
      EXPECT_EQ(bits[i].source, CitationOf(rows[i].at("source")));
    }
  }
}

TEST(BitsProfile, EventBitsAreThoseOfTheManuals) {
  ECAUDIT_NEEDS_TABLE("al_event_bits");
  for (const Family& family : Families()) {
    SCOPED_TRACE(family.profile);
    const auto rows = Table("al_event_bits", family);
    const auto& bits = BuiltinProfile(family.profile)->event_bits;
    ASSERT_EQ(bits.size(), rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      EXPECT_EQ(bits[i].address, Number(rows[i].at("register")));
      EXPECT_EQ(bits[i].printed_address.value_or(bits[i].address), Number(rows[i].at("register_printed")));
      EXPECT_EQ(Range(bits[i].first, bits[i].last), rows[i].at("bit"));
      EXPECT_EQ(bits[i].name, rows[i].at("name"));
      EXPECT_EQ(bits[i].meaning, rows[i].at("meaning"));
      EXPECT_EQ(Printed(bits[i].drive), rows[i].at("drive_access"));
      EXPECT_EQ(Printed(bits[i].ecat), rows[i].at("ecat_access"));
      EXPECT_EQ(bits[i].source, CitationOf(rows[i].at("source")));
    }
  }
}

TEST(BitsProfile, MisprintedEventAddressesAreCorrected) {
  for (const Family& family : Families()) {
    int corrected = 0;
    for (const RegisterBits& row : BuiltinProfile(family.profile)->event_bits) {
      if (!row.printed_address) continue;
      ++corrected;
      EXPECT_EQ(*row.printed_address, 0x0201);
      EXPECT_EQ(row.address, 0x0221);
      EXPECT_NE(row.note, "");
    }
    EXPECT_EQ(corrected, 2) << family.profile;
  }
}

}  // namespace
}  // namespace ecaudit::device
