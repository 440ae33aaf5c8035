/// What a scenario is made of, and the table of all of them.
///
/// To add a sample: write one function in scenarios/<topic>.cpp, declare it at the end of this file, add one line to
/// the table in scenarios/table.cpp, run `ecaudit_make_samples samples`.
#pragma once

#include <deque>
#include <span>
#include <string>
#include <vector>

#include "samples/builder/devices.h"
#include "samples/builder/recorder.h"
#include "samples/builder/scripted_master.h"
#include "samples/builder/simulated_bus.h"

namespace ecaudit::samples {

/// A finding that a correct report holds. Nothing but the expected findings may have severity error or warning;
/// findings of severity info are listed only where they are the point of the sample.
struct Expectation {
  std::string rule{};
  int slave = -1;         ///< position; -1: the whole bus, or not to be told from the capture
  FrameNo sent = 0;       ///< the frame in question: outbound copy, 0 when it is not in the file
  FrameNo returned = 0;   ///< returned copy, 0 when it is not in the file
  FrameNo until = 0;      ///< the finding may also cite a later frame up to this one, which proves it
  int count = 0;          ///< repetitions folded into one finding; 0: not said
  bool optional = false;  ///< a consequence that a report may name or fold into its cause
  std::string why{};
  FrameIds until_frame{};  ///< what `until` is made from

  Expectation& Times(int n) {
    count = n;
    return *this;
  }
  Expectation& Until(const FrameIds& frame) {
    until_frame = frame;
    return *this;
  }
  Expectation& Optional() {
    optional = true;
    return *this;
  }
};

struct Sample {
  std::string extension = "pcapng";
  Bytes file{};
  std::size_t packets = 0;
  std::vector<Expectation> expected{};
};

/// A bus, a master and a capture of it. Power on is 2026-03-02 09:00:00 UTC.
class Story {
 public:
  static constexpr TimeNs kPowerOn = 1'772'442'000'000'000'000;

  explicit Story(const MasterWay& way = WayOf("soem"));

  SimulatedSlave& Add(SlaveDescription description) { return bus.Add(std::move(description)); }
  /// Notes a finding of a correct report at a frame of the master.
  Expectation& Expect(std::string rule, int slave, const FrameIds& frame, std::string why = {});
  /// Notes a finding that belongs to no single frame.
  Expectation& Expect(std::string rule, int slave = -1, std::string why = {}) {
    return Expect(std::move(rule), slave, FrameIds{}, std::move(why));
  }
  [[nodiscard]] Sample Finish() const;

  /// Process data of a drive with PDO 1701h: position command and control word in all further frames.
  void Command(std::size_t position, std::uint16_t control, std::int32_t target = 0);
  /// The master's way of enabling a drive in OP: shutdown, switch on, enable operation; and of switching it off.
  void EnableDrive(std::size_t position);
  void DisableDrive(std::size_t position, std::int32_t target = 0);
  /// `cycles` cycles in which the position command goes from `from` to `to`.
  void Move(std::size_t position, std::int32_t from, std::int32_t to, int cycles);

  Recorder capture;
  SimulatedBus bus;
  ScriptedMaster master;

