// PDO assignment and mapping that the drive does not follow.
#include <utility>

#include "samples/builder/scenarios/scenario.h"

namespace ecaudit::samples {
namespace {

void ReadAssignments(Story& story) {
  for (const std::uint16_t assignment : {kRxAssignment, kTxAssignment}) {
    story.master.Upload(0, assignment, 0);
    story.master.Upload(0, assignment, 1);
  }
}

void Assign(Story& story, std::uint16_t assignment, std::uint16_t pdo) {
  story.master.Download(0, assignment, 0, {0});
  story.master.Download(0, assignment, 1, LeBytes(pdo));
  story.master.Download(0, assignment, 0, {1});
}

/// SAFEOP with an SM2 of `output_bytes`; refused, and acknowledged.
AlAnswer RefusedInSafeop(Story& story, std::uint16_t output_bytes) {
  story.master.SetUpProcessData(0, output_bytes);
  story.master.MapProcessImage();
  const AlAnswer refused = story.master.ChangeState(0, Al::kSafeop);
  story.master.Acknowledge(0, Al::kPreop);
  story.master.DisableSyncManager(0, 2);
  story.master.DisableSyncManager(0, 3);
  return refused;
}

void FinishWell(Story& story) {
  story.master.SetUpProcessData(0);
  story.master.MapProcessImage();
  story.master.ChangeState(0, Al::kSafeop);
  story.master.ShutDown();
}

/// A power supply like the Kollmorgen MKD-C, with free mapping in 1600h and 1A00h.
SlaveDescription PowerSupply() {
  SlaveDescription drive = AkdDrive();  // same mailboxes and sync managers
  drive.is_drive = false;
  drive.has_latches = false;
  drive.name = "MKD-C";
  drive.sii.name = drive.name;
  drive.sii.product_code = 0x00000002;
  drive.sii.revision = 0x00020000;
  drive.sii.rx_pdos.clear();
  drive.sii.tx_pdos.clear();
  drive.objects.Set(0x1018, 2, drive.sii.product_code);
  drive.objects.Set(0x1018, 3, drive.sii.revision);
  drive.objects.AddNumber(0x3000, 0, std::uint16_t{0}, true, "Clear faults");
  drive.objects.AddNumber(0x3009, 0, std::uint8_t{0}, false, "Global STO state");
  drive.objects.AddNumber(0x6100, 1, std::uint16_t{0}, false, "Input word");
  for (const std::uint16_t pdo : {std::uint16_t{0x1600}, std::uint16_t{0x1A00}}) {
    drive.objects.AddNumber(pdo, 0, std::uint8_t{0}, true, "PDO mapping");
    for (std::uint8_t i = 1; i <= 8; ++i) drive.objects.AddNumber(pdo, i, std::uint32_t{0}, true, "mapped object");
  }
  return drive;
}

void Map(Story& story, std::uint16_t pdo, const std::vector<std::uint32_t>& entries) {
  story.master.Download(0, pdo, 0, {0});
  std::uint8_t subindex = 0;
  for (const std::uint32_t entry : entries) story.master.Download(0, pdo, ++subindex, LeBytes(entry));
  story.master.Download(0, pdo, 0, {subindex});
}

/// The only slave of the story, found and in PREOP.
void InPreop(Story& story, SlaveDescription slave) {
  story.Add(std::move(slave));
  story.master.Scan();
  story.master.BringToPreop();
}

}  // namespace

Sample PdoAssignOrder() {
  Story story;
  InPreop(story, AkdDrive());
  ReadAssignments(story);
  const SdoAnswer early = story.master.Download(0, kRxAssignment, 1, LeBytes(std::uint16_t{0x1720}));
  story.Expect("pdo-assign-order", 0, early.request, "1C12h:1 is written while 1C12h:0 is 1");
  story.Expect("sdo-abort", 0, early.response, "the drive wants subindex 0 cleared first").Optional();
  const AlAnswer refused = RefusedInSafeop(story, 12);
  story.Expect("sm-process-config", 0, refused.request, "SM2 has 12 bytes, 1701h is still assigned and has 6");
  story.Expect("al-refused", 0, refused.status_read, "AL status 0x0012, code 0x0017");
  Assign(story, kRxAssignment, 0x1720);
  FinishWell(story);
  return story.Finish();
}

Sample PdoUnsupported() {
  Story story;
  InPreop(story, AkdDrive());
  ReadAssignments(story);
  story.master.Download(0, kRxAssignment, 0, {0});
  const SdoAnswer none = story.master.Download(0, kRxAssignment, 1, LeBytes(std::uint16_t{0x1799}));
  story.Expect("pdo-unsupported", 0, none.request, "1799h is none of the drive's PDOs");
  story.Expect("sdo-abort", 0, none.response, "the drive does not take the value").Optional();
  story.master.Download(0, kRxAssignment, 0, {1});
  const AlAnswer refused = RefusedInSafeop(story, 8);
  story.Expect("sm-process-config", 0, refused.request, "SM2 has 8 bytes, 1701h is still assigned and has 6");
  story.Expect("al-refused", 0, refused.status_read, "AL status 0x0012, code 0x0017");
  Assign(story, kRxAssignment, 0x1721);
  FinishWell(story);
  return story.Finish();
}

Sample PdoOddMapping() {
  Story story;
  SimulatedSlave& drive = story.Add(PowerSupply());
  drive.Override({.from = 2, .to = 4, .action = AlOverride::Action::kRefuse, .code = 0x0017, .times = 1});
  story.master.Scan();
  story.master.BringToPreop();
  Map(story, 0x1600, {0x30000010});
  Map(story, 0x1A00, {0x30090008, 0x61000110});
  Assign(story, kRxAssignment, 0x1600);
  Assign(story, kTxAssignment, 0x1A00);
  const AlAnswer refused = RefusedInSafeop(story, 2);
  story.Expect("pdo-mapping-rule", 0, refused.request, "three bytes of inputs, an odd number");
  story.Expect("al-refused", 0, refused.status_read, "AL status 0x0012, code 0x0017");
  Map(story, 0x1A00, {0x30090008, 0x61000110, 0x20020108});
  Assign(story, kTxAssignment, 0x1A00);
  FinishWell(story);
  return story.Finish();
}

Sample PdoMappedTwice() {
  Story story;
  InPreop(story, PowerSupply());
  Map(story, 0x1600, {0x30000010, 0x30000010});
  Map(story, 0x1A00, {0x30090008, 0x61000110, 0x20020108});
  Assign(story, kRxAssignment, 0x1600);
  Assign(story, kTxAssignment, 0x1A00);
  story.master.SetUpProcessData(0);
  story.master.MapProcessImage();
  const AlAnswer answer = story.master.ChangeState(0, Al::kSafeop);
  story.Expect("pdo-object-mapped-twice", 0, answer.request, "3000h:0 stands twice in the outputs");
  story.master.ShutDown();
  return story.Finish();
}

Sample PdoAssignedInSafeop() {
  Story story;
  InPreop(story, AkdDrive());
  ReadAssignments(story);
  story.master.BringToSafeop();
  const SdoAnswer late = story.master.Download(0, kRxAssignment, 0, {0});
  story.Expect("pdo-assign-state", 0, late.request, "1C12h is written in SAFEOP");
  story.Expect("sdo-abort", 0, late.response, "the drive refuses it in this state").Optional();
  story.master.BringToOp();
  story.master.Cycles(10);
  story.master.ShutDown();
  return story.Finish();
}

Sample SyncManagersOverlap() {
  Story story;
  InPreop(story, AkdDrive());
  ReadAssignments(story);
  story.master.SetUpProcessData(0);
  story.master.DisableSyncManager(0, 3);
  // Three buffers of 6 bytes from 0x1100 on reach to 0x1111.
  story.master.Fpwr(story.master.station(0), 0x0818, {0x08, 0x11, 0x06, 0x00, 0x20, 0x00, 0x01, 0x00});
  story.master.MapProcessImage();
  const AlAnswer refused = story.master.ChangeState(0, Al::kSafeop);
  story.Expect("sm-overlap", 0, refused.request, "SM3 at 0x1108 lies in the buffers of SM2");
  story.Expect("sm-process-config", 0, refused.request, "SM3 at 0x1108, the manual wants 0x1140");
  story.Expect("al-refused", 0, refused.status_read, "AL status 0x0012, code 0x0017");
  story.master.Acknowledge(0, Al::kPreop);
  story.master.DisableSyncManager(0, 2);
  story.master.DisableSyncManager(0, 3);
  FinishWell(story);
  return story.Finish();
}

Sample PdoNotMappable() {
  Story story;
  InPreop(story, PowerSupply());
  Map(story, 0x1600, {0x30000010});
  story.master.Download(0, 0x1A00, 0, {0});
  const SdoAnswer vendor = story.master.Download(0, 0x1A00, 1, LeBytes(std::uint32_t{0x10180120}));
  story.Expect("pdo-not-mappable", 0, vendor.request, "1018h:1, the vendor ID, cannot be mapped");
  story.Expect("sdo-abort", 0, vendor.response, "the drive aborts with 0x06040041").Optional();
  Map(story, 0x1A00, {0x30090008, 0x61000110, 0x20020108});
  Assign(story, kRxAssignment, 0x1600);
  Assign(story, kTxAssignment, 0x1A00);
  FinishWell(story);
  return story.Finish();
}

Sample PdoLengthMismatch() {
  Story story;
  InPreop(story, AkdDrive());
  ReadAssignments(story);
  story.master.SetUpProcessData(0);
  story.master.MapProcessImage();
  // The FMMU of the outputs once more, with 4 bytes: the control word of 1701h, its last two, is left out.
  story.master.Fpwr(story.master.station(0), 0x0600,
                    {0x00, 0x00, 0x00, 0x00, 0x04, 0x00, 0x00, 0x07, 0x00, 0x11, 0x00, 0x02, 0x01, 0x00, 0x00, 0x00});
  story.master.ChangeState(0, Al::kSafeop);
  story.master.StartCyclic({});
  story.master.Cycles(5);
  const AlAnswer op = story.master.ChangeState(0, Al::kOp);
  story.Expect("pdo-length-mismatch", 0, op.status_read, "FMMU 0 maps 4 of the 6 bytes of 1701h");
  story.master.Cycles(20);
  story.master.ShutDown();
  return story.Finish();
}

Sample SyncManagerChangedInOp() {
  Story story;
  InPreop(story, AkdDrive());
  ReadAssignments(story);
  story.master.BringToSafeop();
  story.master.BringToOp();
  story.master.Cycles(10);
  const Answer changed =
      story.master.Fpwr(story.master.station(0), 0x0810, {0x00, 0x11, 0x08, 0x00, 0x64, 0x00, 0x01, 0x00});
  story.Expect("sm-changed-while-active", 0, changed.frame, "SM2 is written with 8 bytes instead of 6 in OP");
  story.master.Cycles(10);
  story.master.Fprd(story.master.station(0), 0x0810, 8);
  story.master.ShutDown();
  return story.Finish();
}

Sample FmmusOverlap() {
  Story story;
  for (int i = 0; i < 2; ++i) story.Add(AkdDrive());
  story.master.Scan();
  story.master.BringToPreop();
  for (std::size_t i = 0; i < 2; ++i) story.master.SetUpProcessData(i);
  story.master.MapProcessImage();
  // Outputs lie at 0 and 6, inputs at 12 and 18. Now both inputs lie at 12.
  story.master.Fpwr(story.master.station(1), 0x0610,
                    {0x0C, 0x00, 0x00, 0x00, 0x06, 0x00, 0x00, 0x07, 0x40, 0x11, 0x00, 0x01, 0x01, 0x00, 0x00, 0x00});
  for (std::size_t i = 0; i < 2; ++i) story.master.ChangeState(i, Al::kSafeop);
  story.master.StartCyclic({});
  story.master.Cycles(1);
  story.Expect("fmmu-mismatch", 1, story.master.last_cyclic(), "slave 1 writes its inputs over those of slave 0");
  story.master.Cycles(4);
  for (std::size_t i = 0; i < 2; ++i) story.master.ChangeState(i, Al::kOp);
  story.master.Cycles(10);
  story.master.ShutDown();
  return story.Finish();
}

Sample FmmuOnOtherSyncManager() {
  Story story;
  SimulatedSlave& drive = story.Add(AkdDrive());
  drive.Override({.from = 4, .to = 8, .action = AlOverride::Action::kRefuse, .code = 0x001B, .times = 1});
  story.master.Scan();
  story.master.BringToPreop();
  story.master.SetUpProcessData(0);
  story.master.MapProcessImage();
  // The FMMU of the outputs once more: it writes to 0x1140, which is SM3.
  story.master.Fpwr(story.master.station(0), 0x0600,
                    {0x00, 0x00, 0x00, 0x00, 0x06, 0x00, 0x00, 0x07, 0x40, 0x11, 0x00, 0x02, 0x01, 0x00, 0x00, 0x00});
  const AlAnswer safeop = story.master.ChangeState(0, Al::kSafeop);
  story.Expect("fmmu-mismatch", 0, safeop.status_read, "FMMU0 writes to SM3, which the slave writes");
  story.master.StartCyclic({});
  story.master.Cycles(20);
  const AlAnswer refused = story.master.ChangeState(0, Al::kOp);
  story.Expect("fmmu-inactive", 0, refused.status_read, "so no FMMU maps the outputs").Optional();
  story.Expect("sync-watchdog-margin", 0, refused.status_read, "no outputs before the request").Optional();
  story.Expect("al-refused", 0, refused.status_read, "AL status 0x0014, code 0x001B");
  story.Expect("al-undocumented-status-code", 0, refused.status_read, "0x001B is not in the manual's list").Optional();
  story.master.Acknowledge(0, Al::kSafeop);
  story.master.ShutDown();
  return story.Finish();
}

Sample FmmuOnMailbox() {
  Story story;
  InPreop(story, AkdDrive());
  story.master.SetUpProcessData(0);
  story.master.MapProcessImage();
  // The FMMU of the inputs once more: it reads 0x1C00, the mailbox of the slave.
  story.master.Fpwr(story.master.station(0), 0x0610,
                    {0x06, 0x00, 0x00, 0x00, 0x06, 0x00, 0x00, 0x07, 0x00, 0x1C, 0x00, 0x01, 0x01, 0x00, 0x00, 0x00});
  const AlAnswer safeop = story.master.ChangeState(0, Al::kSafeop);
  story.Expect("fmmu-mismatch", 0, safeop.status_read, "FMMU1 reads the mailbox at 0x1C00");
  story.master.StartCyclic({});
  story.master.Cycles(30);
  story.master.ShutDown();
  return story.Finish();
}

Sample PdoMappingShifted() {
  Story story;
  SimulatedSlave& drive = story.Add(PowerSupply());
  drive.Override({.from = 2, .to = 4, .action = AlOverride::Action::kRefuse, .code = 0x001E, .times = 1});
  story.master.Scan();
  story.master.BringToPreop();
  Map(story, 0x1600, {0x30000010});
  story.master.Download(0, 0x1A00, 0, {0});
  const SdoAnswer shorter = story.master.Download(0, 0x1A00, 1, LeBytes(std::uint32_t{0x61000108}));
  story.Expect("pdo-not-mappable", 0, shorter.request, "6100h:1 has 16 bits, the master maps 8");
  story.master.Download(0, 0x1A00, 2, LeBytes(std::uint32_t{0x30090008}));
  story.master.Download(0, 0x1A00, 0, {2});
  Assign(story, kRxAssignment, 0x1600);
  Assign(story, kTxAssignment, 0x1A00);
  const AlAnswer refused = RefusedInSafeop(story, 2);
  story.Expect("al-refused", 0, refused.status_read, "AL status 0x0012, code 0x001E");
  story.Expect("al-undocumented-status-code", 0, refused.status_read, "0x001E is not in the manual's list").Optional();
  Map(story, 0x1A00, {0x61000110, 0x30090008, 0x20020108});
  Assign(story, kTxAssignment, 0x1A00);
  FinishWell(story);
  return story.Finish();
}

}  // namespace ecaudit::samples
