#include "analyzers/signals/signal_value.h"

#include <charconv>
#include <cmath>
#include <cstring>

namespace ecaudit::signals {
namespace {

using mailbox::DataType;

template <typename Real, typename Bits>
double AsReal(std::uint64_t raw) {
  const Bits bits = static_cast<Bits>(raw);
  Real value = 0;
  static_assert(sizeof value == sizeof bits);
  std::memcpy(&value, &bits, sizeof value);
  return static_cast<double>(value);
}

std::optional<double> Number(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

SignalValue ReadSignal(DataType type, unsigned bits, std::uint64_t raw) {
  if (type == DataType::kReal32 && bits == 32) return AsReal<float, std::uint32_t>(raw);
  if (type == DataType::kReal64 && bits == 64) return AsReal<double, std::uint64_t>(raw);
  if (!mailbox::IsSigned(type) || bits == 0 || bits > 64) return raw;
  return SignExtend(raw, bits);
}

std::optional<double> DivisorOf(std::string_view scale) {
  const std::size_t colon = scale.find(':');
  if (colon == std::string_view::npos) return std::nullopt;
  const std::optional<double> wire = Number(scale.substr(0, colon));
  const std::optional<double> unit = Number(scale.substr(colon + 1));
  if (!wire || !unit || !(*wire > 0) || !(*unit > 0) || !std::isfinite(*wire / *unit)) return std::nullopt;
  return *wire / *unit;
}

SignalValue Scaled(const SignalValue& value, double divisor) {
  if (divisor == 1.0) return value;
  return std::visit([divisor](auto number) { return static_cast<double>(number) / divisor; }, value);
}

}  // namespace ecaudit::signals
