/// The bits of a signal as a value of its type.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <variant>

#include "decoder/mailbox/coe_types.h"

namespace ecaudit::signals {

/// An integer without or with sign, or a real. Booleans and types without a number are unsigned.
using SignalValue = std::variant<std::uint64_t, std::int64_t, double>;

/// @param raw  the bits, little endian, zero above
/// @param bits  of the signal, 1-64; what is mapped may be a part of the object (its low half)
[[nodiscard]] SignalValue ReadSignal(mailbox::DataType type, unsigned bits, std::uint64_t raw);

/// What a number on the wire is divided by: "1000:1" gives 1000, "1:1" gives 1. Nothing when the scale is no such ratio
/// ("var", empty).
[[nodiscard]] std::optional<double> DivisorOf(std::string_view scale);

/// `value` divided; as it is where `divisor` is 1.
[[nodiscard]] SignalValue Scaled(const SignalValue& value, double divisor);

}  // namespace ecaudit::signals
