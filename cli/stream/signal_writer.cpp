#include "cli/stream/signal_writer.h"

#include <algorithm>
#include <map>

#include "analyzers/objects/object_words.h"
#include "cli/interrupt.h"
#include "decoder/base/text.h"
#include "decoder/base/wrapping.h"
#include "decoder/esc/bit_copy.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/esc/register_map.h"

namespace ecaudit::cli {
namespace {

using device::PdoDirection;

constexpr std::size_t kMaxKinds = 4096;
constexpr std::size_t kMaxLayouts = 4096;
constexpr std::size_t kMaxNamed = 4;  // things listed in one warning

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
  columns_.SetNames(context.settings.analysis.slave_names);
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
  kept_families_.clear();
  kept_kinds_.clear();
  before_ = {};
  cells_.clear();
  families_.clear();
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
  families_.assign(count, nullptr);
  words_.resize(count);
  texts_.resize(count);
  word_columns_.clear();
  for (std::uint32_t column = 0; column < count; ++column) {
    const ColumnKind kind = columns_.columns()[column].kind;
    if (kind == ColumnKind::kDriveState || kind == ColumnKind::kDriveCommand || kind == ColumnKind::kMeaning) {
      word_columns_.push_back(column);
    }
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
    if (std::ranges::find(list, item) == list.end()) list.push_back(item);
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
  const bool all_numbers = std::ranges::all_of(
      row_.filled, [this](std::uint32_t column) { return cells_[column].content == Content::kNumber; });
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
  const RowCell& cell = cells_[column];
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
  const RowCell* const cells = cells_.data();
  std::uint64_t* const before = before_.raw.data();
  const ColumnKind* const kinds = kept_kinds_.data();
  for (const std::uint32_t column : columns) {
    const std::uint64_t raw = cells[column].raw;
    to = RowTape::PutAt(to, raw ^ before[column]);
    before[column] = raw;
    if (kinds[column] == ColumnKind::kSignal) continue;
    const auto drive = std::ranges::find(kept_families_, families_[column]);
    to = RowTape::PutAt(to, static_cast<std::uint64_t>(drive - kept_families_.begin()));
    if (drive == kept_families_.end()) kept_families_.push_back(families_[column]);
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
  RowCell* const cells = cells_.data();
  std::uint64_t* const before = before_.raw.data();
  const ColumnKind* const kinds = kept_kinds_.data();
  const std::uint32_t* place = layout.places.data();
  for (const std::uint32_t column : layout.columns) {
    RowCell& cell = cells[*place];
    cell.content = all_numbers ? Content::kNumber : static_cast<Content>(tape_.TakeNumber());
    if (cell.content == Content::kNumber) {
      cell.raw = before[column] ^= tape_.TakeNumber();
      if (kinds[column] != ColumnKind::kSignal) families_[*place] = kept_families_[tape_.TakeNumber()];
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
  OpenSinks();
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
  OpenSinks();
}

void SignalWriter::End() {
  EndRow();
  if (options_.sink != nullptr) options_.sink->End();
  for (const auto& sink : sinks_) sink->End();
}

bool SignalWriter::ShowsUnmet(std::span<const SlaveSelector> selectors) const {
  return std::ranges::any_of(columns_.columns(), [&](const SignalColumn& column) {
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

RowCell& SignalWriter::Fill(std::uint32_t column) {
  if (column >= cells_.size()) {
    cells_.resize(column + std::size_t{1});
    families_.resize(column + std::size_t{1});
  }
  RowCell& cell = cells_[column];
  if (cell.content == Content::kAbsent) row_.filled.push_back(column);
  return cell;
}

void SignalWriter::FillBytes(std::uint32_t column, ByteSpan bytes) {
  RowCell& cell = Fill(column);
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
    RowCell& cell = Fill(signal.column);
    cell.content = value ? Content::kNumber : Content::kUnknown;
    cell.raw = value.value_or(0);
    if (signal.extra == PartColumns::kNone) continue;
    RowCell& extra = Fill(signal.extra);
    families_[signal.extra] = part.model->profile;
    if (!value) {
      extra.content = Content::kUnknown;
      continue;
    }
    if (columns_.columns()[signal.extra].kind == ColumnKind::kMeaning) {
      extra.raw = *value;
      extra.content = Content::kNumber;
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
    if (show) WriteRow();
    if (learning_ && keeps_) KeepRow();
    for (const std::uint32_t column : row_.filled) {
      if (column < cells_.size()) cells_[column].content = Content::kAbsent;
    }
  }
  row_.filled.clear();
  row_.kind = 0;
  row_.dc_time.reset();
}

void SignalWriter::OpenSinks() {
  table_ = {columns_.columns(), dc_seen_, context_->time_mode != report::TimeMode::kRelative};
  sinks_.clear();
  if (options_.sink != nullptr) {
    options_.sink->Begin(table_);
    return;
  }
  for (LineTarget& target : context_->targets) {
    sinks_.push_back(StreamFormats::OfSignals().At(target.format).signals(target.output, target.color));
    sinks_.back()->Begin(table_);
  }
}

void SignalWriter::WriteRow() {
  for (const std::uint32_t column : word_columns_) {
    if (cells_[column].content == Content::kNumber) RenewWord(column);
  }
  const FrameRef& frame = row_.frame();
  const std::string time = context_->time().Iso(frame);
  const SignalRow row{frame.number, context_->source.SinceStart(frame), time, row_.dc_time, cells_, texts_};
  if (options_.sink != nullptr) return options_.sink->Row(row);
  bool open = false;
  for (std::size_t i = 0; i < sinks_.size(); ++i) {
    sinks_[i]->Row(row);
    open |= !context_->targets[i].output.closed();
  }
  if (!open) InterruptFlag() = true;  // the reader has closed the output
}

/// Drives keep a state for long, and its name takes a search.
void SignalWriter::RenewWord(std::uint32_t column) {
  const std::uint64_t raw = cells_[column].raw;
  const device::DeviceDescription* family = families_[column];
  Word& known = words_[column];
  if (known.raw == raw && known.family == family) return;
  known = {raw, family};
  std::string& text = texts_[column];
  text.clear();
  if (family == nullptr) return;
  const SignalColumn& about = columns_.columns()[column];
  if (about.kind == ColumnKind::kMeaning) {
    text = events::WordsOf(*family, about.index, about.subindex, raw);
    return;
  }
  if (!family->drive) return;
  const device::DriveProfile* drive = &*family->drive;
  const auto word = static_cast<std::uint16_t>(raw);
  if (about.kind == ColumnKind::kDriveCommand) {
    text = CommandText(*drive, static_cast<std::uint16_t>(raw >> 16U), word);
  } else if (const auto state = drive->StateOf(word)) {
    text = device::DriveStateName(*state);
  }
}

}  // namespace ecaudit::cli
