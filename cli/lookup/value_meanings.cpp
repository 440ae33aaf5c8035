/// A value of an object: for the words of a drive the state and the bits that are set.
#include <string>

#include "analyzers/objects/object_names.h"
#include "analyzers/objects/object_words.h"
#include "cli/lookup/meanings.h"
#include "decoder/base/text.h"

namespace ecaudit::cli::lookup {
namespace {

constexpr std::uint16_t kControlWord = 0x6040;
constexpr std::uint16_t kStatusWord = 0x6041;
constexpr std::uint16_t kMode = 0x6060;
constexpr std::uint16_t kModeShown = 0x6061;

std::string BitsText(const std::vector<device::WordBit>& bits, std::uint64_t value) {
  std::string set;
  for (unsigned bit = 0; bit < 16; ++bit) {
    if ((value >> bit & 1U) == 0) continue;
    std::string name;
    for (const device::WordBit& row : bits) {
      if (row.bit == bit) name = row.name;
    }
    set += (set.empty() ? "" : ", ") + std::to_string(bit) + (name.empty() ? "" : " " + name);
  }
  return set.empty() ? "no bit is set" : "bits set: " + set;
}

std::optional<Statement> StatementOf(const device::DeviceDescription& family, std::uint16_t index,
                                     std::uint64_t value) {
  const bool word = index == kControlWord || index == kStatusWord || index == kMode || index == kModeShown;
  if (!word) {
    // An array of numbers has its first one in subindex 1.
    for (const std::uint8_t subindex : {std::uint8_t{0}, std::uint8_t{1}}) {
      const std::string words = events::WordsOf(family, index, subindex, value);
      if (words.empty()) continue;
      const device::DictionaryObject* row = family.object(index, subindex);
      return Statement{{}, words, {}, row == nullptr ? std::string() : row->source};
    }
    return std::nullopt;
  }
  if (!family.drive) return std::nullopt;
  const device::DriveProfile& drive = *family.drive;
  const auto source = [](const auto& rows) { return rows.empty() ? std::string() : rows.front().source; };
  if (index == kControlWord && value <= 0xFFFF) {
    return Statement{{}, BitsText(drive.control_bits, value), {}, source(drive.control_bits)};
  }
  if (index == kStatusWord && value <= 0xFFFF) {
    std::string state = "none of its states";
    for (const device::DriveStateRow& row : drive.states) {
      if (row.printed.Matches(static_cast<std::uint16_t>(value))) state = device::DriveStateName(row.state);
    }
    return Statement{{}, state + "; " + BitsText(drive.status_bits, value), {}, source(drive.states)};
  }
  if (index == kMode || index == kModeShown) {
    for (const device::OperationMode& mode : drive.modes) {
      if (static_cast<std::uint8_t>(mode.value) == value) return Statement{{}, mode.name, mode.note, mode.source};
    }
    return Statement{{}, "none of its modes", {}, source(drive.modes)};
  }
  return std::nullopt;
}

}  // namespace

void AddValue(std::uint16_t index, std::uint64_t value, const Families& families, std::vector<Meaning>& out) {
  Meaning meaning{.kind = "value of an object",
                  .name = ObjectName(index) + " = " +
                          Hex(value, value <= 0xFF     ? 2
                                     : value <= 0xFFFF ? 4
                                                       : 8),
                  .details = {},
                  .statements = {}};
  meaning.details.emplace_back("decimal", std::to_string(value));
  AddStatements(families, meaning,
                [&](const device::DeviceDescription& family) { return StatementOf(family, index, value); });
  if (index == 0x603F && value <= 0xFFFF) AddEmergency(static_cast<std::uint16_t>(value), families, out);
  out.insert(out.begin(), std::move(meaning));
}

}  // namespace ecaudit::cli::lookup
