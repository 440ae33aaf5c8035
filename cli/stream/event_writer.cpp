/// Slaves, registers, states and EEPROM; mailboxes are in event_writer_mailbox.cpp.
#include "cli/stream/event_writer.h"

#include "analyzers/words/al_text.h"
#include "decoder/base/names.h"
#include "decoder/base/text.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/esc/register_map.h"
#include "decoder/esc/register_text.h"

namespace ecaudit::cli {
namespace {

std::string_view Name(track::Acceptance acceptance) {
  static constexpr Named<track::Acceptance> kNames[] = {
      {track::Acceptance::kAccepted, "accepted"},
      {track::Acceptance::kRefused, "refused"},
      {track::Acceptance::kUnknown, "unknown"},
      {track::Acceptance::kAssumed, "assumed"},
  };
  static_assert(NamesAll(kNames, track::Acceptance::kAssumed));
  return NameIn(kNames, acceptance);
}

std::string_view NoteOf(track::Acceptance acceptance) {
  static constexpr Named<track::Acceptance> kNames[] = {
      {track::Acceptance::kAccepted, ""},
      {track::Acceptance::kAssumed, ""},
      {track::Acceptance::kRefused, "not accepted"},
      {track::Acceptance::kUnknown, "not known whether accepted"},
  };
  return NameIn(kNames, acceptance);
}

}  // namespace

/// A write of the master to registers of one slave or of all.
struct EventWriter::RegisterWrite {
  SlaveId slave = kNoSlave;
  FrameRef sent, returned;
  wire::Command command = wire::Command::NOP;
  EscAddress address = 0;
  ByteSpan data;
  track::Acceptance acceptance = track::Acceptance::kUnknown;

