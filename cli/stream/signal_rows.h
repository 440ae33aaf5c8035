/// Rows of `signals`: a value for each column that a frame carries.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "cli/stream/row_sink.h"
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

struct SignalTable {
  std::span<const SignalColumn> columns;
  bool dc_time = false;      ///< some row has the time of the reference clock
  bool clock_times = false;  ///< times are clock times, not seconds from the first packet
};

struct SignalRow {
  FrameNo frame = 0;
  std::optional<std::int64_t> since_start_ns;  ///< from the first packet
  std::string_view time;                       ///< ISO 8601; empty: times are relative, or the frame has none
  std::optional<std::uint64_t> dc_time_ns;
  std::span<const RowCell> cells;      ///< by column
  std::span<const std::string> words;  ///< by column: text of drive states and commands; empty: it has no name
};

using SignalSink = RowSink<SignalTable, SignalRow>;

/// How the numbers of a column are written.
enum class NumberForm : std::uint8_t { kNatural, kInteger, kOther };
/// kOther: AppendValue() is needed, or it has no number.
[[nodiscard]] NumberForm FormOf(const SignalColumn& column);
/// Appends what the bits of a signal mean, divided by its scale; `not_finite` for infinities and NaN.
void AppendValue(std::string& out, const SignalColumn& column, std::uint64_t raw, std::string_view not_finite);

}  // namespace ecaudit::cli
