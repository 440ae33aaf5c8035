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

}  // namespace ecaudit::samples
