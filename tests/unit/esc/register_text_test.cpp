#include "decoder/esc/register_text.h"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace ecaudit::esc {
namespace {

using Bytes = std::vector<std::uint8_t>;

std::string Read(EscAddress address, const Bytes& bytes) {
  return DescribeRegister(RegisterAt(address), bytes, AccessKind::READ);
}
std::string Write(EscAddress address, const Bytes& bytes) {
  return DescribeRegister(RegisterAt(address), bytes, AccessKind::WRITE);
}
std::string ReadAll(EscAddress address, const Bytes& bytes) {
  return DescribeAccess(address, bytes, AccessKind::READ);
}
std::string WriteAll(EscAddress address, const Bytes& bytes) {
  return DescribeAccess(address, bytes, AccessKind::WRITE);
}

// The ten bytes a real AKD answers at 0x0000 (esc-reference 4.1: 04 02 43 00 03 04 04 0f 84 01).
TEST(DescribeRegister, InformationOfARealAkd) {
  EXPECT_EQ(ReadAll(0x0000, {0x04, 0x02, 0x43, 0x00, 0x03, 0x04, 0x04, 0x0F, 0x84, 0x01}),
            "Type: IP core; Revision: 0x02; Build: 0x0043; FMMUs supported: 3; SyncManagers supported: 4; "
            "RAM Size: 4 KiB; Port Descriptor: port 0 MII, port 1 MII, port 2 none, port 3 none; "
            "Features: DC, FCS errors separate, enhanced SYNC activation");
  EXPECT_EQ(Read(0x0000, {0x77}), "Type: 0x77");
  EXPECT_EQ(Read(0x0008, {0x08, 0x0E}), "Features: 64-bit DC, no LRW, no BRW/APRW/FPRW, fixed FMMU/SM configuration");
  EXPECT_EQ(Read(0x0008, {0x00, 0xF0}), "Features: reserved bits 0xf000");
}

TEST(DescribeRegister, AlRegisters) {
  EXPECT_EQ(Read(0x0130, {0x12, 0x00}), "AL Status: PREOP+ERR");
  EXPECT_EQ(Read(0x0130, {0x08}), "AL Status: OP");
  EXPECT_EQ(Read(0x0130, {0x22, 0x00}), "AL Status: PREOP, identification loaded");
  EXPECT_EQ(Write(0x0120, {0x14, 0x00}), "AL Control: SAFEOP, acknowledge");
  EXPECT_EQ(Write(0x0120, {0x21, 0x00}), "AL Control: INIT, identification request");
  EXPECT_EQ(Write(0x0120, {0x01}), "AL Control: INIT");
  EXPECT_EQ(Write(0x0120, {0x07, 0x00}), "AL Control: state 7");
  EXPECT_EQ(Read(0x0134, {0x1D, 0x00}), "AL Status Code: 0x001d invalid output configuration");
  EXPECT_EQ(Read(0x0134, {0x34, 0x92}), "AL Status Code: 0x9234");
  EXPECT_EQ(ReadAll(0x0130, {0x12, 0, 0, 0, 0x1D, 0}),
            "AL Status: PREOP+ERR; AL Status Code: 0x001d invalid output configuration");
}

// 0x5613 is the last slave of a line (esc-reference 4.2).
TEST(DescribeRegister, DataLink) {
  EXPECT_EQ(Read(0x0110, {0x13, 0x56}),
            "DL Status: EEPROM loaded, PDI watchdog ok, link 0, port 0 open, port 1 closed, port 2 closed, "
            "port 3 closed");
  EXPECT_EQ(Read(0x0111, {0x56}), "DL Status: port 0 open, port 1 closed, port 2 closed, port 3 closed");
  EXPECT_EQ(Read(0x0110, {0x00, 0x0C}),
            "DL Status: port 0 open without communication, port 1 closed in spite of communication, "
            "port 2 open without communication, port 3 open without communication");
  EXPECT_EQ(Read(0x0100, {0x01, 0x00, 0x07, 0x00}),  // the value after power-on
            "DL Control: destroys foreign frames, port 0 auto, port 1 auto, port 2 auto, port 3 auto, RX FIFO 7, "
            "alias disabled");
  // TwinCAT while it scans, SOEM when it begins.
  EXPECT_EQ(Write(0x0101, {0xFC}),
            "DL Control: port 0 auto, port 1 always closed, port 2 always closed, port 3 always closed");
  EXPECT_EQ(Write(0x0103, {0x00}), "DL Control: alias disabled");
  EXPECT_EQ(Write(0x0103, {0x01}), "DL Control: alias enabled");
  EXPECT_EQ(Write(0x0010, {0x01, 0x10}), "Configured Station Address: 0x1001");
}

TEST(DescribeRegister, PdiAndEvents) {
  EXPECT_EQ(Read(0x0140, {0x08}), "PDI Control: 16-bit asynchronous microcontroller");
  EXPECT_EQ(Read(0x0141, {0x0C}), "ESC Configuration: SYNC unit, latch unit");
  EXPECT_EQ(Read(0x0141, {0x01}), "ESC Configuration: device emulation");
  EXPECT_EQ(Read(0x0141, {0x00}), "ESC Configuration: none");
  EXPECT_EQ(Write(0x0200, {0x04, 0x00}), "ECAT Event Mask: DL status");
  EXPECT_EQ(Read(0x0210, {0x24, 0x08}), "ECAT Event Request: DL status, SM1, SM7");
  EXPECT_EQ(Read(0x0220, {0x61, 0x04, 0x00, 0x00}), "AL Event Request: AL control, EEPROM emulation, watchdog, SM2");
  EXPECT_EQ(DescribeEvents(0x0004), "DL status");
  EXPECT_EQ(DescribeEvents(0x0030), "SM0, SM1");
  EXPECT_EQ(DescribeEvents(0), "");
}

TEST(DescribeRegister, Watchdogs) {
  EXPECT_EQ(Read(0x0400, {0xC2, 0x09}), "Watchdog Divider: 2498 (steps of 100.00 us)");
  EXPECT_EQ(Read(0x0420, {0xE8, 0x03}), "Watchdog Time Process Data: 100.000 ms (1000 steps of 100 us, the default)");
  EXPECT_EQ(Read(0x0410, {0x00, 0x00}), "Watchdog Time PDI: off");
  // (23 + 2) * 40 ns = 1 us a step
  EXPECT_EQ(DescribeRegister(RegisterAt(0x0420), Bytes{0xDC, 0x05}, AccessKind::WRITE, {.watchdog_divider = 23}),
            "Watchdog Time Process Data: 1.500 ms (1500 steps)");
  EXPECT_EQ(Read(0x0440, {0x01, 0x00}), "Watchdog Status Process Data: running or off");
  EXPECT_EQ(Read(0x0440, {0x00, 0x00}), "Watchdog Status Process Data: expired");
}

TEST(DescribeRegister, Eeprom) {
  EXPECT_EQ(Write(0x0500, {0x02}), "EEPROM Configuration: ECAT owns the EEPROM, taken back by force");
  EXPECT_EQ(Write(0x0500, {0x01}), "EEPROM Configuration: EEPROM offered to the PDI");
  EXPECT_EQ(WriteAll(0x0502, {0x00, 0x01, 0x08, 0x00, 0x00, 0x00}),
            "EEPROM Control/Status: read; EEPROM Address: word 0x0008");
  EXPECT_EQ(WriteAll(0x0502, {0x01, 0x02, 0x04, 0x00, 0x00, 0x00, 0x34, 0x12}),
            "EEPROM Control/Status: write, write enable; EEPROM Address: word 0x0004; EEPROM Data: 3412");
  EXPECT_EQ(Write(0x0502, {0x00, 0x04}), "EEPROM Control/Status: reload");
  EXPECT_EQ(Write(0x0502, {0x00, 0x03}), "EEPROM Control/Status: command 3");
  EXPECT_EQ(Write(0x0502, {0x00, 0x00}), "EEPROM Control/Status: clear errors");
  EXPECT_EQ(Read(0x0502, {0x20, 0x81}), "EEPROM Control/Status: read, busy, emulated");
  EXPECT_EQ(Read(0x0502, {0x00, 0x00}), "EEPROM Control/Status: idle");
  EXPECT_EQ(Read(0x0502, {0x40, 0x20}), "EEPROM Control/Status: no acknowledge or invalid command, 8 bytes a read");
  EXPECT_EQ(Read(0x0508, {0x6A, 0x00, 0x00, 0x00}), "EEPROM Data: 6a000000");
}

// soem-sdinfo-akd, frames 263, 735 and 739.
TEST(DescribeAccess, SyncManagersAndFmmus) {
  EXPECT_EQ(WriteAll(0x0800, {0x00, 0x18, 0x00, 0x04, 0x26, 0, 1, 0, 0x00, 0x1C, 0x00, 0x04, 0x22, 0, 1, 0}),
            "SM0: 0x1800 1024 bytes, mailbox, ECAT writes, PDI irq, enabled; "
            "SM1: 0x1c00 1024 bytes, mailbox, ECAT reads, PDI irq, enabled");
  EXPECT_EQ(WriteAll(0x0810, {0x00, 0x11, 0x11, 0x00, 0x64, 0, 0, 0}),
            "SM2: 0x1100 17 bytes, buffered, ECAT writes, PDI irq, watchdog, disabled");
  EXPECT_EQ(ReadAll(0x0808, {0x00, 0x1C, 0x00, 0x04, 0x22, 0x09, 3, 2}),
            "SM1: 0x1c00 1024 bytes, mailbox, ECAT reads, PDI irq, enabled, repeat request, full, repeat acknowledge");
  EXPECT_EQ(WriteAll(0x0600, {0, 0, 0, 0, 0x11, 0, 0, 7, 0x00, 0x11, 0, 2, 1, 0, 0, 0}),
            "FMMU0: logical 0x00000000 +17 -> 0x1100 write, active");
  EXPECT_EQ(WriteAll(0x0620, {0, 0, 0, 9, 1, 0, 0, 0, 0x0D, 0x08, 0, 1, 1, 0, 0, 0}),
            "FMMU2: logical 0x09000000.0 1 bit -> 0x080d.0 read, active");
  EXPECT_EQ(WriteAll(0x0630, {0, 0, 0, 0, 2, 0, 6, 1, 0x00, 0x0F, 3, 3, 0}),  // 13 bytes are enough
            "FMMU3: logical 0x00000000.6 4 bits -> 0x0f00.3 read and write, inactive");
}

TEST(DescribeAccess, PartsOfUnits) {
  EXPECT_EQ(ReadAll(0x080D, {0x09, 0x01}), "SM1 Status: written, mailbox full; SM1 Activate: enabled");
  EXPECT_EQ(ReadAll(0x0805, {0x30}), "SM0 Status: last buffer none");
  EXPECT_EQ(WriteAll(0x0814, {0x24}), "SM2 Control: buffered, ECAT writes, PDI irq");
  EXPECT_EQ(WriteAll(0x060C, {0x01}), "FMMU0 Activate: active");
  EXPECT_EQ(WriteAll(0x060B, {0x03}), "FMMU0 Type: read, write");
  EXPECT_EQ(ReadAll(0x0802, {0x00, 0x04}), "SM0 Length: 1024 bytes");
}

// Block writes of masters that reset everything (esc-reference 13).
TEST(DescribeAccess, ZerosAreDrawnTogether) {
  EXPECT_EQ(WriteAll(0x0600, Bytes(48, 0)), "FMMU0-FMMU2: all 0");
  EXPECT_EQ(WriteAll(0x0600, Bytes(256, 0)), "FMMU0-FMMU15: all 0");
  EXPECT_EQ(WriteAll(0x0800, Bytes(256, 0)), "SM0-SM15: all 0");
  EXPECT_EQ(WriteAll(0x0800, Bytes(8, 0)), "SM0: all 0");
  EXPECT_EQ(WriteAll(0x0300, Bytes(8, 0)), "Invalid Frame Counter Port 0 - RX Error Counter Port 3: cleared");
  EXPECT_EQ(ReadAll(0x0300, Bytes(8, 0)), "Invalid Frame Counter Port 0 - RX Error Counter Port 3: all 0");
  EXPECT_EQ(ReadAll(0x0300, {0, 0, 0, 5}),
            "Invalid Frame Counter Port 0 - Invalid Frame Counter Port 1: all 0; RX Error Counter Port 1: 5");
  Bytes second_only(16, 0);
  second_only[8] = 0x40;
  EXPECT_EQ(WriteAll(0x0800, second_only), "SM0: all 0; SM1: 0x0040 0 bytes, buffered, ECAT reads, disabled");
}

TEST(DescribeAccess, LongAccessesAreCutShort) {
  Bytes bytes(kMaxSyncManagers * kSyncManagerBytes, 0x11);
  const std::string text = WriteAll(0x0800, bytes);
  EXPECT_NE(text.find("SM7: "), std::string::npos);
  EXPECT_EQ(text.find("SM8: "), std::string::npos);
  EXPECT_NE(text.find("; 8 more"), std::string::npos);
}

// replay-dc: SYNC0 of 5 ms; esc-reference 10.
TEST(DescribeRegister, DistributedClocks) {
  EXPECT_EQ(Write(0x09A0, {0x40, 0x42, 0x0F, 0x00}), "SYNC0 Cycle Time: 1.000 ms (1000000 ns)");
  EXPECT_EQ(WriteAll(0x09A0, {0x40, 0x4B, 0x4C, 0x00, 0, 0, 0, 0}),
            "SYNC0 Cycle Time: 5.000 ms (5000000 ns); SYNC1 Cycle Time: 0 ns");
  EXPECT_EQ(Write(0x0981, {0x03}), "Activation: active, SYNC0");
  EXPECT_EQ(Write(0x0981, {0x00}), "Activation: off");
  EXPECT_EQ(WriteAll(0x0980, {0x30, 0x07}),
            "Cyclic Unit Control: latch 0 by PDI, latch 1 by PDI; Activation: active, SYNC0, SYNC1");
  EXPECT_EQ(Read(0x092C, {0x12, 0, 0, 0x80}), "System Time Difference: 18 ns (bit 31 set)");
  EXPECT_EQ(Read(0x0928, {0xFF, 0x01, 0, 0}), "System Time Delay: 511 ns");
  EXPECT_EQ(Write(0x0920, {0xFE, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF, 0xFF}), "System Time Offset: -2 ns");
  EXPECT_EQ(Write(0x0920, {0xFE, 0xFF, 0xFF, 0xFF}), "System Time Offset: 0xfffffffe (lower half)");
  EXPECT_EQ(Read(0x0910, {0x00, 0xCA, 0x9A, 0x3B, 0, 0, 0, 0}), "System Time: 1000000000 ns");
  EXPECT_EQ(Read(0x0910, {0x00, 0xCA, 0x9A, 0x3B}), "System Time: 1000000000 ns (lower half)");
  EXPECT_EQ(Read(0x0914, {0x01, 0, 0, 0}), "System Time: bytes 4-7: 01000000");
  EXPECT_EQ(Read(0x0904, {0x68, 0x6F, 0x66, 0x66}), "Receive Time Port 1: 1717989224 ns");
  EXPECT_EQ(Write(0x0900, {0, 0, 0, 0}), "Receive Time Port 0: latches the receive times");
  EXPECT_EQ(Read(0x0930, {0x00, 0x10}), "Speed Counter Start: 4096");
  EXPECT_EQ(Read(0x0932, {0xFE, 0xFF}), "Speed Counter Diff: -2");
  EXPECT_EQ(WriteAll(0x0934, {0x00, 0x0C}), "System Time Difference Filter Depth: 0; Speed Counter Filter Depth: 12");
  EXPECT_EQ(Read(0x0982, {0x00, 0x00}), "Pulse Length: acknowledge mode");
  EXPECT_EQ(Read(0x0982, {0x40, 0x9C}), "Pulse Length: 400.00 us (400000 ns)");
  EXPECT_EQ(Read(0x0984, {0x04}), "Activation Status: start time out of near future");
  EXPECT_EQ(Write(0x09A8, {0x03}), "Latch0 Control: positive edge single, negative edge single");
  EXPECT_EQ(Read(0x09AE, {0x05}), "Latch0 Status: positive event, pin high");
}

TEST(DescribeRegister, OddParts) {
  EXPECT_EQ(Read(0x0135, {0x00}), "AL Status Code: byte 1: 00");
  EXPECT_EQ(Read(0x0505, {1, 2}), "EEPROM Address: bytes 1-2: 0102");
  EXPECT_EQ(Read(0x0130, {0x02, 0x00, 0xFF, 0xFF}), "AL Status: PREOP");  // more than the register
  EXPECT_EQ(Read(0x0700, {0x00}), "");                                    // reserved
  EXPECT_EQ(DescribeValue(RegisterAt(0x0130), {}), "");
  EXPECT_EQ(Read(0x0F80, Bytes(128, 0xAB)), "User RAM: abababababababababababababababab...");
}

TEST(DescribeAccess, RequestsReservedAndProcessRam) {
  EXPECT_EQ(DescribeAccess(0x0130, Bytes(6, 0), AccessKind::REQUEST), "AL Status - AL Status Code");
  EXPECT_EQ(WriteAll(0x1800, Bytes(1024, 0)), "process RAM 0x1800, 1024 bytes");
  EXPECT_EQ(ReadAll(0x0700, Bytes(3, 0)), "reserved, 3 bytes");
  EXPECT_EQ(ReadAll(0x0130, {}), "");
  EXPECT_EQ(ReadAll(0xFFFF, {1, 2, 3}), "process RAM 0xffff, 1 byte");
}

// Any bytes at any address give some text, and no reserved address is named.
TEST(DescribeAccess, AnyAddressAndLength) {
  const Bytes ones(300, 0xFF);
  for (unsigned address = 0; address < 0x1002; ++address) {
    for (const std::size_t length : {1U, 2U, 3U, 5U, 13U, 300U}) {
      const ByteSpan bytes = ByteSpan(ones).first(length);
      EXPECT_FALSE(DescribeAccess(static_cast<EscAddress>(address), bytes, AccessKind::READ).empty()) << address;
      EXPECT_FALSE(DescribeAccess(static_cast<EscAddress>(address), bytes, AccessKind::WRITE).empty()) << address;
    }
  }
}

}  // namespace
}  // namespace ecaudit::esc
