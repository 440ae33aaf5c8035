// Start-ups in which nothing is wrong.
#include "samples/builder/scenarios/scenario.h"

namespace ecaudit::samples {

Sample CleanStartup() {
  Story story;
  story.Add(AkdDrive());
  story.master.Scan();
  story.master.BringToPreop();
  story.master.Upload(0, 0x1C12, 1);
  story.master.Upload(0, 0x1C13, 1);
  story.master.BringToSafeop();
  story.master.BringToOp();
  story.EnableDrive(0);
  story.Move(0, 0, 8000, 60);
  story.master.Cycles(10);
  story.DisableDrive(0, 8000);
  story.master.ShutDown();
  return story.Finish();
}

// A terminal without processor between two drives echoes the acknowledge bit in AL Status: 0x0011 is no error there.
Sample CleanMixedBus() {
  Story story;
  story.Add(AkdDrive());
  story.Add(InputTerminal());
  story.Add(AkdDrive());
  story.master.Scan();
  story.master.BringToPreop();
  story.master.BringToSafeop();
  story.master.BringToOp({.reads_al_status = true});
  story.EnableDrive(0);
  story.EnableDrive(2);
  story.Move(2, 0, 4000, 40);
  story.DisableDrive(0);
  story.DisableDrive(2, 4000);
  story.master.ShutDown();
  return story.Finish();
}

Sample CleanTwinCatHabits() {
  Story story(WayOf("twincat"));
  story.Add(AkdDrive());
  story.Add(AkdDrive());
  story.master.Scan();
  story.master.BringToPreop();
  story.master.Upload(0, 0x1018, 1);
  story.master.Upload(1, 0x1018, 2);
  story.master.BringToSafeop();
  story.master.BringToOp({.cycle = 2'000'000, .reads_al_status = true});
  story.EnableDrive(0);
  story.EnableDrive(1);
  story.Move(0, 0, 4000, 30);
  story.DisableDrive(0, 4000);
  story.DisableDrive(1);
  story.master.ShutDown();
  return story.Finish();
}

namespace {

/// Two drives are enabled before the capture begins.
void EnableUnseen(Story& story) {
  story.capture.Pause();
  story.master.Scan();
  story.master.BringToPreop();
  story.master.BringToSafeop();
  story.master.BringToOp({.reads_al_status = true});
  story.EnableDrive(0);
  story.EnableDrive(1);
}

}  // namespace

Sample MidRunInFault() {
  Story story;
  SimulatedSlave& first = story.Add(AkdDrive());
  SimulatedSlave& second = story.Add(AkdDrive());
  EnableUnseen(story);
  first.drive().FaultAt(story.master.now());
  second.drive().FaultAt(story.master.now());
  story.master.Cycles(30);
  story.capture.Resume();
  story.master.Cycles(80);
  return story.Finish();
}

Sample MidRun() {
  Story story;
  story.Add(AkdDrive());
  story.Add(AkdDrive());
  EnableUnseen(story);
  story.capture.Resume();
  story.Move(0, 0, 6000, 80);
  story.Move(1, 0, -6000, 80);
  return story.Finish();
}

}  // namespace ecaudit::samples
