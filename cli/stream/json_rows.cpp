/// Rows as JSON Lines: an object for each column, then one for each row.

#include "cli/stream/json_line.h"
#include "cli/stream/row_sink.h"
#include "decoder/base/text.h"

namespace ecaudit::cli {
namespace {

std::string_view NameOf(device::PdoDirection direction) {
  return direction == device::PdoDirection::kRx ? "rx" : "tx";
}

std::string_view NameOf(ColumnKind kind) {
  switch (kind) {
    case ColumnKind::kSignal:
      return "signal";
    case ColumnKind::kDriveState:
      return "drive-state";
    case ColumnKind::kDriveCommand:
      return "drive-command";
    case ColumnKind::kMeaning:
      return "meaning";
    case ColumnKind::kDatagram:
      return "datagram";
    case ColumnKind::kRaw:
      break;
  }
  return "raw";
}

template <class T>
void NumberOrNull(JsonLine& line, std::string_view key, const std::optional<T>& value) {
  if (value) {
    line.Number(key, *value);
  } else {
    line.Null(key);
  }
}

void TextOrNull(JsonLine& line, std::string_view key, std::string_view text) {
  if (text.empty()) {
    line.Null(key);
  } else {
    line.Text(key, text);
  }
}

void AppendColumn(std::string& out, const SignalColumn& column) {
  const bool datagram = column.kind == ColumnKind::kDatagram;
  JsonLine line(out);
  line.Text("column", column.header);
  line.Text("kind", NameOf(column.kind));
  NumberOrNull(line, "slave", column.position);
  NumberOrNull(line, "station_address", column.station);
  TextOrNull(line, "slave_name", column.slave_name);
  TextOrNull(line, "direction", datagram ? "" : NameOf(column.direction));
  if (column.index != 0) {
    line.Number("pdo", column.pdo);
    line.Number("index", column.index);
    line.Number("subindex", column.subindex);
    line.Number("bits", column.bits);
    TextOrNull(line, "type", column.type == mailbox::DataType::kUnknown ? "" : mailbox::Name(column.type));
    TextOrNull(line, "unit", column.unit);
    TextOrNull(line, "scale", column.scale);
    AppendJsonNumber(line.Key("divisor"), column.divisor);
    line.Bool("name_inferred", column.name_inferred);
    TextOrNull(line, "name", column.name);
    TextOrNull(line, "variable", column.variable);
  }
  TextOrNull(line, "source", datagram ? "" : model::Name(column.source));
  TextOrNull(line, "reason", column.reason);
  line.Close();
}

class JsonRows final : public RowSink {
 public:
  explicit JsonRows(LineOutput& output) : output_(output) {}

  void Begin(const RowTable& table) override {
    table_ = &table;
    for (const SignalColumn& column : table.columns) {
      forms_.push_back(FormOf(column));
      std::string& key = keys_.emplace_back(",");
      AppendJsonString(key, column.header);
      key += ':';
      AppendColumn(output_.buffer(), column);
      output_.EndLine();
    }
  }

  void Row(const TableRow& row) override {
    std::string& out = output_.buffer();
    JsonLine line(out);
    line.Number("frame", row.frame);
    if (row.since_start_ns) {
      AppendSeconds(line.Key("time_s"), *row.since_start_ns);
    } else {
      line.Null("time_s");
    }
    if (!row.time.empty()) line.Text("time", row.time);
    NumberOrNull(line, "dc_time_ns", row.dc_time_ns);
    line.Key("values") += '{';
    bool first = true;
    for (std::size_t column = 0; column < row.cells.size(); ++column) {
      if (row.cells[column].content == RowCell::Content::kAbsent) continue;
      out += std::string_view(keys_[column]).substr(first ? 1 : 0);
      first = false;
      AppendCell(out, row, column);
    }
    out += '}';
    line.Close();
    output_.EndLine();
  }

 private:
  void AppendCell(std::string& out, const TableRow& row, std::size_t number) const {
    const SignalColumn& column = table_->columns[number];
    const RowCell& cell = row.cells[number];
    if (!cell.has_value()) {
      out += "null";
    } else if (cell.content == RowCell::Content::kBytes) {
      out += '"';
      AppendHexBytes(out, cell.bytes);
      out += '"';
    } else if (forms_[number] == NumberForm::kNatural) {
      AppendNumber(out, cell.raw);
    } else if (forms_[number] == NumberForm::kInteger) {
      AppendNumber(out, SignExtend(cell.raw, column.bits));
    } else if (column.kind == ColumnKind::kSignal) {
      AppendValue(out, column, cell.raw, "null");
    } else if (row.words[number].empty()) {
      out += "null";
    } else {
      AppendJsonString(out, row.words[number]);
    }
  }

  LineOutput& output_;
  const RowTable* table_ = nullptr;
  std::vector<NumberForm> forms_;  ///< by column
  std::vector<std::string> keys_;  ///< by column, as JSON text with a comma before and a colon after it
};

}  // namespace

std::unique_ptr<RowSink> MakeJsonRows(LineOutput& output) {
  return std::make_unique<JsonRows>(output);
}

}  // namespace ecaudit::cli
