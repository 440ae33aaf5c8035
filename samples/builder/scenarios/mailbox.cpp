// What goes wrong in the mailbox.
#include "samples/builder/scenarios/scenario.h"

namespace ecaudit::samples {
namespace {

constexpr std::uint8_t kFoe = 4;

// To OP and down again, to show that nothing else is wrong.
void FinishFromPreop(Story& story) {
  story.master.BringToSafeop();
  story.master.BringToOp();
  story.master.Cycles(10);
  story.master.ShutDown();
}

}  // namespace

Sample SdoAborts() {
  Story story;
  story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  master.Upload(0, 0x10F1, 0);  // an optional object that the drive does not have: no fault
  master.Download(0, 0x60C2, 1, {2});
  const SdoAnswer read_only = master.Download(0, 0x1018, 1, LeBytes(std::uint32_t{0x6B}));
  story.Expect("sdo-write-read-only", 0, read_only.request, "1018h:1, the vendor ID");
  story.Expect("sdo-abort", 0, read_only.response, "0x06010002");
  const SdoAnswer short_one = master.Download(0, 0x60FF, 0, LeBytes(std::uint16_t{100}));
  story.Expect("sdo-wrong-size", 0, short_one.request, "2 bytes for 60FFh:0, an INT32");
  story.Expect("sdo-abort", 0, short_one.response, "0x06070013");
  FrameIds first{};
  for (int i = 0; i < 2; ++i) {
    const SdoAnswer absent = master.Download(0, 0x2FFF, 0, LeBytes(std::uint16_t{1}));
    if (i == 0) first = absent.response;
  }
  story.Expect("sdo-abort", 0, first, "2FFFh:0 does not exist, 0x06020000").Times(2);
  FinishFromPreop(story);
  return story.Finish();
}

Sample MailboxNoResponse() {
  MasterWay way;
  way.mailbox_interval = 50 * kMs;
  Story story(way);
  SimulatedSlave& drive = story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  master.Upload(0, 0x1008, 0);
  drive.coe().behaviour().reads_requests = false;
  const SdoAnswer ignored = master.Upload(0, 0x1018, 1);
  story.Expect("mailbox-no-response", 0, ignored.request, "1018h:1; the out mailbox stays full");
  const SdoAnswer refused = master.Upload(0, 0x1018, 2);
  story.Expect("mailbox-overrun", 0, refused.request, "working counter 0").Optional();
  master.ShutDown();
  return story.Finish();
}

Sample Emergencies() {
  Story story;
  SimulatedSlave& drive = story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  drive.coe().QueueEmergency(master.now(), 0x7305, 0x01, {0x11, 0x22, 0x33, 0x44, 0x55});
  FrameIds fault{};
  master.ReadMailbox(0, 100 * kMs, &fault);
  story.Expect("emcy-received", 0, fault, "0x7305");
  master.Upload(0, 0x1001, 0);
  drive.coe().QueueEmergency(master.now(), 0x0000, 0x00, {0, 0, 0, 0, 0});  // free of errors again: an info
  master.ReadMailbox(0, 100 * kMs);
  FinishFromPreop(story);
  return story.Finish();
}

Sample EmergencyDuringSdo() {
  Story story;
  SimulatedSlave& drive = story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  master.Upload(0, 0x1018, 1);
  drive.coe().QueueEmergency(master.now(), 0x7305, 0x01, {0x11, 0x22, 0x33, 0x44, 0x55});
  master.Upload(0, 0x1018, 2);
  story.Expect("emcy-received", 0, "0x7305 between request and response; the upload succeeds");
  FinishFromPreop(story);
  return story.Finish();
}

Sample FoeUnsupported() {
  Story story;
  story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  // A read request for a file, by its name behind opcode and password.
  const Answer request = master.WriteMailbox(0, kFoe, {1, 0, 0, 0, 0, 0, 'f', 'w', '.', 'b', 'i', 'n'});
  FrameIds reply{};
  master.ReadMailbox(0, 100 * kMs, &reply);
  story.Expect("mailbox-unsupported-protocol", 0, request.frame, "the EEPROM lists CoE only");
  story.Expect("mailbox-error-reply", 0, reply, "0x0002");
  FinishFromPreop(story);
  return story.Finish();
}

Sample MailboxCounterSkipped() {
  Story story;
  SimulatedSlave& drive = story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  master.Upload(0, 0x1018, 1);
  drive.coe().SkipCounterOnce();
  const SdoAnswer skipped = master.Upload(0, 0x1018, 2);
  story.Expect("mailbox-counter", 0, skipped.response, "a number of the drive's own sequence is left out");
  FinishFromPreop(story);
  return story.Finish();
}

Sample FoeEndsInError() {
  Story story;
  SlaveDescription description = AkdDrive();
  constexpr std::uint16_t kFoeBit = 0x08;
  description.sii.mailbox_protocols |= kFoeBit;
  description.coe.foe_error = 0x8002;
  story.Add(std::move(description));
  ScriptedMaster& master = story.master;
  master.Scan();
  master.BringToPreop();
  master.WriteMailbox(0, kFoe, {2, 0, 0, 0, 0, 0, 'f', 'w', '.', 'b', 'i', 'n'});
  FrameIds reply{};
  master.ReadMailbox(0, 100 * kMs, &reply);
  story.Expect("foe-error", 0, "error 0x8002 where an acknowledge should be").Until(reply);
  FinishFromPreop(story);
  return story.Finish();
}

Sample SdoBeforePreop() {
  MasterWay way;
  way.mailbox_interval = 50 * kMs;
  Story story(way);
  SimulatedSlave& drive = story.Add(AkdDrive());
  ScriptedMaster& master = story.master;
  master.Scan();
  master.SetUpMailbox(0);
  drive.coe().behaviour().reads_requests = false;  // what arrives before PREOP is lost
  master.Request(0, 2);
  const SdoAnswer early = master.Upload(0, 0x1018, 1);
  story.Expect("mailbox-no-response", 0, early.request, "PREOP is requested, but not reached");
  master.Poll(0, 2);
  master.ShutDown();
  return story.Finish();
}

}  // namespace ecaudit::samples
