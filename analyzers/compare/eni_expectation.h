/// An ENI as an expectation: what its init commands make a master send on the way up to OP.
#pragma once

#include "analyzers/result/expectation.h"
#include "decoder/device/eni_reader.h"

namespace ecaudit::startup {

/// Register writes and SDO transfers of the transitions I->P, P->S and S->O, with the state requests between them.
/// Reads and checks of states are left out, as are commands of the EEPROM interface and values that a master puts in
/// itself (clock times, offsets). Source: ETG2100, init commands.
/// @param name  of the file, for people
[[nodiscard]] Expectation ExpectationOf(const device::EniConfig& eni, std::string name);

}  // namespace ecaudit::startup
