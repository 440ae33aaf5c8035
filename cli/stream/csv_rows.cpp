/// Rows as comma-separated values (RFC 4180), for spreadsheets and plots.
#include <charconv>
#include <concepts>
#include <optional>

#include "cli/stream/datagram_text.h"
#include "cli/stream/json_line.h"
#include "cli/stream/stream_formats.h"
#include "decoder/base/text.h"
#include "decoder/esc/register_map.h"

namespace ecaudit::cli {
namespace {

constexpr std::size_t kLongestCell = 24;  // a comma and an integer of 64 bits

/// Between quotation marks, with those inside doubled, if a program could misread it. Names come from devices and from
/// files of others: an apostrophe in front makes text of what a spreadsheet would read as a formula.
void AppendCsv(std::string& out, std::string_view text) {
  const bool formula = !text.empty() && std::string_view("=+-@\t\r").find(text.front()) != std::string_view::npos;
  if (text.find_first_of(",\"\r\n;") == std::string_view::npos) {
    if (formula) out += '\'';
    out += text;
    return;
  }
  out += '"';
  if (formula) out += '\'';
  for (const char c : text) {
    if (c == '"') out += '"';
    out += c;
  }
  out += '"';
}

class SignalCsv final : public SignalSink {
 public:
  explicit SignalCsv(LineOutput& output) : output_(output) {}

  void Begin(const SignalTable& table) override {
    table_ = &table;
    std::string& out = output_.buffer();
    out += table.clock_times ? "time" : "time_s";
    out += table.dc_time ? ",dc_time_ns,frame" : ",frame";
    for (const SignalColumn& column : table.columns) {
      forms_.push_back(FormOf(column));
      out += ',';
      AppendCsv(out, column.header);
    }
    output_.EndLine();
  }

  void Row(const SignalRow& row) override {
    std::string& out = output_.buffer();
    if (table_->clock_times) {
      out += row.time;
    } else if (row.since_start_ns) {
      AppendSeconds(out, *row.since_start_ns);
    }
    if (table_->dc_time) {
      out += ',';
      if (row.dc_time_ns) AppendNumber(out, *row.dc_time_ns);
    }
    out += ',';
    AppendNumber(out, row.frame);
    // Nearly all cells are integers: the text of neighbouring ones joins the row at once.
    line_.resize(row.cells.size() * kLongestCell);
    char* const begin = line_.data();
    char* at = begin;
    for (std::size_t column = 0; column < row.cells.size(); ++column) {
      const RowCell& cell = row.cells[column];
      *at++ = ',';
      if (!cell.has_value()) continue;
      const NumberForm form = cell.content == RowCell::Content::kNumber ? forms_[column] : NumberForm::kOther;
      if (form == NumberForm::kNatural) {
        at = std::to_chars(at, at + kLongestCell, cell.raw).ptr;
      } else if (form == NumberForm::kInteger) {
        at = std::to_chars(at, at + kLongestCell, SignExtend(cell.raw, table_->columns[column].bits)).ptr;
      } else {
        out.append(begin, static_cast<std::size_t>(at - begin));
        at = begin;
        AppendOther(out, row, column);
      }
    }
    out.append(begin, static_cast<std::size_t>(at - begin));
    output_.EndLine();
  }

 private:
  void AppendOther(std::string& out, const SignalRow& row, std::size_t number) const {
    const SignalColumn& column = table_->columns[number];
    const RowCell& cell = row.cells[number];
    if (cell.content == RowCell::Content::kBytes) return AppendHexBytes(out, cell.bytes);
    if (column.kind != ColumnKind::kSignal) return AppendCsv(out, row.words[number]);
    AppendValue(out, column, cell.raw, "nan");
  }

  LineOutput& output_;
  const SignalTable* table_ = nullptr;
  std::vector<NumberForm> forms_;  ///< by column
  std::string line_;               ///< room for the cells of a row
};

/// The cells of a row, with commas between them.
class Cells {
 public:
  explicit Cells(std::string& out) : out_(out) {}

  std::string& Next() {
    if (!first_) out_ += ',';
    first_ = false;
    return out_;
  }
  template <std::integral T>
  void Number(T value) {
    AppendNumber(Next(), value);
  }
  /// Empty where there is none.
  template <std::integral T>
  void Number(const std::optional<T>& value) {
    Next();
    if (value) AppendNumber(out_, *value);
  }
  void Text(std::string_view text) { AppendCsv(Next(), text); }
  void Time(const TimeColumn& time, const FrameRef& frame, const std::optional<std::int64_t>& since_start_ns) {
    Next();
    if (time.mode != report::TimeMode::kRelative) {
      out_ += time.Iso(frame);
    } else if (since_start_ns) {
      AppendSeconds(out_, *since_start_ns);
    }
  }

 private:
  std::string& out_;
  bool first_ = true;
};

std::string_view TimeTitle(report::TimeMode mode) {
  return mode == report::TimeMode::kRelative ? "time_s" : "time";
}

class EventCsv final : public EventSink {
 public:
  explicit EventCsv(LineOutput& output) : output_(output) {}

  void Begin(const EventTable& table) override {
    output_.buffer() += TimeTitle(table.time_mode);
    output_.buffer() += ",frame,slave,station_address,event,text";
    output_.EndLine();
  }

  void Row(const EventRecord& row) override {
    Cells cells(output_.buffer());
    cells.Time(row.time, row.frame, row.since_start_ns);
    cells.Number(row.frame.seen() ? std::optional(row.frame.number) : std::nullopt);
    cells.Number(row.slave);
    cells.Number(row.station);
    cells.Text(Name(row.type));
    cells.Text(row.text);
    output_.EndLine();
  }

 private:
  LineOutput& output_;
};

class DatagramCsv final : public DatagramSink {
 public:
  explicit DatagramCsv(LineOutput& output) : output_(output) {}

  void Begin(const DatagramTable& table) override {
    output_.buffer() += TimeTitle(table.time_mode);
    output_.buffer() += ",frame,datagram,direction,command,index,adp,ado,logical,length,irq,wkc,slave,register,data";
    output_.EndLine();
  }

  void Row(const DatagramRow& row) override {
    const wire::DatagramView& d = row.datagram;
    const bool logical = wire::IsLogical(d.command());
    Cells cells(output_.buffer());
    cells.Time(row.time, row.frame.ref(), row.since_start_ns);
    cells.Number(row.frame.ref().number);
    cells.Number(d.ordinal());
    cells.Text(DirectionName(row.direction));
    AppendCommand(cells.Next(), d);
    cells.Number(d.index());
    cells.Number(d.adp());
    cells.Number(d.ado());
    cells.Number(logical ? std::optional(d.logical_address()) : std::nullopt);
    cells.Number(d.length());
    cells.Number(d.irq());
    cells.Number(d.wkc());
    cells.Number(row.slave);
    cells.Text(HasEscAddress(d) ? esc::AccessName(d.ado(), d.length()) : std::string());
    AppendHexBytes(cells.Next(), d.data());
    output_.EndLine();
  }

 private:
  LineOutput& output_;
};

}  // namespace

StreamFormat CsvFormat() {
  return {.output = {"csv", ".csv"},
          .help = "csv",
          .signals = &MakeRows<SignalSink, SignalCsv>,
          .events = &MakeRows<EventSink, EventCsv>,
          .datagrams = &MakeRows<DatagramSink, DatagramCsv>};
}

}  // namespace ecaudit::cli
