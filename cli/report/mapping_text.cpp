#include "cli/report/mapping_text.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "cli/report/layout.h"
#include "decoder/base/text.h"

namespace ecaudit::report {
namespace {

constexpr std::size_t kRowsShown = 24;
constexpr std::size_t kColumns = 5;
using Cells = std::array<std::string, kColumns>;

std::string LengthText(std::uint32_t bits) {
  return bits % 8 == 0 ? Count(bits / 8, "byte") : Count(bits, "bit");
}

std::string PlaceText(const std::optional<std::uint32_t>& bit) {
  if (!bit) return "-";
  std::string text = "byte " + std::to_string(*bit / 8);
  if (*bit % 8 != 0) text += " bit " + std::to_string(*bit % 8);
  return text;
}

std::string HeadOf(const MappingTable& table) {
  std::string text = "mapping    " + std::string(table.outputs ? "outputs" : "inputs") + " (SM" +
                     std::to_string(table.sync_manager) + ")";
  std::string lengths;
  const auto add = [&](std::string_view what, const std::string& length) {
    lengths += (lengths.empty() ? ": " : ", ") + std::string(what) + " " + length;
  };
  if (table.wanted_bits) add("wanted", LengthText(*table.wanted_bits));
  const bool doubtful = std::ranges::any_of(table.rows, &MappingRow::doubtful);
  if (table.slave_bits) add(doubtful ? "in the slave maybe" : "in the slave", LengthText(*table.slave_bits));
  if (table.manager_bytes) {
    add("sync manager", Count(*table.manager_bytes, "byte"));
    if (table.manager_frame != 0) lengths += " (frame " + std::to_string(table.manager_frame) + ")";
  }
  if (table.of_each_pdo) lengths += lengths.empty() ? ": places of each PDO" : "; places of each PDO";
  return text + lengths;
}

}  // namespace

std::vector<std::string> MappingLines(const MappingTable& table) {
  std::vector<std::string> lines{HeadOf(table)};
  std::vector<Cells> rows{{"entry", "wanted", "slave", "wanted at", "slave at"}};
  for (const MappingRow& row : table.rows) {
    if (rows.size() > kRowsShown) break;
    // Of an assignment, or of a number of entries.
    const bool placed = row.wanted_bit || row.slave_bit;
    std::string slave_place = placed ? PlaceText(row.slave_bit) : std::string();
    if (row.shifted) slave_place += ", shifted";
    if (row.doubtful && row.slave_bit && row.slave_bit != row.wanted_bit) slave_place += "?";
    rows.push_back({ObjectName(row.list, row.subindex), row.wanted.empty() ? "-" : row.wanted, row.slave,
                    placed ? PlaceText(row.wanted_bit) : std::string(), slave_place});
  }
  std::array<std::size_t, kColumns> width{};
  for (const Cells& cells : rows) {
    for (std::size_t i = 0; i < kColumns; ++i) width[i] = std::max(width[i], Columns(cells[i]));
  }
  for (const Cells& cells : rows) {
    std::string line = "  ";
    for (std::size_t i = 0; i < kColumns; ++i) {
      line += i + 1 < kColumns ? Padded(cells[i], width[i] + 2) : cells[i];
    }
    std::ranges::replace(line, kHardSpace, ' ');
    while (line.ends_with(' ')) line.pop_back();
    lines.push_back(line);
  }
  const std::size_t shown = rows.size() - 1;
  const std::size_t all = table.rows.size() + table.rows_left_out;
  if (all > shown) lines.push_back("  and " + Count(all - shown, "more entry", "more entries"));
  return lines;
}

}  // namespace ecaudit::report
