/// Where events become rows of the formats asked for, in the order of frames.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cli/report/layout.h"
#include "cli/stream/event_record.h"
#include "cli/stream/event_type.h"
#include "cli/stream/row_fields.h"
#include "cli/stream/stream_run.h"
#include "decoder/base/ids.h"

namespace ecaudit::cli {

class EventRow;

class EventOutput {
 public:
  /// @param sink  takes the rows as they become known, in place of the targets' formats; may be null
  EventOutput(const Pipeline& pipeline, const StreamContext& context, EventTypes types, EventSink* sink);

  /// Whether an event of this type is shown at all; where it is not, making it can be left out.
  [[nodiscard]] bool Wants(EventType type) const { return types_.Has(type); }
  /// Whether this one is shown: type, frame and slave are asked for.
  /// @param slave kNoSlave: the whole bus
  ///
  /// Lines grow with the bytes of the capture. A broadcast that makes an event of each of a thousand slaves has its
  /// lines as long as there is room; the rest is counted, and reported.
  [[nodiscard]] bool Wants(EventType type, const FrameRef& frame, SlaveId slave);

  /// Before the first event.
  void Begin();
  /// Writes what waits.
  void End();

  [[nodiscard]] const track::Network& network() const { return pipeline_.network(); }
  [[nodiscard]] std::optional<std::int64_t> SinceStart(const FrameRef& frame) const {
    return context_.source.SinceStart(frame);
  }

 private:
  friend class EventRow;
  /// Events that are known late may belong before others: a number of events wait for those of earlier frames, for a
  /// number of frames.
  static constexpr std::size_t kMostWaiting = 4096;
  static constexpr FrameNo kLongestWait = 20'000;

  /// The lines of one event, a text for each target; empty where it is not shown there.
  struct Waiting {
    FrameNo frame = 0;
    std::uint64_t number = 0;
    std::vector<std::string> lines;
  };
  struct Later {
    bool operator()(const Waiting& a, const Waiting& b) const {
      return a.frame != b.frame ? a.frame > b.frame : a.number > b.number;
    }
  };

  // Room of a format: a constant, and a multiple of the bytes of the frames. Where that is used up, it goes on when
  // there is room for a good many lines again.
  static constexpr std::uint64_t kRoom = std::uint64_t{2} << 20U;
  static constexpr std::uint64_t kTimesInput = 8;
  static constexpr std::uint64_t kRoomToGoOn = std::uint64_t{64} << 10U;

  /// A target and the sink of its format, whose lines wait.
  struct Line {
    LineOutput staged = LineOutput::ToBuffer();
    std::unique_ptr<EventSink> sink;
  };

  [[nodiscard]] bool HasRoom(const FrameRef& frame);
  void ReportLeftOut();
  void Write(const EventRow& row);
  void WriteFirst();
  /// What a sink wrote before or after the events.
  void WriteStaged();

  const Pipeline& pipeline_;
  const StreamContext& context_;
  EventTypes types_;
  EventTable table_;
  EventSink* sink_;
  std::vector<std::unique_ptr<Line>> lines_;  ///< by target; none with sink_
  RowFields fields_;                          ///< of the current event
  std::vector<Waiting> waiting_;              ///< a heap, the earliest frame on top
  std::uint64_t number_ = 0;
  FrameNo newest_ = 0;
  std::uint64_t written_ = 0;   ///< bytes of the format that has most
  std::uint64_t left_out_ = 0;  ///< lines, since there was room last
  FrameRef first_left_out_, last_left_out_;
};

/// One event. What it has beside the columns of all events is added to fields; written when it ends.
class EventRow {
 public:
  /// Only one at a time.
  EventRow(EventOutput& output, EventType type, const FrameRef& frame, SlaveId slave);
  EventRow(const EventRow&) = delete;
  EventRow& operator=(const EventRow&) = delete;
  ~EventRow();

  RowFields& fields;
  /// The line for people; printable text only.
  std::string text;
  report::Style style = report::Style::kPlain;
  /// Another line shows the same to people; shown as text only where --type asks for this type.
  bool shown_elsewhere = false;

  /// A frame number; null when that frame is not in the capture.
  void Frame(std::string_view key, const FrameRef& frame);
  /// Text, null when empty.
  void TextOrNull(std::string_view key, std::string_view value);
  template <typename T>
  void NumberOrNull(std::string_view key, const std::optional<T>& value) {
    if (value) {
      fields.Number(key, *value);
    } else {
      fields.Null(key);
    }
  }
  /// A duration in ns as milliseconds, null when unknown.
  void Milliseconds(std::string_view key, std::optional<TimeNs> duration);
  /// Adds " (TEXT)" to the line for people; nothing when `note` is empty.
  void Note(std::string_view note);

 private:
  friend class EventOutput;

  EventOutput& output_;
  EventType type_;
  FrameRef frame_;
  SlaveId slave_;
};

}  // namespace ecaudit::cli
