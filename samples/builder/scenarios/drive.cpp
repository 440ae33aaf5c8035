// Drives that are commanded wrongly, or that fault.
#include "samples/builder/scenarios/scenario.h"

namespace ecaudit::samples {
namespace {

/// Cycles until the status word of the drive (6041h, behind the position) has these bits, at most `most`.
FrameIds CyclesUntil(Story& story, std::uint16_t mask, std::uint16_t value, int most) {
  for (int i = 0; i < most; ++i) {
    story.master.Cycles(1);
    const Bytes inputs = story.master.inputs(0);
    if (inputs.size() >= 6 && (LoadLe<std::uint16_t>(inputs, 4) & mask) == value) break;
  }
  return story.master.last_cyclic();
}

/// PREOP, with the assignments read: what the process data hold shows in the capture.
void ToPreop(Story& story) {
  story.master.Scan();
  story.master.BringToPreop();
  for (const std::uint16_t assignment : {std::uint16_t{0x1C12}, std::uint16_t{0x1C13}}) {
    story.master.Upload(0, assignment, 0);
    story.master.Upload(0, assignment, 1);
  }
}

void BringToOp(Story& story, TimeNs cycle = kMs) {
  ToPreop(story);
  story.master.BringToSafeop();
  story.master.BringToOp({.cycle = cycle});
}

/// The first frame with this control word.
FrameIds CommandOnce(Story& story, std::uint16_t control) {
  story.Command(0, control);
  story.master.Cycles(1);
  return story.master.last_cyclic();
}

}  // namespace

Sample DriveFault() {
  Story story;
  SimulatedSlave& drive = story.Add(AkdDrive());
  BringToOp(story);
  story.EnableDrive(0);
  story.Move(0, 0, 4000, 20);
  drive.drive().FaultAt(story.master.now());
  drive.coe().QueueEmergency(story.master.now(), 0x7305, 0x20, {0, 0, 0, 0, 0});
  const FrameIds fault = CyclesUntil(story, 0x0008, 0x0008, 10);
  story.Expect("drive-fault", 0, fault, "status word 0x021F, then 0x0218");
  FrameIds message{};
  story.master.ReadMailbox(0, 100 * kMs, &message);
  story.Expect("emcy-received", 0, message, "0x7305");
  story.master.Cycles(10);
  CommandOnce(story, 0x0000);
  CommandOnce(story, 0x0080);
  story.master.Cycles(5);
  story.EnableDrive(0);
  story.DisableDrive(0, 4000);
  story.master.ShutDown();
  return story.Finish();
}

Sample DriveInFault() {
  Story story;
  SimulatedSlave& drive = story.Add(AkdDrive());
  ToPreop(story);
  // It has its fault from before: the first status word shows it.
  drive.drive().FaultAt(story.master.now());
  story.master.BringToSafeop();
  story.master.StartCyclic({});
  story.master.Cycles(1);
  story.Expect("drive-fault", 0, story.master.last_cyclic(), "status word 0x0218 from the first one on");
  story.master.Cycles(4);
  story.master.ChangeState(0, Al::kOp);
  story.master.Cycles(40);
  story.master.ShutDown();
  return story.Finish();
}

Sample DriveIllegalStatus() {
  Story story;
  SimulatedSlave& drive = story.Add(AkdDrive());
  BringToOp(story);
  story.EnableDrive(0);
  story.Move(0, 0, 1000, 10);
  // For one cycle, as a drive may between two states; then for twenty.
  drive.drive().ShowInstead(0x0035);
  story.master.Cycles(1);
  drive.drive().ShowInstead({});
  story.master.Cycles(10);
  drive.drive().ShowInstead(0x0035);
  const FrameIds first = CyclesUntil(story, 0x006F, 0x0025, 3);
  story.Expect("drive-illegal-status", 0, first, "0x0235 is no state");
  story.master.Cycles(19);
  drive.drive().ShowInstead({});
  story.master.Cycles(10);
  story.DisableDrive(0, 1000);
  story.master.ShutDown();
  return story.Finish();
}

Sample SyncSwitchedOff() {
  Story story;
  story.Add(AkdDrive());
  ToPreop(story);
  story.master.SetUpClocks();
  story.master.StartSync0(0, 1'000'000);
  story.master.BringToSafeop();
  story.master.BringToOp({.distributes_time = true});
  story.EnableDrive(0);
  story.Move(0, 0, 1000, 20);
  story.DisableDrive(0, 1000);
  const Answer off = story.master.Fpwr(story.master.station(0), reg::kSyncActivation, {0});
  story.Expect("sync-switched-off", 0, off.frame, "0x0981 = 0 in OP");
  story.master.Cycles(20);
  story.master.ShutDown();
  return story.Finish();
}

Sample DriveIllegalCommand() {
  Story story;
  story.Add(AkdDrive());
  BringToOp(story, 10 * kMs);
  CommandOnce(story, 0x0000);
  story.master.Cycles(3);
  const FrameIds early = CommandOnce(story, 0x000F);
  story.Expect("drive-illegal-command", 0, early, "Enable operation in Switch on disabled");
  story.Expect("drive-not-enabled", 0, early, "0x000F stays, and Shutdown never comes");
  story.master.Cycles(120);
  story.EnableDrive(0);
  story.DisableDrive(0);
  story.master.ShutDown();
  return story.Finish();
}

Sample DriveNeverEnabled() {
  Story story;
  story.Add(AkdDrive());
  BringToOp(story, 10 * kMs);
  CommandOnce(story, 0x0000);
  story.master.Cycles(3);
  // The usual sequence, but with bit 2 left 0 from the first word on: each word is Quick stop.
  CommandOnce(story, 0x0002);
  story.master.Cycles(20);
  CommandOnce(story, 0x0003);
  story.master.Cycles(20);
  const FrameIds wanted = CommandOnce(story, 0x000B);
  story.Expect("drive-not-enabled", 0, wanted, "bit 2 stays 0, so 0x000B is Quick stop, not Enable operation");
  story.master.Cycles(400);
  return story.Finish();
}

Sample DriveUnsupportedMode() {
  Story story;
  story.Add(AkdDrive());
  ToPreop(story);
  const SdoAnswer mode = story.master.Download(0, 0x6060, 0, {9});
  story.Expect("drive-unsupported-mode", 0, mode.request, "mode 9; the manual of 2011 lists 3, 6 and 7");
  story.master.Download(0, 0x6060, 0, {7});
  story.master.BringToSafeop();
  story.master.BringToOp();
  story.EnableDrive(0);
  story.DisableDrive(0);
  story.master.ShutDown();
  return story.Finish();
}

Sample DriveEnabledInSafeop() {
  Story story;
  story.Add(AkdDrive());
  ToPreop(story);
  story.master.BringToSafeop();
  story.master.StartCyclic({});
  story.master.Cycles(5);
  const FrameIds early = CommandOnce(story, 0x000F);
  story.Expect("drive-control-outside-op", 0, early, "Enable operation in SAFEOP: the drive does not look at it");
  story.master.Cycles(5);
  CommandOnce(story, 0x0000);
  story.master.Cycles(5);
  story.master.ChangeState(0, Al::kOp);
  story.EnableDrive(0);
  story.DisableDrive(0);
  story.master.ShutDown();
  return story.Finish();
}

Sample SyncFramesMissing() {
  Story story;
  story.Add(AkdDrive());
  BringToOp(story);
  story.EnableDrive(0);
  story.Move(0, 0, 4000, 60);
  // Seven are tolerated.
  int next = story.master.next_cycle();
  for (int i = 0; i < 7; ++i) story.master.ChangeCycle(next + i, {.skip = true});
  story.master.Cycles(8);
  story.master.Cycles(30);
  next = story.master.next_cycle();
  for (int i = 0; i < 8; ++i) story.master.ChangeCycle(next + i, {.skip = true});
  story.master.Cycles(9);
  story.Expect("sync-lost", 0, story.master.last_cyclic(), "eight frames missing: F125");
  story.master.Cycles(30);
  story.DisableDrive(0, 4000);
  story.master.ShutDown();
  return story.Finish();
}

Sample SyncLostFault() {
  Story story;
  SimulatedSlave& drive = story.Add(AkdDrive());
  BringToOp(story);
  story.EnableDrive(0);
  story.Move(0, 0, 2000, 30);
  const int next = story.master.next_cycle();
  for (int i = 0; i < 8; ++i) story.master.ChangeCycle(next + i, {.skip = true});
  story.master.Cycles(9);
  story.Expect("sync-lost", 0, story.master.last_cyclic(), "eight frames missing: F125");
  drive.drive().FaultAt(story.master.now());
  const FrameIds fault = CyclesUntil(story, 0x0008, 0x0008, 10);
  story.Expect("drive-fault", 0, fault, "the fault that follows from them");
  story.master.Cycles(20);
  story.master.ShutDown();
  return story.Finish();
}

Sample DriveIllegalStateChange() {
  Story story;
  SimulatedSlave& drive = story.Add(AkdDrive());
  BringToOp(story);
  story.EnableDrive(0);
  story.Move(0, 0, 1000, 10);
  drive.drive().FaultAt(story.master.now());
  const FrameIds fault = CyclesUntil(story, 0x000F, 0x0008, 20);
  story.Expect("drive-fault", 0, "status word 0x021F, then 0x0218").Until(fault);
  story.master.Cycles(10);
  // Nobody resets it, and 0x000F stands there all the time: a command that was used up when the drive was enabled.
  drive.drive().ShowInstead(0x0037);
  const FrameIds enabled = CyclesUntil(story, 0x000F, 0x0007, 3);
  story.Expect("drive-illegal-state-change", 0, enabled, "Fault to Operation enabled");
  story.master.Cycles(20);
  return story.Finish();
}

Sample DriveModeNotShown() {
  Story story;
  story.Add(AkdDrive());
  ToPreop(story);
  const SdoAnswer mode = story.master.Download(0, 0x6060, 0, {6});
  SdoAnswer shown = story.master.Upload(0, 0x6061, 0);
  story.master.Wait(1'200 * kMs);
  shown = story.master.Upload(0, 0x6061, 0);
  story.Expect("drive-mode-not-shown", 0, mode.request, "6060h = 6, and 6061h shows 7 after 1.2 s")
      .Until(shown.response);
  story.master.ShutDown();
  return story.Finish();
}

Sample InterpolationTimeChanged() {
  Story story;
  story.Add(AkdDrive());
  ToPreop(story);
  // As it should be: 1 ms.
  story.master.Download(0, 0x60C2, 1, {1});
  story.master.Download(0, 0x60C2, 2, {0xFD});
  story.master.BringToSafeop();
  story.master.BringToOp();
  story.master.Cycles(40);
  const SdoAnswer change = story.master.Download(0, 0x60C2, 1, {2});
  story.master.Cycles(60);
  story.Expect("sync-cycle-mismatch", 0, "60C2h is 2 ms from here on, and the frames come every 1 ms")
      .Until(change.response);
  story.master.ShutDown();
  return story.Finish();
}

Sample ClockOffsetRewritten() {
  Story story;
  story.Add(AkdDrive());
  ToPreop(story);
  // Before OP it is what every master does.
  story.master.SetUpClocks();
  story.master.StartSync0(0, 1'000'000);
  story.master.BringToSafeop();
  story.master.BringToOp({.distributes_time = true});
  story.master.Cycles(30);
  const Bytes offset = story.master.Fprd(story.master.station(0), reg::kTimeOffset, 8).data;
  const Answer again =
      story.master.Fpwr(story.master.station(0), reg::kTimeOffset, LeBytes(LoadLe<std::uint64_t>(offset, 0) + 250'000));
  story.Expect("sync-switched-off", 0, again.frame, "0x0920 rewritten in OP");
  story.master.Cycles(20);
  story.master.ShutDown();
  return story.Finish();
}

}  // namespace ecaudit::samples
