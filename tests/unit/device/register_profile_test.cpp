#include <string>

#include <gtest/gtest.h>

#include "decoder/base/text.h"
#include "decoder/device/profile_registry.h"
#include "tests/unit/device/reference_tables.h"

namespace ecaudit::device {
namespace {

TEST(RegisterProfile, RegistersAreThoseOfTheManuals) {
  ECAUDIT_NEEDS_TABLE("registers");
  for (const Family& family : Families()) {
    SCOPED_TRACE(family.profile);
    const DeviceDescription* profile = BuiltinProfile(family.profile);
    ASSERT_NE(profile, nullptr);
    for (const test::CsvRow& row : Table("registers", family)) {
      SCOPED_TRACE(row.at("address"));
      const auto address = static_cast<EscAddress>(Number(row.at("address")));
      const RegisterRight* right = profile->register_right(address);
      ASSERT_NE(right, nullptr);
      EXPECT_EQ(right->address, address);
      EXPECT_EQ(right->name, row.at("name"));
      EXPECT_EQ(right->printed_length.empty() ? std::to_string(right->length) : right->printed_length,
                row.at("length"));
      const auto printed = [](Access access) {
        return access == Access::kReadWrite ? "R/W" : access == Access::kRead ? "R/O" : "";
      };
      EXPECT_EQ(right->printed_ecat.empty() ? printed(right->ecat) : right->printed_ecat, row.at("ecat_access"));
      EXPECT_EQ(printed(right->drive), row.at("drive_access"));
      EXPECT_EQ(right->source, CitationOf(row.at("source")));
      EXPECT_EQ(right->buffer, address >= 0x1000);
    }
  }
}

TEST(RegisterProfile, AlEventRequestIsReadOnlyThoughPrintedWritable) {
  for (const Family& family : Families()) {
    const RegisterRight* right = BuiltinProfile(family.profile)->register_right(0x0222);
    ASSERT_NE(right, nullptr) << family.profile;
    EXPECT_EQ(right->address, 0x0220);
    EXPECT_TRUE(right->read_only());
    EXPECT_EQ(right->printed_ecat, "R/W");
    EXPECT_NE(right->note, "");
  }
}

TEST(RegisterProfile, WhatTheManualDoesNotNameComesFromTheStandard) {
  const DeviceDescription* akd = BuiltinProfile("kollmorgen-akd-2010");
  ASSERT_NE(akd, nullptr);
  ASSERT_NE(akd->register_right(0x0110), nullptr);
  EXPECT_TRUE(akd->register_right(0x0110)->read_only());
  EXPECT_FALSE(akd->register_right(0x0120)->read_only());
  EXPECT_TRUE(akd->register_right(0x0135)->read_only());
  EXPECT_EQ(akd->register_right(0x0F00), nullptr);
}

// The manuals give the master write access to whole sync managers, the standard not to their status bytes.
TEST(RegisterProfile, TheManualReplacesTheStandardWhereBothSpeak) {
  EXPECT_TRUE(BuiltinProfile("generic")->register_right(0x080D)->read_only());
  EXPECT_EQ(BuiltinProfile("generic")->register_right(0x080D)->name, "SyncManager 1 status");
  EXPECT_FALSE(BuiltinProfile("kollmorgen-akd-2010")->register_right(0x080D)->read_only());
}

TEST(RegisterProfile, RowsAreSortedAndDoNotOverlap) {
  for (const std::string& name : BuiltinProfileNames()) {
    const auto& rows = BuiltinProfile(name)->registers;
    ASSERT_FALSE(rows.empty());
    for (std::size_t i = 1; i < rows.size(); ++i) {
      EXPECT_GE(rows[i].address, rows[i - 1].address + rows[i - 1].length) << name << " " << Hex(rows[i].address);
    }
  }
}

}  // namespace
}  // namespace ecaudit::device
