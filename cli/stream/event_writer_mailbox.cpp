/// Mailbox messages and what they add up to.
#include <type_traits>
#include <variant>

#include "analyzers/objects/object_value.h"
#include "analyzers/objects/object_words.h"
#include "analyzers/objects/relatives.h"
#include "cli/stream/event_writer.h"
#include "cli/stream/json_line.h"
#include "cli/stream/message_text.h"
#include "decoder/base/names.h"
#include "decoder/base/text.h"
#include "decoder/mailbox/eoe.h"
#include "decoder/mailbox/error_reply.h"
#include "decoder/mailbox/foe.h"
#include "decoder/mailbox/sdo.h"
#include "decoder/mailbox/sdo_info.h"
#include "decoder/process/pdo_mapping.h"

namespace ecaudit::cli {
namespace {

using report::Style;

constexpr std::size_t kShownMessageBytes = 24;
constexpr std::size_t kShownText = 160;
constexpr std::size_t kSdoBytes = 10;  // CoE header, command, object, four bytes

/// The object of an SDO answer or transfer, null where it is not known.
template <typename E>
void WriteObject(EventRow& row, const E& event) {
  if (event.has_object) {
    row.fields.Number("index", event.index);
    row.fields.Number("subindex", event.subindex);
  } else {
    row.fields.Null("index");
    row.fields.Null("subindex");
  }
}

std::string_view Name(Certainty certainty) {
  static constexpr Named<Certainty> kNames[] = {
      {Certainty::kUnknown, "unknown"},
      {Certainty::kInferred, "inferred"},
      {Certainty::kObserved, "observed"},
  };
  static_assert(NamesAll(kNames, Certainty::kObserved));
  return NameIn(kNames, certainty);
}

std::string_view Name(mailbox::MailboxUnanswered::End end) {
  static constexpr Named<mailbox::MailboxUnanswered::End> kNames[] = {
      {mailbox::MailboxUnanswered::End::kNextRequest, "next-request"},
      {mailbox::MailboxUnanswered::End::kCaptureEnd, "capture-end"},
      {mailbox::MailboxUnanswered::End::kReset, "reset"},
      {mailbox::MailboxUnanswered::End::kGap, "gap"},
  };
  static_assert(NamesAll(kNames, mailbox::MailboxUnanswered::End::kGap));
  return NameIn(kNames, end);
}

/// How a file transfer or a request for SDO information ended; the same words for all protocols.
template <typename Outcome>
std::string_view OutcomeName(Outcome outcome) {
  static constexpr Named<Outcome> kNames[] = {
      {Outcome::kCompleted, "completed"},
      {Outcome::kError, "error"},
      {Outcome::kMailboxError, "mailbox-error"},
      {Outcome::kSuperseded, "superseded"},
      {Outcome::kCaptureEnd, "capture-end"},
      {Outcome::kReset, "reset"},
      {Outcome::kGap, "gap"},
      {Outcome::kNotCaptured, "not-captured"},
  };
  static_assert(NamesAll(kNames, Outcome::kNotCaptured));
  return NameIn(kNames, outcome);
}

std::string_view OutcomeName(mailbox::SdoOutcome outcome) {
  using mailbox::SdoOutcome;
  static constexpr Named<mailbox::SdoOutcome> kNames[] = {
      {SdoOutcome::kCompleted, "completed"},
      {SdoOutcome::kAborted, "aborted"},
      {SdoOutcome::kMailboxError, "mailbox-error"},
      {SdoOutcome::kSuperseded, "superseded"},
      {SdoOutcome::kCaptureEnd, "capture-end"},
      {SdoOutcome::kReset, "reset"},
      {SdoOutcome::kGap, "gap"},
      {SdoOutcome::kNotCaptured, "not-captured"},
  };
  const std::string_view name = NameIn(kNames, outcome);
  return !name.empty() ? name : "gap";
}

/// Text about an outcome that is not plain success; "" for success.
std::string OutcomeNote(std::string_view outcome, std::uint16_t mailbox_error) {
  if (outcome == "mailbox-error") {
    const std::string_view text = mailbox::MailboxErrorText(mailbox_error);
    return "mailbox error " + Hex(mailbox_error) + (text.empty() ? "" : ", " + std::string(text));
  }
  if (outcome == "superseded") return "not finished when the next one began";
  if (outcome == "capture-end") return "not finished when the capture ended";
  if (outcome == "reset") return "not finished when the mailbox was switched off or reconfigured";
  if (outcome == "gap") return "result unknown, frames are missing from the capture";
  if (outcome == "not-captured") return "the answer is not in the capture";
  return "";
}

/// Of a transfer that did not end with an error.
template <typename Transfer>
void AddOutcome(EventRow& row, const Transfer& event) {
  const std::string note = OutcomeNote(OutcomeName(event.outcome), event.mailbox_error);
  if (note.empty()) return;
  row.text += ": " + note;
  row.style = Style::kWarning;
}

/// "0x06010002 attempt to write a read-only object"
std::string CodeText(std::uint32_t code, std::string_view meaning) {
  return Hex(code, 8) + (meaning.empty() ? "" : " " + std::string(meaning));
}

std::string ShortHex(ByteSpan bytes) {
  return HexBytes(Slice(bytes, 0, kShownMessageBytes)) + (bytes.size() > kShownMessageBytes ? "..." : "");
}

std::string Arrow(mailbox::Direction direction) {
  return direction == mailbox::Direction::kOut ? "->" : "<-";
}

/// Long text is cut, at a character's beginning.
std::string Shortened(const std::string& text) {
  if (text.size() <= kShownText) return text;
  std::size_t end = kShownText;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U) --end;
  return text.substr(0, end) + "...";
}

void AppendValue(std::string& out, const events::ObjectValue& value) {
  if (!value.items.empty()) {
    out += '[';
    for (std::size_t i = 0; i < value.items.size(); ++i) {
      if (i != 0) out += ',';
      AppendValue(out, value.items[i]);
    }
    out += ']';
    return;
  }
  std::visit(
      [&out](const auto& v) {
        using T = std::decay_t<decltype(v)>;
        if constexpr (std::is_same_v<T, std::monostate>) {
          out += "null";
        } else if constexpr (std::is_same_v<T, bool>) {
          out += v ? "true" : "false";
        } else if constexpr (std::is_same_v<T, double>) {
          AppendJsonNumber(out, v);
        } else if constexpr (std::is_same_v<T, std::string>) {
          AppendJsonString(out, v);
        } else {
          AppendNumber(out, v);
        }
      },
      value.value);
}

/// Where a transfer deviates from ETG.1000.6 but is understood all the same.
std::vector<std::string> Deviations(const mailbox::SdoTransfer& transfer, std::uint16_t long_answer) {
  std::vector<std::string> list;
  if (transfer.response_service_mismatch) list.emplace_back("answer under CoE service 2, SDO request");
  if (transfer.request_service_mismatch) list.emplace_back("request under another CoE service than 2");
  if (long_answer != 0) {
    list.push_back("mailbox length " + std::to_string(long_answer) + " where the answer has " +
                   std::to_string(kSdoBytes) + " bytes");
  }
  if (transfer.size_mismatch) {
    list.push_back("size " + std::to_string(transfer.size) + " instead of the announced " +
                   std::to_string(transfer.declared_size.value_or(0)));
  }
  if (transfer.excess != 0) list.push_back(Count(transfer.excess, "byte") + " beyond the announced size");
  if (transfer.toggle_errors != 0) list.push_back(Count(transfer.toggle_errors, "wrong toggle bit"));
  if (transfer.displaced_abort_code) {
    list.push_back("abort code " + Hex(*transfer.displaced_abort_code, 8) + " found four bytes after its place");
  }
  if (transfer.data_gap) list.emplace_back("data are missing: a segment is not in the capture");
  return list;
}

void StringList(RowFields& fields, std::string_view key, const std::vector<std::string>& list) {
  std::string& out = fields.Json(key);
  out += '[';
  for (std::size_t i = 0; i < list.size(); ++i) {
    if (i != 0) out += ',';
    AppendJsonString(out, list[i]);
  }
  out += ']';
}

void AddRequest(EventRow& row, const mailbox::RequestSummary& request) {
  row.TextOrNull("request", request.frame.seen() ? DescribeRequest(request) : "");
  row.Frame("request_frame", request.frame);
}

/// The object of a transfer and the value that went to it or came from it, as far as they are known.
struct SdoObject {
  bool has_value = false;
  events::ObjectInfo info;
  events::ObjectValue value;
  std::string words;  ///< the value in words of the family's manual; empty: none
};

SdoObject ObjectOf(const mailbox::SdoTransfer& event, const events::ObjectNames& names,
                   const device::DeviceDescription* profile) {
  SdoObject object;
  if (!event.has_object) return object;
  // An upload that was cut short has no value; what a download wanted to write is one all the same.
  object.has_value =
      !event.data_gap && !event.data.empty() &&
      (event.service == mailbox::SdoService::kDownload || event.outcome == mailbox::SdoOutcome::kCompleted);
  object.info =
      event.complete_access ? names.FindWhole(profile, event.index) : names.Find(profile, event.index, event.subindex);
  if (object.has_value) {
    object.value = event.complete_access
                       ? events::ReadCompleteAccess(names, profile, event.index, event.subindex, event.data)
                       : events::ReadValue(names, profile, event.index, event.subindex, event.data);
    if (!event.complete_access && profile != nullptr && event.data.size() <= 8) {
      object.words = events::WordsOf(*profile, event.index, event.subindex, UnsignedOf(event.data));
    }
  }
  return object;
}

std::string_view AbortTextOf(const mailbox::SdoTransfer& event) {
  return event.outcome == mailbox::SdoOutcome::kAborted ? mailbox::AbortCodeText(event.abort_code) : std::string_view();
}

void WriteSdoFields(EventRow& row, const mailbox::SdoTransfer& event, const SdoObject& object) {
  const bool aborted = event.outcome == mailbox::SdoOutcome::kAborted;
  const bool service_known = event.service != mailbox::SdoService::kUnknown;
  row.TextOrNull("service", service_known ? mailbox::Name(event.service) : "");
  row.TextOrNull("transfer", event.kind != mailbox::SdoTransferKind::kUnknown ? mailbox::Name(event.kind) : "");
  row.fields.Bool("complete_access", event.complete_access);
  WriteObject(row, event);
  row.fields.Bytes("data", event.data);
  AppendValue(row.fields.Json("value"), object.value);
  row.TextOrNull("name", object.info.name);
  row.NumberOrNull("abort_code", aborted ? std::optional(event.abort_code) : std::nullopt);
  row.TextOrNull("abort_text", AbortTextOf(event));
  row.Frame("request_frame", event.request);
  row.Frame("response_frame", event.response);
  row.Milliseconds("duration_ms", event.duration);
  // Beyond the contract.
  row.fields.Text("outcome", OutcomeName(event.outcome));
  row.TextOrNull("text", object.value.text);
  row.TextOrNull("words", object.words);
  const bool type_known = object.info.type != mailbox::DataType::kUnknown;
  row.TextOrNull("type", type_known ? mailbox::Name(object.info.type) : "");
  row.TextOrNull("name_source", events::Name(object.info.name_source));
  row.fields.Number("size", event.size);
  row.NumberOrNull("declared_size", event.declared_size);
  row.fields.Number("segments", event.segments);
  row.TextOrNull("aborted_by", !aborted ? "" : event.aborted_by == mailbox::Direction::kOut ? "master" : "slave");
  row.NumberOrNull("mailbox_error", event.outcome == mailbox::SdoOutcome::kMailboxError
                                        ? std::optional(event.mailbox_error)
                                        : std::nullopt);
}

void WriteSdoText(EventRow& row, const mailbox::SdoTransfer& event, const SdoObject& object) {
  row.text = event.service != mailbox::SdoService::kUnknown ? std::string(mailbox::Name(event.service)) : "transfer";
  row.text += event.has_object ? " " + (event.complete_access ? ObjectName(event.index) + " complete"
                                                              : ObjectName(event.index, event.subindex))
                               : " of an object whose request was not captured";
  if (!object.info.name.empty()) row.text += " " + Printable(object.info.name);
  if (object.info.name_source == events::NameSource::kInferred) row.text += " (inferred)";
  if (object.has_value) {
    row.text += " = " + Shortened(object.value.text);
    if (!object.words.empty()) row.text += " (" + Printable(object.words) + ")";
    if (event.size > 8) row.Note(Count(event.size, "byte"));
  }
  if (event.outcome == mailbox::SdoOutcome::kAborted) {
    row.text += std::string(": aborted by the ") + (event.aborted_by == mailbox::Direction::kOut ? "master" : "slave") +
                ", " + CodeText(event.abort_code, AbortTextOf(event));
    row.style = Style::kError;
  } else {
    AddOutcome(row, event);
  }
  if (event.duration) row.text += ", " + Duration(*event.duration);
}

/// A list of objects, as far as it came.
void WriteList(EventRow& row, const mailbox::SdoInfo& event, bool completed) {
  row.fields.Text("kind", "list");
  row.fields.Number("list_type", event.list_type);
  std::string& out = row.fields.Json(event.list_type == 0 ? "lengths" : "indices");
  out += '[';
  for (std::size_t i = 0; i < event.indices.size(); ++i) {
    if (i != 0) out += ',';
    AppendNumber(out, event.indices[i]);
  }
  out += ']';
  row.text = "list of " + mailbox::ListTypeName(event.list_type);
  if (completed && event.list_type != 0) {
    row.text += ": " + Count(event.indices.size(), "object");
    constexpr std::size_t kShown = 12;
    for (std::size_t i = 0; i < event.indices.size() && i < kShown; ++i) {
      row.text += (i == 0 ? ", " : " ") + ObjectName(event.indices[i]);
    }
    if (event.indices.size() > kShown) row.text += " ...";
  } else if (completed) {
    row.text += ":";
    for (const std::uint16_t length : event.indices) row.text += " " + std::to_string(length);
  }
}

void WriteObjectDescription(EventRow& row, const mailbox::SdoInfo& event, bool completed) {
  const std::string type_name = mailbox::Name(static_cast<mailbox::DataType>(event.data_type));
  row.fields.Text("kind", "object");
  row.fields.Number("index", event.index);
  row.TextOrNull("name", event.name);
  row.fields.Number("data_type", event.data_type);
  row.fields.Text("type", type_name);
  row.fields.Number("object_code", event.object_code);
  row.fields.Number("max_subindex", event.max_subindex);
  row.text = "object " + ObjectName(event.index);
  if (completed) {
    row.text += " " + Printable(event.name) + ": " + mailbox::ObjectCodeName(event.object_code) + ", " + type_name +
                ", subindices up to " + std::to_string(event.max_subindex);
  }
}

void WriteEntryDescription(EventRow& row, const mailbox::SdoInfo& event, bool completed) {
  const auto type = static_cast<mailbox::DataType>(event.data_type);
  const std::string type_name = mailbox::Name(type);
  row.fields.Text("kind", "entry");
  row.fields.Number("index", event.index);
  row.fields.Number("subindex", event.subindex);
  row.TextOrNull("name", event.name);
  row.fields.Number("data_type", event.data_type);
  row.fields.Text("type", type_name);
  row.fields.Number("bit_length", event.bit_length);
  row.fields.Number("access", event.access);
  row.fields.Text("access_text", mailbox::AccessText(event.access));
  row.NumberOrNull("unit", event.unit);
  row.fields.Bytes("default_value", event.default_value);
  row.fields.Bytes("minimum", event.minimum);
  row.fields.Bytes("maximum", event.maximum);
  row.text = "entry " + ObjectName(event.index, event.subindex);
  if (!completed) return;
  row.text += " " + Printable(event.name) + ": " + type_name + ", " + std::to_string(event.bit_length) + " bit, " +
              mailbox::AccessText(event.access);
  const auto limit = [&](std::string_view name, ByteSpan bytes) {
    if (!bytes.empty()) row.text += ", " + std::string(name) + " " + mailbox::FormatValue(type, bytes);
  };
  limit("default", event.default_value);
  limit("minimum", event.minimum);
  limit("maximum", event.maximum);
}

/// What was asked for, and the answer where it is whole.
void WriteSubject(EventRow& row, const mailbox::SdoInfo& event) {
  using Kind = mailbox::SdoInfo::Kind;
  const bool completed = event.outcome == mailbox::SdoInfo::Outcome::kCompleted;
  switch (event.kind) {
    case Kind::kList:
      WriteList(row, event, completed);
      break;
    case Kind::kObject:
      WriteObjectDescription(row, event, completed);
      break;
    case Kind::kEntry:
      WriteEntryDescription(row, event, completed);
      break;
    case Kind::kUnknown:
      row.fields.Null("kind");
      row.text = "SDO information";
      break;
  }
}

}  // namespace

