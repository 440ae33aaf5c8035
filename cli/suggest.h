/// Helps with a mistyped name.
#pragma once

#include <span>
#include <string>
#include <string_view>

namespace ecaudit::cli {

/// The candidate that `typed` most likely meant; empty when none is near (more than a third of the letters differ).
[[nodiscard]] std::string_view Nearest(std::string_view typed, std::span<const std::string_view> candidates);

/// " (did you mean 'NAME'?)" where a candidate is near, or the few of which `typed` is a part; else " (see 'HINT')";
/// nothing when `hint` is empty too.
[[nodiscard]] std::string Suggestion(std::string_view typed, std::span<const std::string_view> candidates,
                                     std::string_view hint);

}  // namespace ecaudit::cli
