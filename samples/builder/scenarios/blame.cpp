// Who causes it: the computer of the master, the cable, a slave, or the recorder.
#include <functional>

#include "samples/builder/scenarios/scenario.h"

namespace ecaudit::samples {
namespace {

/// Changes the bytes of all packets recorded since `from`.
void ForEachPacket(Story& story, PacketId from, const std::function<void(Bytes&)>& change) {
  for (PacketId id = from; id < story.capture.recorded(); ++id) change(story.capture.bytes(id));
}

constexpr std::size_t kEtherCatHeader = 14;

void CountWholeFrame(Bytes& packet) {
  const std::size_t datagrams = LoadLe<std::uint16_t>(packet, kEtherCatHeader) & 0x07FFU;
  packet.resize(kEtherCatHeader + 2 + datagrams);
  const std::size_t header = packet.size() | 0x1000U;
  packet[kEtherCatHeader] = static_cast<std::uint8_t>(header & 0xFFU);
  packet[kEtherCatHeader + 1] = static_cast<std::uint8_t>(header >> 8U);
}

/// A master of 16 numbers leaves out some.
void LeaveOutNumbers(Bytes& packet) {
  constexpr std::uint8_t kLeftOut = 5;
  std::size_t at = kEtherCatHeader + 2;
  for (bool more = true; more;) {
    packet[at + 1] = static_cast<std::uint8_t>((packet[at + 1] + kLeftOut) % 16U);
    const auto length = LoadLe<std::uint16_t>(packet, at + 6);
    more = (length & 0x8000U) != 0;
    at += 12U + (length & 0x07FFU);
  }
}

/// The frame check sequence of Ethernet behind the packet.
void AppendCheckSequence(Bytes& packet) {
  std::uint32_t crc = 0xFFFFFFFFU;
  for (const std::uint8_t byte : packet) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc >> 1U) ^ ((crc & 1U) != 0 ? 0xEDB88320U : 0U);
  }
  crc = ~crc;
  for (unsigned i = 0; i < 4; ++i) packet.push_back(static_cast<std::uint8_t>(crc >> 8U * i & 0xFFU));
}

void DriveInPreop(Story& story) {
  story.Add(AkdDrive());
  story.master.Scan();
  story.master.BringToPreop();
}

/// With the assignments read: what the process data hold shows in the capture.
void DriveEnabled(Story& story) {
  DriveInPreop(story);
  for (const std::uint16_t assignment : {std::uint16_t{0x1C12}, std::uint16_t{0x1C13}}) {
    story.master.Upload(0, assignment, 0);
    story.master.Upload(0, assignment, 1);
  }
  story.master.BringToSafeop();
  story.master.BringToOp();
  story.EnableDrive(0);
}

}  // namespace

