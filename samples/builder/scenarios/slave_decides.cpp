// What a slave goes on with, although it looks wrong, and what it does not.
#include <utility>

#include "samples/builder/scenarios/scenario.h"

namespace ecaudit::samples {
namespace {

/// A slave with one buffer for its inputs (SM3), which its application fills every now and then.
SlaveDescription OneBufferSlave(TimeNs fills_every) {
  SlaveDescription slave = AcmeServo();
  slave.name = "ENCODER";
  slave.sii.name = slave.name;
  slave.sii.product_code = 0x0000'0132;
  slave.objects.Set(0x1018, 2, slave.sii.product_code);
  slave.sii.sync_managers.at(3).control = 0x22;
  slave.fills_inputs_every = fills_every;
  return slave;
}

void RunWith(Story& story, SlaveDescription second, CyclicTask task = {}) {
  story.Add(AkdDrive());
  story.Add(std::move(second));
  story.master.Scan();
  story.master.BringToPreop();
  story.master.BringToSafeop();
  story.master.BringToOp(std::move(task));
}

}  // namespace

Sample OneBufferInputs() {
  Story story;
  RunWith(story, OneBufferSlave(2'500'000));
  story.master.Cycles(120);
  story.master.ShutDown();
  return story.Finish();
}

Sample OneBufferNeverFilled() {
  Story story;
  RunWith(story, OneBufferSlave(0), {.cycle = 5 * kMs});
  story.Expect("wkc-never-right", 1, "0 of all datagrams with its inputs; one buffer");
  story.master.Cycles(250);
  story.master.ShutDown();
  return story.Finish();
}

Sample InputsSyncManagerOff() {
  Story story;
  SlaveDescription terminal = InputTerminal();
  terminal.sii.sync_managers.at(0).enable = 0;
  story.Add(AkdDrive());
  story.Add(std::move(terminal));
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  master.BringToSafeop();
  master.BringToOp();
  master.Cycles(60);
  master.ShutDown();
  return story.Finish();
}

Sample OutputsNeverWritten() {
  Story story;
  story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  master.Fpwr(master.station(0), reg::kWatchdogProcessData, LeBytes(std::uint16_t{0}));
  master.SetUpProcessData(0);
  master.MapProcessImage();
  master.Fpwr(master.station(0), reg::kFmmu + 12, {0});
  master.ChangeState(0, Al::kSafeop);
  master.StartCyclic({.cycle = 3 * kMs});
  master.Cycles(5);
  const AlAnswer op = master.ChangeState(0, Al::kOp);
  story.Expect("fmmu-inactive", 0, op.request, "no FMMU maps the outputs, but the drive stays in OP: watchdog off")
      .Until(op.status_read);
  for (int i = 0; i < 3; ++i) {
    master.Cycles(120);
    master.Poll(0, 8, 0);
  }
  master.ShutDown();
  return story.Finish();
}

}  // namespace ecaudit::samples
