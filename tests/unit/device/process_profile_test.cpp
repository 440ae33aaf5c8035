/// Latch words, synchronisation, mailboxes and the remaining facts of the profiles.
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "decoder/base/text.h"
#include "decoder/device/profile_registry.h"
#include "tests/unit/device/reference_tables.h"

namespace ecaudit::device {
namespace {

using ::testing::HasSubstr;

std::string RangeText(unsigned first, unsigned last) {
  return first == last ? std::to_string(first) : std::to_string(first) + "-" + std::to_string(last);
}

TEST(LatchProfile, WordsAreThoseOfTheManuals) {
  ECAUDIT_NEEDS_TABLE("latch_control");
  for (const Family& family : Families()) {
    if (family.profile == "kollmorgen-mkd-c") continue;  // no drive
    SCOPED_TRACE(family.profile);
    ASSERT_TRUE(BuiltinProfile(family.profile)->latch);
    const LatchDescription& latch = *BuiltinProfile(family.profile)->latch;
    for (const bool control : {true, false}) {
      const auto rows = Table(control ? "latch_control" : "latch_status", family);
      const auto& fields = control ? latch.control : latch.status;
      ASSERT_EQ(fields.size(), rows.size());
      for (std::size_t i = 0; i < rows.size(); ++i) {
        EXPECT_EQ(RangeText(fields[i].first, fields[i].last), rows[i].at("bits"));
        EXPECT_EQ(fields[i].mask, Number(rows[i].at("mask")));
        EXPECT_EQ(fields[i].reserved, rows[i].at("value").empty());
        if (!rows[i].at("value").empty()) {
          EXPECT_EQ(fields[i].value, Number(rows[i].at("value")));
        }
        EXPECT_EQ(fields[i].meaning, rows[i].at("meaning"));
        const std::string input =
            fields[i].input == 0 ? "" : "state of digital input " + std::to_string(fields[i].input);
        EXPECT_EQ(input, rows[i].at("meaning").starts_with("state of digital") ? rows[i].at("meaning") : "");
        EXPECT_EQ(fields[i].source, CitationOf(rows[i].at("source")));
      }
    }
  }
  EXPECT_FALSE(BuiltinProfile("kollmorgen-mkd-c")->latch);
  EXPECT_FALSE(BuiltinProfile("generic")->latch);
}

TEST(LatchProfile, ReservedBitsAndSelectorsDifferByFamily) {
  const LatchDescription& akd = *BuiltinProfile("kollmorgen-akd-2010")->latch;
  EXPECT_EQ(akd.reserved_control, 0xE0F0);  // 4 to 7, 13 to 15
  EXPECT_NE(akd.FindSelector(4), nullptr);
  EXPECT_EQ(akd.FindSelector(5), nullptr);
  EXPECT_EQ(akd.FindSelector(0), nullptr);
  const LatchDescription& pilz = *BuiltinProfile("pilz-pmcprotego-d")->latch;
  EXPECT_EQ(pilz.reserved_control, 0xE0E0);  // 5 to 7, 13 to 15
  ASSERT_NE(pilz.FindSelector(5), nullptr);
  EXPECT_EQ(pilz.FindSelector(5)->enable, 0x0010);
  EXPECT_EQ(pilz.FindSelector(5)->valid, 0x0010);
}

TEST(LatchProfile, FieldsAreCutFromTheWords) {
  const LatchDescription& akd = *BuiltinProfile("kollmorgen-akd-2010")->latch;
  EXPECT_EQ(akd.Selector(0x0401), 4);
  EXPECT_EQ(akd.Selector(0x1F00), 31);
  EXPECT_EQ(akd.Acknowledge(0xF30F), 3);  // bits 12 to 15 are inputs
}

TEST(LatchProfile, EdgesAgreeWithTheRowsOfTheWords) {
  for (const Family& family : Families()) {
    const auto& latch = BuiltinProfile(family.profile)->latch;
    if (!latch) continue;
    for (const LatchEdge& edge : latch->edges) {
      SCOPED_TRACE(std::string(family.profile) + " " + edge.name);
      const auto row = [&](const std::vector<LatchField>& fields, std::uint16_t mask, std::uint16_t value) {
        for (const LatchField& field : fields) {
          if (field.mask == mask && field.value == value) return field.meaning;
        }
        return std::string("no such row");
      };
      EXPECT_THAT(row(latch->control, edge.enable, edge.enable), HasSubstr(edge.name));
      EXPECT_THAT(row(latch->status, edge.valid, edge.valid), HasSubstr(edge.name));
      const auto selector = static_cast<std::uint16_t>(edge.selector << 8U);
      EXPECT_THAT(row(latch->status, latch->acknowledge_mask, selector), HasSubstr(edge.name));
      EXPECT_NE(row(latch->control, latch->selector_mask, selector), "no such row");
    }
  }
}

// MKD 4.7 and 5.3.3: 20A0h to 20A3h by latch and edge, 20A6h and 20A7h by latch.
TEST(LatchProfile, PositionObjectsOfMkd) {
  const LatchEdge* falling2 = BuiltinProfile("kollmorgen-mkd-n")->latch->FindSelector(4);
  ASSERT_NE(falling2, nullptr);
  ASSERT_EQ(falling2->positions.size(), 2U);
  EXPECT_EQ(falling2->positions[0].index, 0x20A3);
  EXPECT_EQ(falling2->positions[1].index, 0x20A7);
  EXPECT_TRUE(BuiltinProfile("kollmorgen-mkd-n")->latch->other_positions.empty());
  EXPECT_EQ(BuiltinProfile("pilz-pmcprotego-d")->latch->other_positions.size(), 6U);
}

TEST(SyncProfile, ParametersAreThoseOfTheManuals) {
  ECAUDIT_NEEDS_TABLE("sync_parameters");
  for (const Family& family : Families()) {
    SCOPED_TRACE(family.profile);
    const auto rows = Table("sync_parameters", family);
    const auto& parameters = BuiltinProfile(family.profile)->sync.parameters;
    ASSERT_EQ(parameters.size(), rows.size());
    for (std::size_t i = 0; i < rows.size(); ++i) {
      EXPECT_EQ(parameters[i].parameter, rows[i].at("parameter"));
      EXPECT_EQ(parameters[i].object, rows[i].at("object"));
      EXPECT_EQ(parameters[i].unit, rows[i].at("unit"));
      EXPECT_EQ(parameters[i].meaning, rows[i].at("meaning"));
      EXPECT_EQ(parameters[i].default_value, rows[i].at("default"));
      EXPECT_EQ(parameters[i].limit, rows[i].at("limit"));
      EXPECT_EQ(parameters[i].source, CitationOf(rows[i].at("source")));
    }
  }
}

TEST(SyncProfile, LimitsInNumbers) {
  for (const char* name : {"kollmorgen-akd-2010", "kollmorgen-akd-2011", "kollmorgen-mkd-c", "kollmorgen-mkd-n"}) {
    SCOPED_TRACE(name);
    const SyncDescription& sync = BuiltinProfile(name)->sync;
    EXPECT_EQ(sync.cycle_base.value, 62'500);
    EXPECT_EQ(sync.cycle_min.value, 250'000);
    EXPECT_EQ(sync.pll_range_ppm.value, 4800U);
    EXPECT_EQ(sync.pll_step.value, 300);
    EXPECT_EQ(sync.lost_after_missing.value, 7U);
    EXPECT_FALSE(sync.lost_after_jitter);
    EXPECT_EQ(sync.FindJitter(1'000'000), nullptr);
    EXPECT_EQ(sync.cycle_by_60c2.value, std::string_view(name) != "kollmorgen-mkd-c");
  }
  const SyncDescription& pilz = BuiltinProfile("pilz-pmcprotego-d")->sync;
  EXPECT_EQ(pilz.cycle_base.value, 250'000);
  EXPECT_EQ(pilz.pll_range_ppm.value, 1000U);
  EXPECT_EQ(pilz.lost_after_jitter.value, 2U);
  EXPECT_FALSE(pilz.lost_after_missing);
  EXPECT_THAT(pilz.lost_faults, ::testing::ElementsAre("F28"));
  EXPECT_THAT(pilz.lost_warnings, ::testing::ElementsAre("n17"));
  const SyncDescription& generic = BuiltinProfile("generic")->sync;
  EXPECT_FALSE(generic.cycle_min);
  EXPECT_FALSE(generic.pll_range_ppm);
}

TEST(SyncProfile, ParametersThatSdoShowsOrTheUserGives) {
  // Objects are printed in the dictionary of the MKD only (5.3.3); the AKD manuals name the parameters without them.
  for (const char* name : {"kollmorgen-akd-2010", "kollmorgen-akd-2011", "kollmorgen-mkd-c", "kollmorgen-mkd-n"}) {
    SCOPED_TRACE(name);
    const SyncDescription& sync = BuiltinProfile(name)->sync;
    const bool inferred = std::string_view(name).starts_with("kollmorgen-akd");
    ASSERT_EQ(sync.DriveParameters().size(), 7U);
    EXPECT_EQ(sync.cycle_count->keyword, "FBUS.SAMPLEPERIOD");
    EXPECT_FALSE(sync.cycle_count->object);
    EXPECT_EQ(sync.sync_distance->keyword, "FBUS.SYNCDIST");
    EXPECT_EQ(sync.sync_distance->object->index, 0x3496);
    EXPECT_EQ(sync.sync_distance->object->subindex, 1);
    EXPECT_EQ(sync.sync_distance->object_inferred, inferred);
    EXPECT_EQ(sync.sync_actual->object->subindex, 2);
    EXPECT_EQ(sync.sync_window->object->subindex, 3);
    EXPECT_EQ(sync.pll_threshold->object->index, 0x50B1);
    EXPECT_EQ(sync.supervision->keyword, "FBUS.PARAM04");
    EXPECT_EQ(sync.supervision->object->index, 0x36E8);
    EXPECT_TRUE(sync.supervision->IsOn(1));
    EXPECT_FALSE(sync.supervision->IsOn(0));
    EXPECT_EQ(sync.pll_switch->keyword, "FBUS.PARAM02");
    EXPECT_EQ(sync.pll_switch->object->index, 0x36E6);
    EXPECT_EQ(sync.pll_switch->object_inferred, inferred);
    EXPECT_FALSE(sync.pll_switch->IsOn(2));
    EXPECT_TRUE(sync.pll_switch->IsOn(3));
    EXPECT_EQ(sync.pll_switch->OnValue(2), 3);
  }
  const SyncDescription& pilz = BuiltinProfile("pilz-pmcprotego-d")->sync;
  ASSERT_EQ(pilz.DriveParameters().size(), 2U);
  EXPECT_EQ(pilz.supervision->keyword, "SERCSET");
  EXPECT_TRUE(pilz.supervision->IsOn(0));
  EXPECT_FALSE(pilz.supervision->IsOn(1 << 17));
  EXPECT_EQ(pilz.supervision->OnValue(1 << 17 | 1 << 19), 1 << 19);
  EXPECT_TRUE(pilz.supervision->IsOn(1 << 19));
  EXPECT_EQ(pilz.cycle_count->keyword, "PTBASE");
  EXPECT_TRUE(BuiltinProfile("generic")->sync.DriveParameters().empty());
}

TEST(SyncProfile, SwitchWithoutBitsIsOnWithAnyValueButZero) {
  const device::DriveParameter parameter;
  EXPECT_FALSE(parameter.IsOn(0));
  EXPECT_TRUE(parameter.IsOn(2));
  EXPECT_EQ(parameter.OnValue(0), 1);
  EXPECT_EQ(parameter.OnValue(2), 2);
}

TEST(SyncProfile, PilzJitterDependsOnTheCycle) {
  const SyncDescription& pilz = BuiltinProfile("pilz-pmcprotego-d")->sync;
  EXPECT_EQ(pilz.FindJitter(250'000)->jitter, 70'000);
  EXPECT_EQ(pilz.FindJitter(750'000)->jitter, 70'000);
  EXPECT_FALSE(pilz.FindJitter(750'000)->undocumented);
  EXPECT_EQ(pilz.FindJitter(750'001)->jitter, 70'000);
  EXPECT_TRUE(pilz.FindJitter(750'001)->undocumented);
  EXPECT_TRUE(pilz.FindJitter(999'999)->undocumented);
  EXPECT_EQ(pilz.FindJitter(1'000'000)->jitter, 320'000);
  EXPECT_EQ(pilz.FindJitter(8'000'000)->jitter, 320'000);
}

TEST(MailboxProfile, SyncManagersFollowTheRegisterTable) {
  for (const Family& family : Families()) {
    SCOPED_TRACE(family.profile);
    const MailboxDescription& mailbox = BuiltinProfile(family.profile)->mailbox;
    ASSERT_EQ(mailbox.sync_managers.size(), 4U);
    EXPECT_EQ(mailbox.FindSyncManager(0)->start, 0x1800);
    EXPECT_EQ(mailbox.FindSyncManager(1)->start, 0x1C00);
    EXPECT_EQ(mailbox.FindSyncManager(2)->start, 0x1100);
    EXPECT_EQ(mailbox.FindSyncManager(3)->start, 0x1140);
    EXPECT_EQ(mailbox.FindSyncManager(2)->max_length, 64U);
    EXPECT_EQ(mailbox.FindSyncManager(3)->max_length, family.profile == "pilz-pmcprotego-d" ? 72U : 64U);
    EXPECT_TRUE(mailbox.FindSyncManager(0)->mailbox_mode && mailbox.FindSyncManager(0)->master_writes);
    EXPECT_TRUE(mailbox.FindSyncManager(1)->mailbox_mode && !mailbox.FindSyncManager(1)->master_writes);
    EXPECT_TRUE(!mailbox.FindSyncManager(2)->mailbox_mode && mailbox.FindSyncManager(2)->master_writes);
    EXPECT_TRUE(!mailbox.FindSyncManager(3)->mailbox_mode && !mailbox.FindSyncManager(3)->master_writes);
    EXPECT_EQ(mailbox.FindSyncManager(4), nullptr);
  }
  EXPECT_FALSE(BuiltinProfile("generic")->mailbox.FindSyncManager(0)->start);
}

/// Rows of the one page of the AKD user guide stand beside those of the AKD manual they agree with.
void ExpectUserGuideAgrees(std::string_view table, const std::vector<std::string>& columns) {
  const auto manual = Table(table, Family{"", {"akd_d"}});
  for (const test::CsvRow& row : Table(table, Family{"", {"akd_ug"}})) {
    const bool found = std::any_of(manual.begin(), manual.end(), [&](const test::CsvRow& other) {
      return std::all_of(columns.begin(), columns.end(),
                         [&](const std::string& column) { return row.at(column) == other.at(column); });
    });
    EXPECT_TRUE(found) << table << " " << row.at(columns[0]) << " " << row.at(columns[1]);
  }
}

TEST(MailboxProfile, TablesAreThoseOfTheManuals) {
  ECAUDIT_NEEDS_TABLE("mailbox_layout");
  for (const Family& family : Families()) {
    SCOPED_TRACE(family.profile);
    const MailboxDescription& mailbox = BuiltinProfile(family.profile)->mailbox;
    const auto sizes = Table("mailbox_sizes", family);
    ASSERT_EQ(mailbox.sizes.size(), sizes.size());
    for (std::size_t i = 0; i < sizes.size(); ++i) {
      EXPECT_EQ(mailbox.sizes[i].direction, sizes[i].at("direction"));
      EXPECT_EQ(mailbox.sizes[i].bytes, Number(sizes[i].at("size")));
      EXPECT_EQ(mailbox.sizes[i].start ? Hex(*mailbox.sizes[i].start) : "",
                sizes[i].at("start_address").empty() ? "" : Hex(Number(sizes[i].at("start_address"))));
      EXPECT_THAT(mailbox.sizes[i].source, HasSubstr(CitationOf(sizes[i].at("source"))));
    }
    for (const test::CsvRow& row : Table("mailbox_types", family)) {
      const MailboxProtocol* protocol = mailbox.FindProtocol(static_cast<std::uint8_t>(Number(row.at("value"))));
      ASSERT_NE(protocol, nullptr);
      EXPECT_EQ(protocol->name, row.at("meaning"));
      // The MKD manual calls EoE reserved and describes it elsewhere.
      const bool described = row.at("notes").find("is supported by this family") != std::string::npos;
      EXPECT_EQ(protocol->reserved, row.at("notes").find("reserved") == 0 && !described);
      EXPECT_THAT(protocol->source, HasSubstr(CitationOf(row.at("source"))));
    }
    const auto services = Table("coe_types", family);
    ASSERT_EQ(mailbox.coe_services.size(), services.size());
    for (std::size_t i = 0; i < services.size(); ++i) {
      EXPECT_EQ(RangeText(mailbox.coe_services[i].first, mailbox.coe_services[i].last), services[i].at("value"));
      EXPECT_EQ(mailbox.coe_services[i].meaning, services[i].at("meaning"));
    }
    const auto commands = Table("sdo_command_bytes", family);
    ASSERT_EQ(mailbox.sdo_commands.size(), commands.size());
    for (std::size_t i = 0; i < commands.size(); ++i) {
      EXPECT_EQ(mailbox.sdo_commands[i].request, commands[i].at("direction") == "out");
      EXPECT_EQ(mailbox.sdo_commands[i].value, Number(commands[i].at("byte")));
      EXPECT_EQ(mailbox.sdo_commands[i].meaning, commands[i].at("meaning"));
      const auto bytes = mailbox.sdo_commands[i].data_bytes;
      EXPECT_EQ(bytes ? std::to_string(*bytes) : "", commands[i].at("data_bytes"));
    }
    const auto layout = Table("mailbox_layout", family);
    ASSERT_EQ(mailbox.layout.size(), layout.size());
    for (std::size_t i = 0; i < layout.size(); ++i) {
      EXPECT_EQ(mailbox.layout[i].request, layout[i].at("direction") == "out");
      EXPECT_EQ(mailbox.layout[i].byte, Number(layout[i].at("byte")));
      const std::string high_first =
          mailbox.layout[i].first == mailbox.layout[i].last
              ? std::to_string(mailbox.layout[i].first)
              : std::to_string(mailbox.layout[i].last) + "-" + std::to_string(mailbox.layout[i].first);
      EXPECT_EQ(high_first, layout[i].at("bits"));
      if (!NamesATable(layout[i].at("meaning"))) {
        EXPECT_EQ(mailbox.layout[i].meaning, layout[i].at("meaning"));
      }
    }
    const auto example = Table("mailbox_example", family);
    ASSERT_EQ(mailbox.example.size(), example.size());
    for (std::size_t i = 0; i < example.size(); ++i) {
      EXPECT_EQ(mailbox.example[i].request, example[i].at("direction") == "out");
      EXPECT_EQ(mailbox.example[i].byte, Number(example[i].at("byte")));
      EXPECT_EQ(mailbox.example[i].value, Number(example[i].at("value")));
      EXPECT_EQ(mailbox.example[i].meaning, example[i].at("meaning"));
    }
  }
  ExpectUserGuideAgrees("mailbox_types", {"value", "meaning"});
  ExpectUserGuideAgrees("coe_types", {"value", "meaning"});
  ExpectUserGuideAgrees("sdo_command_bytes", {"byte", "direction", "meaning", "data_bytes"});
  ExpectUserGuideAgrees("mailbox_layout", {"byte", "bits", "direction", "meaning"});
  ExpectUserGuideAgrees("mailbox_sizes", {"direction", "start_address", "size"});
}

TEST(MailboxProfile, ProtocolsBesideTheListCarryTheirReason) {
  EXPECT_EQ(BuiltinProfile("kollmorgen-akd-2010")->mailbox.FindProtocol(4), nullptr);
  ASSERT_NE(BuiltinProfile("kollmorgen-akd-2011")->mailbox.FindProtocol(4), nullptr);
  EXPECT_NE(BuiltinProfile("kollmorgen-akd-2011")->mailbox.FindProtocol(4)->note, "");
  EXPECT_FALSE(BuiltinProfile("kollmorgen-mkd-n")->mailbox.FindProtocol(2)->reserved);
  EXPECT_TRUE(BuiltinProfile("kollmorgen-akd-2010")->mailbox.FindProtocol(2)->reserved);
}

TEST(FactsProfile, TablesAreThoseOfTheManuals) {
  ECAUDIT_NEEDS_TABLE("other_facts");
  for (const Family& family : Families()) {
    SCOPED_TRACE(family.profile);
    const DeviceDescription& profile = *BuiltinProfile(family.profile);
    const auto parameters = Table("fbus_params", family);
    ASSERT_EQ(profile.fieldbus_parameters.size(), parameters.size());
    for (std::size_t i = 0; i < parameters.size(); ++i) {
      const FieldbusParameter& parameter = profile.fieldbus_parameters[i];
      EXPECT_EQ(parameter.parameter, parameters[i].at("parameter"));
      EXPECT_EQ(parameter.bit ? std::to_string(*parameter.bit) : "", parameters[i].at("bit"));
      EXPECT_EQ(parameter.value ? std::to_string(*parameter.value) : "", parameters[i].at("value"));
      EXPECT_EQ(parameter.meaning, parameters[i].at("meaning"));
      EXPECT_EQ(parameter.source, CitationOf(parameters[i].at("source")));
    }
    const auto limits = Table("limits", family);
    ASSERT_EQ(profile.limits.size(), limits.size());
    for (std::size_t i = 0; i < limits.size(); ++i) {
      EXPECT_EQ(profile.limits[i].name, limits[i].at("limit"));
      EXPECT_EQ(profile.limits[i].value, limits[i].at("value"));
      EXPECT_EQ(profile.limits[i].unit, limits[i].at("unit"));
      EXPECT_EQ(profile.limits[i].source, CitationOf(limits[i].at("source")));
    }
    Family with_guide = family;
    if (family.profile == "kollmorgen-akd-2011") with_guide.rows.push_back("akd_ug");
    const auto facts = Table("other_facts", with_guide);
    ASSERT_EQ(profile.facts.size(), facts.size());
    for (std::size_t i = 0; i < facts.size(); ++i) {
      EXPECT_EQ(profile.facts[i].category, facts[i].at("category"));
      if (!NamesATable(facts[i].at("fact"))) {
        EXPECT_EQ(profile.facts[i].name, facts[i].at("fact"));
        EXPECT_EQ(profile.facts[i].value, facts[i].at("value"));
      }
      EXPECT_EQ(profile.facts[i].source, CitationOf(facts[i].at("source")));
    }
    const auto eeprom = Table("eeprom", family);
    if (eeprom.empty()) continue;  // then the standard categories remain
    ASSERT_EQ(profile.eeprom.size(), eeprom.size());
    for (std::size_t i = 0; i < eeprom.size(); ++i) {
      EXPECT_EQ(profile.eeprom[i].kind, eeprom[i].at("kind"));
      EXPECT_EQ(profile.eeprom[i].key, eeprom[i].at("key"));
      EXPECT_EQ(profile.eeprom[i].fact, eeprom[i].at("fact"));
      if (profile.eeprom[i].kind == "category") {
        EXPECT_EQ(profile.eeprom[i].category, Number(eeprom[i].at("key")));
      }
    }
  }
}

}  // namespace
}  // namespace ecaudit::device
