// The same healthy run in the ways of several masters.
#include "samples/builder/scenarios/scenario.h"

namespace ecaudit::samples {
namespace {

Sample InTheWayOf(std::string_view name) {
  Story story(WayOf(name));
  PlayHealthyRun(story);
  return story.Finish();
}

}  // namespace

void PlayHealthyRun(Story& story, int cycles) {
  constexpr TimeNs kCycle = 2 * kMs;
  std::uint16_t alias = 0x0200;
  for (SlaveDescription slave : {AkdDrive(), InputTerminal(), AkdDrive()}) {
    slave.sii.alias = ++alias;
    slave.esc.clock_ppb = alias % 4 * 1'000;
    story.Add(std::move(slave));
  }
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  for (const std::size_t drive : {0U, 2U}) {
    master.Upload(drive, 0x1C12, 1);
    master.Upload(drive, 0x1C13, 1);
  }
  master.SetUpClocks(8);
  master.BringToSafeop();
  for (const std::size_t drive : {0U, 2U}) master.StartSync0(drive, static_cast<std::uint32_t>(kCycle));
  // Half a cycle behind SYNC0, whose pulses stand at whole cycles.
  master.WaitUntil((master.now() / kCycle + 1) * kCycle + kCycle / 2);
  master.BringToOp({.cycle = kCycle, .distributes_time = true, .reads_al_status = true});
  story.EnableDrive(0);
  story.EnableDrive(2);
  story.Move(2, 0, 4000, cycles);
  master.Upload(0, 0x1018, 1);
  story.DisableDrive(0);
  story.DisableDrive(2, 4000);
  master.ShutDown();
}

Sample MasterIgh() {
  return InTheWayOf("igh");
}
Sample MasterEtherCrab() {
  return InTheWayOf("ethercrab");
}
Sample MasterEtherCrabEarly() {
  return InTheWayOf("ethercrab-early");
}
Sample MasterKickCat() {
  return InTheWayOf("kickcat");
}
Sample MasterAcontis() {
  return InTheWayOf("acontis");
}
Sample MasterCodesys() {
  return InTheWayOf("codesys");
}

}  // namespace ecaudit::samples
