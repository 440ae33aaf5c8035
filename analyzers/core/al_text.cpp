#include "analyzers/core/al_text.h"

#include "decoder/base/text.h"
#include "decoder/esc/al.h"

namespace ecaudit {

std::string CodeText(std::uint16_t code, const device::DeviceDescription& family) {
  const device::AlStatusCode* entry = family.al_status_code(code);
  std::string name = entry != nullptr ? entry->name : std::string(esc::AlStatusCodeName(code));
  if (name.empty() && family.al.vendor_codes_from && code >= *family.al.vendor_codes_from) name = "vendor specific";
  return Hex(code) + (name.empty() ? "" : " (" + name + ")");
}

std::string TransitionText(const model::AlRequestRecord& request) {
  const std::string to = esc::StateName(request.control.state());
  return request.from == 0 ? to : esc::StateName(request.from) + " to " + to;
}

std::string RequestText(const model::AlRequestRecord& request) {
  return esc::StateName(request.control.state()) + " (AL Control " + Hex(request.control.raw) + ")";
}

std::uint64_t RequestKey(const model::AlRequestRecord& request) {
  return static_cast<std::uint64_t>(request.from) << 8U | request.control.state();
}

std::string RepetitionText(const model::AlRequestRecord& request) {
  if (request.repetitions == 0) return {};
  return " (written " + Count(request.repetitions + 1, "time") + " up to frame " + std::to_string(request.last.number) +
         ")";
}

}  // namespace ecaudit
