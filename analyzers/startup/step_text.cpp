#include "analyzers/startup/step_text.h"

#include "analyzers/events/object_value.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/text.h"
#include "decoder/esc/register_map.h"
#include "decoder/esc/register_text.h"

namespace ecaudit::startup {
namespace {

const events::ObjectNames& NamesOf(const model::SlaveModel* slave) {
  static const events::ObjectNames kNone;
  return slave != nullptr ? slave->names : kNone;
}

const device::DeviceDescription* ProfileOf(const model::SlaveModel* slave) {
  return slave != nullptr ? slave->profile : nullptr;
}

}  // namespace

std::string StepName(const StartupKey& key, std::size_t length, const model::SlaveModel* slave) {
  switch (key.kind) {
    case StartupKey::Kind::kWrite: {
      const auto address = static_cast<EscAddress>(key.address);
      std::string name = esc::AccessName(address, length == 0 ? 1 : length);
      return name.empty() ? Hex(address) : name;
    }
    case StartupKey::Kind::kEeprom:
      return "EEPROM word " + Hex(key.address);
    case StartupKey::Kind::kRequest:
      return esc::StateName(static_cast<std::uint8_t>(key.address)) + " requested";
    case StartupKey::Kind::kDownload:
    case StartupKey::Kind::kUpload: {
      const auto index = static_cast<std::uint16_t>(key.address);
      const events::ObjectInfo info = key.complete_access ? NamesOf(slave).FindWhole(ProfileOf(slave), index)
                                                          : NamesOf(slave).Find(ProfileOf(slave), index, key.subindex);
      std::string name = ObjectName(index, key.subindex);
      if (key.complete_access) name += " (complete)";
      if (!info.name.empty()) name += " " + Printable(info.name);
      return name;
    }
    case StartupKey::Kind::kDrive:
      break;
  }
  return "control word " + Hex(key.address);
}

std::string StepValue(const StartupKey& key, ByteSpan data, const model::SlaveModel* slave) {
  if (data.empty()) return {};
  switch (key.kind) {
    case StartupKey::Kind::kWrite:
      return esc::DescribeAccess(static_cast<EscAddress>(key.address), data, esc::AccessKind::WRITE);
    case StartupKey::Kind::kEeprom:
      return Fits(data, 0, 2) ? Hex(LittleEndian<std::uint16_t>(data, 0)) : HexBytes(data);
    case StartupKey::Kind::kDownload:
    case StartupKey::Kind::kUpload: {
      const auto index = static_cast<std::uint16_t>(key.address);
      const events::ObjectValue value =
          key.complete_access ? events::ReadCompleteAccess(NamesOf(slave), ProfileOf(slave), index, key.subindex, data)
                              : events::ReadValue(NamesOf(slave), ProfileOf(slave), index, key.subindex, data);
      return value.text.empty() ? HexBytes(data) : value.text;
    }
    case StartupKey::Kind::kRequest:
    case StartupKey::Kind::kDrive:
      break;
  }
  return {};
}

std::string ExpectedValue(const ExpectedStep& step, const model::SlaveModel* slave) {
  if (step.number) return std::to_string(*step.number);
  if (step.data) return StepValue(step.key, *step.data, slave);
  return "any value";
}

std::string ExpectedName(const ExpectedStep& step, const model::SlaveModel* slave) {
  if (step.key.kind == StartupKey::Kind::kDrive && !step.name.empty()) return step.name;
  return StepName(step.key, step.data ? step.data->size() : 0, slave);
}

std::string StepNoun(const StartupKey& key, const std::string& name) {
  switch (key.kind) {
    case StartupKey::Kind::kWrite:
      return "write of " + name + " (" + Hex(key.address) + ")";
    case StartupKey::Kind::kEeprom:
      return "write of " + name;
    case StartupKey::Kind::kRequest:
      return "request of " + esc::StateName(static_cast<std::uint8_t>(key.address));
    case StartupKey::Kind::kDownload:
      return "download of " + name;
    case StartupKey::Kind::kUpload:
      return "upload of " + name;
    case StartupKey::Kind::kDrive:
      break;
  }
  return "drive command " + name;
}

}  // namespace ecaudit::startup
