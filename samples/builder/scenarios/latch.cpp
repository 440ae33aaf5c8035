// External latches that the master does not use as the manual says.
#include "samples/builder/scenarios/scenario.h"

namespace ecaudit::samples {
namespace {

constexpr int kLatch2Rising = 2;
constexpr std::uint16_t kEnable2Rising = 0x0004;
constexpr std::uint16_t kSelect2Rising = 0x0300;

/// To OP with 1720h and 1B20h, which hold the latch words.
SimulatedSlave& LatchDrive(Story& story) {
  SimulatedSlave& drive = story.Add(AkdDrive());
  story.master.Scan();
  story.master.BringToPreop();
  for (const auto& [assignment, pdo] : {std::pair{0x1C12, 0x1720}, std::pair{0x1C13, 0x1B20}}) {
    const auto object = static_cast<std::uint16_t>(assignment);
    story.master.Download(0, object, 0, {0});
    story.master.Download(0, object, 1, LeBytes(static_cast<std::uint16_t>(pdo)));
    story.master.Download(0, object, 0, {1});
  }
  // What 1B20h holds the manual of 2011 does not print.
  for (std::uint8_t entry = 0; entry <= 10; ++entry) story.master.Upload(0, 0x1B20, entry);
  story.master.BringToSafeop();
  story.master.BringToOp();
  return drive;
}

/// All further frames carry this latch control word; the drive stays disabled.
FrameIds Latch(Story& story, std::uint16_t control, int cycles) {
  Bytes outputs = LeBytes(std::uint16_t{0});
  AppendLe(outputs, std::int32_t{0});
  AppendLe(outputs, control);
  AppendLe(outputs, std::uint32_t{0});
  story.master.SetOutputs(0, std::move(outputs));
  story.master.Cycles(1);
  const FrameIds first = story.master.last_cyclic();
  story.master.Cycles(cycles - 1);
  return first;
}

}  // namespace

Sample LatchWellUsed() {
  Story story;
  SimulatedSlave& drive = LatchDrive(story);
  for (const std::int32_t position : {1000, 2000}) {
    Latch(story, 0, 4);
    drive.drive().LatchEdgeAt(story.master.now() + 3 * kMs, kLatch2Rising, position);
    Latch(story, kEnable2Rising, 8);
    Latch(story, kEnable2Rising | kSelect2Rising, 5);
    Latch(story, kEnable2Rising, 3);
  }
  Latch(story, 0, 5);
  story.master.ShutDown();
  return story.Finish();
}

Sample LatchMisuse() {
  Story story;
  SimulatedSlave& drive = LatchDrive(story);
  Latch(story, 0, 4);
  // Asked for before there is anything.
  Latch(story, kEnable2Rising, 5);
  const FrameIds early = Latch(story, kEnable2Rising | kSelect2Rising, 5);
  story.Expect("latch-read-before-valid", 0, early, "selector 3, but no edge came yet");
  Latch(story, kEnable2Rising, 3);
  // The edge comes, and nobody reads the position.
  drive.drive().LatchEdgeAt(story.master.now() + 2 * kMs, kLatch2Rising, 4711);
  Latch(story, kEnable2Rising, 8);
  const FrameIds lost = Latch(story, 0, 5);
  story.Expect("latch-value-lost", 0, lost, "position of latch 2 rising");
  const FrameIds selector = Latch(story, 0x0600, 3);
  story.Expect("latch-invalid-selector", 0, selector, "selector 6");
  Latch(story, 0, 3);
  // Read as it should be, so that the position of this edge is known to be wanted.
  drive.drive().LatchEdgeAt(story.master.now() + 3 * kMs, kLatch2Rising, 4712);
  Latch(story, kEnable2Rising, 8);
  Latch(story, kEnable2Rising | kSelect2Rising, 5);
  Latch(story, 0, 5);
  story.master.ShutDown();
  return story.Finish();
}

Sample LatchLostWhileDisarming() {
  Story story;
  SimulatedSlave& drive = LatchDrive(story);
  Latch(story, 0, 4);
  // Read by its selector, disarmed then: what the master wants to do.
  drive.drive().LatchEdgeAt(story.master.now() + 3 * kMs, kLatch2Rising, 1000);
  Latch(story, kEnable2Rising, 8);
  Latch(story, kEnable2Rising | kSelect2Rising, 5);
  Latch(story, 0, 4);
  // Captured, and gone with the frame that disarms: its returned copy does not show the valid bit any more.
  drive.drive().LatchEdgeAt(story.master.now() + 3 * kMs, kLatch2Rising, 2000);
  Latch(story, kEnable2Rising, 8);
  drive.drive().DropLatched();
  const FrameIds lost = Latch(story, 0, 4);
  story.Expect("latch-value-lost", 0, lost, "position of latch 2 rising");
  Latch(story, kEnable2Rising, 8);
  Latch(story, 0, 4);
  story.master.ShutDown();
  return story.Finish();
}

Sample LatchUnreadable() {
  Story story;
  SimulatedSlave& drive = story.Add(AkdDrive());
  story.master.Scan();
  story.master.BringToPreop();
  // The latch control word is mapped; the inputs stay as they are by default, without status word and position.
  story.master.Download(0, 0x1C12, 0, {0});
  story.master.Download(0, 0x1C12, 1, LeBytes(std::uint16_t{0x1720}));
  story.master.Download(0, 0x1C12, 0, {1});
  for (std::uint8_t entry = 0; entry <= 2; ++entry) story.master.Upload(0, 0x1B01, entry);
  for (std::uint8_t entry = 0; entry <= 1; ++entry) story.master.Upload(0, 0x1C13, entry);
  story.master.BringToSafeop();
  story.master.BringToOp({.cycle = 20 * kMs});
  Latch(story, 0, 4);
  drive.drive().LatchEdgeAt(story.master.now() + 100 * kMs, kLatch2Rising, 1000);
  const FrameIds armed = Latch(story, kEnable2Rising, 70);
  story.Expect("latch-not-mapped", 0, armed, "enabled for 1.4 s, and nothing can tell the master of a capture");
  Latch(story, 0, 4);
  story.master.ShutDown();
  return story.Finish();
}

}  // namespace ecaudit::samples
