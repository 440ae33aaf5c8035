/// Where the rows of a table go: a sink for each format.
///
/// A format is one file with its sink, and a row in row_formats.cpp. Nothing else knows it: not the command, not the
/// writer of the rows.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "cli/output_plan.h"
#include "cli/stream/line_output.h"
#include "cli/stream/signal_columns.h"
#include "decoder/base/ids.h"

namespace ecaudit::cli {

/// Value of one column in one row.
struct RowCell {
  enum class Content : std::uint8_t {
    kAbsent,   ///< not in this frame
    kUnknown,  ///< in this frame, but the slave did not give it
    kNumber,
    kBytes,
  };
  Content content = Content::kAbsent;
  std::uint64_t raw = 0;
  std::vector<std::uint8_t> bytes;

  [[nodiscard]] bool has_value() const { return content == Content::kNumber || content == Content::kBytes; }
  friend bool operator==(const RowCell&, const RowCell&) = default;
};

/// What holds for all rows.
struct RowTable {
  std::span<const SignalColumn> columns;
  bool dc_time = false;      ///< some row has the time of the reference clock
  bool clock_times = false;  ///< times are clock times, not seconds from the first packet
};

/// Valid during the call.
struct TableRow {
  FrameNo frame = 0;
  std::optional<std::int64_t> since_start_ns;  ///< from the first packet
  std::string_view time;                       ///< ISO 8601; empty: times are relative, or the frame has none
  std::optional<std::uint64_t> dc_time_ns;
  std::span<const RowCell> cells;      ///< by column
  std::span<const std::string> words;  ///< by column: text of drive states and commands; empty: it has no name
};

class RowSink {
 public:
  virtual ~RowSink() = default;
  /// Before the first row. `table` stays valid until the last one.
  virtual void Begin(const RowTable& table) = 0;
  virtual void Row(const TableRow& row) = 0;
  /// After the last row.
  virtual void End() {}
};

struct RowFormat {
  OutputFormat output;
  std::string_view help;  ///< its name, and what it is if that needs words
  /// @param output must outlive the sink
  std::unique_ptr<RowSink> (*make)(LineOutput& output);
};

/// The default comes first.
[[nodiscard]] std::span<const RowFormat> RowFormats();
/// "csv (default) or jsonl: one JSON object a line"
[[nodiscard]] std::string RowFormatsHelp();

// Each in the file of its format.
[[nodiscard]] std::unique_ptr<RowSink> MakeCsvRows(LineOutput& output);
[[nodiscard]] std::unique_ptr<RowSink> MakeJsonRows(LineOutput& output);

/// How the numbers of a column are written.
enum class NumberForm : std::uint8_t { kNatural, kInteger, kOther };
/// kOther: AppendValue() is needed, or it has no number.
[[nodiscard]] NumberForm FormOf(const SignalColumn& column);
/// Appends what the bits of a signal mean, divided by its scale; `not_finite` for infinities and NaN.
void AppendValue(std::string& out, const SignalColumn& column, std::uint64_t raw, std::string_view not_finite);

}  // namespace ecaudit::cli