void EventWriter::On(const mailbox::MailboxMessage& event) {
  eeprom_->Pause(event.slave);
  if (event.direction == mailbox::Direction::kIn && event.header.protocol == mailbox::Protocol::kCoE &&
      event.header.length > kSdoBytes) {
    // The manuals print the answer to a download with length 0x0E.
    const mailbox::SdoMessage sdo = mailbox::ParseSdo(Slice(event.payload, mailbox::kCoeHeaderBytes), event.direction);
    const mailbox::CoeService service = mailbox::ParseCoeHeader(event.payload).service;
    const bool is_sdo = service == mailbox::CoeService::kSdoRequest || service == mailbox::CoeService::kSdoResponse;
    const bool short_one = sdo.kind == mailbox::SdoKind::kDownloadInitiate || sdo.kind == mailbox::SdoKind::kAbort ||
                           (sdo.kind == mailbox::SdoKind::kUploadInitiate && sdo.expedited);
    if (is_sdo && short_one) {
      SlaveNotes& notes = NotesOf(event.slave);
      notes.long_answer = event.frame().number;
      notes.long_answer_length = event.header.length;
    }
  }
  if (!output_->Wants(EventType::kMailbox, event.frame(), event.slave)) return;
  EventRow row(*output_, EventType::kMailbox, event.frame(), event.slave);
  row.fields.Text("kind", "message");
  row.fields.Text("direction", mailbox::Name(event.direction));
  row.fields.Text("protocol", mailbox::Name(event.header.protocol));
  row.TextOrNull("service", ServiceName(event));
  row.fields.Number("length", event.header.length);
  row.fields.Number("address", event.header.address);
  row.fields.Number("channel", event.header.channel);
  row.fields.Number("priority", event.header.priority);
  row.fields.Number("counter", event.header.counter);
  row.fields.Bytes("data", event.payload);
  row.TextOrNull("problem", mailbox::Describe(event.problem));
  row.fields.Bool("repeated", event.repeated);
  row.fields.Text("certainty", Name(event.certainty));
  row.Frame("first_frame", event.first.seen() ? event.first : event.frame());
  row.Frame("sent_frame", event.sent);
  row.Frame("returned_frame", event.returned);
  const device::DeviceDescription* const profile = ProfileOf(event.slave);
  row.text =
      Arrow(event.direction) + " " + DescribeMessage(event, profile != nullptr ? profile->diagnosis_texts() : nullptr);
  row.fields.Text("summary", std::string_view(row.text).substr(3));
  if (event.header.counter != 0) row.text += ", counter " + std::to_string(event.header.counter);
  row.Note(mailbox::Describe(event.problem));
  if (event.repeated) row.Note("repeated");
  if (event.mailbox_off) row.Note("the mailbox is switched off");
  if (event.problem != mailbox::Problem::kNone || event.mailbox_off) row.style = Style::kWarning;
}

