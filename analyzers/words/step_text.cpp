#include "analyzers/words/step_text.h"

#include <vector>

#include "analyzers/model/slave_model.h"
#include "analyzers/objects/object_value.h"
#include "decoder/base/text.h"
#include "decoder/esc/fmmu.h"
#include "decoder/esc/register_map.h"
#include "decoder/esc/register_text.h"
#include "decoder/esc/sync_manager.h"

namespace ecaudit::startup {
namespace {

const events::ObjectNames& NamesOf(const model::SlaveModel* slave) {
  static const events::ObjectNames kNone;
  return slave != nullptr ? slave->names : kNone;
}

const device::DeviceDescription* ProfileOf(const model::SlaveModel* slave) {
  return slave != nullptr ? slave->profile : nullptr;
}

/// A part of a structure that people speak of.
struct Part {
  std::string name;
  std::string a, b;
};

std::pair<std::string, std::string> Join(const std::vector<Part>& parts) {
  constexpr std::size_t kMost = 2;
  std::pair<std::string, std::string> out;
  std::size_t differing = 0;
  for (const Part& part : parts) {
    if (part.a == part.b) continue;
    if (++differing > kMost) return {};
    out.first += (out.first.empty() ? "" : ", ") + part.name + " " + part.a;
    out.second += (out.second.empty() ? "" : ", ") + part.name + " " + part.b;
  }
  return out;
}

std::string Bits(const esc::Fmmu& fmmu) {
  return std::to_string(fmmu.logical_start_bit) + "-" + std::to_string(fmmu.logical_stop_bit) + " to " +
         std::to_string(fmmu.physical_start_bit);
}

std::string Use(const esc::Fmmu& fmmu) {
  return std::string(fmmu.reads() ? "read" : "") + (fmmu.writes() ? "write" : "");
}

std::string OnOff(bool on) {
  return on ? "on" : "off";
}

}  // namespace

std::pair<std::string, std::string> DifferingParts(const StartupKey& key, ByteSpan a, ByteSpan b) {
  if (key.kind != StartupKey::Kind::kWrite || a.size() != b.size()) return {};
  const std::uint32_t address = key.address;
  const auto x = esc::SyncManager::Decode(a);
  const auto y = esc::SyncManager::Decode(b);
  if (address >= esc::kSyncManagerBase && address < 0x0880 && a.size() == esc::kSyncManagerBytes && x && y) {
    return Join({{"start", Hex(x->start), Hex(y->start)},
                 {"length", Count(x->length, "byte"), Count(y->length, "byte")},
                 {"control", Hex(x->control, 2), Hex(y->control, 2)},
                 {"enable", OnOff(x->enabled()), OnOff(y->enabled())}});
  }
  const auto f = esc::Fmmu::Decode(a);
  const auto g = esc::Fmmu::Decode(b);
  if (address >= 0x0600 && address < 0x0700 && a.size() == 16 && f && g) {
    return Join({{"logical address", Hex(f->logical_start, 8), Hex(g->logical_start, 8)},
                 {"length", Count(f->length, "byte"), Count(g->length, "byte")},
                 {"slave address", Hex(f->physical_start), Hex(g->physical_start)},
                 {"bits", Bits(*f), Bits(*g)},
                 {"use", Use(*f), Use(*g)},
                 {"active", OnOff(f->active()), OnOff(g->active())}});
  }
  return {};
}

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

std::string ExpectedValue(const ExpectedStep& step, const model::SlaveModel* slave, std::size_t bytes) {
  if (step.number) {
    std::vector<std::uint8_t> data;
    auto rest = static_cast<std::uint64_t>(*step.number);
    for (std::size_t i = 0; i < bytes && i < sizeof(rest); ++i, rest >>= 8) {
      data.push_back(static_cast<std::uint8_t>(rest & 0xFFU));
    }
    const bool fits =
        bytes >= sizeof(rest) || rest == 0 || (*step.number < 0 && rest + 1 == std::uint64_t{1} << (64 - 8 * bytes));
    std::string shown = fits ? StepValue(step.key, data, slave) : std::string();
    if (!shown.empty()) return shown;
    constexpr std::int64_t kPlain = 10;
    const std::string decimal = std::to_string(*step.number);
    return *step.number < kPlain ? decimal : decimal + " (" + Hex(static_cast<std::uint64_t>(*step.number), 1) + ")";
  }
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
