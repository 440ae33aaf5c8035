/// Rows as JSON Lines: an object for each row; those of `signals` come after one for each column.
#include "cli/stream/json_datagrams.h"
#include "cli/stream/json_line.h"
#include "cli/stream/stream_formats.h"
#include "decoder/base/names.h"
#include "decoder/base/text.h"

namespace ecaudit::cli {
namespace {

std::string_view NameOf(device::PdoDirection direction) {
  return direction == device::PdoDirection::kRx ? "rx" : "tx";
}

std::string_view NameOf(ColumnKind kind) {
  static constexpr Named<ColumnKind> kNames[] = {
      {ColumnKind::kSignal, "signal"},
      {ColumnKind::kDriveState, "drive-state"},
      {ColumnKind::kDriveCommand, "drive-command"},
      {ColumnKind::kMeaning, "meaning"},
      {ColumnKind::kDatagram, "datagram"},
      {ColumnKind::kRaw, "raw"},
  };
  const std::string_view name = NameIn(kNames, kind);
  return !name.empty() ? name : "raw";
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

class SignalLines final : public SignalSink {
 public:
  explicit SignalLines(LineOutput& output) : output_(output) {}

  void Begin(const SignalTable& table) override {
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

  void Row(const SignalRow& row) override {
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
  void AppendCell(std::string& out, const SignalRow& row, std::size_t number) const {
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
  const SignalTable* table_ = nullptr;
  std::vector<NumberForm> forms_;  ///< by column
  std::vector<std::string> keys_;  ///< by column, as JSON text with a comma before and a colon after it
};

class EventLines final : public EventSink {
 public:
  explicit EventLines(LineOutput& output) : output_(output) {}

  void Begin(const EventTable& /*table*/) override {}

  void Row(const EventRecord& row) override {
    JsonLine line(output_.buffer());
    line.Text("event", Name(row.type));
    NumberOrNull(line, "frame", row.frame.seen() ? std::optional(row.frame.number) : std::nullopt);
    if (row.since_start_ns) {
      AppendSeconds(line.Key("time_s"), *row.since_start_ns);
    } else {
      line.Null("time_s");
    }
    if (const std::string time = row.time.Iso(row.frame); !time.empty()) line.Text("time", time);
    NumberOrNull(line, "slave", row.slave);
    NumberOrNull(line, "station_address", row.station);
    for (const RowField& field : row.fields.all()) AppendField(line, row.fields, field);
    line.Close();
    output_.EndLine();
  }

 private:
  static void AppendField(JsonLine& line, const RowFields& fields, const RowField& field) {
    switch (field.kind) {
      case RowField::Kind::kNull:
        return line.Null(field.key);
      case RowField::Kind::kNatural:
        return line.Number(field.key, field.natural);
      case RowField::Kind::kInteger:
        return line.Number(field.key, field.integer);
      case RowField::Kind::kReal:
        return AppendJsonNumber(line.Key(field.key), field.real);
      case RowField::Kind::kBool:
        return line.Bool(field.key, field.natural != 0);
      case RowField::Kind::kText:
        return line.Text(field.key, fields.TextOf(field));
      case RowField::Kind::kBytes:
        return line.Bytes(field.key, fields.BytesOf(field));
      case RowField::Kind::kJson:
        line.Key(field.key) += fields.TextOf(field);
        return;
    }
  }

  LineOutput& output_;
};

class DatagramLines final : public DatagramSink {
 public:
  explicit DatagramLines(LineOutput& output) : output_(output) {}

  void Begin(const DatagramTable& /*table*/) override {}
  void Row(const DatagramRow& row) override {
    objects_.Append(output_.buffer(), row);
    output_.EndLine();
  }

 private:
  LineOutput& output_;
  DatagramObjects objects_;
};

}  // namespace

StreamFormat JsonLinesFormat() {
  return {.output = {"jsonl", ".jsonl"},
          .help = "jsonl: one JSON object a line",
          .signals = &MakeRows<SignalSink, SignalLines>,
          .events = &MakeRows<EventSink, EventLines>,
          .datagrams = &MakeRows<DatagramSink, DatagramLines>};
}

}  // namespace ecaudit::cli
