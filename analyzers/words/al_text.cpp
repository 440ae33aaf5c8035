#include "analyzers/words/al_text.h"

#include <algorithm>

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

bool FollowsStandard(const device::DeviceDescription& family) {
  const device::DeviceDescription* generic = device::BuiltinProfile("generic");
  return generic == nullptr || family.al.source == generic->al.source;
}

void SetManual(Finding& finding, const device::DeviceDescription& family) {
  if (!FollowsStandard(family)) finding.Set("manual", arg::Text(family.title));
}

void SetKnownCause(Finding& finding, const device::DeviceDescription& family, std::optional<esc::AlWord> before,
                   esc::AlWord status, std::uint16_t code) {
  const auto known = std::ranges::find_if(family.al.spontaneous, [&](const device::SpontaneousAlChange& row) {
    return (!before || static_cast<std::uint8_t>(row.from) == before->state()) &&
           static_cast<std::uint8_t>(row.to) == status.state() && std::ranges::find(row.codes, code) != row.codes.end();
  });
  if (known == family.al.spontaneous.end()) return;
  finding.Set("known_cause", arg::Text(known->cause));
  SetManual(finding, family);
  finding.reference = ReferenceTo(known->source);
}

std::uint64_t RequestKey(const model::AlRequestRecord& request) {
  return static_cast<std::uint64_t>(request.from) << 8U | request.control.state();
}

void SetRepetition(Finding& finding, const model::AlRequestRecord& request) {
  if (request.repetitions == 0) return;
  finding.Set("times", arg::Count(request.repetitions + 1, "time"));
  finding.Set("last_request_frame", arg::Frame(request.last.number));
}

}  // namespace ecaudit