void EventWriter::On(const mailbox::MailboxRefused& event) {
  if (!output_->Wants(EventType::kMailbox, event.frame(), event.slave)) return;
  EventRow row(*output_, EventType::kMailbox, event.frame(), event.slave);
  row.fields.Text("kind", "refused");
  row.fields.Text("direction", "out");
  row.fields.Text("protocol", mailbox::Name(event.header.protocol));
  row.fields.Number("length", event.header.length);
  row.fields.Number("counter", event.header.counter);
  row.fields.Bool("repeated", event.same_as_last);
  row.fields.Bool("mailbox_off", event.off);
  AddRequest(row, event.outstanding);
  row.text = "-> " + mailbox::Name(event.header.protocol) + " message not accepted: the mailbox is " +
             (event.off ? "switched off" : "full");
  if (event.same_as_last) row.Note("repetition of the last one");
  row.style = Style::kWarning;
}

void EventWriter::On(const mailbox::MailboxReadLost& event) {
  if (!output_->Wants(EventType::kMailbox, event.frame, event.slave)) return;
  EventRow row(*output_, EventType::kMailbox, event.frame, event.slave);
  row.fields.Text("kind", "read-lost");
  AddRequest(row, event.outstanding);
  row.text = "a mailbox read never returned";
  if (event.outstanding.frame.seen()) {
    row.text += "; it may have removed the answer to " + DescribeRequest(event.outstanding);
  }
  row.style = Style::kWarning;
}

