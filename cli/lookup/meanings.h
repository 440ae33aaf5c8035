/// The parts of LookUp(): each knows one kind of number.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cli/lookup/meaning.h"

namespace ecaudit::cli::lookup {

/// Adds what the standard states, and then what each family states in its own words.
/// @param statement_of  gives nothing where the family has no such row; what a family only inherits is the standard's
template <typename StatementOf>
void AddStatements(const Families& families, Meaning& meaning, StatementOf statement_of) {
  const device::DeviceDescription* generic = nullptr;
  for (const device::DeviceDescription* family : families) {
    if (family->id == "generic") generic = family;
  }
  std::optional<Statement> standard;
  if (generic != nullptr) standard = statement_of(*generic);
  if (standard) {
    standard->family = "standard";
    meaning.statements.push_back(*standard);
  }
  for (const device::DeviceDescription* family : families) {
    if (family == generic) continue;
    std::optional<Statement> own = statement_of(*family);
    if (!own || (standard && own->source == standard->source && own->text == standard->text)) continue;
    own->family = family->id;
    meaning.statements.push_back(std::move(*own));
  }
}

void AddAlStatusCode(std::uint16_t code, const Families& families, std::vector<Meaning>& out);
/// What leads to the code, as far as the standard and the usual devices have it; empty where nothing is usual.
[[nodiscard]] std::string_view UsualCauses(std::uint16_t al_status_code);
/// "6041h=0x1237": the bits and what they come to.
void AddValue(std::uint16_t index, std::uint64_t value, const Families& families, std::vector<Meaning>& out);
void AddAlState(std::string_view name, const Families& families, std::vector<Meaning>& out);
void AddSdoAbort(std::uint32_t code, std::vector<Meaning>& out);
void AddMailboxError(std::uint16_t detail, std::vector<Meaning>& out);
void AddEmergency(std::uint16_t code, const Families& families, std::vector<Meaning>& out);
/// @param letter  'F', 'n', ... in any case; 0: any
void AddDriveNumber(char letter, std::uint32_t number, const Families& families, std::vector<Meaning>& out);
void AddObject(std::uint16_t index, std::optional<std::uint8_t> subindex, const Families& families,
               std::vector<Meaning>& out);
void AddRegister(std::uint16_t address, const Families& families, std::vector<Meaning>& out);
/// The name of a mode, and the parameters of the drive that go with it.
[[nodiscard]] std::string ModeWithParameters(const device::DriveProfile& drive, const device::OperationMode& mode);
/// Rows with that name, in any case, as a manual prints names: a parameter, a number that a drive shows, a command.
/// Names have capitals or digits (SERCSET, n17); words of sentences are none.
void AddNamed(std::string_view name, const Families& families, std::vector<Meaning>& out);
void AddCommand(std::string_view name, std::vector<Meaning>& out);

}  // namespace ecaudit::cli::lookup
