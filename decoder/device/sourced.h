/// A single fact with the place it comes from.
#pragma once

#include <optional>
#include <string>

namespace ecaudit::device {

/// Unset `value`: no source states it; `note` may give the reason. A rule that needs it reports "not evaluable".
template <typename T>
struct Sourced {
  std::optional<T> value;
  std::string note;
  std::string source;

  explicit operator bool() const { return value.has_value(); }
  /// Only when set.
  const T& operator*() const { return *value; }
};

}  // namespace ecaudit::device