Sample SwitchOnTheBus() {
  Story story;
  DriveInPreop(story);
  ScriptedMaster& master = story.master;
  const Bytes hello{0x01, 0x80, 0xC2, 0x00, 0x00, 0x00, 0x00, 0x1B, 0x21, 0x33, 0x44, 0x55, 0x00, 0x27, 0x42,
                    0x42, 0x03, 0x00, 0x00, 0x02, 0x02, 0x3C, 0x80, 0x00, 0x00, 0x1B, 0x21, 0x33, 0x44, 0x55,
                    0x00, 0x00, 0x00, 0x00, 0x80, 0x00, 0x00, 0x1B, 0x21, 0x33, 0x44, 0x55, 0x80, 0x01, 0x00,
                    0x00, 0x14, 0x00, 0x02, 0x00, 0x0F, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00};
  const PacketId first = master.Foreign(hello);
  master.Upload(0, 0x1018, 1);
  master.Wait(2'000 * kMs);
  master.Foreign(hello);
  master.ShutDown();
  story.Expect("bus-switch", -1, FrameIds{.sent = first}, "spanning tree from another sender");
  return story.Finish();
}

Sample IrregularMaster() {
  Story story;
  story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  master.SetUpClocks(8);
  master.BringToSafeop();
  master.StartSync0(0, static_cast<std::uint32_t>(kMs));
  // SYNC0 begins a while after it is switched on.
  master.Wait(120 * kMs);
  master.WaitUntil((master.now() / kMs + 1) * kMs + kMs * 8 / 10);
  master.BringToOp({.cycle = kMs, .distributes_time = true});
  master.Cycles(30);
  // The first ones stay within their interval.
  int next = master.next_cycle();
  for (int i = 0; i < 20; ++i) master.ChangeCycle(next + i, {.shift = i % 2 == 0 ? 300'000 : -300'000});
  master.Cycles(20);
  next = master.next_cycle();
  for (int i = 0; i < 40; i += 4) master.ChangeCycle(next + i, {.shift = 700'000});
  master.Cycles(2);
  const FrameIds until = master.last_cyclic();
  master.Cycles(40);
  story.Expect("sync-window-violation", 0, "frames 700 us late: an interval without and one with two").Until(until);
  story.Expect("sync-window-violation", 0, "the other kind of interval").Optional();
  master.ShutDown();
  return story.Finish();
}

Sample CheckSequences() {
  Story story;
  PlayHealthyRun(story);
  ForEachPacket(story, 0, AppendCheckSequence);
  return story.Finish();
}

Sample EightLostThenFault() {
  Story story;
  DriveEnabled(story);
  story.Move(0, 0, 2000, 40);
  const int next = story.master.next_cycle();
  for (int i = 0; i < 8; ++i) story.master.ChangeCycle(next + i, {.lose = true});
  story.master.Cycles(8);
  story.Expect("frame-lost", -1, "eight frames in a row").Times(8);
  story.bus.slave(0).drive().FaultAt(story.master.now());
  story.master.Cycles(30);
  story.Expect("drive-fault", 0, "the fault that follows");
  story.Expect("sync-lost", 0, "eight frames missing: F125").Optional();
  story.master.ShutDown();
  return story.Finish();
}

Sample SdoStopsProcessData() {
  Story story;
  DriveInPreop(story);
  ScriptedMaster& master = story.master;
  master.BringToSafeop();
  master.BringToOp();
  master.Cycles(40);
  master.StopCyclic();
  story.bus.slave(0).coe().behaviour().reads_requests = false;
  master.WriteMailbox(0, 3, {0x00, 0x20, 0x40, 0x60, 0x60, 0x00, 0x00, 0x00, 0x00, 0x00});
  for (int i = 0; i < 38; ++i) {
    master.Wait(4 * kMs);
    master.Fprd(master.station(0), reg::kSyncManager + 13, 1);
  }
  story.bus.slave(0).coe().behaviour().reads_requests = true;
  master.ReadMailbox(0, 100 * kMs);
  master.StartCyclic({});
  master.Cycles(1);
  story.Expect("sync-watchdog-margin", 0, "152 ms without outputs, while the master waits for 6060h")
      .Until(master.last_cyclic());
  master.Cycles(20);
  return story.Finish();
}

Sample NumbersLeftOut() {
  Story story;
  story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  const PacketId from = story.capture.recorded();
  master.Fpwr(master.station(0), reg::kWatchdogDivider, LeBytes(std::uint16_t{2498}));
  master.Fpwr(master.station(0), reg::kWatchdogProcessData, LeBytes(std::uint16_t{1000}));
  master.BringToSafeop();
  master.BringToOp();
  master.Cycles(20);
  const Answer off = master.Fpwr(master.station(0), reg::kFmmu + 12, {0});
  story.Expect("fmmu-inactive", 0, off.frame, "FMMU0, which carries the outputs, is switched off in OP");
  master.Cycles(1);
  story.Expect("wkc-mismatch", 0, master.last_cyclic(), "working counter 1 instead of 3").Optional();
  master.Cycles(60);
  ForEachPacket(story, from, LeaveOutNumbers);
  return story.Finish();
}

/// As a master that was seen to do so: its header counts the whole Ethernet frame, which is not padded.
Sample WholeFrameLengths() {
  MasterWay way;
  way.mailbox_interval = 50 * kMs;
  Story story(way);
  SimulatedSlave& drive = story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  master.Upload(0, 0x1008, 0);
  drive.coe().behaviour().reads_requests = false;
  const SdoAnswer ignored = master.Upload(0, 0x1018, 1);
  story.Expect("mailbox-no-response", 0, ignored.request, "1018h:1; the out mailbox stays full");
  const SdoAnswer refused = master.Upload(0, 0x1018, 2);
  story.Expect("mailbox-overrun", 0, refused.request, "working counter 0").Optional();
  ForEachPacket(story, 0, CountWholeFrame);
  return story.Finish();
}

Sample ReferenceClockWritten() {
  Story story(WayOf("igh"));
  story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  master.Fpwr(master.station(0), reg::kWatchdogDivider, LeBytes(std::uint16_t{2498}));
  master.Fpwr(master.station(0), reg::kWatchdogProcessData, LeBytes(std::uint16_t{1000}));
  master.SetUpClocks(8);
  master.BringToSafeop();
  master.BringToOp({.cycle = kMs, .distributes_time = true});
  const auto with_time = [&](int cycles) {
    for (int i = 0; i < cycles; ++i) {
      master.Cycles(1);
      master.Fpwr(master.station(0), reg::kSystemTime, LeBytes(static_cast<std::uint64_t>(master.now())));
    }
  };
  with_time(60);
  for (int i = 0; i < 141; ++i) master.ChangeCycle(master.next_cycle() + i, {.skip = true});
  master.Cycles(141);
  with_time(1);
  story.Expect("sync-watchdog-margin", 0, "142 ms without outputs, watchdog 100 ms").Until(master.last_cyclic());
  with_time(10);
  const AlAnswer fallen = master.Poll(0, 8, 0);
  story.Expect("al-unexpected-change", 0, fallen.status_read, "OP to SAFEOP+ERR, code 0x001B").Optional();
  story.Expect("al-undocumented-status-code", 0, fallen.status_read, "0x001B is not in the manual's list").Optional();
  return story.Finish();
}

/// The second drive of three has its cables swapped: the frame passes it on its way to the third one, and it is
/// processed there on its way back.
Sample PortsSwapped() {
  Story story;
  for (int i = 0; i < 3; ++i) story.Add(AkdDrive());
  story.bus.slave(1).esc().SetLink(1, false);
  story.bus.slave(2).esc().SetLink(1, true);
  story.bus.slave(2).esc().SwapPorts();
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  FrameIds status;
  for (std::size_t i = 0; i < 3; ++i) status = master.Fprd(master.station(i), reg::kDlStatus, 2).frame;
  master.SetUpClocks(8);
  story.Expect("bus-port-order", 2, status, "two open ports at the last slave, and port 1 before port 0")
      .Until(master.Fprd(master.station(2), reg::kDlStatus, 2).frame);
  master.BringToSafeop();
  master.BringToOp();
  master.Cycles(20);
  master.ShutDown();
  return story.Finish();
}

}  // namespace ecaudit::samples
