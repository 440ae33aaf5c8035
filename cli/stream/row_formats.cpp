#include <array>
#include <cmath>
#include <variant>

#include "analyzers/signals/signal_value.h"
#include "cli/stream/json_line.h"
#include "cli/stream/row_sink.h"

namespace ecaudit::cli {
namespace {

constexpr std::array kRowFormats{
    RowFormat{{"csv", ".csv"}, "csv", &MakeCsvRows},
    RowFormat{{"jsonl", ".jsonl"}, "jsonl: one JSON object a line", &MakeJsonRows},
};

}  // namespace

std::span<const RowFormat> RowFormats() {
  return kRowFormats;
}

std::string RowFormatsHelp() {
  std::string help;
  for (std::size_t i = 0; i < kRowFormats.size(); ++i) {
    help += i == 0 ? "" : i + 1 < kRowFormats.size() ? ", " : " or ";
    help += kRowFormats[i].help;
    if (i == 0) help += " (default)";
  }
  return help;
}

NumberForm FormOf(const SignalColumn& column) {
  if (column.kind != ColumnKind::kSignal || column.divisor != 1.0) return NumberForm::kOther;
  const signals::SignalValue none = signals::ReadSignal(column.type, column.bits, 0);
  if (std::holds_alternative<std::uint64_t>(none)) return NumberForm::kNatural;
  return std::holds_alternative<std::int64_t>(none) ? NumberForm::kInteger : NumberForm::kOther;
}

void AppendValue(std::string& out, const SignalColumn& column, std::uint64_t raw, std::string_view not_finite) {
  const signals::SignalValue value =
      signals::Scaled(signals::ReadSignal(column.type, column.bits, raw), column.divisor);
  if (const auto* natural = std::get_if<std::uint64_t>(&value)) {
    AppendNumber(out, *natural);
  } else if (const auto* integer = std::get_if<std::int64_t>(&value)) {
    AppendNumber(out, *integer);
  } else if (const double real = std::get<double>(value); std::isfinite(real)) {
    AppendJsonNumber(out, real);
  } else {
    out += not_finite;
  }
}

}  // namespace ecaudit::cli
