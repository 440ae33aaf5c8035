/// The formats of `signals`, `events` and `decode`: one table for help, completion, -o and the sinks.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "cli/output_plan.h"
#include "cli/stream/datagram_row.h"
#include "cli/stream/event_record.h"
#include "cli/stream/line_output.h"
#include "cli/stream/signal_rows.h"

namespace ecaudit::cli {

/// @param output must outlive the sink
/// @param color  the output is for a person who sees colours
template <class Sink>
using MakeSink = std::unique_ptr<Sink> (*)(LineOutput& output, bool color);

/// Makes sinks of one class.
template <class Sink, class Rows>
[[nodiscard]] std::unique_ptr<Sink> MakeRows(LineOutput& output, bool color) {
  if constexpr (std::is_constructible_v<Rows, LineOutput&, bool>) {
    return std::make_unique<Rows>(output, color);
  } else {
    return std::make_unique<Rows>(output);
  }
}

/// A command has the formats that have a sink for its rows.
struct StreamFormat {
  OutputFormat output;
  std::string_view help;  ///< its name, and what it is if that needs words
  MakeSink<SignalSink> signals = nullptr;
  MakeSink<EventSink> events = nullptr;
  MakeSink<DatagramSink> datagrams = nullptr;
};

// Each in the file of its format.
[[nodiscard]] StreamFormat TextFormat();
[[nodiscard]] StreamFormat CsvFormat();
[[nodiscard]] StreamFormat JsonLinesFormat();

/// The formats of one command, the default first.
class StreamFormats {
 public:
  [[nodiscard]] static const StreamFormats& OfSignals();
  [[nodiscard]] static const StreamFormats& OfEvents();
  [[nodiscard]] static const StreamFormats& OfDatagrams();

  [[nodiscard]] std::span<const OutputFormat> outputs() const { return outputs_; }
  /// @param place  in outputs()
  [[nodiscard]] const StreamFormat& At(std::size_t place) const { return formats_[place]; }
  /// "csv (default) or jsonl: one JSON object a line"
  [[nodiscard]] std::string Help() const;

 private:
  explicit StreamFormats(bool (*has_sink)(const StreamFormat&));

  std::vector<StreamFormat> formats_;
  std::vector<OutputFormat> outputs_;
};

}  // namespace ecaudit::cli