  [[nodiscard]] const FrameRef& frame() const { return sent.seen() ? sent : returned; }
};

void EventWriter::Begin(Observation& observation, const StreamContext& context) {
  output_ = std::make_unique<EventOutput>(observation.pipeline(), context, types_, sink_);
  eeprom_ = std::make_unique<EepromLines>(*output_);
  model_ = &observation.model();
  observation.bus()
      .ListenTo<track::SlaveAccess, track::Answered, model::EventBitChanged, model::LatchStep, model::LatchMisuse,
                model::DriveCommanded, model::DriveBits, model::DriveStateChanged, model::DriveMode,
                model::DriveWarning, model::DriveFaultExplained, track::EepromError, mailbox::MailboxMessage,
                mailbox::MailboxRefused, mailbox::MailboxReadLost, mailbox::MailboxRepeatRequest,
                mailbox::MailboxUnanswered, mailbox::MailboxErrorReply, mailbox::SdoTransfer, mailbox::SdoUnexpected,
                mailbox::EoeFrame, mailbox::EoeControl, mailbox::FoeTransfer, mailbox::SoeMessage, mailbox::AoeMessage,
                mailbox::VoeMessage>(Stage::kBeforeModel, *this);
  // Shown with what the model makes of them: names, families, mappings.
  observation.bus()
      .ListenTo<track::EepromRead, track::EepromWrite, track::AlRequest, track::AlStatusRead, track::AlStatusCodeRead,
                track::AlStateForgotten, mailbox::SdoInfo, mailbox::Emergency>(Stage::kAfterModel, *this);
  observation.bus().Listen(Stage::kAfterModel, *this, &EventWriter::OnTaken);
  output_->Begin();
}

void EventWriter::End() {
  eeprom_->End();
  output_->End();
}

const device::DeviceDescription* EventWriter::ProfileOf(SlaveId slave) const {
  return slave < model_->size() ? model_->slave(slave).profile : nullptr;
}

EventWriter::SlaveNotes& EventWriter::NotesOf(SlaveId slave) {
  while (notes_.size() <= slave) notes_.emplace_back();
  return notes_[slave];
}

void EventWriter::WriteRegister(const RegisterWrite& write) {
  if (!output_->Wants(EventType::kRegisterWrite, write.frame(), write.slave)) return;
  EventRow row(*output_, EventType::kRegisterWrite, write.frame(), write.slave);
  row.fields.Text("command", wire::Name(write.command));
  row.fields.Number("address", write.address);
  row.TextOrNull("register", esc::AccessName(write.address, write.data.size()));
  row.fields.Number("length", write.data.size());
  row.fields.Bytes("data", write.data);
  row.text = esc::DescribeAccess(write.address, write.data, esc::AccessKind::WRITE);
  row.fields.Text("value", row.text);
  row.fields.Text("acceptance", Name(write.acceptance));
  row.fields.Bool("broadcast", wire::IsBroadcast(write.command));
  row.Frame("sent_frame", write.sent);
  row.Frame("returned_frame", write.returned);
  row.Note(NoteOf(write.acceptance));
  if (write.acceptance == track::Acceptance::kRefused) row.style = report::Style::kWarning;
  const bool al_control = write.address == esc::kAlControl && write.data.size() <= 2;
  const bool eeprom = write.address >= esc::kEepromControl && write.address + write.data.size() <= esc::kEepromEnd;
  row.shown_elsewhere = write.slave != kNoSlave && (al_control || eeprom);
}

void EventWriter::WriteClock(const track::SlaveAccess& access) {
  const bool distributes = access.command == wire::Command::ARMW || access.command == wire::Command::FRMW;
  const bool writes = !access.written.empty() && !distributes;
  const ByteSpan data = writes ? access.written : access.read;
  if (data.empty() || access.address >= esc::kDcEnd || access.address + data.size() <= esc::kDcFirst) return;
  SlaveId slave = access.slave;
  if (access.broadcast) {
    if (access.frame().number == clock_broadcast_frame_ && access.datagram == clock_broadcast_datagram_) return;
    clock_broadcast_frame_ = access.frame().number;
    clock_broadcast_datagram_ = access.datagram;
    slave = kNoSlave;
  }
  const FrameRef& frame = writes && access.sent.seen() ? access.sent : access.frame();
  if (!output_->Wants(EventType::kDc, frame, slave)) return;
  EventRow row(*output_, EventType::kDc, frame, slave);
  row.fields.Text("access", distributes ? "distribution" : writes ? "write" : "read");
  row.fields.Text("command", wire::Name(access.command));
  row.fields.Number("address", access.address);
  row.TextOrNull("register", esc::AccessName(access.address, data.size()));
  row.fields.Number("length", data.size());
  row.fields.Bytes("data", data);
  row.text = esc::DescribeAccess(access.address, data, writes ? esc::AccessKind::WRITE : esc::AccessKind::READ);
  row.fields.Text("value", row.text);
  std::optional<std::uint64_t> time;
  if (const ByteSpan wide = access.Covered(access.read, esc::kSystemTime, 8); !wide.empty()) {
    time = LittleEndian<std::uint64_t>(wide, 0);
  } else if (const ByteSpan low = access.Covered(access.read, esc::kSystemTime, 4); !low.empty()) {
    time = LittleEndian<std::uint32_t>(low, 0);
  }
  row.NumberOrNull("system_time_ns", time);
  row.fields.Text("acceptance", Name(access.acceptance));
  row.fields.Bool("broadcast", access.broadcast);
  if (distributes) {
    row.Note("distributed");
  } else {
    row.Note(NoteOf(access.acceptance));
  }
  // Writes are reported by register-write, and one sample a cycle would bury everything else.
  row.shown_elsewhere = writes || distributes;
}

void EventWriter::On(const track::SlaveAccess& access) {
  if (output_->Wants(EventType::kDc)) WriteClock(access);
  if (access.written.empty() || access.address >= esc::kProcessRam || !output_->Wants(EventType::kRegisterWrite)) {
    return;
  }
  RegisterWrite write{access.slave,   access.sent,    access.returned,  access.command,
                      access.address, access.written, access.acceptance};
  if (access.broadcast) {
    if (write.frame().number == broadcast_frame_ && access.datagram == broadcast_datagram_) return;
    broadcast_frame_ = write.frame().number;
    broadcast_datagram_ = access.datagram;
    write.slave = kNoSlave;
  }
  WriteRegister(write);
}

/// While no slave is known yet, the accesses of broadcasts have no slave to belong to.
void EventWriter::On(const track::Answered& event) {
  if (!output_->Wants(EventType::kRegisterWrite) || output_->network().slaves().size() != 0 ||
      !wire::IsBroadcast(event.command) || !wire::Writes(event.command) || event.address >= esc::kProcessRam) {
    return;
  }
  const bool assumed = !event.returned.seen();
  const bool refused = event.wkc == 0;
  const std::optional<std::uint16_t> count = event.slaves_passed;
  const unsigned step = event.command == wire::Command::BRW ? 3U : 1U;
  const bool all = count && event.wkc == *count * step;
  WriteRegister({kNoSlave, event.sent, event.returned, event.command, event.address,
                 event.sent.seen() ? event.sent_data : event.returned_data,
                 assumed   ? track::Acceptance::kAssumed
                 : refused ? track::Acceptance::kRefused
                 : all     ? track::Acceptance::kAccepted
                           : track::Acceptance::kUnknown});
}

void EventWriter::On(const track::AlRequest& event) {
  if (event.control.state() != static_cast<std::uint8_t>(esc::AlState::INIT)) eeprom_->Pause(event.slave);
  if (!output_->Wants(EventType::kAlRequest, event.frame(), event.slave)) return;
  EventRow row(*output_, EventType::kAlRequest, event.frame(), event.slave);
  const std::string state = esc::StateName(event.control.state());
  row.fields.Text("state", state);
  row.fields.Bool("acknowledge", event.control.bit4());
  row.fields.Number("control", event.control.raw);
  row.fields.Text("acceptance", Name(event.acceptance));
  row.fields.Bool("broadcast", event.broadcast);
  row.Frame("sent_frame", event.sent);
  row.Frame("returned_frame", event.returned);
  row.text = state + " requested";
  if (event.control.bit4()) row.text += ", error acknowledged";
  if (event.control.identification()) row.text += ", identification requested";
  row.text += OtherBitsText(event.control);
  if (event.broadcast) row.text += ", by broadcast";
  row.Note(NoteOf(event.acceptance));
  if (event.acceptance == track::Acceptance::kRefused) row.style = report::Style::kWarning;
}

std::string EventWriter::OtherBitsText(esc::AlWord word) {
  return word.other_bits() != 0 ? ", reserved bits " + Hex(word.other_bits()) : "";
}

std::string EventWriter::AlText(esc::AlWord status, bool echo) {
  return echo ? esc::StateName(status.state()) + " (acknowledge echoed)" : esc::StatusText(status.raw);
}

void EventWriter::WriteAlState(SlaveId slave, const FrameRef& frame, esc::AlWord status,
                               const std::optional<esc::AlWord>& before, std::optional<std::uint16_t> code,
                               bool error_bit_known) {
  if (!output_->Wants(EventType::kAlState, frame, slave)) return;
  const device::DeviceDescription* profile = ProfileOf(slave);
  const bool has_code = code && (*code != 0 || status.bit4());
  const std::string code_text = has_code && profile != nullptr ? CodeText(*code, *profile) : "";
  const bool echo = status.bit4() && slave < model_->size() && model_->slave(slave).al.echoes();
  const bool from_echo = before && before->bit4() && NotesOf(slave).echo;
  NotesOf(slave).echo = echo;
  EventRow row(*output_, EventType::kAlState, frame, slave);
  row.fields.Text("state", esc::StateName(status.state()));
  if (error_bit_known) {
    row.fields.Bool("error", status.bit4() && !echo);
    row.fields.Bool("acknowledge_echoed", echo);
  } else {
    row.fields.Null("error");
    row.fields.Null("acknowledge_echoed");
  }
  row.TextOrNull("from", !before     ? std::string()
                         : from_echo ? esc::StateName(before->state())
                                     : esc::StatusText(before->raw));
  row.fields.Number("status", status.raw);
  row.NumberOrNull("status_code", code);
  row.TextOrNull("status_code_text", code_text);
  const bool same = before && before->raw == status.raw;
  row.text = (before && !same ? AlText(*before, from_echo) + " -> " : "") + AlText(status, echo);
  row.text += OtherBitsText(status);
  if (!code_text.empty()) row.text += ": " + code_text;
  if (!error_bit_known) row.Note("error bit not known, read by broadcast");
  if (status.bit4() && !echo) row.style = report::Style::kError;
}

void EventWriter::On(const track::AlStatusRead& event) {
  if (!event.changed()) {
    if (event.status_code) ShowStatusCode(event.slave, event.frame, *event.status_code);
    return;
  }
  NotesOf(event.slave).shown_code = event.status_code;
  WriteAlState(event.slave, event.frame, event.status, event.before, event.status_code, event.error_bit_known);
  // From here on the process data are used: a mapping that no SDO shows is in force, too.
  if (event.status.state() >= static_cast<std::uint8_t>(esc::AlState::SAFEOP)) WriteMappings(event.slave, event.frame);
}

void EventWriter::On(const track::AlStatusCodeRead& event) {
  ShowStatusCode(event.slave, event.frame, event.code);
}

void EventWriter::ShowStatusCode(SlaveId slave, const FrameRef& frame, std::uint16_t code) {
  SlaveNotes& notes = NotesOf(slave);
  const esc::AlWord* status = output_->network().state(slave).al_status.if_known();
  const bool shown = notes.shown_code ? *notes.shown_code == code : code == 0;
  if (shown || status == nullptr) return;
  notes.shown_code = code;
  WriteAlState(slave, frame, *status, *status, code, true);
}

void EventWriter::On(const track::AlStateForgotten& event) {
  NotesOf(event.slave).shown_code.reset();
  if (!output_->Wants(EventType::kAlState, event.frame, event.slave)) return;
  EventRow row(*output_, EventType::kAlState, event.frame, event.slave);
  for (const char* key : {"state", "error", "from", "acknowledge_echoed", "status", "status_code", "status_code_text"})
    row.fields.Null(key);
  row.text = event.may_be_set_up_anew ? "no longer known: a broadcast read contradicts it, or it may be set up again"
                                      : "no longer known: the slave was gone for a while";
}

void EventWriter::On(const model::EventBitChanged& event) {
  if (!output_->Wants(EventType::kEcatEvent, event.frame, event.slave)) return;
  EventRow row(*output_, EventType::kEcatEvent, event.frame, event.slave);
  const std::string name = esc::EventBitName(esc::kEcatEventRequest, event.bit);
  row.fields.Number("bit", event.bit);
  row.fields.Text("name", name);
  row.fields.Bool("set", event.set);
  row.fields.Text("confidence", event.slave_inferred ? "inferred" : "observed");
  if (event.set) {
    for (const char* key : {"frames", "first_frame", "last_frame"}) row.fields.Null(key);
    row.text = name + " signalled";
  } else {
    row.fields.Number("frames", event.frames);
    row.Frame("first_frame", event.first);
    row.Frame("last_frame", event.last);
    row.text = name + " no longer signalled, was since #" + std::to_string(event.first.number);
    if (event.slave_inferred) row.Note("it went when this slave was read");
  }
}

void EventWriter::On(const track::EepromRead& event) {
  if (output_->Wants(EventType::kEeprom)) eeprom_->On(event);
}
void EventWriter::On(const track::EepromWrite& event) {
  if (output_->Wants(EventType::kEeprom)) eeprom_->On(event);
}
void EventWriter::On(const track::EepromError& event) {
  if (output_->Wants(EventType::kEeprom)) eeprom_->On(event);
}

}  // namespace ecaudit::cli