void EventWriter::On(const mailbox::MailboxRepeatRequest& event) {
  if (!output_->Wants(EventType::kMailbox, event.frame, event.slave)) return;
  const bool requested = event.kind == mailbox::MailboxRepeatRequest::Kind::kRequested;
  EventRow row(*output_, EventType::kMailbox, event.frame, event.slave);
  row.fields.Text("kind", requested ? "repeat-request" : "repeat-acknowledge");
  row.text = requested ? "the master asks for the last answer again" : "the slave has put the last answer back";
}

void EventWriter::On(const mailbox::MailboxUnanswered& event) {
  if (!output_->Wants(EventType::kMailbox, event.request.frame, event.slave)) return;
  EventRow row(*output_, EventType::kMailbox, event.request.frame, event.slave);
  row.fields.Text("kind", "unanswered");
  AddRequest(row, event.request);
  row.fields.Text("ended_by", Name(event.end));
  row.Frame("ended_frame", event.ended);
  row.fields.Number("polls", event.polls);
  row.Frame("last_poll_frame", event.last_poll);
  row.fields.Bool("not_taken", event.not_accepted);
  row.fields.Bool("read_lost", event.read_lost);
  row.fields.Text("certainty", Name(event.certainty));
  row.text = DescribeRequest(event.request) + " got no answer, " + Count(event.polls, "poll") + " without result";
  if (event.not_accepted) row.Note("the slave never accepted it");
  if (event.read_lost) row.Note("a mailbox read was lost in between");
  row.style = Style::kWarning;
}

