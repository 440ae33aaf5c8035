#include "cli/stream/event_output.h"

#include <algorithm>
#include <utility>

#include "cli/interrupt.h"
#include "cli/stream/columns.h"
#include "decoder/base/text.h"

namespace ecaudit::cli {
namespace {

constexpr std::size_t kFrameColumns = 8;
constexpr std::size_t kSlaveColumns = 6;
constexpr std::size_t kTypeColumns = 14;

}  // namespace

bool EventOutput::Wants(EventType type, const FrameRef& frame, SlaveId slave) {
  if (!types_.Has(type)) return false;
  if (slave != kNoSlave && !SelectsSlave(context_.settings.slaves, network(), slave)) return false;
  const std::optional<std::int64_t> since = SinceStart(frame);
  if (!context_.range.Contains(frame.number, since ? std::optional(static_cast<double>(*since) / 1e9) : std::nullopt)) {
    return false;
  }
  return HasRoom(frame);
}

bool EventOutput::HasRoom(const FrameRef& frame) {
  const std::uint64_t room = kRoom + kTimesInput * pipeline_.statistics().frame_bytes;
  if (written_ + (left_out_ > 0 ? kRoomToGoOn : 0) > room) {
    if (left_out_++ == 0) first_left_out_ = frame;
    last_left_out_ = frame;
    return false;
  }
  ReportLeftOut();
  return true;
}

void EventOutput::ReportLeftOut() {
  if (left_out_ == 0) return;
  const std::uint64_t lines = std::exchange(left_out_, 0);
  EventRow row(*this, EventType::kLeftOut, first_left_out_, kNoSlave);
  row.json.Number("lines", lines);
  row.Frame("last_frame", last_left_out_);
  row.text = Grouped(lines) + " events up to #" + std::to_string(last_left_out_.number) +
             " are not shown: out of proportion to the capture";
  row.style = report::Style::kWarning;
}

void EventOutput::Begin() {
  for (LineTarget& target : context_.targets) {
    if (target.format != kTextLines) continue;
    const report::Style bold = report::Style::kBold;
    Columns columns(target.output.buffer(), target.color);
    const TimeColumn time = context_.time();
    columns.Right("frame", kFrameColumns, bold).Right(time.title(), time.width(), bold);
    columns.Right("slave", kSlaveColumns, bold);
    columns.Left("event", kTypeColumns, bold).Last("what", bold);
    target.output.EndLine();
  }
}

void EventOutput::Write(const EventRow& row) {
  std::string slave_text = "all";
  if (row.slave_ != kNoSlave) {
    const bus::SlaveAddress& address = network().slaves()[row.slave_];
    const SlavePos* position = address.position.if_known();
    const StationAddress* station = address.station.if_known();
    slave_text = position != nullptr  ? context_.settings.analysis.slave_names.Number(*position)
                 : station != nullptr ? Hex(*station)
                                      : "?";
  }
  Waiting waiting{row.frame_.number, number_++, {}};
  for (const LineTarget& target : context_.targets) {
    std::string& out = waiting.lines.emplace_back();
    if (target.format == kJsonLines) {
      out = json_;
    } else if (target.format == kJsonAndText) {
      out = json_ + '\t' + row.text;
    } else if (types_.chosen() || !row.shown_elsewhere) {
      Columns columns(out, target.color);
      columns.Right(std::to_string(row.frame_.number), kFrameColumns);
      const TimeColumn time = context_.time();
      columns.Right(time.Text(row.frame_, SinceStart(row.frame_)), time.width(), report::Style::kFaint);
      columns.Right(slave_text, kSlaveColumns).Left(Name(row.type_), kTypeColumns, report::Style::kInfo);
      columns.Last(row.text, row.style);
    }
  }
  std::uint64_t bytes = 0;
  for (const std::string& line : waiting.lines) bytes = std::max<std::uint64_t>(bytes, line.size() + 1);
  written_ += bytes;
  newest_ = std::max(newest_, waiting.frame);
  waiting_.push_back(std::move(waiting));
  std::push_heap(waiting_.begin(), waiting_.end(), Later{});
  while (waiting_.size() > kMostWaiting || waiting_.front().frame + kLongestWait < newest_) WriteFirst();
}

void EventOutput::WriteFirst() {
  std::pop_heap(waiting_.begin(), waiting_.end(), Later{});
  bool open = false;
  for (std::size_t i = 0; i < context_.targets.size(); ++i) {
    LineTarget& target = context_.targets[i];
    if (const std::string& line = waiting_.back().lines[i]; !line.empty()) {
      target.output.buffer() += line;
      target.output.EndLine();
    }
    open = open || !target.output.closed();
  }
  waiting_.pop_back();
  if (!open) InterruptFlag() = true;  // the reader has closed the output
}

void EventOutput::End() {
  ReportLeftOut();
  while (!waiting_.empty()) WriteFirst();
}

namespace {

std::string& Emptied(std::string& text) {
  text.clear();
  return text;
}

}  // namespace

EventRow::EventRow(EventOutput& output, EventType type, const FrameRef& frame, SlaveId slave)
    : json(Emptied(output.json_)), output_(output), type_(type), frame_(frame), slave_(slave) {
  json.Text("event", Name(type));
  Frame("frame", frame);
  if (const std::optional<std::int64_t> since = output.SinceStart(frame)) {
    AppendSeconds(json.Key("time_s"), *since);
  } else {
    json.Null("time_s");
  }
  if (const std::string time = output.context_.time().Iso(frame); !time.empty()) json.Text("time", time);
  const bus::SlaveAddress none;
  const bus::SlaveAddress& address = slave != kNoSlave ? output.network().slaves()[slave] : none;
  const auto known = [this](std::string_view key, const auto& value) {
    if (const auto* number = value.if_known()) {
      json.Number(key, *number);
    } else {
      json.Null(key);
    }
  };
  known("slave", address.position);
  known("station_address", address.station);
}

EventRow::~EventRow() {
  json.Close();
  output_.Write(*this);
}

void EventRow::Frame(std::string_view key, const FrameRef& frame) {
  if (frame.seen()) {
    json.Number(key, frame.number);
  } else {
    json.Null(key);
  }
}

void EventRow::TextOrNull(std::string_view key, std::string_view value) {
  if (value.empty()) {
    json.Null(key);
  } else {
    json.Text(key, value);
  }
}

void EventRow::Milliseconds(std::string_view key, std::optional<TimeNs> duration) {
  if (duration) {
    AppendJsonNumber(json.Key(key), static_cast<double>(*duration) / 1e6);
  } else {
    json.Null(key);
  }
}

void EventRow::Note(std::string_view note) {
  if (!note.empty()) text.append(" (").append(note).append(")");
}

}  // namespace ecaudit::cli
