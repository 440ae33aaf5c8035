/// Where the rows of a stream go, one at a time: `signals`, `events` and `decode` write through this.
///
/// A format is one file with its sinks, and a row in stream_formats.cpp. Nothing else knows it: not the command, not
/// the writer of the rows.
#pragma once

namespace ecaudit::cli {

/// @tparam TableType  what holds for all rows
/// @tparam RowType  valid during the call
template <class TableType, class RowType>
class RowSink {
 public:
  virtual ~RowSink() = default;
  /// Before the first row. `table` stays valid until the last one.
  virtual void Begin(const TableType& table) = 0;
  virtual void Row(const RowType& row) = 0;
  /// After the last row.
  virtual void End() {}
};

}  // namespace ecaudit::cli
