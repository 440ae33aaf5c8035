/// Rows of process data into a side file, and the names that become fields in Wireshark.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "cli/stream/signal_rows.h"
#include "cli/wireshark/side_file.h"

namespace ecaudit::cli {

/// A field that the post-dissector registers for a signal: "ecaudit.signal." and the key.
struct SignalField {
  std::string key;    ///< "s0.status_word"
  char type = 'n';    ///< 'n': a number, 's': text
  std::string title;  ///< "S0.Status word"
};

class SideRows final : public SignalSink {
 public:
  /// @param fields  receives those of the columns
  SideRows(SideFile& side, std::vector<SignalField>& fields) : side_(side), fields_(fields) {}

  void Begin(const SignalTable& table) override;
  void Row(const SignalRow& row) override;

  [[nodiscard]] std::uint64_t rows() const { return rows_; }

 private:
  [[nodiscard]] std::size_t LayoutOf(const SignalRow& row);
  void AppendCell(std::string& out, const SignalRow& row, std::size_t column) const;

  SideFile& side_;
  std::vector<SignalField>& fields_;
  std::span<const SignalColumn> columns_;
  std::vector<NumberForm> forms_;
  std::vector<std::string> shown_;  ///< by column: as last written in this block
  std::map<std::vector<std::uint32_t>, std::size_t> layouts_;
  std::vector<std::uint32_t> present_;
  std::vector<std::uint32_t> last_present_;
  std::size_t last_layout_ = 0;
  std::string line_, cell_;
  std::uint64_t rows_ = 0;
};

/// The part of a field's name that stands for `name`: lower case, other characters than letters and digits as "_".
[[nodiscard]] std::string FieldWord(std::string_view name);

}  // namespace ecaudit::cli