void EventWriter::On(const mailbox::MailboxErrorReply& event) {
  if (!output_->Wants(EventType::kMailbox, event.frame, event.slave)) return;
  const std::string_view meaning = mailbox::MailboxErrorText(event.detail);
  EventRow row(*output_, EventType::kMailbox, event.frame, event.slave);
  row.fields.Text("kind", "error-reply");
  row.fields.Number("detail", event.detail);
  row.TextOrNull("error", meaning);
  AddRequest(row, event.request);
  row.text = "error reply " + Hex(event.detail) + (meaning.empty() ? "" : " " + std::string(meaning));
  if (event.request.frame.seen()) {
    row.text +=
        ", answers " + DescribeRequest(event.request) + " of frame " + std::to_string(event.request.frame.number);
  }
  row.style = Style::kWarning;
}

void EventWriter::On(const mailbox::SdoUnexpected& event) {
  if (!output_->Wants(EventType::kMailbox, event.response, event.slave)) return;
  EventRow row(*output_, EventType::kMailbox, event.response, event.slave);
  row.fields.Text("kind", "unexpected-sdo-response");
  row.fields.Text("reason", mailbox::Describe(event.reason));
  row.fields.Number("command", event.command);
  WriteObject(row, event);
  row.Frame("request_frame", event.request);
  row.text = "SDO answer" + (event.has_object ? " for " + ObjectName(event.index, event.subindex) : std::string()) +
             " without its request: " + std::string(mailbox::Describe(event.reason));
  row.style = Style::kWarning;
}

void EventWriter::OnTaken(const mailbox::SdoTransfer& event) {
  if (event.has_object && process::IsPdoObject(event.index)) WriteMappings(event.slave, event.last);
}

void EventWriter::On(const mailbox::SdoTransfer& event) {
  const FrameRef& frame = event.response.seen() ? event.response : event.last.seen() ? event.last : event.request;
  if (!output_->Wants(EventType::kSdo, frame, event.slave)) return;
  const SlaveNotes& notes = NotesOf(event.slave);
  const SdoObject object = ObjectOf(event, model_->slave(event.slave).names, ProfileOf(event.slave));
  const bool long_answer = event.response.seen() && event.response.number == notes.long_answer;
  const std::vector<std::string> deviations =
      Deviations(event, long_answer ? notes.long_answer_length : std::uint16_t{0});
  EventRow row(*output_, EventType::kSdo, frame, event.slave);
  WriteSdoFields(row, event, object);
  StringList(row.fields, "deviations", deviations);
  row.fields.Text("certainty", Name(event.certainty));
  WriteSdoText(row, event, object);
  for (const std::string& deviation : deviations) row.text += " [" + deviation + "]";
}

