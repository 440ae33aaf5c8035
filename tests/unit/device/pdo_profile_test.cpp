#include <map>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "decoder/base/text.h"
#include "decoder/device/profile_registry.h"
#include "tests/unit/device/reference_tables.h"

namespace ecaudit::device {
namespace {

/// The MKD tables of PDOs and cyclic objects belong to the drive (MKD-N), not to the power supply.
std::vector<Family> PdoFamilies() {
  std::vector<Family> families;
  for (const Family& family : Families()) {
    if (family.profile != "kollmorgen-mkd-c") families.push_back(family);
  }
  return families;
}

const PdoDescription& Pdo(std::string_view name) {
  return BuiltinProfile(name)->pdo;
}

std::string DirectionName(PdoDirection direction) {
  return direction == PdoDirection::kRx ? "rx" : "tx";
}

std::string ConfidenceName(Confidence confidence) {
  static constexpr const char* kNames[] = {"printed", "resolved", "ambiguous", "inferred"};
  return kNames[static_cast<std::size_t>(confidence)];
}

TEST(PdoProfile, FixedPdosAreThoseOfTheManuals) {
  ECAUDIT_NEEDS_TABLE("fixed_pdos");
  for (const Family& family : PdoFamilies()) {
    SCOPED_TRACE(family.profile);
    const PdoDescription& pdo = Pdo(family.profile);
    std::size_t entries = 0;
    std::map<std::string, std::size_t> indices;
    for (const test::CsvRow& row : Table("fixed_pdos", family)) {
      SCOPED_TRACE(row.at("pdo_index") + " entry " + row.at("position"));
      ++indices[row.at("pdo_index")];
      const PdoContent* found = pdo.FindFixed(static_cast<std::uint16_t>(Number(row.at("pdo_index"))));
      ASSERT_NE(found, nullptr);
      EXPECT_EQ(DirectionName(found->direction), row.at("direction"));
      EXPECT_NE(found->source.find(CitationOf(row.at("source"))), std::string::npos);
      if (row.at("object_index").empty()) {
        EXPECT_FALSE(found->known);
        EXPECT_TRUE(found->entries.empty());
        continue;
      }
      ++entries;
      EXPECT_TRUE(found->known);
      const std::size_t position = Number(row.at("position"));
      ASSERT_LE(position, found->entries.size());
      const PdoEntry& entry = found->entries[position - 1];
      EXPECT_EQ(entry.index, Number(row.at("object_index")));
      EXPECT_EQ(entry.subindex, Number(row.at("subindex")));
      EXPECT_EQ(entry.bits, Number(row.at("bits")));
      EXPECT_EQ(entry.name, row.at("signal_name"));
      EXPECT_EQ(ConfidenceName(entry.confidence), row.at("confidence"));
      std::uint32_t offset = 0;
      for (std::size_t i = 0; i + 1 < position; ++i) offset += found->entries[i].bits;
      EXPECT_EQ(offset, 8 * Number(row.at("byte_offset")));
    }
    EXPECT_EQ(pdo.fixed.size(), indices.size());
    std::size_t held = 0;
    for (const PdoContent& content : pdo.fixed) held += content.entries.size();
    EXPECT_EQ(held, entries);
  }
}

TEST(PdoProfile, SelectablePdosAreThoseOfTheManuals) {
  ECAUDIT_NEEDS_TABLE("fixed_pdo_selectable");
  for (const Family& family : PdoFamilies()) {
    SCOPED_TRACE(family.profile);
    const PdoDescription& pdo = Pdo(family.profile);
    const auto rows = Table("fixed_pdo_selectable", family);
    // Revision D of the AKD manual lost 0x1B20, which edition B and real drives have.
    const std::size_t added = family.profile == "kollmorgen-akd-2011" ? 1 : 0;
    EXPECT_EQ(pdo.selectable.size(), rows.size() + added);
    for (const test::CsvRow& row : rows) {
      const PdoDirection direction = row.at("direction") == "rx" ? PdoDirection::kRx : PdoDirection::kTx;
      const auto index = static_cast<std::uint16_t>(Number(row.at("pdo_index")));
      const bool example = row.at("notes").find("only in the mailbox example") != std::string::npos;
      EXPECT_EQ(pdo.IsAssignable(direction, index), !example) << row.at("pdo_index");
      EXPECT_EQ(direction == PdoDirection::kRx ? pdo.rx_assign : pdo.tx_assign,
                Number(row.at("assign_object").substr(0, 6)));
      const auto found = std::find_if(pdo.selectable.begin(), pdo.selectable.end(),
                                      [&](const SelectablePdo& s) { return s.index == index; });
      ASSERT_NE(found, pdo.selectable.end());
      EXPECT_EQ(found->source, CitationOf(row.at("source")));
    }
  }
}

TEST(PdoProfile, CyclicObjectsAreThoseOfTheManuals) {
  ECAUDIT_NEEDS_TABLE("cyclic_objects");
  for (const Family& family : PdoFamilies()) {
    SCOPED_TRACE(family.profile);
    const auto rows = Table("cyclic_objects", family);
    const auto& cyclic = Pdo(family.profile).cyclic;
    ASSERT_EQ(cyclic.size(), rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      EXPECT_EQ(DirectionName(cyclic[i].direction), rows[i].at("direction"));
      EXPECT_EQ(cyclic[i].index, Number(rows[i].at("object_index")));
      EXPECT_EQ(cyclic[i].subindex, Number(rows[i].at("subindex")));
      EXPECT_EQ(DataTypeName(cyclic[i].type), rows[i].at("type"));
      EXPECT_EQ(cyclic[i].bits, Number(rows[i].at("bits")));
      EXPECT_EQ(cyclic[i].name, rows[i].at("name"));
      EXPECT_EQ(cyclic[i].source, CitationOf(rows[i].at("source")));
    }
  }
}

TEST(PdoProfile, MappingRulesAreThoseOfTheManuals) {
  ECAUDIT_NEEDS_TABLE("flexible_mapping_rules");
  for (const Family& family : Families()) {
    SCOPED_TRACE(family.profile);
    const auto rows = Table("flexible_mapping_rules", family);
    const auto& rules = Pdo(family.profile).rules;
    ASSERT_EQ(rules.size(), rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      EXPECT_EQ(rules[i].rule, rows[i].at("rule"));
      EXPECT_EQ(rules[i].value, rows[i].at("value"));
      EXPECT_EQ(rules[i].source, CitationOf(rows[i].at("source")));
    }
  }
}

// MKD 4.6: four modules of eight bytes, even length, 32 bytes for Tx; 20 printed for Rx.
TEST(PdoProfile, FlexibleMappingHasNumbers) {
  for (const char* name : {"kollmorgen-mkd-n", "kollmorgen-mkd-c"}) {
    ASSERT_TRUE(Pdo(name).flexible);
    const FlexibleMapping& flexible = *Pdo(name).flexible;
    EXPECT_EQ(flexible.max_pdos.value, 4U);
    EXPECT_EQ(flexible.max_bytes_per_pdo.value, 8U);
    EXPECT_EQ(flexible.even_length.value, true);
    ASSERT_EQ(flexible.max_rx_bytes.size(), 2U);
    EXPECT_EQ(flexible.max_rx_bytes[0].bytes, 20U);
    EXPECT_EQ(flexible.max_rx_bytes[1].bytes, 32U);
    EXPECT_EQ(flexible.max_rx_bytes[1].basis, Basis::kInferred);
    ASSERT_EQ(flexible.max_tx_bytes.size(), 1U);
    EXPECT_EQ(flexible.max_tx_bytes[0].bytes, 32U);
    EXPECT_TRUE(Pdo(name).IsAssignable(PdoDirection::kRx, 0x1603));
    EXPECT_FALSE(Pdo(name).IsAssignable(PdoDirection::kRx, 0x1604));
    EXPECT_FALSE(Pdo(name).IsAssignable(PdoDirection::kTx, 0x1600));
  }
  EXPECT_FALSE(Pdo("kollmorgen-akd-2010").flexible);
  EXPECT_FALSE(Pdo("generic").flexible);
}

TEST(PdoProfile, MappabilityComesFromDictionaryAndCyclicObjects) {
  const DeviceDescription& mkd = *BuiltinProfile("kollmorgen-mkd-n");
  EXPECT_EQ(mkd.MappableIn(PdoDirection::kRx, 0x6040, 0), Mappable::kYes);
  EXPECT_EQ(mkd.MappableIn(PdoDirection::kTx, 0x6040, 0), Mappable::kNo);  // write only
  EXPECT_EQ(mkd.MappableIn(PdoDirection::kTx, 0x6041, 0), Mappable::kYes);
  EXPECT_EQ(mkd.MappableIn(PdoDirection::kRx, 0x6041, 0), Mappable::kNo);
  EXPECT_EQ(mkd.MappableIn(PdoDirection::kRx, 0x3497, 0), Mappable::kYes);  // missing in the dictionary
  EXPECT_EQ(mkd.MappableIn(PdoDirection::kTx, 0x1018, 1), Mappable::kNo);
  EXPECT_EQ(mkd.MappableIn(PdoDirection::kTx, 0x6091, 1), Mappable::kUnknown);  // behind the end of our copy
  EXPECT_EQ(mkd.MappableIn(PdoDirection::kRx, 0x0002, 0), Mappable::kYes);      // padding
  EXPECT_EQ(mkd.MappableIn(PdoDirection::kRx, 0x0000, 0), Mappable::kYes);
  EXPECT_EQ(mkd.MappableIn(PdoDirection::kTx, 0x2002, 4), Mappable::kYes);
  const DeviceDescription& supply = *BuiltinProfile("kollmorgen-mkd-c");
  EXPECT_EQ(supply.MappableIn(PdoDirection::kTx, 0x3001, 0), Mappable::kYes);
  EXPECT_EQ(supply.MappableIn(PdoDirection::kTx, 0x5000, 0), Mappable::kNo);  // its table is complete
}

TEST(PdoProfile, TypeOfPdosMatchTheirSize) {
  EXPECT_EQ(Pdo("kollmorgen-mkd-n").FindFixed(0x1701)->bits(), 48U);
  EXPECT_EQ(Pdo("kollmorgen-mkd-n").FindFixed(0x1B20)->bits(), 256U);
  EXPECT_EQ(Pdo("kollmorgen-akd-2011").FindFixed(0x1B03)->known, false);
  EXPECT_EQ(Pdo("kollmorgen-mkd-n").FindFixed(0x1600), nullptr);
}

}  // namespace
}  // namespace ecaudit::device
