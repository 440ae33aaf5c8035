#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "decoder/base/text.h"
#include "decoder/device/profile_registry.h"
#include "tests/unit/device/reference_tables.h"

namespace ecaudit::device {
namespace {

using ::testing::HasSubstr;

const ObjectDictionary& Dictionary(std::string_view name) {
  return *BuiltinProfile(name)->dictionary;
}

std::string TypesOf(const DictionaryObject& object) {
  std::string text;
  for (const DataType type : object.types) text += (text.empty() ? "" : "/") + std::string(DataTypeName(type));
  return text;
}

/// "U8/U32" in the spelling of DataTypeName().
std::string Spelled(const std::string& printed) {
  std::string text;
  for (std::size_t at = 0; at <= printed.size() && !printed.empty();) {
    const std::size_t slash = std::min(printed.find('/', at), printed.size());
    text += (text.empty() ? "" : "/") + std::string(DataTypeName(DataTypeFromName(printed.substr(at, slash - at))));
    at = slash + 1;
  }
  return text;
}

std::string AccessOf(const DictionaryObject& object) {
  if (object.constant) return "const";
  switch (object.access) {
    case Access::kRead:
      return "RO";
    case Access::kReadWrite:
      return "RW";
    case Access::kWrite:
      return "WO";
    default:
      return "";
  }
}

std::string MappableOf(const DictionaryObject& object) {
  static constexpr const char* kNames[] = {"", "no", "yes", "yes*"};
  return kNames[static_cast<std::size_t>(object.mappable)];
}

void CompareWithTable(std::string_view profile, std::string_view table) {
  const ObjectDictionary& dictionary = Dictionary(profile);
  const auto rows = Table(table);
  EXPECT_EQ(dictionary.objects.size(), rows.size());
  for (const test::CsvRow& row : rows) {
    SCOPED_TRACE(row.at("index") + ":" + row.at("subindex"));
    const auto index = static_cast<std::uint16_t>(std::stoul(row.at("index"), nullptr, 16));
    const std::string& type = row.at("data_type");
    const bool head = row.at("subindex").empty() && (type == "ARRAY" || type == "RECORD" || type == "STRUCT");
    const auto sub = static_cast<std::uint8_t>(row.at("subindex").empty() ? 0 : Number(row.at("subindex")));
    const DictionaryObject* found = head ? dictionary.FindIndex(index) : dictionary.Find(index, sub);
    ASSERT_NE(found, nullptr);
    EXPECT_EQ(found->head, head);
    if (!head) {
      EXPECT_EQ(found->subindex, sub);
    }
    if (const std::string& range = row.at("subindex_range"); !range.empty()) {
      const std::string end = range.substr(range.find("..") + 2);
      EXPECT_EQ(std::to_string(found->last_subindex), end == "n" ? "254" : end);
    } else if (!head) {
      EXPECT_EQ(found->last_subindex, sub);
    }
    EXPECT_EQ(found->printed_type.empty() ? TypesOf(*found) : found->printed_type,
              found->printed_type.empty() ? Spelled(type) : type);
    EXPECT_EQ(found->printed_access.empty() ? AccessOf(*found) : found->printed_access, row.at("access"));
    EXPECT_EQ(MappableOf(*found), row.at("pdo_map"));
    EXPECT_EQ(found->scale, row.at("float_scale"));
    EXPECT_EQ(found->name, row.at("description"));
    EXPECT_EQ(found->keyword, row.at("ascii_parameter"));
    EXPECT_EQ(found->source, CitationOf(row.at("source")));
  }
}

TEST(DictionaryProfile, MkdCDictionaryIsThatOfTheManual) {
  ECAUDIT_NEEDS_TABLE("object_dictionary_mkd_c");
  CompareWithTable("kollmorgen-mkd-c", "object_dictionary_mkd_c");
  EXPECT_TRUE(Dictionary("kollmorgen-mkd-c").complete);
}

TEST(DictionaryProfile, MkdNDictionaryIsThatOfTheManual) {
  ECAUDIT_NEEDS_TABLE("object_dictionary_mkd_n");
  CompareWithTable("kollmorgen-mkd-n", "object_dictionary_mkd_n");
  EXPECT_FALSE(Dictionary("kollmorgen-mkd-n").complete);  // our copy of the manual is cut
}

TEST(DictionaryProfile, ObjectsThatTheMappingSequenceWritesAreWritable) {
  const ObjectDictionary& mkd = Dictionary("kollmorgen-mkd-n");
  for (const int index : {0x1600, 0x1601, 0x1602, 0x1603, 0x1A00, 0x1A01, 0x1A02, 0x1A03, 0x1C12, 0x1C13}) {
    const DictionaryObject* count = mkd.Find(static_cast<std::uint16_t>(index), 0);
    ASSERT_NE(count, nullptr) << Hex(static_cast<std::uint64_t>(index));
    EXPECT_EQ(count->access, Access::kReadWrite);
    EXPECT_EQ(count->printed_access, "RO");
    EXPECT_NE(count->note, "");
  }
  for (const int index : {0x1C12, 0x1C13}) {
    const DictionaryObject* entry = mkd.Find(static_cast<std::uint16_t>(index), 4);
    ASSERT_NE(entry, nullptr);
    EXPECT_TRUE(entry->AllowsBits(4, 16));
    EXPECT_FALSE(entry->AllowsBits(4, 8));
    EXPECT_EQ(entry->printed_type, "U8");
  }
}

TEST(DictionaryProfile, RangesKnowTheTypeOfEachSubindex) {
  const DictionaryObject* mapping = Dictionary("kollmorgen-mkd-c").Find(0x1600, 8);
  ASSERT_NE(mapping, nullptr);
  EXPECT_EQ(mapping->TypeOf(0), DataType::kUnsigned8);
  EXPECT_EQ(mapping->TypeOf(8), DataType::kUnsigned32);
  EXPECT_TRUE(mapping->AllowsBits(0, 8));
  EXPECT_FALSE(mapping->AllowsBits(0, 32));
  EXPECT_FALSE(mapping->AllowsBits(1, 16));
  const DictionaryObject* communication = Dictionary("kollmorgen-mkd-c").Find(0x1800, 3);
  ASSERT_NE(communication, nullptr);  // "U8/16/32" over 0..5: which one is not printed
  EXPECT_EQ(communication->TypeOf(3), DataType::kUnknown);
  EXPECT_TRUE(communication->AllowsBits(3, 16));
  EXPECT_FALSE(communication->AllowsBits(3, 64));
  EXPECT_EQ(Dictionary("kollmorgen-mkd-c").Find(0x1600, 9), nullptr);
}

TEST(DictionaryProfile, StringsHaveNoFixedSize) {
  const DictionaryObject* name = Dictionary("kollmorgen-mkd-n").Find(0x1008, 0);
  ASSERT_NE(name, nullptr);
  EXPECT_TRUE(name->constant);
  EXPECT_TRUE(name->AllowsBits(0, 8 * 17));
}

TEST(DictionaryProfile, LookupsOutsideTheTableFindNothing) {
  const ObjectDictionary& mkd = Dictionary("kollmorgen-mkd-n");
  EXPECT_EQ(mkd.Find(0x0FFF, 0), nullptr);
  EXPECT_EQ(mkd.Find(0x1018, 5), nullptr);
  EXPECT_EQ(mkd.Find(0xFFFF, 0), nullptr);
  EXPECT_EQ(mkd.FindIndex(0x1019), nullptr);
  EXPECT_TRUE(mkd.FindIndex(0x1018)->head);
}

TEST(DictionaryProfile, AkdHasTheObjectsOfAllCoeDevicesOnly) {
  const ObjectDictionary& akd = Dictionary("kollmorgen-akd-2010");
  EXPECT_FALSE(akd.complete);
  ASSERT_NE(akd.Find(0x1018, 2), nullptr);
  EXPECT_EQ(akd.Find(0x1018, 2)->access, Access::kRead);
  EXPECT_EQ(akd.Find(0x3425, 0), nullptr);
}

TEST(DictionaryProfile, EmergencyCodesAreThoseOfTheManual) {
  ECAUDIT_NEEDS_TABLE("emcy_codes");
  for (const auto& [profile, table] :
       {std::pair{"kollmorgen-mkd-n", "mkd-drive"}, std::pair{"kollmorgen-mkd-c", "mkd-power-supply"}}) {
    SCOPED_TRACE(profile);
    const EmergencyTable& emergency = *BuiltinProfile(profile)->emergency;
    std::size_t count = 0;
    for (const test::CsvRow& row : Table("emcy_codes")) {
      if (row.at("family") != table) continue;
      ++count;
      SCOPED_TRACE(row.at("error_code"));
      const auto code = static_cast<std::uint16_t>(Number(row.at("error_code")));
      const EmergencyCode* found = emergency.Find(code);
      ASSERT_NE(found, nullptr);
      EXPECT_EQ(found->code, code);
      EXPECT_EQ(found->last_code, code);
      EXPECT_EQ(found->id, row.at("id").size() > 1 ? row.at("id") : "");
      static constexpr const char* kKinds[] = {"none", "fault", "warning"};
      EXPECT_EQ(kKinds[static_cast<std::size_t>(found->kind)], row.at("kind"));
      if (row.at("id") == "n243") {
        EXPECT_THAT(found->text, HasSubstr("sensor 3"));  // printed sensor 1
      } else {
        EXPECT_EQ(found->text, row.at("description"));
      }
      EXPECT_EQ(found->source, CitationOf(row.at("source")));
    }
    EXPECT_EQ(emergency.codes.size(), count);
  }
}

// The same number means different faults in the two tables.
TEST(DictionaryProfile, EmergencyCodesDependOnTheFamily) {
  EXPECT_EQ(BuiltinProfile("kollmorgen-mkd-n")->emergency_code(0x8780)->id, "F125");
  EXPECT_EQ(BuiltinProfile("kollmorgen-mkd-n")->emergency_code(0x55C1)->id, "F623");
  EXPECT_EQ(BuiltinProfile("kollmorgen-mkd-c")->emergency_code(0x55C1)->id, "F627");
  EXPECT_EQ(BuiltinProfile("kollmorgen-mkd-n")->emergency_code(0x0000)->kind, EmergencyKind::kNone);
  EXPECT_EQ(BuiltinProfile("kollmorgen-mkd-n")->emergency_code(0x1234), nullptr);
}

TEST(DictionaryProfile, WithoutAListTheClassesOfCia301Remain) {
  const DeviceDescription* pilz = BuiltinProfile("pilz-pmcprotego-d");
  ASSERT_NE(pilz->emergency_code(0x2310), nullptr);
  EXPECT_EQ(pilz->emergency_code(0x2310)->text, "current, device output side");
  EXPECT_EQ(pilz->emergency_code(0x2F00)->text, "current");
  EXPECT_EQ(pilz->emergency_code(0xB000), nullptr);
}

TEST(DictionaryProfile, TypeNamesOfManualsAndEsiFilesAreUnderstood) {
  EXPECT_EQ(DataTypeFromName("U32"), DataType::kUnsigned32);
  EXPECT_EQ(DataTypeFromName("UDINT"), DataType::kUnsigned32);
  EXPECT_EQ(DataTypeFromName("DINT"), DataType::kInteger32);
  EXPECT_EQ(DataTypeFromName("STRING(20)"), DataType::kVisibleString);
  EXPECT_EQ(DataTypeFromName("DT1018"), DataType::kUnknown);
  EXPECT_EQ(DataTypeFromName(""), DataType::kUnknown);
  EXPECT_EQ(DataTypeFromCode(0x0007), DataType::kUnsigned32);
  EXPECT_EQ(DataTypeFromCode(0x0004), DataType::kInteger32);
  EXPECT_EQ(DataTypeFromCode(0x0009), DataType::kVisibleString);
  EXPECT_EQ(DataTypeFromCode(0xFFFF), DataType::kUnknown);
}

}  // namespace
}  // namespace ecaudit::device
