#include "analyzers/model/drive_places.h"

#include <algorithm>

#include "analyzers/model/drive_axes.h"
#include "analyzers/model/drive_events.h"
#include "analyzers/model/process_image.h"
#include "analyzers/model/terminal_objects.h"

namespace ecaudit::model {
namespace {

constexpr std::uint16_t kFirstOfAxis = 0x6000;  ///< objects before are the device's

/// DrivePart::bytes
std::size_t BytesOf(const DrivePart& part) {
  std::size_t bytes = 0;
  const auto add = [&bytes](const std::optional<std::uint32_t>& bit, std::size_t length) {
    if (bit) bytes = *bit % 8 != 0 ? DrivePart::kNone : std::max(bytes, *bit / 8 + length);
  };
  for (std::size_t i = 0; i < part.controls; ++i) add(part.control[i], 2);
  add(part.status, 2);
  add(part.mode, 1);
  add(part.mode_shown, 1);
  add(part.error_code, 2);
  return bytes;
}

}  // namespace

void DrivePlaces::SetFamily(const device::DriveProfile* drive) {
  drive_ = drive;
  parts_.clear();
  next_ = 0;
  last_ = {};
}

const DrivePart& DrivePlaces::Of(const ImagePart& part) {
  if (part.places.empty()) {
    static const DrivePart kNowhere;
    return kNowhere;
  }
  const DrivePart*& last = last_[part.direction == device::PdoDirection::kRx ? 0 : 1];
  for (const DrivePart& known : parts_) {
    if (known.serial == part.serial) return *(last = &known);
  }
  if (parts_.empty()) parts_.resize(kParts);
  DrivePart& places = parts_[next_];
  last = &places;
  next_ = (next_ + 1) % parts_.size();
  places = {};
  places.serial = part.serial;
  const TerminalObjects terminal(part);
  for (const ImagePart::Place& place : part.places) {
    const std::uint32_t object = terminal.InCia402(place.object, place.bits);
    const auto index_mapped = static_cast<std::uint16_t>(object >> 8U);
    const auto subindex = static_cast<std::uint8_t>(object);
    if (const auto axis = DriveAxes::AxisOfWord(index_mapped, subindex, place.bits)) {
      places.axes = static_cast<std::uint8_t>(places.axes | 1U << *axis);
    }
    const auto is = [&](std::uint16_t index, unsigned bits) {
      return InFirstAxis(index_mapped) == index && subindex == 0 && place.bits == bits;
    };
    if (part.direction == device::PdoDirection::kRx) {
      if (is(kControlWord, 16) && places.controls < places.control.size())
        places.control[places.controls++] = place.bit;
      if (is(kModesOfOperation, 8)) places.mode = place.bit;
    } else {
      if (is(kStatusWord, 16)) places.status = place.bit;
      if (is(kModesDisplay, 8)) places.mode_shown = place.bit;
      if (MapsErrorCode(object, place.bits)) {
        places.error_code = place.bit;
        places.error_object = InFirstAxis(index_mapped);
      }
    }
  }
  places.bytes = BytesOf(places);
  places.known = places.controls > 0 || places.mode || places.status || places.mode_shown || places.error_code;
  return places;
}

bool DrivePlaces::MapsErrorCode(std::uint32_t object, std::uint16_t bits) const {
  const device::FaultObject* row =
      drive_->FindFaultObject(InFirstAxis(static_cast<std::uint16_t>(object >> 8U)), static_cast<std::uint8_t>(object));
  return row != nullptr && row->kind == device::FaultValue::kErrorCode && row->bits == bits && bits == 16;
}

std::uint16_t DrivePlaces::InFirstAxis(std::uint16_t index) const {
  if (index < kFirstOfAxis) return index;  // of the device
  const std::uint16_t first = ObjectOfAxis(kFirstOfAxis, axis_);
  const bool own = index >= first && index < ObjectOfAxis(first, 1);
  return own ? static_cast<std::uint16_t>(kFirstOfAxis + (index - first)) : std::uint16_t{0};
}

}  // namespace ecaudit::model
