#include "cli/stream/signal_writer.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <map>

#include "analyzers/signals/signal_value.h"
#include "cli/interrupt.h"
#include "cli/report/layout.h"
#include "cli/stream/json_line.h"
#include "decoder/base/text.h"
#include "decoder/base/wrapping.h"
#include "decoder/esc/bit_copy.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/esc/register_map.h"

namespace ecaudit::cli {
namespace {

using device::PdoDirection;

constexpr std::array kSignalFormats{OutputFormat{"csv", ".csv"}, OutputFormat{"jsonl", ".jsonl"}};
constexpr std::size_t kMaxKinds = 4096;
constexpr std::size_t kMaxLayouts = 4096;
constexpr std::size_t kLongestCell = 24;  // a comma and an integer of 64 bits
constexpr std::size_t kMaxNamed = 4;      // things listed in one warning

std::string_view PdoDirectionName(PdoDirection direction) {
  return direction == PdoDirection::kRx ? "rx" : "tx";
}

/// RFC 4180: between quotation marks, and those doubled, where a program could mistake it. Names come from devices and
/// files of others: what a spreadsheet would take for a formula gets an apostrophe in front, which makes it text.
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

void AppendSignal(std::string& out, const signals::SignalValue& value) {
  if (const auto* number = std::get_if<std::uint64_t>(&value)) {
    AppendNumber(out, *number);
  } else if (const auto* with_sign = std::get_if<std::int64_t>(&value)) {
    AppendNumber(out, *with_sign);
  } else {
    const std::size_t at = out.size();
    AppendJsonNumber(out, std::get<double>(value));
    if (out.compare(at, std::string::npos, "null") == 0) out.replace(at, std::string::npos, "nan");
  }
}

/// What a control word asks for: "Shutdown"; several where the word alone does not distinguish them.
std::string CommandText(const device::DriveProfile& drive, std::uint16_t before, std::uint16_t word) {
  std::string text;
  for (const device::DriveCommand& command : drive.commands) {
    if (command.automatic || !command.Matches(before, word) || text.find(command.name) != std::string::npos) continue;
    text += (text.empty() ? "" : " / ") + command.name;
  }
  return text;
}

/// "S0, S1, S2, S3 and 36 more"
std::string Listed(const std::vector<std::string>& items) {
  std::string text;
  for (std::size_t i = 0; i < items.size() && i < kMaxNamed; ++i) text += (i == 0 ? "" : ", ") + items[i];
  if (items.size() > kMaxNamed) text += " and " + std::to_string(items.size() - kMaxNamed) + " more";
  return text;
}

/// Kind of a datagram: what it reads or writes, and where.
std::uint64_t KindOf(wire::Command command, std::uint32_t address, std::size_t length) {
  return (std::uint64_t{1} << 63U) | static_cast<std::uint64_t>(command) << 48U |
         (static_cast<std::uint64_t>(length) & 0xFFFFU) << 32U | address;
}

}  // namespace

std::span<const OutputFormat> SignalWriter::Formats() {
  return kSignalFormats;
}

const AnalysisOptions& SignalWriter::Adapt(const AnalysisOptions& options) {
  model_options_ = options;
  if (guessed_) model_options_.files = guessed_->files;
  return model_options_;
}

void SignalWriter::BeginPass(Observation& observation, const StreamContext& context) {
  context_ = &context;
  network_ = &observation.pipeline().network();
  // The row is entered before the model reads the process data in it.
  observation.bus().ListenTo<track::LogicalAccess, track::SlaveAccess, model::ProcessCycle, model::ProcessDataUnplaced>(
      Stage::kBeforeModel, *this);
  columns_.NewPass();
  row_ = {};
}

void SignalWriter::BeginLearning(Observation& observation, const StreamContext& context) {
  learning_ = true;
  again_ = false;
  if (!guessed_) guess_.emplace(context.settings.analysis.files.get());
  keeps_ = true;
  tape_.Clear();
  layouts_.clear();
  layout_of_kind_.clear();
  kept_drives_.clear();
  kept_kinds_.clear();
  before_ = {};
  cells_.clear();
  drives_.clear();
  BeginPass(observation, context);
}

std::optional<Error> SignalWriter::EndLearning(Console& console) {
  EndRow();
  learning_ = false;
  if (guess_) {
    guessed_ = guess_->Find();
    guess_.reset();
    if (guessed_) {
      columns_ = SignalColumns(options_.choice);
      again_ = true;
      return std::nullopt;
    }
  }
  if (guessed_)
    console.Warning("places of the process data inferred: " + guessed_->what + " (an ENI file gives them: --eni)");
  keeps_ = keeps_ && !tape_.failed();
  columns_.Finish();
  for (KeptLayout& layout : layouts_) {
    for (const std::uint32_t column : layout.columns) layout.places.push_back(columns_.PlaceOf(column));
  }
  const std::size_t count = columns_.columns().size();
  cells_.assign(count, {});
  shown_.resize(count);
  drives_.assign(count, nullptr);
  words_.resize(count);
  json_keys_.clear();
  forms_.clear();
  for (const SignalColumn& column : columns_.columns()) {
    forms_.push_back(FormOf(column));
    std::string& key = json_keys_.emplace_back(",");
    AppendJsonString(key, column.header);
    key += ':';
  }

  ReportOddities(console);
  if (columns_.full()) {
    console.Warning("more than " + Grouped(SignalColumns::kMaxColumns) +
                    " signals: those that come later are left out");
  }
  if (!columns_.columns().empty()) {
    for (const std::string& pattern : columns_.unmatched()) console.Warning("no signal matches '" + pattern + "'");
    return std::nullopt;
  }
  if (!columns_.passed_over().empty()) {
    std::string names;
    for (const std::string& name : columns_.passed_over()) names += (names.empty() ? "" : ", ") + name;
    return Error{"no signal matches --signal; there are " + names + ", ..."};
  }
  if (context_->settings.slaves.empty()) console.Warning("no process data in the frames chosen");
  return std::nullopt;
}

/// Why bytes have no names, and which names are guesses; the same thing of many slaves once.
void SignalWriter::ReportOddities(Console& console) const {
  std::map<std::string, std::vector<std::string>> raw;                     // slaves by what is reported about them
  std::vector<std::pair<std::string, std::vector<std::string>>> inferred;  // objects of each slave, in their order
  const auto add = [](std::vector<std::string>& list, const std::string& item) {
    if (std::find(list.begin(), list.end(), item) == list.end()) list.push_back(item);
  };
  for (const SignalColumn& column : columns_.columns()) {
    if (!column.reason.empty()) {
      const bool datagram = column.slave.empty();
      add(raw[(datagram ? std::string() : " " + column.name) + ": raw bytes, since " + column.reason],
          datagram ? column.name : column.slave);
    } else if (column.name_inferred && column.kind == ColumnKind::kSignal) {
      if (inferred.empty() || inferred.back().first != column.slave)
        inferred.emplace_back(column.slave, std::vector<std::string>());
      add(inferred.back().second, ObjectName(column.index, column.subindex));
    }
  }
  for (const auto& [what, whose] : raw) console.Warning(Listed(whose) + what);
  std::map<std::string, std::vector<std::string>> guesses;  // slaves by their objects
  for (const auto& [slave, objects] : inferred) add(guesses[Listed(objects)], slave);
  for (const auto& [objects, slaves] : guesses) {
    console.Warning(Listed(slaves) + ": " + objects + " named after another family of the same maker");
  }
}

/// How nearly all signals are written, described once: as signals::ReadSignal() reads them.
SignalWriter::Form SignalWriter::FormOf(const SignalColumn& column) {
  if (column.kind != ColumnKind::kSignal || column.divisor != 1.0) return Form::kOther;
  const signals::SignalValue none = signals::ReadSignal(column.type, column.bits, 0);
  if (std::holds_alternative<std::uint64_t>(none)) return Form::kNatural;
  return std::holds_alternative<std::int64_t>(none) ? Form::kInteger : Form::kOther;
}

/// The number of the row's layout; nothing when there are too many.
std::optional<std::uint32_t> SignalWriter::LayoutOfRow() {
  const auto [last, added] = layout_of_kind_.try_emplace(row_.kind, 0);
  if (!added && layouts_[last->second].columns == row_.filled) return last->second;
  if (layouts_.size() >= kMaxLayouts) return std::nullopt;
  last->second = static_cast<std::uint32_t>(layouts_.size());
  layouts_.push_back({row_.kind, row_.filled, {}});
  return last->second;
}

void SignalWriter::KeepRow() {
  const auto layout = LayoutOfRow();
  if (!layout || tape_.failed()) {
    keeps_ = false;
    tape_.Clear();
    return;
  }
  const FrameRef& sent = row_.sent;
  const FrameRef& returned = row_.returned;
  const auto difference = [](auto value, auto before) {
    return static_cast<std::int64_t>(
        WrappingDifference(static_cast<std::uint64_t>(value), static_cast<std::uint64_t>(before)));
  };
  tape_.PutNumber(*layout);
  const bool all_numbers = std::all_of(row_.filled.begin(), row_.filled.end(), [this](std::uint32_t column) {
    return cells_[column].content == Content::kNumber;
  });
  tape_.PutNumber((sent.has_time ? 1U : 0U) | (returned.has_time ? 2U : 0U) | (row_.dc_time ? 4U : 0U) |
                  (all_numbers ? 8U : 0U));
  tape_.PutSigned(difference(sent.number, before_.number));
  tape_.PutSigned(difference(sent.time, before_.time));
  tape_.PutSigned(difference(returned.number, sent.number));
  tape_.PutSigned(difference(returned.time, sent.time));
  if (row_.dc_time) {
    tape_.PutSigned(difference(*row_.dc_time, before_.dc_time));
    before_.dc_time = *row_.dc_time;
  }
  before_.number = sent.number;
  before_.time = static_cast<std::uint64_t>(sent.time);
  before_.raw.resize(cells_.size());
  while (kept_kinds_.size() < columns_.columns().size())
    kept_kinds_.push_back(columns_.columns()[kept_kinds_.size()].kind);
  if (all_numbers) {
    KeepNumbers(row_.filled);
  } else {
    for (const std::uint32_t column : row_.filled) KeepCell(column);
  }
  tape_.EndRow();
}

void SignalWriter::KeepCell(std::uint32_t column) {
  const Cell& cell = cells_[column];
  tape_.PutNumber(static_cast<std::uint64_t>(cell.content));
  if (cell.content == Content::kBytes) {
    tape_.PutNumber(cell.bytes.size());
    tape_.Put(cell.bytes);
  } else if (cell.content == Content::kNumber) {
    KeepNumbers(std::span(&column, 1));
  }
}

void SignalWriter::KeepNumbers(std::span<const std::uint32_t> columns) {
  std::uint8_t* to = tape_.RoomForNumbers(2 * columns.size());
  const Cell* const cells = cells_.data();
  std::uint64_t* const before = before_.raw.data();
  const ColumnKind* const kinds = kept_kinds_.data();
  for (const std::uint32_t column : columns) {
    const std::uint64_t raw = cells[column].raw;
    to = RowTape::PutAt(to, raw ^ before[column]);
    before[column] = raw;
    if (kinds[column] == ColumnKind::kSignal) continue;
    const auto drive = std::find(kept_drives_.begin(), kept_drives_.end(), drives_[column]);
    to = RowTape::PutAt(to, static_cast<std::uint64_t>(drive - kept_drives_.begin()));
    if (drive == kept_drives_.end()) kept_drives_.push_back(drives_[column]);
  }
  tape_.PutUpTo(to);
}

void SignalWriter::TakeRow() {
  const KeptLayout& layout = layouts_[tape_.TakeNumber()];
  const std::uint64_t flags = tape_.TakeNumber();
  const auto next = [this](std::uint64_t before) {
    return WrappingSum(before, static_cast<std::uint64_t>(tape_.TakeSigned()));
  };
  before_.number = next(before_.number);
  before_.time = next(before_.time);
  row_.kind = layout.kind;
  row_.sent = {before_.number, static_cast<TimeNs>(before_.time), (flags & 1U) != 0};
  const std::uint64_t number = next(before_.number);
  row_.returned = {number, static_cast<TimeNs>(next(before_.time)), (flags & 2U) != 0};
  if ((flags & 4U) != 0) row_.dc_time = before_.dc_time = next(before_.dc_time);
  row_.filled = layout.places;
  const bool all_numbers = (flags & 8U) != 0;
  Cell* const cells = cells_.data();
  std::uint64_t* const before = before_.raw.data();
  const ColumnKind* const kinds = kept_kinds_.data();
  const std::uint32_t* place = layout.places.data();
  for (const std::uint32_t column : layout.columns) {
    Cell& cell = cells[*place];
    cell.content = all_numbers ? Content::kNumber : static_cast<Content>(tape_.TakeNumber());
    if (cell.content == Content::kNumber) {
      cell.raw = before[column] ^= tape_.TakeNumber();
      if (kinds[column] != ColumnKind::kSignal) drives_[*place] = kept_drives_[tape_.TakeNumber()];
    } else if (cell.content == Content::kBytes) {
      tape_.Take(cell.bytes, tape_.TakeNumber());
    }
    ++place;
  }
}

std::optional<Error> SignalWriter::WriteKept(const StreamContext& context) {
  context_ = &context;
  row_ = {};
  const std::size_t columns = before_.raw.size();
  before_ = {};
  before_.raw.resize(columns);
  for (LineTarget& target : context.targets) WriteHeader(target);
  tape_.Rewind();
  while (tape_.more() && !InterruptFlag()) {
    TakeRow();
    EndRow();
  }
  if (tape_.failed()) return Error{"the rows that were kept in a temporary file cannot be read"};
  return std::nullopt;
}

void SignalWriter::Begin(Observation& observation, const StreamContext& context) {
  BeginPass(observation, context);
  for (LineTarget& target : context.targets) WriteHeader(target);
}

void SignalWriter::End() {
  EndRow();
}

bool SignalWriter::ShowsUnmet(std::span<const SlaveSelector> selectors) const {
  return std::any_of(columns_.columns().begin(), columns_.columns().end(), [&](const SignalColumn& column) {
    return !column.slave.empty() && SelectsAddress(selectors, column.position, column.station);
  });
}

bool SignalWriter::EnterRow(const FrameRef& sent, const FrameRef& returned) {
  if (row_.sent.number != sent.number || row_.returned.number != returned.number) {
    EndRow();
    row_.sent = sent;
    row_.returned = returned;
  }
  const FrameRef& frame = row_.frame();
  const std::optional<std::int64_t> since = context_->source.SinceStart(frame);
  return context_->range.Contains(frame.number,
                                  since ? std::optional(static_cast<double>(*since) / 1e9) : std::nullopt);
}

void SignalWriter::On(const track::LogicalAccess& access) {
  in_range_ = EnterRow(access.sent, access.returned);
  if (!in_range_) return;
  kind_ = KindOf(access.command, access.address, access.length);
  if (row_.kind == 0) row_.kind = kind_;
}

void SignalWriter::On(const track::SlaveAccess& access) {
  in_range_ = false;
  if (access.broadcast) return;
  ByteSpan time = access.Covered(access.read, esc::kSystemTime, 8);
  if (time.empty()) time = access.Covered(access.read, esc::kSystemTime, 4);
  if (!time.empty()) {
    if (EnterRow(access.sent, access.returned) && !row_.dc_time) {
      row_.dc_time = time.size() >= 8 ? LittleEndian<std::uint64_t>(time, 0) : LittleEndian<std::uint32_t>(time, 0);
    }
  } else if (access.address >= esc::kProcessRam) {
    in_range_ = EnterRow(access.sent, access.returned);
    kind_ = KindOf(access.command, std::uint32_t{access.slave} << 16U | access.address,
                   std::max(access.written.size(), access.read.size()));
  }
}

void SignalWriter::On(const model::ProcessDataUnplaced& event) {
  if (in_range_) ShowDatagram(event.access);
}

SignalWriter::Cell& SignalWriter::Fill(std::uint32_t column) {
  if (column >= cells_.size()) {
    cells_.resize(column + std::size_t{1});
    drives_.resize(column + std::size_t{1});
  }
  Cell& cell = cells_[column];
  if (cell.content == Content::kAbsent) row_.filled.push_back(column);
  return cell;
}

void SignalWriter::FillBytes(std::uint32_t column, ByteSpan bytes) {
  Cell& cell = Fill(column);
  cell.content = bytes.empty() ? Content::kUnknown : Content::kBytes;
  cell.bytes.assign(bytes.begin(), bytes.end());
}

void SignalWriter::On(const model::ProcessCycle& cycle) {
  if (!in_range_ || cycle.lost) return;
  if (row_.kind == 0) row_.kind = kind_;
  const model::ImagePart& part = cycle.part;
  const auto& selectors = context_->settings.slaves;
  if (!selectors.empty()) {
    if (part.slave != kNoSlave
            ? !SelectsSlave(selectors, *network_, part.slave)
            : !SelectsAddress(selectors, part.model->eni->position(), part.model->eni->station_address)) {
      return;
    }
  }
  const PartColumns& places = columns_.Of(part, *network_);
  if (learning_ && !keeps_) {
    if (!places.empty()) row_.filled.push_back(0);
    return;
  }
  if (places.raw != PartColumns::kNone) {
    scratch_.clear();
    cycle.AppendRaw(scratch_);
    FillBytes(places.raw, scratch_);
  }
  for (const PartColumns::Signal& signal : places.signals) {
    const model::ImagePart::Place& place = part.places[signal.place];
    if (place.bits > 64) {
      scratch_.assign((place.bits + 7U) / 8U, 0);
      if (!cycle.has_data() || !esc::CopyBits(cycle.data, place.bit, scratch_, 0, place.bits)) scratch_.clear();
      FillBytes(signal.column, scratch_);
      continue;
    }
    const std::optional<std::uint64_t> value = cycle.Value(place);
    Cell& cell = Fill(signal.column);
    cell.content = value ? Content::kNumber : Content::kUnknown;
    cell.raw = value.value_or(0);
    if (signal.extra == PartColumns::kNone) continue;
    Cell& extra = Fill(signal.extra);
    drives_[signal.extra] = part.model->profile->drive ? &*part.model->profile->drive : nullptr;
    if (!value) {
      extra.content = Content::kUnknown;
      continue;
    }
    // Commands depend on the word before: both are kept, the newer one in the low half.
    const std::uint64_t known = extra.bytes.empty() ? *value << 16U | *value : extra.raw;
    extra.raw = (known & 0xFFFFU) == *value ? known : known << 16U | *value;
    extra.raw &= 0xFFFF'FFFFU;
    extra.bytes.assign(1, 1);  // a word was seen
    extra.content = Content::kNumber;
  }
}

std::string SignalWriter::WhyUnknown() const {
  if (model_options_.files == nullptr || !model_options_.files->eni) {
    return "no FMMU setting in the capture maps these addresses to a slave (an ENI file gives them: --eni)";
  }
  return "no FMMU setting in the capture maps these addresses to a slave, and the ENI has no such cyclic command";
}

void SignalWriter::ShowDatagram(const track::LogicalAccess& access) {
  if (learning_ && guess_) guess_->Add(access);
  if (!context_->settings.slaves.empty()) return;
  const auto show = [&](bool returned, const FrameRef& frame, ByteSpan data) {
    if (!frame.seen()) return;
    const std::uint32_t column = columns_.OfDatagram(access, returned, learning_ ? WhyUnknown() : std::string());
    if (column == PartColumns::kNone) return;
    if (learning_ && !keeps_) {
      row_.filled.push_back(0);
    } else {
      FillBytes(column, data);
    }
  };
  // What the copy sent holds where slaves only read is nothing: it shows what the master left there.
  if (access.command != wire::Command::LRD) show(false, access.sent, access.sent_data);
  if (access.command != wire::Command::LWR) show(true, access.returned, access.returned_data);
}

bool SignalWriter::Changed() {
  bool changed = false;
  for (const std::uint32_t column : row_.filled) {
    if (shown_[column] == cells_[column]) continue;
    shown_[column] = cells_[column];
    changed = true;
  }
  return changed;
}

void SignalWriter::EndRow() {
  if (!row_.filled.empty()) {
    dc_seen_ |= learning_ && row_.dc_time;
    bool show = !learning_;
    if (show && options_.every > 1) {
      if (rows_of_kind_.size() >= kMaxKinds) rows_of_kind_.clear();
      show = rows_of_kind_[row_.kind]++ % options_.every == 0;
    }
    if (show && options_.changes) show = Changed();
    if (show) {
      bool open = false;
      for (LineTarget& target : context_->targets) {
        if (target.format == LineFormat::kJsonLines) {
          WriteJsonRow(target.output.buffer());
        } else {
          WriteCsvRow(target.output.buffer());
        }
        target.output.EndLine();
        open |= !target.output.closed();
      }
      if (!open) InterruptFlag() = true;  // the reader has closed the output
    }
    if (learning_ && keeps_) KeepRow();
    for (const std::uint32_t column : row_.filled) {
      if (column < cells_.size()) cells_[column].content = Content::kAbsent;
    }
  }
  row_.filled.clear();
  row_.kind = 0;
  row_.dc_time.reset();
}

void SignalWriter::WriteHeader(LineTarget& target) {
  std::string& out = target.output.buffer();
  if (target.format == LineFormat::kCsv) {
    out += context_->time_mode == report::TimeMode::kRelative ? "time_s" : "time";
    out += dc_seen_ ? ",dc_time_ns,frame" : ",frame";
    for (const SignalColumn& column : columns_.columns()) {
      out += ',';
      AppendCsv(out, column.header);
    }
    target.output.EndLine();
    return;
  }
  const auto known = [](JsonLine& line, std::string_view key, const auto& value) {
    if (value) {
      line.Number(key, *value);
    } else {
      line.Null(key);
    }
  };
  const auto text = [](JsonLine& line, std::string_view key, const std::string& value) {
    if (value.empty()) {
      line.Null(key);
    } else {
      line.Text(key, value);
    }
  };
  for (const SignalColumn& column : columns_.columns()) {
    JsonLine line(out);
    line.Text("column", column.header);
    const bool datagram = column.kind == ColumnKind::kDatagram;
    line.Text("kind", column.kind == ColumnKind::kSignal         ? "signal"
                      : column.kind == ColumnKind::kDriveState   ? "drive-state"
                      : column.kind == ColumnKind::kDriveCommand ? "drive-command"
                      : datagram                                 ? "datagram"
                                                                 : "raw");
    known(line, "slave", column.position);
    known(line, "station_address", column.station);
    text(line, "slave_name", column.slave_name);
    text(line, "direction", datagram ? "" : std::string(PdoDirectionName(column.direction)));
    if (column.index != 0) {
      line.Number("pdo", column.pdo);
      line.Number("index", column.index);
      line.Number("subindex", column.subindex);
      line.Number("bits", column.bits);
      text(line, "type", column.type == mailbox::DataType::kUnknown ? "" : mailbox::Name(column.type));
      text(line, "unit", column.unit);
      text(line, "scale", column.scale);
      AppendJsonNumber(line.Key("divisor"), column.divisor);
      line.Bool("name_inferred", column.name_inferred);
      text(line, "name", column.name);
      text(line, "variable", column.variable);
    }
    text(line, "source", datagram ? "" : std::string(model::Name(column.source)));
    text(line, "reason", column.reason);
    line.Close();
    target.output.EndLine();
  }
}

void SignalWriter::AppendCell(std::string& out, std::uint32_t number, bool json) {
  const SignalColumn& column = columns_.columns()[number];
  const Cell& cell = cells_[number];
  if (cell.content == Content::kAbsent || cell.content == Content::kUnknown) {
    if (json) out += "null";
    return;
  }
  if (cell.content == Content::kBytes) {
    if (json) out += '"';
    AppendHexBytes(out, cell.bytes);
    if (json) out += '"';
    return;
  }
  if (column.kind != ColumnKind::kSignal) return AppendWord(out, number, json);
  if (forms_[number] == Form::kNatural) return AppendNumber(out, cell.raw);
  if (forms_[number] == Form::kInteger) return AppendNumber(out, SignExtend(cell.raw, column.bits));
  const signals::SignalValue value = signals::ReadSignal(column.type, column.bits, cell.raw);
  if (json && std::holds_alternative<double>(value)) {
    AppendJsonNumber(out, std::get<double>(signals::Scaled(value, column.divisor)));
  } else {
    AppendSignal(out, signals::Scaled(value, column.divisor));
  }
}

void SignalWriter::AppendWord(std::string& out, std::uint32_t number, bool json) {
  const std::uint64_t raw = cells_[number].raw;
  const device::DriveProfile* drive = drives_[number];
  Word& said = words_[number];
  if (said.raw != raw || said.drive != drive) {
    const auto word = static_cast<std::uint16_t>(raw);
    std::string text;
    if (drive != nullptr && columns_.columns()[number].kind == ColumnKind::kDriveState) {
      if (const auto state = drive->StateOf(word)) text = device::DriveStateName(*state);
    } else if (drive != nullptr) {
      text = CommandText(*drive, static_cast<std::uint16_t>(raw >> 16U), word);
    }
    said = {raw, drive, {}, {}};
    AppendCsv(said.csv, text);
    if (text.empty()) {
      said.json = "null";
    } else {
      AppendJsonString(said.json, text);
    }
  }
  out += json ? said.json : said.csv;
}

void SignalWriter::WriteCsvRow(std::string& out) {
  if (context_->time_mode != report::TimeMode::kRelative) {
    out += context_->time().Iso(row_.frame());
  } else if (const auto since = context_->source.SinceStart(row_.frame())) {
    AppendSeconds(out, *since);
  }
  if (dc_seen_) {
    out += ',';
    if (row_.dc_time) AppendNumber(out, *row_.dc_time);
  }
  out += ',';
  AppendNumber(out, row_.frame().number);
  // Nearly all cells are integers: the text of as many as stand side by side joins the row at once.
  line_.resize(cells_.size() * kLongestCell);
  char* const begin = line_.data();
  char* at = begin;
  const Cell* cell = cells_.data();
  for (std::uint32_t column = 0; column < cells_.size(); ++column, ++cell) {
    *at++ = ',';
    if (cell->content == Content::kAbsent || cell->content == Content::kUnknown) continue;
    const Form form = cell->content == Content::kNumber ? forms_[column] : Form::kOther;
    if (form == Form::kNatural) {
      at = std::to_chars(at, at + kLongestCell, cell->raw).ptr;
    } else if (form == Form::kInteger) {
      at = std::to_chars(at, at + kLongestCell, SignExtend(cell->raw, columns_.columns()[column].bits)).ptr;
    } else {
      out.append(begin, static_cast<std::size_t>(at - begin));
      at = begin;
      AppendCell(out, column, false);
    }
  }
  out.append(begin, static_cast<std::size_t>(at - begin));
}

void SignalWriter::WriteJsonRow(std::string& out) {
  JsonLine line(out);
  line.Number("frame", row_.frame().number);
  if (const auto since = context_->source.SinceStart(row_.frame())) {
    AppendSeconds(line.Key("time_s"), *since);
  } else {
    line.Null("time_s");
  }
  if (const std::string time = context_->time().Iso(row_.frame()); !time.empty()) line.Text("time", time);
  if (row_.dc_time) {
    line.Number("dc_time_ns", *row_.dc_time);
  } else {
    line.Null("dc_time_ns");
  }
  line.Key("values") += '{';
  bool first = true;
  for (std::uint32_t column = 0; column < cells_.size(); ++column) {
    if (cells_[column].content == Content::kAbsent) continue;
    out += first ? std::string_view(json_keys_[column]).substr(1) : std::string_view(json_keys_[column]);
    first = false;
    AppendCell(out, column, true);
  }
  out += '}';
  line.Close();
}

}  // namespace ecaudit::cli