 private:
  struct Noted {
    Expectation finding;
    FrameIds frame;
  };
  std::deque<Noted> noted_;
};

struct Scenario {
  const char* name;    ///< of the file, without extension
  const char* about;   ///< what happens
  const char* report;  ///< what a correct report says
  Sample (*make)();
};

/// All scenarios, in the order of samples/README.md.
[[nodiscard]] std::span<const Scenario> AllScenarios();

/// Two drives with distributed clocks and a terminal between them, from the scan to OP, moved for `cycles` cycles, and
/// back to INIT: for `story` in any master's way, without slaves yet.
void PlayHealthyRun(Story& story, int cycles = 20);

// startup.cpp
Sample CleanStartup();
Sample CleanMixedBus();
Sample CleanTwinCatHabits();
Sample MidRun();
Sample MidRunInFault();
// runs.cpp
Sample BroadcastFirst();
Sample BroadcastFirstRefused();
Sample RestartOtherCycle();
Sample RestartWrongCycle();
Sample TwoRecordings();
Sample LongPause();
Sample PositionAndStation();
Sample PositionAndStationFalls();
// losses.cpp
Sample SentAgain();
Sample NobodyAnswers();
Sample FramePerSlave();
Sample TwoCountersOutputs();
Sample BranchSlaveLeaves();
// absence.cpp
Sample FmmuSwitchedOff();
Sample ProcessDataStop();
Sample OpWithoutProcessData();
Sample BroadcastShowsError();
Sample BroadcastShowsAllFall();
Sample OpWaitsForProcessData();
// masters.cpp
Sample MasterIgh();
Sample MasterEtherCrab();
Sample MasterEtherCrabEarly();
Sample MasterKickCat();
Sample MasterAcontis();
Sample MasterCodesys();
// al.cpp
Sample InitToOpRefused();
Sample RefusalNeverAcknowledged();
Sample FallsOutOfOp();
Sample TwoSlavesOneRefuses();
Sample BadMailboxConfig();
Sample AlTimeout();
Sample WrongStatusCode();
Sample UndocumentedStatusCode();
Sample WatchdogTimeZero();
Sample AcceptedIllegal();
Sample InvalidRequest();
Sample UnexpectedErrorUnread();
Sample ErrorStanding();
// mailbox.cpp
Sample SdoAborts();
Sample MailboxNoResponse();
Sample Emergencies();
Sample EmergencyDuringSdo();
Sample FoeUnsupported();
Sample FoeEndsInError();
Sample MailboxCounterSkipped();
Sample SdoBeforePreop();
// bus.cpp
Sample LostFrames();
Sample SecondMaster();
Sample DuplicatedFrames();
Sample Circulating();
Sample WkcLinkBreak();
Sample DuplicateAddress();
Sample SlaveCountChanges();
Sample LinkErrors();
Sample ReadOnlyWrite();
Sample EepromChecksum();
Sample EepromAlias();
Sample EepromBlank();
Sample IdentityRepeated();
Sample NothingMapped();
// blame.cpp
Sample SwitchOnTheBus();
Sample IrregularMaster();
Sample CheckSequences();
Sample EightLostThenFault();
Sample SdoStopsProcessData();
Sample NumbersLeftOut();
Sample WholeFrameLengths();
Sample ReferenceClockWritten();
Sample PortsSwapped();
// pdo.cpp
Sample PdoAssignOrder();
Sample PdoUnsupported();
Sample PdoOddMapping();
Sample PdoMappedTwice();
Sample PdoAssignedInSafeop();
Sample SyncManagersOverlap();
Sample PdoNotMappable();
Sample PdoLengthMismatch();
Sample SyncManagerChangedInOp();
Sample FmmusOverlap();
Sample FmmuOnOtherSyncManager();
Sample FmmuOnMailbox();
Sample PdoMappingShifted();
// drive.cpp
Sample DriveFault();
Sample DriveInFault();
Sample DriveIllegalStatus();
Sample DriveIllegalCommand();
Sample DriveNeverEnabled();
Sample DriveUnsupportedMode();
Sample DriveEnabledInSafeop();
Sample SyncFramesMissing();
Sample SyncSwitchedOff();
Sample SyncLostFault();
Sample DriveIllegalStateChange();
Sample DriveModeNotShown();
Sample InterpolationTimeChanged();
Sample ClockOffsetRewritten();
// latch.cpp
Sample LatchWellUsed();
Sample LatchMisuse();
Sample LatchLostWhileDisarming();
Sample LatchUnreadable();
// capture.cpp
Sample OutboundOnly();
Sample ReturnedOnly();
Sample Truncated();
Sample SnapLength();
Sample CoarseTimestamps();
Sample PcapMicroseconds();
Sample TwoInterfaces();
Sample EslProbe();
Sample VlanTagged();
Sample UdpEncapsulated();
Sample NoEtherCat();
Sample ForeignTraffic();
Sample Malformed();

}  // namespace ecaudit::samples
