/// How a person writes the values of findings: the only place that decides hexadecimal or decimal, units and plurals.
#pragma once

#include <string>
#include <string_view>

#include "analyzers/result/argument.h"

namespace ecaudit::report {

enum class Form : std::uint8_t {
  kWhole,    ///< "0x001d (Invalid output configuration)", "frame 112"
  kNumber,   ///< without its meaning: "0x001d", "112"
  kMeaning,  ///< without the number: "Invalid output configuration"; empty where it has none
};

/// Untrusted texts are made printable.
[[nodiscard]] std::string TextOf(const Value& value, Form form = Form::kWhole);
/// "al-status": public interface.
[[nodiscard]] std::string_view Name(Value::Type type);
/// Whether the number takes a plural.
[[nodiscard]] bool IsPlural(const Value& value);

}  // namespace ecaudit::report
