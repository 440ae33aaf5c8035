/// Fuzzes the reader of drive profiles, and the lookups on what it accepted.
///
/// Input: the JSON text of a profile. "extends" finds a small profile with registers and an AL table.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "decoder/device/profile_reader.h"

namespace ecaudit::device {
namespace {

constexpr std::string_view kBase = R"({"schema": "ecaudit.profile/1", "id": "base", "title": "t", "document": "d",
  "al": {"source": "s", "status_codes": [{"code": 17, "name": "n", "source": "s"}],
         "transitions": [{"from": "INIT", "to": "PREOP", "allowed": true, "basis": "printed", "source": "s"}]},
  "registers": [{"address": "0x0120", "length": 2, "name": "n", "ecat": "rw", "source": "s"}]})";

void Check(bool condition) {
  if (!condition) std::abort();
}

void Use(const DeviceDescription& profile) {
  for (std::size_t i = 1; i < profile.registers.size(); ++i) {
    const RegisterRight& before = profile.registers[i - 1];
    Check(before.address + before.length <= profile.registers[i].address);
  }
  for (unsigned address = 0; address < 0x10000; address += 0x10) {
    const RegisterRight* right = profile.register_right(static_cast<EscAddress>(address));
    Check(right == nullptr || right->Covers(static_cast<EscAddress>(address)));
  }
  for (const AlTransition& row : profile.al.transitions) Check(profile.al_transition(row.from, row.to) == &row);
  for (const AlStatusCode& code : profile.al.status_codes) Check(profile.al_status_code(code.code) == &code);
  if (profile.dictionary) {
    for (const DictionaryObject& object : profile.dictionary->objects) {
      const DictionaryObject* found = object.head ? profile.dictionary->FindIndex(object.index)
                                                  : profile.dictionary->Find(object.index, object.last_subindex);
      Check(found == &object);
      static_cast<void>(object.AllowsBits(object.subindex, 32));
    }
  }
  for (const PdoContent& pdo : profile.pdo.fixed) Check(profile.pdo.FindFixed(pdo.index) == &pdo);
  for (unsigned index = 0; index < 0x10000; index += 0x101) {
    static_cast<void>(profile.object_name(static_cast<std::uint16_t>(index), 0));
    static_cast<void>(profile.MappableIn(PdoDirection::kTx, static_cast<std::uint16_t>(index), 1));
    static_cast<void>(profile.emergency_code(static_cast<std::uint16_t>(index)));
    if (profile.drive) {
      static_cast<void>(profile.drive->StateOf(static_cast<std::uint16_t>(index)));
      static_cast<void>(profile.drive->Commanded(DriveState::kSwitchedOn, 0, static_cast<std::uint16_t>(index)));
    }
    if (profile.latch) static_cast<void>(profile.latch->Selector(static_cast<std::uint16_t>(index)));
  }
  static_cast<void>(profile.sync.FindJitter(1'000'000));
}

}  // namespace
}  // namespace ecaudit::device

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using ecaudit::device::DeviceDescription;
  static const auto base = ecaudit::device::ReadProfile(ecaudit::device::kBase, nullptr);
  if (!base) std::abort();
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto lookup = [&](std::string_view id) -> const DeviceDescription* { return id == "base" ? &*base : nullptr; };
  const auto profile = ecaudit::device::ReadProfile(text, lookup);
  if (profile) {
    ecaudit::device::Use(*profile);
  } else if (profile.error().message.empty()) {
    std::abort();
  }
  static_cast<void>(ecaudit::device::ReadProfileHead(text));
  return 0;
}
