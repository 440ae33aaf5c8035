// What goes wrong on the cable and with addressing.
#include "samples/builder/scenarios/scenario.h"

namespace ecaudit::samples {
namespace {

void BringAllToOp(Story& story, CyclicTask task = {}) {
  story.master.Scan();
  story.master.BringToPreop();
  story.master.BringToSafeop();
  story.master.BringToOp(std::move(task));
}

FrameIds OneCycle(Story& story) {
  story.master.Cycles(1);
  return story.master.last_cyclic();
}

}  // namespace

Sample LostFrames() {
  Story story;
  story.Add(AkdDrive());
  BringAllToOp(story);
  ScriptedMaster& master = story.master;
  const int base = master.next_cycle();
  for (const int lost : {20, 41, 42, 77}) master.ChangeCycle(base + lost, {.lose = true});
  master.Cycles(20);
  const FrameIds first = OneCycle(story);
  master.Cycles(70);
  master.ShutDown();
  story.Expect("frame-lost", -1, first, "cycles 20, 41, 42 and 77 after reaching OP").Times(4);
  return story.Finish();
}

Sample DuplicatedFrames() {
  Story story;
  story.Add(AkdDrive());
  BringAllToOp(story);
  ScriptedMaster& master = story.master;
  const int base = master.next_cycle();
  for (const int twice : {10, 25, 40}) master.ChangeCycle(base + twice, {.twice = true});
  master.Cycles(10);
  const FrameIds second_copy{.returned = OneCycle(story).again};
  master.Cycles(45);
  master.ShutDown();
  story.Expect("frame-duplicated", -1, second_copy, "three frames come back twice").Times(3);
  return story.Finish();
}

Sample Circulating() {
  Story story;
  story.Add(AkdDrive());
  story.Add(AkdDrive());
  BringAllToOp(story);
  ScriptedMaster& master = story.master;
  const int base = master.next_cycle();
  for (int i = 20; i < 26; ++i) master.ChangeCycle(base + i, {.circulating = true});
  master.Cycles(20);
  const FrameIds first = OneCycle(story);
  master.Cycles(30);
  master.ShutDown();
  story.Expect("frame-duplicated", -1, first, "the circulating bit is set in six returned frames").Times(6);
  return story.Finish();
}

Sample WkcLinkBreak() {
  Story story;
  for (int i = 0; i < 3; ++i) story.Add(AkdDrive());
  BringAllToOp(story, {.reads_al_status = true});
  ScriptedMaster& master = story.master;
  master.Cycles(30);
  story.bus.BreakBehind(2);
  const FrameIds broken = OneCycle(story);
  master.Cycles(39);
  story.bus.Heal();
  const FrameIds healed = OneCycle(story);
  master.Cycles(29);
  master.ShutDown();
  story.Expect("wkc-mismatch", 2, broken, "the working counter of the LRW falls from 9 to 6 for 40 cycles").Times(40);
  story.Expect("bus-slave-count-changed", -1, broken, "two slaves answer instead of three");
  story.Expect("bus-slave-count-changed", -1, healed, "three slaves again").Optional();
  return story.Finish();
}

Sample SecondMaster() {
  Story story;
  story.Add(AkdDrive());
  story.Add(AkdDrive());
  BringAllToOp(story, {.reads_al_status = true});
  ScriptedMaster& master = story.master;
  MasterWay way = WayOf("soem");
  way.mac = {0x00, 0x1B, 0x21, 0x0A, 0x0B, 0x0C};
  ScriptedMaster laptop(story.bus, story.capture, master.now(), way);
  FrameIds first;
  constexpr int kPolls = 12;
  for (int poll = 0; poll < kPolls; ++poll) {
    master.Cycles(5);
    laptop.WaitUntil(master.now() + 200'000);
    const Answer states = laptop.Brd(0x0130, 2);
    if (poll == 0) first = states.frame;
    laptop.Fprd(0x1001, 0x0130, 6);
  }
  master.Cycles(10);
  master.ShutDown();
  story.Expect("bus-second-master", -1, first, "a laptop polls the AL states while the controller runs")
      .Times(2 * kPolls);
  return story.Finish();
}

Sample DuplicateAddress() {
  Story story;
  story.Add(AkdDrive());
  story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  master.Bwr(reg::kAlControl, LeBytes(std::uint16_t{0x11}));
  master.Brd(reg::kInformation, 2);
  master.Apwr(0, reg::kStationAddress, LeBytes(std::uint16_t{0x1001}));
  const Answer second = master.Apwr(1, reg::kStationAddress, LeBytes(std::uint16_t{0x1001}));
  const Answer both = master.Fprd(0x1001, reg::kAlStatus, 6);
  story.Expect("bus-duplicate-address", 1, second.frame, "0x1001 is already the address of slave 0").Until(both.frame);
  story.Expect("wkc-mismatch", 1, both.frame, "two slaves answer to one address").Optional();
  master.Wait(5 * kMs);
  master.Apwr(1, reg::kStationAddress, LeBytes(std::uint16_t{0x1002}));
  master.Scan();
  master.BringToPreop();
  master.ShutDown();
  return story.Finish();
}

Sample SlaveCountChanges() {
  Story story;
  for (int i = 0; i < 3; ++i) story.Add(AkdDrive());
  BringAllToOp(story, {.reads_al_status = true});
  ScriptedMaster& master = story.master;
  master.Cycles(30);
  story.bus.BreakBehind(1);
  const FrameIds gone = OneCycle(story);
  master.Cycles(29);
  story.Expect("bus-slave-count-changed", -1, gone, "one slave answers instead of three");
  story.Expect("wkc-mismatch", -1, gone, "the working counter of the LRW falls from 9 to 3");
  return story.Finish();
}

Sample LinkErrors() {
  Story story;
  for (int i = 0; i < 3; ++i) story.Add(AkdDrive());
  BringAllToOp(story);
  ScriptedMaster& master = story.master;
  const auto read_counters = [&] {
    FrameIds of_second;
    for (std::size_t i = 0; i < 3; ++i) {
      const Answer answer = master.Fprd(master.station(i), reg::kRxErrors, 20);
      if (i == 1) of_second = answer.frame;
    }
    return of_second;
  };
  read_counters();
  master.Cycles(30);
  read_counters();
  story.bus.slave(1).esc().CountErrors(reg::kRxErrors + 2, 2);  // invalid frames at port 1
  story.bus.slave(1).esc().CountErrors(reg::kRxErrors + 3, 5);  // RX errors at port 1
  story.bus.slave(1).esc().CountErrors(reg::kLostLinks + 1, 1);
  master.Cycles(30);
  const FrameIds seen = read_counters();
  master.Cycles(20);
  master.ShutDown();
  story.Expect("bus-link-errors", 1, seen, "port 1: 2 invalid frames");
  story.Expect("bus-link-errors", 1, seen, "port 1: 5 RX errors").Optional();
  story.Expect("bus-link-errors", 1, seen, "port 1: 1 lost link").Optional();
  return story.Finish();
}

Sample EepromChecksum() {
  Story story;
  story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  master.Scan();
  for (std::uint16_t word = 0; word < 8; word += 2) master.ReadEeprom(0, word);
  // A station alias, but not the checksum over it.
  Bytes command = LeBytes(std::uint16_t{0x0201});
  AppendLe(command, std::uint32_t{0x0004});
  AppendLe(command, std::uint16_t{0x1234});
  const Answer written = master.Fpwr(master.station(0), reg::kEepromControl, command);
  story.Expect("eeprom-written", 0, written.frame, "the alias, and no checksum for it");
  master.Wait(5 * kMs);
  master.Fprd(master.station(0), reg::kEepromControl, 2);
  master.BringToPreop();
  master.ShutDown();
  return story.Finish();
}

Sample ReadOnlyWrite() {
  Story story;
  story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  const Answer refused = master.Fpwr(master.station(0), reg::kAlStatus, LeBytes(std::uint16_t{0x0004}));
  story.Expect("register-read-only-write", 0, refused.frame, "AL Status 0x0130 is written by the drive only");
  master.Poll(0, 2);
  master.ShutDown();
  return story.Finish();
}

Sample EepromAlias() {
  Story story;
  story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  master.Scan();
  for (std::uint16_t word = 0; word < 8; word += 2) master.ReadEeprom(0, word);
  Bytes head = story.bus.slave(0).esc().eeprom();
  StoreLe(head, 8, std::uint16_t{0x1234});
  head.resize(14);
  const auto write = [&](std::uint16_t word, std::uint16_t value) {
    Bytes command = LeBytes(std::uint16_t{0x0201});
    AppendLe(command, std::uint32_t{word});
    AppendLe(command, value);
    const FrameIds frame = master.Fpwr(master.station(0), reg::kEepromControl, command).frame;
    master.Wait(5 * kMs);
    master.Fprd(master.station(0), reg::kEepromControl, 2);
    return frame;
  };
  write(4, 0x1234);
  write(7, SiiChecksum(head));
  master.BringToPreop();
  master.ShutDown();
  return story.Finish();
}

Sample IdentityRepeated() {
  Story story;
  story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  master.Scan();
  story.Expect("identity-repeated", 0, "vendor ID and product code, read 8 times more; no state is requested");
  for (int i = 0; i < 8; ++i) {
    master.Wait(400 * kMs);
    master.ReadEeprom(0, 0x0008);
    master.ReadEeprom(0, 0x000A);
    master.Poll(0, 1, 0);
  }
  return story.Finish();
}

Sample NothingMapped() {
  Story story;
  story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  master.BringToSafeop();
  // The image lies at 0x00000000; the master exchanges it at 0x00010000.
  Datagram image{.command = Cmd::LRW, .data = Bytes(12, 0)};
  image.set_logical(0x0001'0000);
  for (int cycle = 0; cycle < 300; ++cycle) {
    master.Exchange({image});
    master.Wait(kMs);
  }
  story.Expect("wkc-never-right", -1, "LRW counts 0 in all frames");
  return story.Finish();
}

Sample EepromBlank() {
  Story story;
  SlaveDescription terminal = InputTerminal();
  terminal.esc.eeprom = Bytes(2048, 0xFF);
  story.Add(AkdDrive());
  story.Add(std::move(terminal));
  ScriptedMaster& master = story.master;
  master.Scan();
  story.Expect("eeprom-invalid", 1, "every word is 0xFFFF");
  for (int i = 0; i < 10; ++i) master.Poll(1, 1, 0);
  return story.Finish();
}

}  // namespace ecaudit::samples