void EventWriter::On(const mailbox::SdoInfo& event) {
  const FrameRef& frame = event.response.seen() ? event.response : event.request;
  if (!output_->Wants(EventType::kSdoInfo, frame, event.slave)) return;
  const bool failed = event.outcome == mailbox::SdoInfo::Outcome::kError;
  const std::string_view abort_text = failed ? mailbox::AbortCodeText(event.abort_code) : std::string_view();
  EventRow row(*output_, EventType::kSdoInfo, frame, event.slave);
  WriteSubject(row, event);
  row.NumberOrNull("abort_code", failed ? std::optional(event.abort_code) : std::nullopt);
  row.TextOrNull("abort_text", abort_text);
  row.fields.Text("outcome", OutcomeName(event.outcome));
  row.fields.Number("fragments", event.fragments);
  row.fields.Bool("malformed", event.malformed || event.fragment_error);
  row.Frame("request_frame", event.request);
  row.Frame("response_frame", event.response);
  row.Milliseconds("duration_ms", event.duration);
  if (failed) {
    row.text += ": error " + CodeText(event.abort_code, abort_text);
    row.style = Style::kError;
  } else {
    AddOutcome(row, event);
  }
  if (event.fragment_error) row.Note("fragments are missing");
  if (event.malformed) row.Note("fixed fields are missing from the answer");
}

void EventWriter::On(const mailbox::Emergency& event) {
  if (!output_->Wants(EventType::kEmergency, event.frame, event.slave)) return;
  const device::DeviceDescription* profile = ProfileOf(event.slave);
  const events::EmergencyInfo info = events::FindEmergency(profile, event.data.error_code);
  const device::EmergencyCode* known = info.code;
  EventRow row(*output_, EventType::kEmergency, event.frame, event.slave);
  row.fields.Number("code", event.data.error_code);
  row.fields.Number("register", event.data.error_register);
  row.fields.Bytes("data", event.data.data);
  row.TextOrNull("text", known != nullptr ? known->text : "");
  row.TextOrNull("id", known != nullptr ? known->id : "");
  const bool fault = known == nullptr || known->kind == device::EmergencyKind::kFault;
  const bool warning = known != nullptr && known->kind == device::EmergencyKind::kWarning;
  row.fields.Bool("inferred", info.inferred);
  row.TextOrNull("kind", known == nullptr ? "" : fault ? "fault" : warning ? "warning" : "none");
  row.text = Hex(event.data.error_code);
  if (known != nullptr && !known->id.empty()) row.text += " " + known->id;
  if (known != nullptr && !known->text.empty()) row.text += " " + known->text;
  if (info.inferred) row.Note("inferred");
  row.text += ", error register " + Hex(event.data.error_register, 2) + ", data " + HexBytes(event.data.data);
  if (profile != nullptr && profile->emergency && profile->emergency->category) {
    row.text += ", error category " + Hex(event.data.data[0], 2);
    if (const std::string number = mailbox::NumberText(event.data); !number.empty()) row.text += ", number " + number;
  }
  if (event.data.too_short) row.Note("too short");
  row.style = event.data.error_code == 0 ? Style::kGood : warning ? Style::kWarning : Style::kError;
}

void EventWriter::On(const mailbox::EoeFrame& event) {
  if (!output_->Wants(EventType::kEoe, event.last, event.slave)) return;
  const mailbox::EthernetSummary& ethernet = event.summary;
  EventRow row(*output_, EventType::kEoe, event.last, event.slave);
  row.fields.Text("kind", "frame");
  row.fields.Text("direction", mailbox::Name(event.direction));
  row.fields.Number("port", event.port);
  row.fields.Number("frame_number", event.frame_number);
  row.fields.Number("fragments", event.fragments);
  row.fields.Number("size", event.size);
  row.fields.Bytes("data", event.data);
  row.TextOrNull("problem", mailbox::Describe(event.problem));
  row.TextOrNull("destination", ethernet.valid ? MacText(ethernet.destination) : "");
  row.TextOrNull("source", ethernet.valid ? MacText(ethernet.source) : "");
  row.NumberOrNull("ether_type", ethernet.valid ? std::optional(ethernet.ether_type) : std::nullopt);
  row.NumberOrNull("vlan", ethernet.vlan);
  row.NumberOrNull("ip_protocol", ethernet.ip_protocol);
  row.TextOrNull("source_ip", ethernet.source_ip ? mailbox::IpText(*ethernet.source_ip) : "");
  row.TextOrNull("destination_ip", ethernet.destination_ip ? mailbox::IpText(*ethernet.destination_ip) : "");
  row.NumberOrNull("source_port", ethernet.source_port);
  row.NumberOrNull("destination_port", ethernet.destination_port);
  row.NumberOrNull("timestamp", event.timestamp);
  row.Frame("first_frame", event.first);
  row.text = Arrow(event.direction) + " ";
  if (!ethernet.valid) {
    row.text += "Ethernet frame";
  } else {
    row.text += mailbox::EtherTypeName(ethernet.ether_type);
    if (ethernet.ip_protocol) {
      row.text += *ethernet.ip_protocol == 1    ? " ICMP"
                  : *ethernet.ip_protocol == 6  ? " TCP"
                  : *ethernet.ip_protocol == 17 ? " UDP"
                                                : " protocol " + std::to_string(*ethernet.ip_protocol);
    }
    const auto end = [](const auto& ip, const auto& port, const auto& mac) {
      return (ip ? mailbox::IpText(*ip) : MacText(mac)) + (port ? ":" + std::to_string(*port) : "");
    };
    row.text += " " + end(ethernet.source_ip, ethernet.source_port, ethernet.source) + " -> " +
                end(ethernet.destination_ip, ethernet.destination_port, ethernet.destination);
  }
  row.text += ", " + Count(event.size, "byte") + " in " + Count(event.fragments, "fragment");
  row.Note(mailbox::Describe(event.problem));
  if (event.problem != mailbox::EoeFrame::Problem::kNone) row.style = Style::kWarning;
}

