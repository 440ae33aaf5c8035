/// Words for the steps of a start-up, from what the slave, its family and the standard call things.
#pragma once

#include <string>
#include <utility>

#include "analyzers/result/expectation.h"
#include "analyzers/result/startup_summary.h"
#include "decoder/base/bytes.h"

namespace ecaudit::model {
struct SlaveModel;
}  // namespace ecaudit::model

namespace ecaudit::startup {

/// "SM2", "1C12h:0 RxPDO assignment: Number of entries", "SAFEOP requested".
/// @param length  bytes of a register write
/// @param slave   null: the bus, or not known
[[nodiscard]] std::string StepName(const StartupKey& key, std::size_t length, const model::SlaveModel* slave);
/// "0x1100 6 bytes, buffered, ECAT writes, enabled", "7 (0x07)"; empty where a step has no value.
[[nodiscard]] std::string StepValue(const StartupKey& key, ByteSpan data, const model::SlaveModel* slave);
/// The same for a step that is expected; "any value".
/// @param bytes  length of the actual value; a number is then shown in the form of that value
[[nodiscard]] std::string ExpectedValue(const ExpectedStep& step, const model::SlaveModel* slave, std::size_t bytes);
/// Where two values of a structure differ, as pairs of texts: "length 1024 bytes" and "length 512 bytes" of a sync
/// manager. Empty for all else, and where nearly everything differs: then the whole values show more.
[[nodiscard]] std::pair<std::string, std::string> DifferingParts(const StartupKey& key, ByteSpan a, ByteSpan b);
/// StepName() of a step that is expected; a drive's command is called as the expectation calls it.
[[nodiscard]] std::string ExpectedName(const ExpectedStep& step, const model::SlaveModel* slave);
/// "write of SM2 (0x0810)", "download of 6060h:0 Modes of operation", "request of SAFEOP": a step as a noun.
[[nodiscard]] std::string StepNoun(const StartupKey& key, const std::string& name);

}  // namespace ecaudit::startup
