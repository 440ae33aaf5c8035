#include "cli/stream/event_output.h"

#include <algorithm>
#include <utility>

#include "cli/interrupt.h"
#include "cli/stream/stream_formats.h"
#include "decoder/base/text.h"

namespace ecaudit::cli {
EventOutput::EventOutput(const Pipeline& pipeline, const StreamContext& context, EventTypes types, EventSink* sink)
    : pipeline_(pipeline), context_(context), types_(types), sink_(sink) {
  table_ = {context.time_mode, types.chosen(), context.settings.analysis.slave_names};
}

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
  row.fields.Number("lines", lines);
  row.Frame("last_frame", last_left_out_);
  row.text = Grouped(lines) + " events up to #" + std::to_string(last_left_out_.number) +
             " are not shown: out of proportion to the capture";
  row.style = report::Style::kWarning;
}

void EventOutput::Begin() {
  if (sink_ != nullptr) return sink_->Begin(table_);
  for (const LineTarget& target : context_.targets) {
    Line& line = *lines_.emplace_back(std::make_unique<Line>());
    line.sink = StreamFormats::OfEvents().At(target.format).events(line.staged, target.color);
    line.sink->Begin(table_);
  }
  WriteStaged();
}

void EventOutput::WriteStaged() {
  for (std::size_t i = 0; i < lines_.size(); ++i) {
    const std::string lines = lines_[i]->staged.TakeLines();
    if (lines.empty()) continue;
    context_.targets[i].output.buffer() += lines;
    context_.targets[i].output.EndLine();
  }
}

void EventOutput::Write(const EventRow& row) {
  const bus::SlaveAddress none;
  const bus::SlaveAddress& address = row.slave_ != kNoSlave ? network().slaves()[row.slave_] : none;
  const auto known = [](const auto& value) {
    return value.if_known() != nullptr ? std::optional(*value.if_known()) : std::nullopt;
  };
  fields_.Close();
  const EventRecord record{row.type_,
                           row.frame_,
                           SinceStart(row.frame_),
                           context_.time(),
                           row.slave_ == kNoSlave,
                           known(address.position),
                           known(address.station),
                           fields_,
                           row.text,
                           row.style,
                           row.shown_elsewhere};
  if (sink_ != nullptr) {
    written_ += fields_.size() + row.text.size();
    return sink_->Row(record);
  }
  Waiting waiting{row.frame_.number, number_++, {}};
  std::uint64_t bytes = 1;
  for (const auto& line : lines_) {
    line->sink->Row(record);
    const std::string& text = waiting.lines.emplace_back(line->staged.TakeLines());
    bytes = std::max<std::uint64_t>(bytes, text.size() + 1);
  }
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
  if (sink_ != nullptr) sink_->End();
  for (const auto& line : lines_) line->sink->End();
  WriteStaged();
}

EventRow::EventRow(EventOutput& output, EventType type, const FrameRef& frame, SlaveId slave)
    : fields(output.fields_), output_(output), type_(type), frame_(frame), slave_(slave) {
  fields.Clear();
}

EventRow::~EventRow() {
  output_.Write(*this);
}

void EventRow::Frame(std::string_view key, const FrameRef& frame) {
  if (frame.seen()) {
    fields.Number(key, frame.number);
  } else {
    fields.Null(key);
  }
}

void EventRow::TextOrNull(std::string_view key, std::string_view value) {
  if (value.empty()) {
    fields.Null(key);
  } else {
    fields.Text(key, value);
  }
}

void EventRow::Milliseconds(std::string_view key, std::optional<TimeNs> duration) {
  if (duration) {
    fields.Real(key, static_cast<double>(*duration) / 1e6);
  } else {
    fields.Null(key);
  }
}

void EventRow::Note(std::string_view note) {
  if (!note.empty()) text.append(" (").append(note).append(")");
}

}  // namespace ecaudit::cli
