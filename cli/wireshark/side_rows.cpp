#include "cli/wireshark/side_rows.h"

#include <algorithm>
#include <set>

#include "analyzers/objects/object_names.h"
#include "cli/stream/json_line.h"
#include "decoder/base/text.h"

namespace ecaudit::cli {
namespace {

constexpr std::size_t kMostLayouts = 4096;  // as many sets of signals no bus has

/// How the post-dissector shows a column.
std::string_view KindOf(ColumnKind kind) {
  switch (kind) {
    case ColumnKind::kDriveState:
      return "state";
    case ColumnKind::kDriveCommand:
      return "command";
    case ColumnKind::kSignal:
      return "number";
    default:
      return "text";
  }
}

bool IsText(const SignalColumn& column) {
  return column.kind != ColumnKind::kSignal || column.bits > 64;
}

}  // namespace

std::string FieldWord(std::string_view name) {
  std::string word;
  for (const char c : name) {
    const bool upper = c >= 'A' && c <= 'Z';
    const bool plain = (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9');
    if (upper || plain) {
      word += upper ? static_cast<char>(c - 'A' + 'a') : c;
    } else if (!word.empty() && word.back() != '_') {
      word += '_';
    }
  }
  while (!word.empty() && word.back() == '_') word.pop_back();
  return word;
}

void SideRows::Begin(const SignalTable& table) {
  columns_ = table.columns;
  shown_.assign(columns_.size(), {});
  std::set<std::string> keys;
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    const SignalColumn& column = columns_[i];
    forms_.push_back(FormOf(column));
    // A header is "S0.Status word"; a datagram without known slave has no slave in front.
    const std::string_view header = column.header;
    const std::string prefix = column.slave.empty() ? std::string() : column.slave + ".";
    const std::string name(header.starts_with(prefix) ? header.substr(prefix.size()) : header);
    std::string key = (column.slave.empty() ? "" : FieldWord(column.slave) + ".") + FieldWord(name);
    // Two names can differ in characters that a field cannot have.
    const std::string first = key;
    for (int n = 2; !keys.insert(key).second; ++n) key = first + "_" + std::to_string(n);
    std::string line = "column\t" + std::to_string(i) + '\t' + std::string(KindOf(column.kind)) + '\t' +
                       SideField(column.slave) + '\t' + SideField(name) + '\t' + SideField(column.unit) + '\t';
    if (column.index != 0) line += ObjectName(column.index, column.subindex);
    line += '\t' + key;
    side_.Directory(line);
    fields_.push_back({key, IsText(column) ? 's' : 'n', SideField(header)});
  }
}

std::size_t SideRows::LayoutOf(const SignalRow& row) {
  present_.clear();
  for (std::uint32_t i = 0; i < row.cells.size(); ++i) {
    if (row.cells[i].has_value()) present_.push_back(i);
  }
  if (present_ == last_present_) return last_layout_;
  if (layouts_.size() >= kMostLayouts && layouts_.count(present_) == 0) return kMostLayouts;
  const auto [at, added] = layouts_.try_emplace(present_, layouts_.size());
  if (added) {
    std::string line = "layout\t" + std::to_string(at->second) + "\t";
    for (const std::uint32_t column : present_) {
      AppendNumber(line, column);
      line += ',';
    }
    side_.Directory(line);
  }
  last_present_ = present_;
  return last_layout_ = at->second;
}

void SideRows::Row(const SignalRow& row) {
  const std::size_t layout = LayoutOf(row);
  if (present_.empty() || layout >= kMostLayouts) return;
  if (side_.begins_block(SideSection::kSignals)) {
    side_.BeginBlock(SideSection::kSignals, row.frame);
    std::ranges::for_each(shown_, [](std::string& text) { text.clear(); });
  }
  line_.clear();
  AppendNumber(line_, row.frame);
  line_ += '\t';
  AppendNumber(line_, layout);
  for (const std::uint32_t column : present_) {
    cell_.clear();
    AppendCell(cell_, row, column);
    if (cell_.empty()) cell_ = "?";  // the word has no name in the manual
    if (cell_ == shown_[column]) continue;
    shown_[column] = cell_;
    line_ += '\t';
    AppendNumber(line_, column);
    line_ += '=';
    line_ += cell_;
  }
  side_.Line(SideSection::kSignals, line_);
  side_.EndFrame(SideSection::kSignals);
  ++rows_;
}

void SideRows::AppendCell(std::string& out, const SignalRow& row, std::size_t number) const {
  const SignalColumn& column = columns_[number];
  const RowCell& cell = row.cells[number];
  if (cell.content == RowCell::Content::kBytes) {
    AppendHexBytes(out, cell.bytes);
  } else if (column.kind != ColumnKind::kSignal) {
    out += SideField(row.words[number]);
  } else if (forms_[number] == NumberForm::kNatural) {
    AppendNumber(out, cell.raw);
  } else {
    AppendValue(out, column, cell.raw, "nan");
  }
}

}  // namespace ecaudit::cli
