/// Unsigned arithmetic that is meant to wrap (hashes, counters that run over). Everywhere else a wrap is a mistake, and
/// the integer sanitizers end the program there.
#pragma once

#include <concepts>

namespace ecaudit {

template <std::unsigned_integral T>
[[nodiscard]] constexpr T WrappingSum(T a, T b) {
  T sum{};
  static_cast<void>(__builtin_add_overflow(a, b, &sum));
  return sum;
}

template <std::unsigned_integral T>
[[nodiscard]] constexpr T WrappingDifference(T a, T b) {
  T difference{};
  static_cast<void>(__builtin_sub_overflow(a, b, &difference));
  return difference;
}

template <std::unsigned_integral T>
[[nodiscard]] constexpr T WrappingProduct(T a, T b) {
  T product{};
  static_cast<void>(__builtin_mul_overflow(a, b, &product));
  return product;
}

}  // namespace ecaudit
