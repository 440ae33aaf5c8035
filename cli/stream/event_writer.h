/// Writes what the decoder reconstructed, one event a line, in the order in which it became known.
#pragma once

#include <array>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "analyzers/events/object_names.h"
#include "analyzers/model/bus_model.h"
#include "cli/stream/eeprom_lines.h"
#include "cli/stream/event_output.h"
#include "cli/stream/stream_run.h"
#include "decoder/track/events.h"

namespace ecaudit::cli {

class EventWriter final : public LineWriter, private track::EventSink, private model::ModelSink {
 public:
  explicit EventWriter(EventTypes types) : types_(types) {}

  [[nodiscard]] track::EventSink& events() override { return *this; }
  void Begin(const Pipeline& pipeline, const StreamContext& context) override;
  void End() override;
  /// An event is shown by its own frame, but what completes it may lie behind the range.
  [[nodiscard]] bool stops_at_range_end() const override { return false; }

 private:
  /// What is remembered of a slave to tell its story.
  struct SlaveNotes {
    std::optional<std::uint16_t> shown_code;  ///< AL status code of the last al-state line
    FrameNo long_answer = 0;                  ///< SDO answer whose mailbox length is more than it needs
    std::uint16_t long_answer_length = 0;
    std::array<std::uint64_t, 2> mapping{};  ///< Rx, Tx: digest of what the last pdo-mapping line told, 0: none yet
  };

  using model::ModelSink::On;
  using track::EventSink::On;
  // Slaves and their families.
  void On(const track::SlaveFound& event) override;
  void On(const track::AddressAssigned& event) override;
  void On(const track::IdentityLearned& event) override;
  // Registers and states.
  void OnAccess(const track::SlaveAccess& access) override;
  void On(const track::Answered& event) override;
  void On(const track::AlRequest& event) override;
  void On(const track::AlStatusRead& event) override;
  void On(const track::AlStatusCodeRead& event) override;
  void On(const track::AlStateForgotten& event) override;
  void On(const track::EventFieldChanged& event) override;
  void On(const model::EventBitChanged& event) override;
  // Process data.
  void On(const track::LogicalAccess& access) override;
  void On(const track::FrameLost& event) override;
  void On(const model::LatchStep& event) override;
  void On(const model::LatchMisuse& event) override;
  // Drives.
  void On(const model::DriveCommanded& event) override;
  void On(const model::DriveStateChanged& event) override;
  void On(const model::DriveMode& event) override;
  void On(const model::DriveWarning& event) override;
  void On(const model::DriveFaultExplained& event) override;
  // EEPROM.
  void On(const track::EepromRead& event) override;
  void On(const track::EepromWrite& event) override;
  void On(const track::EepromError& event) override;
  // Mailboxes.
  void On(const mailbox::MailboxMessage& event) override;
  void On(const mailbox::MailboxRefused& event) override;
  void On(const mailbox::MailboxReadLost& event) override;
  void On(const mailbox::MailboxRepeatRequest& event) override;
  void On(const mailbox::MailboxUnanswered& event) override;
  void On(const mailbox::MailboxErrorReply& event) override;
  void On(const mailbox::SdoTransfer& event) override;
  void On(const mailbox::SdoUnexpected& event) override;
  void On(const mailbox::SdoInfo& event) override;
  void On(const mailbox::Emergency& event) override;
  void On(const mailbox::EoeFrame& event) override;
  void On(const mailbox::EoeControl& event) override;
  void On(const mailbox::FoeTransfer& event) override;
  void On(const mailbox::SoeMessage& event) override;
  void On(const mailbox::AoeMessage& event) override;
  void On(const mailbox::VoeMessage& event) override;

  struct RegisterWrite;
  struct DriveLine;
  void WriteDrive(SlaveId slave, const FrameRef& frame, const DriveLine& line);
  void WriteRegister(const RegisterWrite& write);
  /// Distributed clocks: what was configured and read, and each sample of the distributed time.
  void WriteClock(const track::SlaveAccess& access);
  void WriteAlState(SlaveId slave, const FrameRef& frame, esc::AlWord status, const std::optional<esc::AlWord>& before,
                    std::optional<std::uint16_t> code, bool error_bit_known);
  /// A code that was read apart from the state it explains.
  void ShowStatusCode(SlaveId slave, const FrameRef& frame, std::uint16_t code);
  void WriteSdo(const mailbox::SdoTransfer& event);
  /// One line for each direction whose process data are known and differ from those of the last line.
  void WriteMappings(SlaveId slave, const FrameRef& frame);
  void WriteMapping(SlaveId slave, const FrameRef& frame, device::PdoDirection direction);
  [[nodiscard]] const device::DeviceDescription* ProfileOf(SlaveId slave) const;
  SlaveNotes& NotesOf(SlaveId slave);

  EventTypes types_;
  std::unique_ptr<EventOutput> output_;
  std::unique_ptr<EepromLines> eeprom_;
  std::unique_ptr<model::BusModel> model_;  ///< knows the family of each slave
  AnalysisOptions model_options_;
  std::deque<SlaveNotes> notes_;
  // The broadcast write that was shown last: it reaches every slave, but is one event.
  FrameNo broadcast_frame_ = 0;
  int broadcast_datagram_ = -1;
  FrameNo clock_broadcast_frame_ = 0;
  int clock_broadcast_datagram_ = -1;
};

}  // namespace ecaudit::cli
