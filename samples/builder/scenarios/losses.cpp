// What does not come back, or is not in the file, in the ways of masters and recorders.
#include "samples/builder/scenarios/scenario.h"

namespace ecaudit::samples {

Sample SentAgain() {
  MasterWay way = WayOf("soem");
  way.frame_timeout = 3 * kMs;
  Story story(way);
  story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  master.Upload(0, 0x1018, 1);
  master.LoseNext(1);
  const Answer answer = master.Fprd(master.station(0), reg::kDlStatus, 2);
  master.Upload(0, 0x1018, 2);
  master.LoseNext(1);
  master.Fprd(master.station(0), reg::kAlStatus, 6);
  master.Upload(0, 0x1018, 3);
  story.Expect("frame-lost", -1, "two frames, each sent again under its index after 3 ms").Until(answer.frame).Times(2);
  master.ShutDown();
  return story.Finish();
}

Sample NobodyAnswers() {
  Story story;
  story.Add(AkdDrive());
  story.master.LoseNext(1000);
  story.master.Brd(reg::kInformation, 2);
  for (int i = 0; i < 15; ++i) story.master.Brd(reg::kAlStatus, 2);
  story.Expect("bus-no-answer", -1, "each frame is sent three times under its index");
  return story.Finish();
}

Sample FramePerSlave() {
  Story story(WayOf("acontis"));
  story.Add(AkdDrive());
  story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  for (const std::size_t drive : {0U, 1U}) {
    for (const std::uint16_t assignment : {std::uint16_t{0x1C12}, std::uint16_t{0x1C13}}) {
      master.Upload(drive, assignment, 0);
      master.Upload(drive, assignment, 1);
    }
  }
  master.BringToSafeop();
  master.BringToOp({.cycle = 2 * kMs});
  story.EnableDrive(0);
  story.EnableDrive(1);
  const auto skip = [&](std::size_t frame, int from, int count) {
    for (int i = 0; i < count; ++i) {
      master.ChangeCycle(master.next_cycle() + from + i, {.skip = true, .frame = frame});
    }
  };
  // Seven for each of the drives are tolerated, also side by side; eight are not.
  skip(0, 5, 7);
  skip(1, 14, 7);
  master.Cycles(30);
  skip(1, 0, 8);
  master.Cycles(9);
  story.Expect("sync-lost", 1, "eight of its frames missing: F125");
  for (const int lost : {4, 9, 10}) master.ChangeCycle(master.next_cycle() + lost, {.lose = true, .frame = 0});
  master.Cycles(20);
  story.Expect("frame-lost", -1, "three frames of the first drive").Times(3);
  story.DisableDrive(0);
  story.DisableDrive(1);
  master.ShutDown();
  return story.Finish();
}

Sample TwoCountersOutputs() {
  MasterWay way = WayOf("acontis");
  way.addressing = Addressing::kStation;
  way.grouping = {};
  Story story(way);
  for (int i = 0; i < 3; ++i) story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  master.BringToSafeop();
  master.BringToOp();
  for (int i = 0; i < 10; ++i) {
    master.Cycles(3);
    master.Poll(static_cast<std::size_t>(i % 3), 8);
  }
  // The outputs of the second drive: it takes them no more, and gives its inputs as before.
  story.bus.slave(1).esc().SetByte(reg::kSyncManager + 16 + 7, 1);
  master.Cycles(1);
  story.Expect("wkc-mismatch", -1, master.last_cyclic(), "the working counter of the LRW falls from 9 to 7");
  for (int i = 0; i < 10; ++i) {
    master.Cycles(2);
    master.Poll(static_cast<std::size_t>(i % 3), 8);
  }
  story.bus.slave(1).esc().SetByte(reg::kSyncManager + 16 + 7, 0);
  master.Cycles(10);
  master.ShutDown();
  return story.Finish();
}

Sample BranchSlaveLeaves() {
  Story story;
  for (int i = 0; i < 3; ++i) story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  master.BringToSafeop();
  master.BringToOp({.reads_al_status = true});
  master.Cycles(30);
  story.bus.Unplug(1);
  master.Cycles(1);
  const FrameIds gone = master.last_cyclic();
  FrameIds silent{};
  for (int i = 0; i < 6; ++i) {
    master.Cycles(5);
    for (const std::size_t asked : {0U, 1U, 2U}) {
      const Answer answer = master.Fprd(master.station(asked), reg::kAlStatus, 6);
      if (asked == 1 && i == 0) silent = answer.frame;
    }
  }
  story
      .Expect("wkc-mismatch", 1, gone,
              "the working counter of the LRW falls from 9 to 6; the third drive still answers")
      .Until(master.last_cyclic());
  story.Expect("wkc-mismatch", 1, silent, "it does not answer at 0x1002").Optional();
  story.Expect("bus-slave-count-changed", -1, gone, "two slaves answer instead of three");
  return story.Finish();
}

}  // namespace ecaudit::samples
