/// What a number or a short word of EtherCAT can mean, as plain data: `explain` prints it as text and as JSON.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "decoder/device/device_description.h"

namespace ecaudit::cli {

/// What one document states about it.
struct Statement {
  std::string family;  ///< "standard", or the id of a profile
  std::string text;
  std::string note;
  std::string source;  ///< "AKD-2011, 4.3.3": manual and section; empty where the note gives the reason
};

/// One of the things that the number can be.
struct Meaning {
  std::string_view kind;  ///< "AL status code"
  std::string name;       ///< "0x001d invalid output configuration"
  std::vector<std::pair<std::string, std::string>> details;
  std::vector<Statement> statements;
};

/// The families that are asked; the standard ("generic") is asked besides, and first.
using Families = std::vector<const device::DeviceDescription*>;

/// All that `what` can mean, the most likely first; empty when nothing is known of it.
///
///   "0x001d", "0x8611"          AL status code, register, object, emergency, mailbox error: whatever has that number
///   "0x06090011"                SDO abort code
///   "F125", "n125", "125"       number of a fault or warning that drives show
///   "6040h", "6040h:1", "0x1018:1"   object
///   "FPRD"                      datagram command
///   "6041h=0x1237"              a value of an object, with its bits
///   "6041", "1C12:1", "27"      the same without a mark: hexadecimal, and as a code decimal, too
///   "PREOP", "PREOP+ERR"        AL state
///   a parameter, a command      as a manual names it
///   "enabled"                   rung of the progress ladder
///   "axis does not move"        question that the rungs answer
[[nodiscard]] std::vector<Meaning> LookUp(std::string_view what, const Families& families);

/// Whether `what` has the form of something that LookUp() knows, though it may know nothing about this one.
[[nodiscard]] bool IsNumberLike(std::string_view what);

}  // namespace ecaudit::cli
