// Who causes it: the computer of the master, the cable, a slave, or the recorder.
#include <functional>

#include "samples/builder/scenarios/scenario.h"

namespace ecaudit::samples {
namespace {

/// Changes the bytes of all packets recorded since `from`.
void ForEachPacket(Story& story, PacketId from, const std::function<void(Bytes&)>& change) {
  for (PacketId id = from; id < story.capture.recorded(); ++id) change(story.capture.bytes(id));
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

}  // namespace ecaudit::samples
