// More than one start in a file, and captures that begin with a request.
#include "samples/builder/scenarios/scenario.h"

namespace ecaudit::samples {
namespace {

Datagram DatagramOf(Cmd command, std::uint16_t adp, std::uint16_t ado, Bytes data) {
  Datagram d;
  d.command = command;
  d.adp = adp;
  d.ado = ado;
  d.data = std::move(data);
  return d;
}

/// Asks all slaves for a state, reads what they are in and clears some of their registers: seven datagrams in a frame.
Answer RequestInFullFrame(ScriptedMaster& master, std::uint16_t control) {
  return master
      .Exchange({DatagramOf(Cmd::BWR, 0, reg::kAlControl, LeBytes(control)),
                 DatagramOf(Cmd::BRD, 0, reg::kAlStatus, Bytes(2, 0)),
                 DatagramOf(Cmd::BRD, 0, reg::kInformation, Bytes(1, 0)),
                 DatagramOf(Cmd::BWR, 0, reg::kEventMask, LeBytes(std::uint16_t{4})),
                 DatagramOf(Cmd::BWR, 0, reg::kRxErrors, Bytes(8, 0)),
                 DatagramOf(Cmd::BWR, 0, reg::kFilterDepth, LeBytes(std::uint16_t{0x0C00})),
                 DatagramOf(Cmd::BRD, 0, reg::kDlStatus, Bytes(2, 0))})
      .front();
}

/// A drive and four terminals, in OP before the capture begins.
void FiveInOpUnseen(Story& story) {
  story.capture.Pause();
  story.Add(AkdDrive());
  for (int i = 0; i < 4; ++i) story.Add(InputTerminal());
  story.master.Scan();
  story.master.BringToPreop();
  story.master.BringToSafeop();
  story.master.BringToOp();
  story.master.Cycles(10);
  story.master.StopCyclic();
}

/// From the scan to OP with SYNC0 of `sync0`, and `cycles` cycles half of it behind SYNC0.
void RunWithClocks(Story& story, TimeNs sync0, TimeNs cycle, int cycles) {
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  master.SetUpClocks(8);
  master.BringToSafeop();
  for (const std::size_t drive : {0U, 1U}) master.StartSync0(drive, static_cast<std::uint32_t>(sync0));
  master.WaitUntil((master.now() / sync0 + 1) * sync0 + cycle / 2);
  master.BringToOp({.cycle = cycle, .distributes_time = true, .reads_al_status = true});
  master.Cycles(cycles);
}

/// A drive in OP whose master reads the time of position 0 and speaks to 0x1001.
SimulatedSlave& TimedByPosition(Story& story) {
  SimulatedSlave& drive = story.Add(AkdDrive());
  story.capture.Pause();
  story.master.Scan();
  story.master.BringToPreop();
  story.master.SetUpClocks(4);
  story.master.BringToSafeop();
  story.master.BringToOp({.distributes_time = true});
  story.master.Cycles(20);
  story.capture.Resume();
  story.master.Cycles(30);
  return drive;
}

MasterWay TimeByPosition() {
  MasterWay way = WayOf("soem");
  way.time.command = Cmd::ARMW;
  return way;
}

}  // namespace

Sample BroadcastFirst() {
  MasterWay way = WayOf("kickcat");
  way.numbering.others = Numbering::Others::kSame;
  Story story(way);
  FiveInOpUnseen(story);
  story.capture.Resume();
  RequestInFullFrame(story.master, 0x0011);
  story.master.Wait(20 * kMs);
  story.master.Scan();
  story.master.BringToPreop();
  story.master.BringToSafeop();
  story.master.BringToOp({.reads_al_status = true});
  story.master.Cycles(20);
  return story.Finish();
}

Sample BroadcastFirstRefused() {
  MasterWay way = WayOf("kickcat");
  way.always_acknowledges = true;
  Story story(way);
  story.capture.Pause();
  story.Add(AkdDrive());
  story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  master.SetUpProcessData(0);
  master.SetUpProcessData(1, std::uint16_t{8});
  master.MapProcessImage();
  story.capture.Resume();
  RequestInFullFrame(master, 0x0014);
  master.Wait(kMs);
  master.Poll(0, 4);
  const AlAnswer refused = master.Poll(1, 4);
  story.Expect("al-refused", 1, refused.status_read, "AL status 0x0012, code 0x0017");
  master.Acknowledge(1, Al::kPreop);
  master.ChangeState(0, Al::kPreop);
  return story.Finish();
}

Sample RestartOtherCycle() {
  Story story;
  story.Add(AkdDrive());
  story.Add(AkdDrive());
  RunWithClocks(story, kMs, kMs, 30);
  story.master.ShutDown();
  story.master.Wait(300 * kMs);
  RunWithClocks(story, 2 * kMs, 2 * kMs, 30);
  story.master.ShutDown();
  return story.Finish();
}

Sample RestartWrongCycle() {
  Story story;
  story.Add(AkdDrive());
  story.Add(AkdDrive());
  RunWithClocks(story, kMs, kMs, 30);
  story.master.ShutDown();
  story.master.Wait(300 * kMs);
  RunWithClocks(story, 3 * kMs, 2 * kMs, 80);
  story.Expect("sync-cycle-mismatch", 0, "SYNC0 3 ms, frames every 2 ms");
  story.Expect("sync-cycle-mismatch", 1, "SYNC0 3 ms, frames every 2 ms");
  story.Expect("sync-window-violation", 0, "two frames between two pulses").Optional();
  story.Expect("sync-window-violation", 1, "two frames between two pulses").Optional();
  story.master.ShutDown();
  return story.Finish();
}

Sample TwoRecordings() {
  constexpr TimeNs kHour = 3'600'000 * kMs;
  Story story;
  story.Add(AkdDrive());
  story.Add(AkdDrive());
  RunWithClocks(story, kMs, kMs, 40);
  // The second recording is of another day, by a computer whose clock is two weeks behind.
  story.capture.Pause();
  story.master.ShutDown();
  story.master.Wait(20 * kHour);
  RunWithClocks(story, 2 * kMs, 2 * kMs, 40);
  story.capture.Resume();
  story.capture.clock_ahead = -14 * 24 * kHour;
  story.master.Cycles(1);
  story.Expect("capture-spliced", -1, story.master.last_cyclic(), "the clock jumps back by thirteen days");
  story.master.Cycles(60);
  return story.Finish();
}

Sample LongPause() {
  Story story;
  story.Add(AkdDrive());
  story.master.Scan();
  story.master.BringToPreop();
  story.master.Upload(0, 0x1018, 1);
  story.master.Wait(600'000 * kMs);
  story.master.Upload(0, 0x1018, 2);
  story.master.BringToSafeop();
  story.master.BringToOp();
  story.master.Cycles(20);
  story.master.ShutDown();
  return story.Finish();
}

Sample PositionAndStation() {
  Story story(TimeByPosition());
  TimedByPosition(story);
  story.master.ShutDown();
  return story.Finish();
}

Sample PositionAndStationFalls() {
  Story story(TimeByPosition());
  SimulatedSlave& drive = TimedByPosition(story);
  story.master.Poll(0, 8);
  drive.ChangeStatusAt(story.master.now() + 2 * kMs, 0x0014, 0x001B);
  story.master.Cycles(5);
  const AlAnswer fallen = story.master.Poll(0, 8, 0);
  story.Expect("al-unexpected-change", 0, fallen.status_read, "OP to SAFEOP+ERR, code 0x001B");
  story.Expect("al-undocumented-status-code", 0, fallen.status_read).Optional();
  story.master.Acknowledge(0, Al::kSafeop);
  story.master.ShutDown();
  return story.Finish();
}

}  // namespace ecaudit::samples
