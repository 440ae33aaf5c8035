// What does not happen, although it should.
#include "samples/builder/scenarios/scenario.h"

namespace ecaudit::samples {
namespace {

/// The watchdog of 100 ms, written so that the capture shows it.
void WriteWatchdog(Story& story, std::size_t position) {
  ScriptedMaster& master = story.master;
  master.Fpwr(master.station(position), reg::kWatchdogDivider, LeBytes(std::uint16_t{2498}));
  master.Fpwr(master.station(position), reg::kWatchdogProcessData, LeBytes(std::uint16_t{1000}));
}

}  // namespace

Sample FmmuSwitchedOff() {
  Story story;
  story.Add(AkdDrive());
  // A terminal has no outputs, and so no FMMU for them.
  story.Add(InputTerminal());
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  WriteWatchdog(story, 0);
  master.BringToSafeop();
  master.BringToOp();
  master.Cycles(20);
  const Answer off = master.Fpwr(master.station(0), reg::kFmmu + 12, {0});
  story.Expect("fmmu-inactive", 0, off.frame, "FMMU0, which carries the outputs, is switched off in OP");
  master.Cycles(1);
  story.Expect("wkc-mismatch", 0, master.last_cyclic(), "working counter 2 instead of 4").Optional();
  FrameIds fallen{};
  for (int i = 0; i < 13; ++i) {
    master.Cycles(10);
    const AlAnswer answer = master.Poll(0, 8, 0);
    if (answer.error && !fallen.sent) fallen = answer.status_read;
  }
  story.Expect("sync-watchdog-margin", 0, "no outputs for longer than the watchdog").Optional();
  story.Expect("al-unexpected-change", 0, fallen, "OP to SAFEOP+ERR, code 0x001B");
  story.Expect("al-undocumented-status-code", 0, fallen, "0x001B is not in the manual's list").Optional();
  return story.Finish();
}

Sample ProcessDataStop() {
  Story story;
  story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  WriteWatchdog(story, 0);
  master.BringToSafeop();
  master.BringToOp();
  master.Cycles(30);
  // 30 ms without do not reach half of the watchdog.
  for (int i = 0; i < 30; ++i) master.ChangeCycle(master.next_cycle() + i, {.skip = true});
  master.Cycles(60);
  master.StopCyclic();
  // What goes on are frames that carry no process data; nobody looks at AL Status.
  for (int i = 0; i < 26; ++i) {
    master.Wait(50 * kMs);
    master.Fprd(master.station(0), reg::kDlStatus, 2);
  }
  story.Expect("sync-watchdog-margin", 0, "no process data for 1.3 s before the end, watchdog 100 ms");
  return story.Finish();
}

Sample OpWithoutProcessData() {
  Story story;
  story.Add(AkdDrive());
  story.Add(AkdDrive());
  story.Add(InputTerminal());
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  WriteWatchdog(story, 0);
  WriteWatchdog(story, 1);
  master.BringToSafeop();
  for (const std::size_t slave : {0U, 1U, 2U}) {
    master.ChangeState(slave, Al::kOp);
    if (slave != 2) story.Expect("sync-watchdog-margin", static_cast<int>(slave), "OP requested, and nothing flows");
  }
  // Frames of another kind go on, so that nobody takes the pause for a hole in the capture.
  for (int i = 0; i < 40; ++i) {
    master.Wait(5 * kMs);
    master.Fprd(master.station(0), reg::kDlStatus, 2);
  }
  return story.Finish();
}

Sample BroadcastShowsError() {
  Story story;
  story.Add(AkdDrive());
  SimulatedSlave& second = story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  master.BringToSafeop();
  // While the drives go to OP one after the other the broadcasts show SAFEOP and OP: requested, and no mixture to tell.
  master.BringToOp({.reads_al_status = true});
  master.Cycles(30);
  second.ChangeStatusAt(master.now(), 0x0014, 0x001B);
  master.Cycles(1);
  story.Expect("al-unexpected-change", -1, master.last_cyclic(), "BRD 0x0130 turns from 0x08 to 0x1C");
  master.Cycles(150);
  return story.Finish();
}

Sample BroadcastShowsAllFall() {
  Story story;
  SimulatedSlave& first = story.Add(AkdDrive());
  SimulatedSlave& second = story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  master.BringToSafeop();
  master.BringToOp({.reads_al_status = true});
  master.Cycles(30);
  first.ChangeStatusAt(master.now(), 0x0014, 0x001A);
  second.ChangeStatusAt(master.now(), 0x0004, 0x0000);
  master.Cycles(1);
  story.Expect("al-unexpected-change", -1, master.last_cyclic(), "BRD 0x0130 turns from 0x08 to 0x14");
  master.Cycles(150);
  return story.Finish();
}

Sample OpWaitsForProcessData() {
  MasterWay way;
  way.poll_interval = 100 * kMs;
  Story story(way);
  SimulatedSlave& drive = story.Add(AkdDrive());
  drive.Override({.to = 8, .action = AlOverride::Action::kIgnore, .times = 1});
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  master.BringToSafeop();
  const AlAnswer silent = master.ChangeState(0, Al::kOp, 10'600 * kMs);
  story.Expect("sync-watchdog-margin", 0, silent.request, "OP requested, and no outputs are sent")
      .Until(silent.status_read);
  story.Expect("al-timeout", 0, silent.request, "no OP and no error, as nothing flows").Until(silent.status_read);
  return story.Finish();
}

}  // namespace ecaudit::samples
