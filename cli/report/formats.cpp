#include "cli/report/formats.h"

#include <array>

#include "cli/report/json_writer.h"

namespace ecaudit::report {
namespace {

std::string WriteJsonPlain(const Report& report, const TextStyle& /*style*/) {
  return WriteJson(report);
}

constexpr std::array kFormats{
    Format{"text", ".txt", &WriteText},
    Format{"json", ".json", &WriteJsonPlain},
};

}  // namespace

std::span<const Format> Formats() {
  return kFormats;
}

const Format* FindFormat(std::string_view name) {
  for (const Format& format : kFormats) {
    if (format.name == name) return &format;
  }
  return nullptr;
}

const Format* FormatOfPath(std::string_view path) {
  for (const Format& format : kFormats) {
    if (path.ends_with(format.extension)) return &format;
  }
  return nullptr;
}

}  // namespace ecaudit::report
