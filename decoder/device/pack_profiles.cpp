// Run while the program is built: PROFILE.json TARGET writes TARGET.cbor, TARGET.head and TARGET.objects. Silent; the
// exit status reports it.
#include <charconv>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "decoder/base/cbor.h"
#include "decoder/base/json.h"
#include "decoder/device/profile_reader.h"

namespace {

bool Write(const std::string& path, const std::string& packed, bool may_be_empty = false) {
  std::ofstream out(path, std::ios::binary);
  out << packed;
  out.close();
  return (may_be_empty || !packed.empty()) && out.good();
}

/// Indices of the objects that the profile itself has rows of, ascending, 16 bit each, low byte first; nothing where
/// one is no index.
std::optional<std::string> ObjectsIn(const std::string& text) {
  const ecaudit::JsonReading read = ecaudit::ReadJson(text);
  if (!read.document) return std::nullopt;
  std::set<std::uint16_t> indices;
  for (const std::string_view section : {"dictionary", "drive"}) {
    for (const ecaudit::JsonValue row : read.document->root().member(section).member("objects").Elements()) {
      const std::string_view* const index = row.member("index").text();
      if (index == nullptr || !index->starts_with("0x")) return std::nullopt;
      std::uint16_t number = 0;
      const auto [end, error] = std::from_chars(index->data() + 2, index->data() + index->size(), number, 16);
      if (error != std::errc() || end != index->data() + index->size()) return std::nullopt;
      indices.insert(number);
    }
  }
  std::string packed;
  for (const std::uint16_t index : indices) {
    packed += static_cast<char>(index & 0xFFU);
    packed += static_cast<char>(index >> 8U);
  }
  return packed;
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 3) return 2;
  std::ifstream file(arguments[1], std::ios::binary);
  const std::string text(std::istreambuf_iterator<char>(file), {});
  const std::string target = arguments[2];
  const std::optional<std::string> objects = ObjectsIn(text);
  const bool written = objects && Write(target + ".cbor", ecaudit::CborOf(text)) &&
                       Write(target + ".head", ecaudit::CborOf(text, ecaudit::device::kHeadKeys)) &&
                       Write(target + ".objects", *objects, true);
  return written ? 0 : 1;
}
