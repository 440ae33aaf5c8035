/// The small parts that every section of the JSON report is made of: what is not known is null, text is printable.
#pragma once

#include <optional>
#include <string_view>

#include <nlohmann/json.hpp>

#include "cli/report/layout.h"
#include "decoder/base/ids.h"

namespace ecaudit::report {

using Json = nlohmann::ordered_json;

/// Printable text, line breaks kept.
inline Json Text(std::string_view text) {
  return PrintableLines(text);
}

/// As Text(); null for an empty text.
inline Json TextOrNull(std::string_view text) {
  return text.empty() ? Json(nullptr) : Text(text);
}

/// The value, or null where it is unknown.
template <typename T>
Json OrNull(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}

/// A frame number of the capture, from 1; 0 stands for no frame and becomes null.
inline Json FrameOrNull(FrameNo frame) {
  return frame == 0 ? Json(nullptr) : Json(frame);
}
inline Json FrameOrNull(const FrameRef& frame) {
  return FrameOrNull(frame.number);
}

}  // namespace ecaudit::report