void EventWriter::On(const mailbox::EoeControl& event) {
  if (!output_->Wants(EventType::kEoe, event.frame, event.slave)) return;
  const mailbox::EoeIpParameters& ip = event.ip;
  const auto address = [](const std::optional<std::uint32_t>& value) {
    return value ? mailbox::IpText(*value) : std::string();
  };
  EventRow row(*output_, EventType::kEoe, event.frame, event.slave);
  row.fields.Text("kind", mailbox::Name(event.type));
  row.fields.Text("direction", mailbox::Name(event.direction));
  row.NumberOrNull("result", event.result);
  row.TextOrNull("result_text", event.result ? mailbox::EoeResultText(*event.result) : "");
  row.TextOrNull("mac", ip.mac ? MacText(*ip.mac) : "");
  row.TextOrNull("ip", address(ip.ip));
  row.TextOrNull("subnet_mask", address(ip.subnet_mask));
  row.TextOrNull("gateway", address(ip.gateway));
  row.TextOrNull("dns_server", address(ip.dns_server));
  row.TextOrNull("dns_name", std::string(ip.dns_name.begin(), ip.dns_name.end()));
  row.NumberOrNull("timestamp", event.timestamp);
  row.Frame("request_frame", event.request);
  row.text = Arrow(event.direction) + " " + mailbox::Name(event.type);
  const auto add = [&row](std::string_view name, const std::string& value) {
    if (!value.empty()) row.text.append(", ").append(name).append(" ").append(value);
  };
  add("MAC", ip.mac ? MacText(*ip.mac) : "");
  add("IP", address(ip.ip));
  add("mask", address(ip.subnet_mask));
  add("gateway", address(ip.gateway));
  add("DNS", address(ip.dns_server));
  add("name", Printable(std::string(ip.dns_name.begin(), ip.dns_name.end())));
  if (event.result) {
    const std::string_view meaning = mailbox::EoeResultText(*event.result);
    row.text += ": " + (meaning.empty() ? Hex(*event.result) : Hex(*event.result) + " " + std::string(meaning));
    if (*event.result != 0) row.style = Style::kWarning;
  }
}

void EventWriter::On(const mailbox::FoeTransfer& event) {
  using Outcome = mailbox::FoeTransfer::Outcome;
  const FrameRef& frame = event.last.seen() ? event.last : event.request;
  if (!output_->Wants(EventType::kFoe, frame, event.slave)) return;
  const bool failed = event.outcome == Outcome::kError;
  EventRow row(*output_, EventType::kFoe, frame, event.slave);
  row.fields.Text("service", event.write ? "write" : "read");
  row.TextOrNull("file_name", event.file_name);
  row.fields.Number("password", event.password);
  row.fields.Text("outcome", OutcomeName(event.outcome));
  row.fields.Number("size", event.bytes);
  row.fields.Number("packets", event.packets);
  row.fields.Number("repeated_packets", event.repeated_packets);
  row.fields.Number("busy", event.busy);
  row.fields.Number("packet_errors", event.packet_errors);
  row.Frame("packet_error_frame", event.packet_error);
  row.NumberOrNull("error_code", failed ? std::optional(event.error_code) : std::nullopt);
  const std::string_view meaning = failed ? mailbox::FoeErrorText(event.error_code) : std::string_view();
  row.TextOrNull("error_meaning", meaning);
  row.TextOrNull("error_text", event.error_text);
  row.TextOrNull("error_by", !failed ? "" : event.error_by == mailbox::Direction::kOut ? "master" : "slave");
  row.NumberOrNull("mailbox_error",
                   event.outcome == Outcome::kMailboxError ? std::optional(event.mailbox_error) : std::nullopt);
  row.Frame("request_frame", event.request);
  row.Frame("last_frame", event.last);
  row.Milliseconds("duration_ms", event.duration);
  row.fields.Text("certainty", Name(event.certainty));
  row.text = event.write ? "write" : "read";
  row.text +=
      event.file_name.empty() ? " of a file whose request was not captured" : " \"" + Printable(event.file_name) + "\"";
  row.text += ", " + Count(event.bytes, "byte") + " in " + Count(event.packets, "packet");
  if (event.repeated_packets != 0) row.text += ", " + Grouped(event.repeated_packets) + " repeated";
  if (event.busy != 0) row.text += ", busy " + Count(event.busy, "time");
  if (event.duration) row.text += ", " + Duration(*event.duration);
  if (failed) {
    row.text += std::string(": error of the ") + (event.error_by == mailbox::Direction::kOut ? "master " : "slave ") +
                CodeText(event.error_code, meaning) +
                (event.error_text.empty() ? "" : " \"" + Printable(event.error_text) + "\"");
    row.style = Style::kError;
  } else {
    AddOutcome(row, event);
  }
  if (event.packet_errors != 0) {
    row.Note(Count(event.packet_errors, "packet number") + " out of order");
    row.style = Style::kWarning;
  }
}

