#include "analyzers/collect/event_collector.h"

#include "decoder/device/event_names.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/esc/register_text.h"

namespace ecaudit {
namespace {

std::vector<std::string> NamesOf(std::uint32_t value, EscAddress address, const device::DeviceDescription& family) {
  std::vector<std::string> names;
  for (unsigned bit = 0; bit < 32; ++bit) {
    if ((value >> bit & 1U) != 0) names.push_back(device::EventBitName(family, address, bit));
  }
  return names;
}

}  // namespace

std::vector<EventBitSummary> SummariseEventField(std::span<const model::EventUnit::Story> stories) {
  std::vector<EventBitSummary> bits;
  for (unsigned bit = 0; bit < stories.size(); ++bit) {
    const model::EventUnit::Story& story = stories[bit];
    if (story.raised == 0) continue;
    bits.push_back({static_cast<std::uint8_t>(bit), esc::EventBitName(esc::kEcatEventRequest, bit), story.raised,
                    story.frames, story.first, story.last, story.from_start, story.at_end, story.inferred});
  }
  return bits;
}

EventSummary SummariseEvents(const model::BusModel& model, SlaveId slave) {
  EventSummary summary;
  const model::EventUnit::Slave& known = model.signalled().slave(slave);
  const device::DeviceDescription& family = *model.slave(slave).profile;
  summary.signalled = SummariseEventField(known.signalled);
  const auto take = [&](std::optional<EventRegister>& to, const std::optional<model::EventUnit::Reading>& from,
                        EscAddress address) {
    if (from)
      to = EventRegister{from->value, from->read, NamesOf(from->value, address, family), false, from->frame.number};
  };
  take(summary.ecat_request, known.ecat_request, esc::kEcatEventRequest);
  take(summary.al_mask, known.al_mask, esc::kAlEventMask);
  take(summary.al_request, known.al_request, esc::kAlEventRequest);
  const esc::RegisterImage& registers = model.network().state(slave).registers;
  if (const auto mask = registers.Value<std::uint16_t>(esc::kEcatEventMask)) {
    const bool inferred = registers.CertaintyOf(esc::kEcatEventMask, 2) != Certainty::kObserved;
    summary.ecat_mask =
        EventRegister{*mask, 0xFFFF, NamesOf(*mask, esc::kEcatEventMask, family), inferred, known.mask_frame.number};
  }
  return summary;
}

}  // namespace ecaudit
