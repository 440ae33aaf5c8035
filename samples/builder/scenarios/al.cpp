// What goes wrong with AL state changes.
#include "samples/builder/scenarios/scenario.h"

namespace ecaudit::samples {
namespace {

// From INIT to OP and down again, the right way.
void FinishFromInit(Story& story) {
  story.master.BringToPreop();
  story.master.BringToSafeop();
  story.master.BringToOp();
  story.master.Cycles(20);
  story.master.ShutDown();
}

}  // namespace

Sample InitToOpRefused() {
  Story story;
  story.Add(AkdDrive());
  story.master.Scan();
  const AlAnswer refused = story.master.ChangeState(0, Al::kOp);
  story.Expect("al-illegal-transition", 0, refused.request, "INIT to OP");
  story.Expect("al-refused", 0, refused.status_read, "AL status 0x0011, code 0x0011");
  story.master.Acknowledge(0, Al::kInit);
  FinishFromInit(story);
  return story.Finish();
}

Sample RefusalNeverAcknowledged() {
  MasterWay way;
  way.always_acknowledges = false;
  way.poll_interval = 20 * kMs;
  Story story(way);
  story.Add(AkdDrive());
  story.master.Scan();
  story.master.SetUpMailbox(0);
  const AlAnswer refused = story.master.ChangeState(0, Al::kSafeop);
  story.Expect("al-illegal-transition", 0, refused.request, "INIT to SAFEOP");
  story.Expect("al-refused", 0, refused.status_read, "AL status 0x0011, code 0x0011");
  FrameIds first{};
  for (int i = 0; i < 3; ++i) {
    const AlAnswer ignored = story.master.ChangeState(0, Al::kPreop, 200 * kMs);
    if (i == 0) first = ignored.request;
  }
  story.Expect("al-error-not-acknowledged", 0, first, "PREOP requested as 0x0002 while the error bit is set").Times(3);
  return story.Finish();
}

Sample FallsOutOfOp() {
  Story story;
  story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  // The watchdog of 100 ms, written so that the capture shows it.
  master.Fpwr(master.station(0), reg::kWatchdogDivider, LeBytes(std::uint16_t{2498}));
  master.Fpwr(master.station(0), reg::kWatchdogProcessData, LeBytes(std::uint16_t{1000}));
  master.BringToSafeop();
  master.BringToOp();
  story.EnableDrive(0);
  story.Move(0, 0, 2000, 20);
  story.DisableDrive(0, 2000);
  story.Command(0, 0, 2000);
  master.Cycles(6);
  master.StopCyclic();
  FrameIds fallen{};
  for (int i = 0; i < 13; ++i) {
    master.Wait(10 * kMs);
    const AlAnswer answer = master.Poll(0, 8, 0);
    if (answer.error && !fallen.sent) fallen = answer.status_read;
  }
  master.StartCyclic({});
  master.Cycles(1);
  const FrameIds late = master.last_cyclic();
  story.Expect("sync-watchdog-margin", 0, late, "130 ms without process data, watchdog 100 ms");
  story.Expect("al-unexpected-change", 0, fallen, "OP to SAFEOP+ERR, code 0x001B");
  story.Expect("al-undocumented-status-code", 0, fallen, "0x001B is not in the manual's list").Optional();
  master.Acknowledge(0, Al::kSafeop);
  master.ChangeState(0, Al::kOp);
  master.Cycles(10);
  master.ShutDown();
  return story.Finish();
}

Sample TwoSlavesOneRefuses() {
  Story story;
  story.Add(AkdDrive());
  story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  for (const std::uint16_t assignment : {std::uint16_t{0x1C12}, std::uint16_t{0x1C13}}) {
    master.Upload(1, assignment, 0);
    master.Upload(1, assignment, 1);
  }
  master.SetUpProcessData(0);
  master.SetUpProcessData(1, std::uint16_t{8});  // the PDOs need 6 bytes
  master.MapProcessImage();
  const FrameIds request = master.RequestAll(0x14);
  master.Wait(kMs);
  master.Poll(0, 4);
  const AlAnswer refused = master.Poll(1, 4);
  story.Expect("sm-process-config", 1, request, "SM2 has 8 bytes, PDO 1701h needs 6");
  story.Expect("al-refused", 1, refused.status_read, "AL status 0x0012, code 0x0017");
  master.Acknowledge(1, Al::kPreop);
  master.DisableSyncManager(1, 2);
  master.DisableSyncManager(1, 3);
  master.SetUpProcessData(1);
  master.ChangeState(0, Al::kPreop);
  master.MapProcessImage();
  master.ChangeState(0, Al::kSafeop);
  master.ChangeState(1, Al::kSafeop);
  master.BringToOp();
  master.Cycles(20);
  master.ShutDown();
  return story.Finish();
}

Sample BadMailboxConfig() {
  Story story;
  story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  master.Scan();
  const std::uint16_t station = master.station(0);
  // SM0 ends 64 bytes early; SM1 is right.
  master.Fpwr(station, reg::kSyncManager, {0x00, 0x18, 0x40, 0x00, 0x26, 0x00, 0x01, 0x00});
  master.Fpwr(station, reg::kSyncManager + 8, {0x00, 0x1C, 0x80, 0x00, 0x22, 0x00, 0x01, 0x00});
  const AlAnswer refused = master.ChangeState(0, Al::kPreop);
  story.Expect("sm-mailbox-config", 0, refused.request, "SM0 has 64 bytes, the EEPROM says 128");
  story.Expect("al-refused", 0, refused.status_read, "AL status 0x0011, code 0x0017");
  master.Acknowledge(0, Al::kInit);
  master.DisableSyncManager(0, 0);
  master.DisableSyncManager(0, 1);
  master.BringToPreop();
  master.Upload(0, 0x1018, 1);
  master.ShutDown();
  return story.Finish();
}

Sample AlTimeout() {
  MasterWay way;
  way.poll_interval = 40 * kMs;
  Story story(way);
  SimulatedSlave& drive = story.Add(AkdDrive());
  drive.Override({.to = 2, .action = AlOverride::Action::kIgnore, .times = 1});
  ScriptedMaster& master = story.master;
  master.Scan();
  master.SetUpMailbox(0);
  const AlAnswer silent = master.ChangeState(0, Al::kPreop, 3'600 * kMs);
  story.Expect("al-timeout", 0, silent.request, "no PREOP and no error for 3.6 s of polling, limit 3 s")
      .Until(silent.status_read);
  master.ChangeState(0, Al::kPreop);
  master.ChangeState(0, Al::kInit);
  return story.Finish();
}

Sample WrongStatusCode() {
  Story story;
  SimulatedSlave& drive = story.Add(AkdDrive());
  drive.Override({.from = 1, .to = 8, .action = AlOverride::Action::kRefuse, .code = 0x0017, .times = 1});
  story.master.Scan();
  const AlAnswer refused = story.master.ChangeState(0, Al::kOp);
  story.Expect("al-illegal-transition", 0, refused.request, "INIT to OP");
  story.Expect("al-refused", 0, refused.status_read, "AL status 0x0011, code 0x0017");
  story.Expect("al-wrong-status-code", 0, refused.status_read, "0x0017 where the manual says 0x0011");
  story.master.Acknowledge(0, Al::kInit);
  FinishFromInit(story);
  return story.Finish();
}

Sample UndocumentedStatusCode() {
  Story story;
  SimulatedSlave& drive = story.Add(AkdDrive());
  drive.Override({.from = 2, .to = 4, .action = AlOverride::Action::kRefuse, .code = 0x001D, .times = 1});
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  master.SetUpProcessData(0);
  master.MapProcessImage();
  const AlAnswer refused = master.ChangeState(0, Al::kSafeop);
  story.Expect("al-refused", 0, refused.status_read, "AL status 0x0012, code 0x001D");
  story.Expect("al-undocumented-status-code", 0, refused.status_read, "the manual lists 0x0000, 0x0011 and 0x0017");
  master.Acknowledge(0, Al::kPreop);
  master.ChangeState(0, Al::kSafeop);
  master.BringToOp();
  master.Cycles(20);
  master.ShutDown();
  return story.Finish();
}

Sample WatchdogTimeZero() {
  Story story;
  SimulatedSlave& drive = story.Add(AkdDrive());
  drive.Override({.from = 2, .to = 4, .action = AlOverride::Action::kRefuse, .code = 0x001F, .times = 1});
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  master.Fpwr(master.station(0), reg::kWatchdogDivider, LeBytes(std::uint16_t{2498}));
  master.Fpwr(master.station(0), reg::kWatchdogProcessData, LeBytes(std::uint16_t{0}));
  master.SetUpProcessData(0);
  master.MapProcessImage();
  const AlAnswer refused = master.ChangeState(0, Al::kSafeop);
  story.Expect("al-refused", 0, refused.status_read, "AL status 0x0012, code 0x001F: 0x0420 is 0");
  story.Expect("al-undocumented-status-code", 0, refused.status_read, "the manual lists 0x0000, 0x0011 and 0x0017");
  master.Acknowledge(0, Al::kPreop);
  master.Fpwr(master.station(0), reg::kWatchdogProcessData, LeBytes(std::uint16_t{1000}));
  master.ChangeState(0, Al::kSafeop);
  master.BringToOp();
  master.Cycles(20);
  master.ShutDown();
  return story.Finish();
}

Sample AcceptedIllegal() {
  Story story;
  SimulatedSlave& drive = story.Add(AkdDrive());
  drive.Override({.from = 2, .to = 8, .action = AlOverride::Action::kAccept});
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  master.SetUpProcessData(0);
  master.MapProcessImage();
  master.StartCyclic({});
  master.Cycles(5);
  const AlAnswer accepted = master.ChangeState(0, Al::kOp);
  story.Expect("al-illegal-transition", 0, accepted.request, "PREOP to OP");
  story.Expect("al-accepted-illegal", 0, accepted.status_read, "the drive goes to OP");
  master.Cycles(20);
  master.ShutDown();
  return story.Finish();
}

Sample InvalidRequest() {
  Story story;
  story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  const FrameIds request = master.Request(0, 0x0005);
  master.Wait(kMs);
  const AlAnswer refused = master.Poll(0, 5);
  story.Expect("al-invalid-request", 0, request, "state 5 does not exist");
  story.Expect("al-refused", 0, refused.status_read, "AL status 0x0012, code 0x0011");
  master.Acknowledge(0, Al::kPreop);
  master.BringToSafeop();
  master.BringToOp();
  master.Cycles(20);
  master.ShutDown();
  return story.Finish();
}

Sample ErrorStanding() {
  Story story;
  SimulatedSlave& drive = story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  story.capture.Pause();
  master.Scan();
  master.BringToPreop();
  master.BringToSafeop();
  master.BringToOp();
  master.Cycles(20);
  drive.ChangeStatusAt(master.now() + 3 * kMs, 0x0014, 0x001B);
  master.Cycles(10);
  story.capture.Resume();
  const AlAnswer first = master.Poll(0, 8, 0);
  story.Expect("al-error-standing", 0, first.status_read, "SAFEOP+ERR, code 0x001B, from the first read on");
  for (int i = 0; i < 10; ++i) {
    master.Cycles(5);
    master.Poll(0, 8, 0);
  }
  return story.Finish();
}

Sample UnexpectedErrorUnread() {
  MasterWay way;
  way.reads_status_code = false;
  Story story(way);
  SimulatedSlave& drive = story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  master.BringToSafeop();
  master.BringToOp();
  master.Cycles(20);
  drive.ChangeStatusAt(master.now() + 3 * kMs, 0x0014, 0x0017);
  master.Cycles(5);
  const AlAnswer fallen = master.Poll(0, 8, 0);
  story.Expect("al-unexpected-change", 0, fallen.status_read, "OP to SAFEOP+ERR without a request");
  story.Expect("al-status-code-unread", 0, fallen.status_read, "only 0x0130 is read, never 0x0134");
  master.Acknowledge(0, Al::kSafeop);
  master.ChangeState(0, Al::kOp);
  master.Cycles(10);
  master.ShutDown();
  return story.Finish();
}

}  // namespace ecaudit::samples