void EventWriter::On(const mailbox::SoeMessage& event) {
  if (!output_->Wants(EventType::kSoe, event.frame, event.slave)) return;
  const std::string_view error = event.error_code ? mailbox::SoeErrorText(*event.error_code) : std::string_view();
  EventRow row(*output_, EventType::kSoe, event.frame, event.slave);
  row.fields.Text("operation", mailbox::Name(event.operation));
  row.fields.Text("direction", mailbox::Name(event.direction));
  row.fields.Number("drive", event.drive);
  row.NumberOrNull("idn", event.idn_known ? std::optional(event.idn) : std::nullopt);
  row.TextOrNull("idn_name", event.idn_known ? mailbox::IdnName(event.idn) : "");
  row.fields.Number("elements", event.elements);
  row.TextOrNull("element_names", mailbox::ElementNames(event.elements));
  row.fields.Bytes("data", event.data);
  row.fields.Number("size", event.size);
  row.fields.Number("fragments", event.fragments);
  row.NumberOrNull("error_code", event.error_code);
  row.TextOrNull("error_text", error);
  row.Frame("request_frame", event.request);
  row.text = Arrow(event.direction) + " " + mailbox::Name(event.operation) + " " +
             (event.idn_known ? mailbox::IdnName(event.idn) : "of an unknown IDN") + ", drive " +
             std::to_string(event.drive);
  if (const std::string elements = mailbox::ElementNames(event.elements); !elements.empty()) {
    row.text += ", " + elements;
  }
  if (!event.data.empty()) row.text += ": " + ShortHex(event.data);
  if (event.error_code) {
    row.text += ": error " + Hex(*event.error_code) + (error.empty() ? "" : " " + std::string(error));
    row.style = Style::kError;
  }
  if (event.fragment_error) row.Note("fragments are missing");
}

void EventWriter::On(const mailbox::AoeMessage& event) {
  if (!output_->Wants(EventType::kAoe, event.frame, event.slave)) return;
  const mailbox::AdsParameters& ads = event.parameters;
  EventRow row(*output_, EventType::kAoe, event.frame, event.slave);
  row.fields.Text("command", mailbox::Name(event.header.command));
  row.fields.Bool("response", event.header.response());
  row.fields.Text("direction", mailbox::Name(event.direction));
  row.fields.Text("target", mailbox::Text(event.header.target));
  row.fields.Number("target_port", event.header.target_port);
  row.fields.Text("source", mailbox::Text(event.header.source));
  row.fields.Number("source_port", event.header.source_port);
  row.fields.Number("invoke_id", event.header.invoke_id);
  row.fields.Number("error", event.header.error);
  row.NumberOrNull("index_group", ads.index_group);
  row.NumberOrNull("index_offset", ads.index_offset);
  row.NumberOrNull("read_length", ads.read_length);
  row.NumberOrNull("write_length", ads.write_length);
  row.NumberOrNull("result", ads.result);
  row.fields.Bytes("data", ads.data);
  row.Frame("request_frame", event.request);
  row.text = Arrow(event.direction) + " " + mailbox::Name(event.header.command) +
             (event.header.response() ? " response" : " request") + " " + mailbox::Text(event.header.source) + ":" +
             std::to_string(event.header.source_port) + " -> " + mailbox::Text(event.header.target) + ":" +
             std::to_string(event.header.target_port);
  if (ads.index_group) row.text += ", group " + Hex(*ads.index_group, 8);
  if (ads.index_offset) row.text += ", offset " + Hex(*ads.index_offset, 8);
  if (!ads.data.empty()) row.text += ": " + ShortHex(ads.data);
  const std::uint32_t error = event.header.error != 0 ? event.header.error : ads.result.value_or(0);
  if (error != 0) {
    row.text += ": error " + Hex(error, 8);
    row.style = Style::kError;
  }
}

void EventWriter::On(const mailbox::VoeMessage& event) {
  if (!output_->Wants(EventType::kVoe, event.frame, event.slave)) return;
  EventRow row(*output_, EventType::kVoe, event.frame, event.slave);
  row.fields.Text("direction", mailbox::Name(event.direction));
  row.fields.Number("vendor_id", event.vendor_id);
  row.fields.Number("vendor_type", event.vendor_type);
  row.fields.Bytes("data", event.data);
  row.text = Arrow(event.direction) + " vendor " + Hex(event.vendor_id, 8) + ", type " +
             std::to_string(event.vendor_type) + (event.data.empty() ? "" : ": " + ShortHex(event.data));
}

}  // namespace ecaudit::cli
