#include "decoder/esc/register_map.h"

#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "analyzers/wiring/event_bus.h"
#include "decoder/capture/capture_reader.h"
#include "decoder/pipeline.h"
#include "tests/support/folders.h"

namespace ecaudit::esc {
namespace {

using testing::ElementsAre;

// Names as in section II of the ESC data sheet. Wireshark swaps types and revisions, ports and RAM size.
TEST(RegisterMap, NamesOfTheDataSheet) {
  EXPECT_EQ(RegisterName(0x0000), "Type");
  EXPECT_EQ(RegisterName(0x0001), "Revision");
  EXPECT_EQ(RegisterName(0x0006), "RAM Size");
  EXPECT_EQ(RegisterName(0x0007), "Port Descriptor");
  EXPECT_EQ(RegisterName(0x0010), "Configured Station Address");
  EXPECT_EQ(RegisterName(0x0100), "DL Control");
  EXPECT_EQ(RegisterName(0x0103), "DL Control");
  EXPECT_EQ(RegisterName(0x0120), "AL Control");
  EXPECT_EQ(RegisterName(0x0131), "AL Status");
  EXPECT_EQ(RegisterName(0x0134), "AL Status Code");
  EXPECT_EQ(RegisterName(0x0508), "EEPROM Data");
  EXPECT_EQ(RegisterName(0x092C), "System Time Difference");
  EXPECT_EQ(RegisterName(0x0981), "Activation");
  EXPECT_EQ(RegisterName(0x09A0), "SYNC0 Cycle Time");
}

TEST(RegisterMap, RepeatedRegistersHaveNumbers) {
  EXPECT_EQ(RegisterName(0x0300), "Invalid Frame Counter Port 0");
  EXPECT_EQ(RegisterName(0x0307), "RX Error Counter Port 3");
  EXPECT_EQ(RegisterName(0x030B), "Forwarded RX Error Counter Port 3");
  EXPECT_EQ(RegisterName(0x0312), "Lost Link Counter Port 2");
  EXPECT_EQ(RegisterName(0x051B), "PHY Port Status Port 3");
  EXPECT_EQ(RegisterName(0x0600), "FMMU0 Logical Start");
  EXPECT_EQ(RegisterName(0x06F3), "FMMU15 Logical Start");
  EXPECT_EQ(RegisterName(0x062B), "FMMU2 Type");
  EXPECT_EQ(RegisterName(0x0810), "SM2 Start");
  EXPECT_EQ(RegisterName(0x080D), "SM1 Status");
  EXPECT_EQ(RegisterName(0x087F), "SM15 PDI Control");
  EXPECT_EQ(RegisterName(0x0900), "Receive Time Port 0");
  EXPECT_EQ(RegisterName(0x0904), "Receive Time Port 1");
  EXPECT_EQ(RegisterName(0x090F), "Receive Time Port 3");
}

TEST(RegisterMap, ReservedAddressesAndProcessRam) {
  for (const int listed : {0x000A, 0x0014, 0x0022, 0x0132, 0x0314, 0x0444, 0x051C, 0x0700, 0x0880, 0x09D0, 0x0F7F}) {
    const auto reserved = static_cast<EscAddress>(listed);
    EXPECT_EQ(RegisterName(reserved), "") << reserved;
    EXPECT_EQ(FindRegister(reserved), nullptr) << reserved;
    EXPECT_FALSE(RegisterAt(reserved));
  }
  EXPECT_EQ(RegisterName(0x0FFF), "User RAM");
  EXPECT_EQ(RegisterName(0x1000), "Process RAM");
  EXPECT_EQ(RegisterName(0xFFFF), "Process RAM");
  EXPECT_EQ(FindRegister(0x1000), nullptr);
}

TEST(RegisterMap, HitsNameInstanceAndOffset) {
  const RegisterHit hit = RegisterAt(0x0813);
  ASSERT_TRUE(hit);
  EXPECT_EQ(hit.reg, FindRegister(0x0802));
  EXPECT_EQ(hit.number, 2);
  EXPECT_EQ(hit.start, 0x0812);
  EXPECT_EQ(hit.offset, 1);
  EXPECT_EQ(hit.unit->name, "SM");
  EXPECT_EQ(RegisterAt(0x0914).offset, 4);
  EXPECT_EQ(RegisterAt(0x0914).unit, nullptr);
}

// Each address of the area belongs to one register at most, and each register finds itself.
TEST(RegisterMap, EveryAddressResolvesConsistently) {
  for (unsigned address = 0; address < kProcessRam; ++address) {
    const RegisterHit hit = RegisterAt(static_cast<EscAddress>(address));
    if (!hit) continue;
    EXPECT_EQ(hit.start + hit.offset, address);
    EXPECT_LT(hit.offset, hit.reg->length);
    EXPECT_EQ(RegisterAt(hit.start).reg, hit.reg);
    EXPECT_EQ(RegisterName(hit).find('#'), std::string::npos);
  }
}

TEST(RegisterMap, FieldsFitTheirRegisters) {
  std::set<std::string_view> names;
  for (const Register& reg : AllRegisters()) {
    EXPECT_FALSE(reg.source.empty()) << reg.name;
    EXPECT_FALSE(reg.fields.empty()) << reg.name;
    EXPECT_LE(reg.mandatory_bytes, reg.length) << reg.name;
    names.insert(reg.name);
    std::uint64_t used = 0;
    for (const Field& field : reg.fields) {
      if (field.unit == Unit::DATA) continue;
      EXPECT_LE(field.lsb + field.width, reg.length * 8) << reg.name << " " << field.name;
      EXPECT_EQ(field.unit == Unit::VALUE, !field.values.empty()) << reg.name;
      EXPECT_TRUE(field.unit != Unit::FLAG || field.width == 1) << reg.name;
      if (field.width >= 64) continue;
      const std::uint64_t mask = ((std::uint64_t{1} << field.width) - 1) << field.lsb;
      EXPECT_EQ(used & mask, 0U) << reg.name << " " << field.name;
      used |= mask;
    }
  }
  // "Receive Time Port #" and its port 0 differ in access, hence two entries.
  EXPECT_EQ(names.size(), AllRegisters().size());
}

// esc-reference 4: the ECAT columns.
TEST(RegisterMap, AccessRights) {
  for (const int read_only :
       {0x0000, 0x0012, 0x0110, 0x0130, 0x0134, 0x0140, 0x0204, 0x0210, 0x0220, 0x0440, 0x0501, 0x0805,
        0x0807, 0x0904, 0x0918, 0x092C, 0x0932, 0x0982, 0x0984, 0x0998, 0x09AE, 0x09B0, 0x09F0}) {
    EXPECT_TRUE(IsReadOnly(FindRegister(static_cast<EscAddress>(read_only))->access)) << read_only;
  }
  for (const int writable :
       {0x0010, 0x0020, 0x0100, 0x0108, 0x0120, 0x0138, 0x0200, 0x0300, 0x030C, 0x0310, 0x0400, 0x0420,
        0x0442, 0x0500, 0x0502, 0x0504, 0x0508, 0x0510, 0x0600, 0x060C, 0x0800, 0x0804, 0x0806, 0x0900,
        0x0910, 0x0920, 0x0928, 0x0930, 0x0934, 0x0980, 0x0981, 0x0990, 0x09A0, 0x09A8, 0x0F80}) {
    EXPECT_FALSE(IsReadOnly(FindRegister(static_cast<EscAddress>(writable))->access)) << writable;
  }
  EXPECT_EQ(FindRegister(0x0300)->access, EcatAccess::WRITE_CLEARS);
  EXPECT_EQ(FindRegister(0x0120)->access, EcatAccess::WRITE_IF);
  EXPECT_EQ(FindRegister(0x0900)->access, EcatAccess::WRITE_EFFECT);
}

// ---- cutting

std::vector<std::string> Cut(EscAddress address, std::size_t length) {
  std::vector<std::string> parts;
  CutAccess(address, length, [&](const RegisterPart& part) {
    std::string name = part.is_process_ram() ? "RAM" : part.hit ? RegisterName(part.hit) : "reserved";
    parts.push_back(name + " " + std::to_string(part.at) + "+" + std::to_string(part.length) +
                    (part.complete ? "" : " partly"));
  });
  return parts;
}

TEST(CutAccess, RegistersReservedBytesAndParts) {
  EXPECT_THAT(Cut(0x0130, 2), ElementsAre("AL Status 0+2"));
  EXPECT_THAT(Cut(0x0130, 6), ElementsAre("AL Status 0+2", "reserved 2+2 partly", "AL Status Code 4+2"));
  EXPECT_THAT(Cut(0x0120, 1), ElementsAre("AL Control 0+1 partly"));
  EXPECT_THAT(Cut(0x0101, 1), ElementsAre("DL Control 0+1 partly"));
  EXPECT_THAT(Cut(0x0502, 6), ElementsAre("EEPROM Control/Status 0+2", "EEPROM Address 2+4"));
  EXPECT_THAT(Cut(0x080D, 2), ElementsAre("SM1 Status 0+1", "SM1 Activate 1+1"));
  EXPECT_THAT(Cut(0x087F, 3), ElementsAre("SM15 PDI Control 0+1", "reserved 1+2 partly"));
  EXPECT_THAT(Cut(0x0FFE, 4), ElementsAre("User RAM 0+2 partly", "RAM 2+2 partly"));
  EXPECT_THAT(Cut(0x1800, 1024), ElementsAre("RAM 0+1024 partly"));
  EXPECT_THAT(Cut(0x0130, 0), ElementsAre());
  EXPECT_THAT(Cut(0xFFFF, 4), ElementsAre("RAM 0+1 partly"));
}

// The parts of any access are exactly its bytes.
TEST(CutAccess, PartsAreContiguous) {
  for (unsigned address = 0; address < kProcessRam + 4; address += 3) {
    for (const std::size_t length : {1U, 2U, 7U, 16U, 33U, 256U, 1486U}) {
      std::size_t next = 0;
      CutAccess(static_cast<EscAddress>(address), length, [&](const RegisterPart& part) {
        ASSERT_EQ(part.at, next);
        ASSERT_GT(part.length, 0U);
        ASSERT_EQ(part.address, address + part.at);
        next += part.length;
      });
      ASSERT_EQ(next, length) << address;
    }
  }
}

TEST(AccessName, OneRegisterUnitsOrARange) {
  EXPECT_EQ(AccessName(0x0130, 2), "AL Status");
  EXPECT_EQ(AccessName(0x0130, 6), "AL Status - AL Status Code");
  EXPECT_EQ(AccessName(0x0000, 10), "Type - Features");
  EXPECT_EQ(AccessName(0x0800, 8), "SM0");
  EXPECT_EQ(AccessName(0x0800, 16), "SM0-SM1");
  EXPECT_EQ(AccessName(0x0800, 256), "SM0-SM15");
  EXPECT_EQ(AccessName(0x0805, 1), "SM0 Status");
  EXPECT_EQ(AccessName(0x080D, 2), "SM1");
  EXPECT_EQ(AccessName(0x0600, 48), "FMMU0-FMMU2");
  EXPECT_EQ(AccessName(0x0300, 8), "Invalid Frame Counter Port 0 - RX Error Counter Port 3");
  EXPECT_EQ(AccessName(0x1100, 17), "Process RAM");
  EXPECT_EQ(AccessName(0x0700, 4), "");
  EXPECT_EQ(AccessName(0x0130, 0), "");
}

// ---- what every ESC has

TEST(EveryEsc, OneByteIsEnough) {
  EXPECT_TRUE(EveryEscReads(0x0000, 1));
  EXPECT_TRUE(EveryEscReads(0x0130, 2));
  EXPECT_TRUE(EveryEscReads(0x0008, 16));  // features, then reserved bytes
  EXPECT_FALSE(EveryEscReads(0x0918, 8));  // receive time of the processing unit: not on every ESC (CAP replay-dc)
  EXPECT_FALSE(EveryEscReads(0x0700, 16));
  EXPECT_FALSE(EveryEscReads(0x1000, 64));
  EXPECT_FALSE(EveryEscReads(0x0130, 0));
  EXPECT_TRUE(EveryEscWrites(0x0010, 2));
  EXPECT_TRUE(EveryEscWrites(0x0300, 8));
  EXPECT_TRUE(EveryEscWrites(0x0101, 1));
  EXPECT_FALSE(EveryEscWrites(0x0120, 2));   // refused until the PDI has read the last request (CAP soem-sdinfo-akd)
  EXPECT_FALSE(EveryEscWrites(0x0630, 16));  // FMMU 3 is missing on a coupler (CAP replay-dc)
  EXPECT_FALSE(EveryEscWrites(0x0502, 6));
  EXPECT_FALSE(EveryEscWrites(0x0000, 8));
}

TEST(NothingToWrite, ReadOnlyAndReserved) {
  EXPECT_TRUE(NothingToWrite(0x092C, 4));  // counted by nobody in CAP replay-dc
  EXPECT_TRUE(NothingToWrite(0x0130, 6));
  EXPECT_TRUE(NothingToWrite(0x0700, 8));
  EXPECT_FALSE(NothingToWrite(0x0928, 8));  // the delay is writable
  EXPECT_FALSE(NothingToWrite(0x080D, 2));  // status and activate, as SOEM writes it
  EXPECT_FALSE(NothingToWrite(0x1800, 16));
  EXPECT_FALSE(NothingToWrite(0x0130, 0));
}

/// Compares the expectations with what real slaves counted for broadcasts.
class BroadcastCounts final : public EventBus {
 public:
  BroadcastCounts() { ListenTo<track::Answered>(Stage::kModel, *this); }
  void On(const track::Answered& answer) {
    const std::uint16_t* slaves = pipeline.network().slave_count().if_known();
    if (slaves == nullptr) return;
    if (answer.command == wire::Command::BRD && EveryEscReads(answer.address, answer.length)) {
      ++reads;
      EXPECT_EQ(answer.wkc, *slaves) << answer.returned.number;
    }
    if (answer.command == wire::Command::BWR && EveryEscWrites(answer.address, answer.length)) {
      ++writes;
      EXPECT_EQ(answer.wkc, *slaves) << answer.returned.number;
    }
    if (answer.command == wire::Command::BWR && NothingToWrite(answer.address, answer.length)) {
      ++refused;
      EXPECT_EQ(answer.wkc, 0) << answer.returned.number;
    }
  }

  int reads = 0;
  int writes = 0;
  int refused = 0;
  Pipeline pipeline{*this};
};

TEST(EveryEsc, AgreesWithRealSlaves) {
  int reads = 0;
  int writes = 0;
  int refused = 0;
  bool any = false;
  for (const char* name : {"soem-sdinfo-akd", "replay-dc", "replay-ek1914-segmented-upload",
                           "replay-ek1914-no-complete-access", "soem-single-lan9252", "twincat-run-ek1100-el1004"}) {
    auto source = capture::OpenCapture(test::SharedDir() + "/captures/real/" + name + ".pcapng");
    if (!source) continue;
    any = true;
    SCOPED_TRACE(name);
    BroadcastCounts counts;
    counts.pipeline.Run(**source);
    reads += counts.reads;
    writes += counts.writes;
    refused += counts.refused;
  }
  if (!any) GTEST_SKIP() << "captures not found";
  // BRD of type and AL status; BWR of DL control, counters and EEPROM owner; BWR 0x092C three times.
  EXPECT_GT(reads, 3000);
  EXPECT_GT(writes, 15);
  EXPECT_EQ(refused, 3);
}

}  // namespace
}  // namespace ecaudit::esc
