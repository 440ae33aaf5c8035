/// Rows as text in columns, for people.
#include "cli/stream/columns.h"
#include "cli/stream/datagram_text.h"
#include "cli/stream/stream_formats.h"
#include "decoder/base/text.h"

namespace ecaudit::cli {
namespace {

using report::Style;

constexpr std::size_t kFrameColumns = 8;
constexpr std::size_t kSlaveColumns = 6;
constexpr std::size_t kTypeColumns = 14;
constexpr std::size_t kDatagramColumns = 10;  // frame, and number in the frame

class EventText final : public EventSink {
 public:
  EventText(LineOutput& output, bool color) : output_(output), color_(color) {}

  void Begin(const EventTable& table) override {
    table_ = &table;
    const TimeColumn time{table.time_mode, {}};
    Columns columns(output_.buffer(), color_);
    columns.Right("frame", kFrameColumns, Style::kBold).Right(time.title(), time.width(), Style::kBold);
    columns.Right("slave", kSlaveColumns, Style::kBold);
    columns.Left("event", kTypeColumns, Style::kBold).Last("what", Style::kBold);
    output_.EndLine();
  }

  void Row(const EventRecord& row) override {
    if (row.shown_elsewhere && !table_->types_chosen) return;
    Columns columns(output_.buffer(), color_);
    columns.Right(std::to_string(row.frame.number), kFrameColumns);
    columns.Right(row.time.Text(row.frame, row.since_start_ns), row.time.width(), Style::kFaint);
    columns.Right(SlaveOf(row), kSlaveColumns).Left(Name(row.type), kTypeColumns, Style::kInfo);
    columns.Last(row.text, row.style);
    output_.EndLine();
  }

 private:
  [[nodiscard]] std::string SlaveOf(const EventRecord& row) const {
    if (row.whole_bus) return "all";
    return row.slave ? table_->names.Number(*row.slave) : row.station ? Hex(*row.station) : "?";
  }

  LineOutput& output_;
  bool color_;
  const EventTable* table_ = nullptr;
};

std::string SlaveText(const DatagramRow& row, const SlaveNames& names) {
  if (row.slave) return names.Number(*row.slave);
  const wire::DatagramView& d = row.datagram;
  if (!HasEscAddress(d)) return "-";
  return wire::IsBroadcast(d.command()) ? "all" : "?";
}

std::string AddressText(const wire::DatagramView& d) {
  if (wire::IsLogical(d.command())) return Hex(d.logical_address(), 8);
  return Hex(d.adp()) + ":" + Hex(d.ado());
}

std::string_view DatagramArrow(const DatagramRow& row) {
  return row.outbound() ? "->" : row.returned() ? "<-" : "--";
}

/// A slave was addressed and no slave answered.
bool Unanswered(const DatagramRow& row) {
  return row.returned() && row.datagram.wkc() == 0 && row.datagram.command() != wire::Command::NOP;
}

class DatagramText final : public DatagramSink {
 public:
  DatagramText(LineOutput& output, bool color) : output_(output), color_(color) {}

  void Begin(const DatagramTable& table) override {
    names_ = table.names;
    const TimeColumn time{table.time_mode, {}};
    Columns columns(output_.buffer(), color_);
    columns.Right("frame", kDatagramColumns, Style::kBold).Right(time.title(), time.width(), Style::kBold);
    columns.Left("", 2).Left("cmd", 4, Style::kBold).Right("slave", 5, Style::kBold);
    columns.Left("address", 13, Style::kBold).Right("bytes", 5, Style::kBold);
    columns.Right("wkc", 5, Style::kBold).Last("content", Style::kBold);
    output_.EndLine();
  }

  void Row(const DatagramRow& row) override {
    const wire::DatagramView& d = row.datagram;
    std::string frame = std::to_string(row.frame.ref().number);
    if (row.frame.size() > 1) frame += "." + std::to_string(d.ordinal());
    std::string command;
    AppendCommand(command, d);
    const Style faint = row.outbound() ? Style::kPlain : Style::kFaint;
    Columns columns(output_.buffer(), color_);
    columns.Right(frame, kDatagramColumns)
        .Right(row.time.Text(row.frame.ref(), row.since_start_ns), row.time.width(), Style::kFaint)
        .Left(DatagramArrow(row), 2, faint);
    columns.Left(command, 4, Style::kInfo).Right(SlaveText(row, names_), 5).Left(AddressText(d), 13);
    columns.Right(std::to_string(d.length()), 5);
    columns.Right(row.outbound() && d.wkc() == 0 ? "" : std::to_string(d.wkc()), 5,
                  Unanswered(row) ? Style::kWarning : Style::kPlain);
    columns.Last(contents_.Find(row));
    output_.EndLine();
  }

  void Unsound(const UnsoundFrame& unsound) override {
    const FrameRef& frame = unsound.frame.ref();
    Columns columns(output_.buffer(), color_);
    columns.Right(std::to_string(frame.number), kDatagramColumns)
        .Right(unsound.time.Text(frame, unsound.since_start_ns), unsound.time.width(), Style::kFaint)
        .Left("!!", 2, Style::kError)
        .Last(ProblemText(unsound.frame), Style::kError);
    output_.EndLine();
  }

 private:
  LineOutput& output_;
  bool color_;
  SlaveNames names_;
  ContentTexts contents_;
};

}  // namespace

StreamFormat TextFormat() {
  return {.output = {"text", ".txt"},
          .help = "text",
          .events = &MakeRows<EventSink, EventText>,
          .datagrams = &MakeRows<DatagramSink, DatagramText>};
}

}  // namespace ecaudit::cli
