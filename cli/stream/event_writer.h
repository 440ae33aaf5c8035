/// Writes what the decoder reconstructed, one event a line, in the order of frames.
#pragma once

#include <array>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "analyzers/model/bus_model.h"
#include "cli/stream/eeprom_lines.h"
#include "cli/stream/event_output.h"
#include "cli/stream/stream_formats.h"
#include "cli/stream/stream_run.h"
#include "decoder/track/events.h"

namespace ecaudit::cli {

class EventWriter final : public LineWriter {
 public:
  /// @param sink  takes the rows as they become known, in place of the targets' formats; outlives the writer
  explicit EventWriter(EventTypes types, EventSink* sink = nullptr) : types_(types), sink_(sink) {}

  [[nodiscard]] std::span<const OutputFormat> formats() const override { return StreamFormats::OfEvents().outputs(); }

  [[nodiscard]] Depth depth() const override { return Depth::kSlaves; }
  void Begin(Observation& observation, const StreamContext& context) override;
  void End() override;
  /// An event is shown by its own frame, but what completes it may follow the range.
  [[nodiscard]] bool stops_at_range_end() const override { return false; }

  // What is received: registers and states.
  void On(const track::SlaveAccess& access);
  void On(const track::Answered& event);
  void On(const track::AlRequest& event);
  void On(const track::AlStatusRead& event);
  void On(const track::AlStatusCodeRead& event);
  void On(const track::AlStateForgotten& event);
  void On(const model::EventBitChanged& event);
  // Latches.
  void On(const model::LatchStep& event);
  void On(const model::LatchMisuse& event);
  // Drives.
  void On(const model::DriveCommanded& event);
  void On(const model::DriveStateChanged& event);
  void On(const model::DriveBits& event);
  void On(const model::DriveMode& event);
  void On(const model::DriveWarning& event);
  void On(const model::DriveFaultExplained& event);
  // EEPROM.
  void On(const track::EepromRead& event);
  void On(const track::EepromWrite& event);
  void On(const track::EepromError& event);
  // Mailboxes.
  void On(const mailbox::MailboxMessage& event);
  void On(const mailbox::MailboxRefused& event);
  void On(const mailbox::MailboxReadLost& event);
  void On(const mailbox::MailboxRepeatRequest& event);
  void On(const mailbox::MailboxUnanswered& event);
  void On(const mailbox::MailboxErrorReply& event);
  void On(const mailbox::SdoTransfer& event);
  /// The model has taken it: the mapping may be another one.
  void OnTaken(const mailbox::SdoTransfer& event);
  void On(const mailbox::SdoUnexpected& event);
  void On(const mailbox::SdoInfo& event);
  void On(const mailbox::Emergency& event);
  void On(const mailbox::EoeFrame& event);
  void On(const mailbox::EoeControl& event);
  void On(const mailbox::FoeTransfer& event);
  void On(const mailbox::SoeMessage& event);
  void On(const mailbox::AoeMessage& event);
  void On(const mailbox::VoeMessage& event);

 private:
  /// What is remembered of a slave to show its story.
  struct SlaveNotes {
    std::optional<std::uint16_t> shown_code;  ///< AL status code of the last al-state line
    bool echo = false;                        ///< the error bit of the last al-state line is the echo of an acknowledge
    FrameNo long_answer = 0;                  ///< SDO answer whose mailbox length is more than it needs
    std::uint16_t long_answer_length = 0;
    std::array<std::uint64_t, 2> mapping{};  ///< Rx, Tx: digest of what the last pdo-mapping line reported, 0: none yet
  };

  struct RegisterWrite;
  struct DriveLine;
  void WriteDrive(SlaveId slave, const FrameRef& frame, const DriveLine& line);
  void WriteRegister(const RegisterWrite& write);
  /// Distributed clocks: what was configured and read, and each sample of the distributed time.
  void WriteClock(const track::SlaveAccess& access);
  void WriteAlState(SlaveId slave, const FrameRef& frame, esc::AlWord status, const std::optional<esc::AlWord>& before,
                    std::optional<std::uint16_t> code, bool error_bit_known);
  /// ", reserved bits 0x0100", or nothing
  [[nodiscard]] static std::string OtherBitsText(esc::AlWord word);
  /// "PREOP+ERR", "INIT (acknowledge echoed)"
  [[nodiscard]] static std::string AlText(esc::AlWord status, bool echo);
  /// A code that was read apart from the state it explains.
  void ShowStatusCode(SlaveId slave, const FrameRef& frame, std::uint16_t code);
  /// One line for each direction whose process data are known and differ from those of the last line.
  void WriteMappings(SlaveId slave, const FrameRef& frame);
  void WriteMapping(SlaveId slave, const FrameRef& frame, device::PdoDirection direction);
  [[nodiscard]] const device::DeviceDescription* ProfileOf(SlaveId slave) const;
  SlaveNotes& NotesOf(SlaveId slave);

  EventTypes types_;
  EventSink* sink_;
  std::unique_ptr<EventOutput> output_;
  std::unique_ptr<EepromLines> eeprom_;
  const model::BusModel* model_ = nullptr;  ///< knows the family of each slave
  std::deque<SlaveNotes> notes_;
  // The broadcast write that was shown last: it reaches every slave, but is one event.
  FrameNo broadcast_frame_ = 0;
  int broadcast_datagram_ = -1;
  FrameNo clock_broadcast_frame_ = 0;
  int clock_broadcast_datagram_ = -1;
};

}  // namespace ecaudit::cli
