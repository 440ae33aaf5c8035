#include "decoder/base/cbor.h"

#include <utility>

#include <nlohmann/json.hpp>

#include "decoder/base/json.h"

namespace ecaudit {

std::string CborOf(std::string_view text, std::span<const std::string_view> only) {
  const JsonReading reading = ReadJson(text);
  if (!reading.document || reading.repeated_key) return {};
  nlohmann::ordered_json document = nlohmann::ordered_json::parse(text);
  if (!only.empty() && document.is_object()) {
    nlohmann::ordered_json kept = nlohmann::ordered_json::object();
    for (const std::string_view key : only) {
      const std::string name(key);  // nlohmann-json 3.10 finds no view
      if (const auto member = document.find(name); member != document.end()) kept[name] = *member;
    }
    document = std::move(kept);
  }
  std::string cbor;
  nlohmann::ordered_json::to_cbor(document, cbor);
  return cbor;
}

}  // namespace ecaudit
