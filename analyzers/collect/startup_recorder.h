/// in: decoder and model events.  out: StartupSummary of each slave, and of what the master sent to all of them.
///
/// Follows each slave from its first frame to OP (a drive: to Operation enabled). Phases are recognised by registers
/// and AL states, so that it does not matter which master is at work. A slave that is taken back to INIT before it
/// reached OP begins again: of several attempts the one that came furthest is kept, the first of equals.
///
/// Keeps: at most kMaxSteps steps a slave, kMaxBytes of their values; later ones are counted. What happens in OP adds
/// nothing, so memory does not grow with the length of the capture.
/// Source: esc-reference 13.
#pragma once

#include <array>
#include <deque>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "analyzers/collect/collector.h"
#include "analyzers/collect/step_room.h"
#include "analyzers/model/bus_model.h"
#include "analyzers/model/model_events.h"
#include "analyzers/result/startup_summary.h"
#include "analyzers/wiring/event_bus.h"
#include "decoder/track/events.h"

namespace ecaudit::startup {

class StartupRecorder final : public Collector {
 public:
  static constexpr std::size_t kMaxSteps = 1000;       ///< a slave
  static constexpr std::size_t kMaxBytes = 1U << 16U;  ///< of values, a slave
  static constexpr std::size_t kMaxSettings = 256;     ///< by SoE, EoE and AoE, a slave
  // Of all slaves; real buses stay far below.
  static constexpr std::size_t kMaxAllSteps = 25'000;
  static constexpr std::uint64_t kAtOnce = 4'000;   ///< of all slaves, however short the capture is, and ...
  static constexpr std::uint64_t kBytesAStep = 80;  ///< ... one more for this many bytes of frames
  static constexpr std::size_t kMaxAllBytes = std::size_t{4} << 20U;

  /// @param model must outlive this, as @param pipeline must
  StartupRecorder(const model::BusModel& model, const Pipeline& pipeline, EventBus& bus);

  void On(const track::AlRequest& request);
  void On(const track::AlStatusRead& read);
  /// Needs the event of each slave, unless all are in OP: reading once more that they are shows nothing new.
  void On(const track::AlPoll& poll);
  void On(const track::Answered& event);
  /// Until a slave is in operation its steps are counted.
  void On(const track::EepromRead& event);
  void On(const track::EepromWrite& event);
  void On(const mailbox::SdoTransfer& transfer);
  void On(const model::AlAnswered& event);
  void On(const model::AlErrorCode& event);
  void On(const model::AlOverdue& event);
  void On(const model::AlGivenUp& event);
  void On(const mailbox::MailboxUnanswered& event);
  void On(const mailbox::SoeMessage& message) { AddSetting(message); }
  void On(const mailbox::EoeControl& message) { AddSetting(message); }
  void On(const mailbox::AoeMessage& message) { AddSetting(message); }
  void On(const mailbox::MailboxErrorReply& reply);
  void On(const model::DriveCommanded& event);
  void On(const model::DriveStateChanged& event);
  void On(const track::SlaveAccess& access);

  /// Hands the steps over. Texts are made here, when the names that the capture teaches are known.
  void Summarise(AnalysisResult& result) override;

 private:
  struct Phase {
    FrameRef first, last;
    std::uint64_t accesses = 0;
    std::uint64_t words = 0;   ///< read from the EEPROM
    std::uint8_t reached = 0;  ///< AL state
    std::uint8_t refused = 0;  ///< AL state that was refused last
    std::uint16_t code = 0;
    bool enabled = false;
  };
  /// One attempt.
  struct Record {
    std::vector<StartupStep> steps;
    std::vector<MailboxSetting> settings;
    std::uint64_t left_out = 0;
    std::size_t bytes = 0;
    std::uint64_t dropped_bytes = 0;
    std::array<Phase, kStartupPhases> phases{};
    std::uint8_t highest = 0;
    FrameRef end;
  };
  struct Story {
    Record record;
    std::unique_ptr<Record> best;  ///< null: the current attempt is the first
    std::uint8_t state = 0;        ///< as read last, 0: unknown
    /// The last changes of `state`, a ring: SDO transfers are published when they end, which may be later.
    std::array<std::pair<FrameNo, std::uint8_t>, 8> changes{};
    std::size_t change_count = 0;
    FrameNo operation_since = 0;

    void SetState(std::uint8_t now, FrameNo frame);
    [[nodiscard]] std::uint8_t StateAt(FrameNo frame) const;
    std::optional<std::uint8_t> first_state;
    FrameNo asked = 0;          ///< the frame that brought the last request back
    bool in_operation = false;  ///< OP was reached: the master's part is over
    bool enabled = false;       ///< and the drive is enabled, or OP was left
    bool left_operation = false;
    bool drive_commanded = false;
    std::optional<device::DriveState> drive_shows;
    mailbox::MailboxUnanswered unanswered;  ///< the last request to the mailbox that got no answer
    std::uint64_t again = 0;
    FrameRef again_frame;
    FrameRef to_init;  ///< the last request of INIT since operation was left
  };

  [[nodiscard]] StartupSummary SummariseSlave(SlaveId slave, const FrameRef& capture_end);
  /// Null: no state was requested yet.
  [[nodiscard]] static StartupStep* LastRequest(Record& record);
  bool TookItsPlace(Story& story, const track::AlRequest& request);
  static void NotFollowed(Story& story, std::uint8_t wanted, const FrameRef& last_look);
  /// What was sent to all slaves at once.
  [[nodiscard]] StartupSummary SummariseBus();
  Story& Get(SlaveId slave);
  template <typename Message>
  void AddSetting(const Message& message);
  static void Extend(Record& record, StartupPhase phase, const FrameRef& first, const FrameRef& last);
  void Add(Record& record, StartupStep step, ByteSpan data);
  void Write(Record& record, const track::SlaveAccess& access, std::uint8_t state);
  void WriteUnit(Record& record, const track::SlaveAccess& access, EscAddress address, ByteSpan data,
                 StartupPhase phase);
  [[nodiscard]] bool TakeBytes(Record& record, std::size_t count);
  void ReadBack(Record& record, const track::SlaveAccess& access);
  void BeginAnew(Story& story);
  [[nodiscard]] StartupSummary Finish(Record& record, SlaveId slave) const;
  void Describe(StartupStep& step, SlaveId slave) const;

  const model::BusModel& model_;
  std::deque<Story> stories_;
  /// Of each story: a read of this state would show nothing new; 0: any may. In OP the master's part is over.
  std::vector<std::uint8_t> last_shown_;
  Record bus_;
  bool scan_done_ = false;  ///< a slave reached PREOP
  bool bus_done_ = false;   ///< a slave reached OP
  FrameNo broadcast_frame_ = 0;
  std::uint8_t broadcast_datagram_ = 0;
  StepRoom room_;
  std::size_t all_steps_ = 0;
  std::size_t all_bytes_ = 0;
};

}  // namespace ecaudit::startup
