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

}  // namespace ecaudit::report
