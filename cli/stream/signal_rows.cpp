#include "cli/stream/signal_rows.h"

#include <cmath>
#include <variant>

#include "analyzers/signals/signal_value.h"
#include "cli/stream/json_line.h"

namespace ecaudit::cli {

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
