// Every fixed PDO that the manuals print decodes by name, through assignment, layout and bits (fixed_pdos.csv).
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "analyzers/model/process_data.h"
#include "analyzers/model/process_image.h"
#include "decoder/device/profile_registry.h"
#include "tests/unit/device/reference_tables.h"

namespace ecaudit::model {
namespace {

/// One slave that is told its PDO as a master does: count 0, entry, count 1.
class Slave {
 public:
  explicit Slave(std::string_view profile) { process.SetFamily(*device::BuiltinProfile(profile)); }

  void Assign(std::uint16_t assignment, std::uint16_t pdo) {
    Write(assignment, 0, {0});
    Write(assignment, 1, {static_cast<std::uint8_t>(pdo), static_cast<std::uint8_t>(pdo >> 8U)});
    Write(assignment, 0, {1});
  }

  track::SlaveState state;
  events::ObjectNames names;
  ProcessData process{state, names};

 private:
  void Write(std::uint16_t index, std::uint8_t subindex, std::vector<std::uint8_t> bytes) {
    mailbox::SdoTransfer sdo;
    sdo.service = mailbox::SdoService::kDownload;
    sdo.has_object = true;
    sdo.index = index;
    sdo.subindex = subindex;
    sdo.data = bytes;
    sdo.size = bytes.size();
    sdo.outcome = mailbox::SdoOutcome::kCompleted;
    sdo.request.number = ++frame_;
    sdo.response.number = ++frame_;
    process.Apply(sdo);
  }

  FrameNo frame_ = 0;
};

TEST(FixedPdo, EveryOneOfEveryFamilyDecodesByName) {
  ECAUDIT_NEEDS_TABLE("fixed_pdos");
  // No two bytes alike, so that a value from a wrong place shows.
  std::vector<std::uint8_t> buffer(64);
  for (std::size_t i = 0; i < buffer.size(); ++i) buffer[i] = static_cast<std::uint8_t>(0x81 + 37 * i);
  std::size_t decoded = 0;
  for (const device::Family& family : device::Families()) {
    // The MKD tables of PDOs belong to the drive (MKD-N), not to the power supply.
    if (family.profile == "kollmorgen-mkd-c") continue;
    std::map<std::string, std::vector<test::CsvRow>> pdos;
    for (const test::CsvRow& row : device::Table("fixed_pdos", family)) pdos[row.at("pdo_index")].push_back(row);
    for (const auto& [pdo, rows] : pdos) {
      SCOPED_TRACE(std::string(family.profile) + " " + pdo);
      const bool rx = rows.front().at("direction") == "rx";
      Slave slave(family.profile);
      slave.Assign(rx ? 0x1C12 : 0x1C13, static_cast<std::uint16_t>(device::Number(pdo)));
      const ProcessLayout& layout = rx ? slave.process.rx() : slave.process.tx();
      EXPECT_EQ(layout.source, LayoutSource::kObserved);
      if (rows.front().at("object_index").empty()) {  // the manual names the PDO, not what is in it
        EXPECT_FALSE(layout.known());
        EXPECT_NE(layout.reason, "");
        continue;
      }
      ASSERT_TRUE(layout.known()) << layout.reason;
      ASSERT_EQ(layout.signals.size(), rows.size());
      for (const test::CsvRow& row : rows) {
        const Signal& signal = layout.signals[device::Number(row.at("position")) - 1];
        SCOPED_TRACE(row.at("signal_name"));
        EXPECT_EQ(signal.index, device::Number(row.at("object_index")));
        EXPECT_EQ(signal.subindex, device::Number(row.at("subindex")));
        EXPECT_NE(signal.name, "");
        const std::size_t first = device::Number(row.at("byte_offset"));
        const std::size_t bits = device::Number(row.at("bits"));
        ASSERT_EQ(signal.bits, bits);
        ASSERT_LE(first + bits / 8, buffer.size());
        std::uint64_t expected = 0;
        for (std::size_t i = bits / 8; i > 0; --i) expected = expected * 256 + buffer[first + i - 1];
        EXPECT_EQ(ExtractBits(buffer, signal.bit_offset, signal.bits), expected);
        ++decoded;
      }
    }
  }
  EXPECT_GT(decoded, 0U);
}

}  // namespace
}  // namespace ecaudit::model
