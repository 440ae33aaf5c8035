#include "analyzers/words/al_text.h"

#include "decoder/base/text.h"
#include "decoder/device/profile_registry.h"
#include "decoder/esc/al.h"

namespace ecaudit {

namespace {

std::string CodeName(std::uint16_t code, const device::DeviceDescription& family) {
  const device::AlStatusCode* entry = family.al_status_code(code);
  std::string name = entry != nullptr ? entry->name : std::string(esc::AlStatusCodeName(code));
  if (name.empty() && family.al.vendor_codes_from && code >= *family.al.vendor_codes_from) name = "vendor specific";
  return name;
}

}  // namespace

std::string CodeText(std::uint16_t code, const device::DeviceDescription& family) {
  const std::string name = CodeName(code, family);
  return Hex(code) + (name.empty() ? "" : " (" + name + ")");
}

Value CodeValue(std::uint16_t code, const device::DeviceDescription& family) {
  return arg::Code(code, CodeName(code, family));
}

bool JudgedByStandard(const device::DeviceDescription& family) {
  const device::DeviceDescription* generic = device::BuiltinProfile("generic");
  return generic == nullptr || family.al.source == generic->al.source;
}

std::string LawText(const device::DeviceDescription& family) {
  if (JudgedByStandard(family)) return "The EtherCAT standard";
  return "The manual (" + family.title + ")";
}

std::string StatesText(model::StateSet states) {
  std::string out;
  for (const std::uint8_t state :
       {std::uint8_t{1}, std::uint8_t{2}, std::uint8_t{3}, std::uint8_t{4}, std::uint8_t{8}}) {
    if (states.contains(state)) out += (out.empty() ? "" : " or ") + esc::StateName(state);
  }
  return out.empty() ? "an unknown state" : out;
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

void SetRepetition(Finding& finding, const model::AlRequestRecord& request) {
  if (request.repetitions == 0) return;
  finding.Set("times", arg::Count(request.repetitions + 1, "time"));
  finding.Set("last_request_frame", arg::Frame(request.last.number));
}

std::string RepetitionText(const model::AlRequestRecord& request) {
  if (request.repetitions == 0) return {};
  return " (written " + Count(request.repetitions + 1, "time") + " up to frame " + std::to_string(request.last.number) +
         ")";
}

}  // namespace ecaudit
