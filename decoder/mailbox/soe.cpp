#include "decoder/mailbox/soe.h"

#include "decoder/base/names.h"

namespace ecaudit::mailbox {
namespace {

// The first digit names the element (2 name, 3 attribute, 4 unit, 5 minimum, 6 maximum, 7 data).
constexpr Named<std::uint16_t> kErrors[] = {
    {0x1001, "IDN does not exist"},
    {0x1009, "invalid access to element 1"},
    {0x2001, "no name"},
    {0x2002, "name transmission too short"},
    {0x2003, "name transmission too long"},
    {0x2004, "name is read only"},
    {0x2005, "name is write-protected at this time"},
    {0x3002, "attribute transmission too short"},
    {0x3003, "attribute transmission too long"},
    {0x3004, "attribute is read only"},
    {0x3005, "attribute is write-protected at this time"},
    {0x4001, "no unit"},
    {0x4002, "unit transmission too short"},
    {0x4003, "unit transmission too long"},
    {0x4004, "unit is read only"},
    {0x4005, "unit is write-protected at this time"},
    {0x5001, "no minimum value"},
    {0x5002, "minimum value transmission too short"},
    {0x5003, "minimum value transmission too long"},
    {0x5004, "minimum value is read only"},
    {0x5005, "minimum value is write-protected at this time"},
    {0x6001, "no maximum value"},
    {0x6002, "maximum value transmission too short"},
    {0x6003, "maximum value transmission too long"},
    {0x6004, "maximum value is read only"},
    {0x6005, "maximum value is write-protected at this time"},
    {0x7002, "operation data transmission too short"},
    {0x7003, "operation data transmission too long"},
    {0x7004, "operation data are read only"},
    {0x7005, "operation data are write-protected at this time"},
    {0x7006, "operation data are below the minimum"},
    {0x7007, "operation data are above the maximum"},
    {0x7008, "invalid operation data: the configured IDN is not supported"},
    {0x7009, "operation data are protected by a password"},
    {0x700A, "operation data are write-protected because they are configured cyclically"},
    {0x700B, "invalid indirect addressing"},
    {0x700C, "operation data are write-protected by other settings"},
    {0x7010, "procedure command already active"},
    {0x7011, "procedure command cannot be interrupted"},
    {0x7012, "procedure command cannot be executed at this time"},
    {0x7013, "procedure command cannot be executed with these parameters"},
    {0x7014, "no data state"},
    {0x8001, "no default value"},
    {0x8002, "default value transmission too long"},
    {0x8004, "default value is read only"},
    {0x800A, "invalid drive number"},
};

}  // namespace

std::string Name(SoeOperation operation) {
  static constexpr Named<SoeOperation> kNames[] = {
      {SoeOperation::kReadRequest, "read request"},   {SoeOperation::kReadResponse, "read response"},
      {SoeOperation::kWriteRequest, "write request"}, {SoeOperation::kWriteResponse, "write response"},
      {SoeOperation::kNotification, "notification"},  {SoeOperation::kEmergency, "emergency"},
  };
  const std::string_view name = NameIn(kNames, operation);
  return !name.empty() ? std::string(name) : "operation " + std::to_string(static_cast<unsigned>(operation));
}

std::string IdnName(std::uint16_t idn) {
  std::string number = std::to_string(idn & 0x0FFFU);
  number.insert(0, 4 - number.size(), '0');
  return std::string((idn & 0x8000U) != 0 ? "P-" : "S-") + std::to_string(idn >> 12U & 0x07U) + "-" + number;
}

std::string ElementNames(std::uint8_t elements) {
  constexpr std::string_view kNames[] = {"data state", "name",    "attribute", "unit",
                                         "minimum",    "maximum", "value",     "default value"};
  std::string text;
  for (unsigned bit = 0; bit < 8; ++bit) {
    if ((elements >> bit & 1U) == 0) continue;
    if (!text.empty()) text += ", ";
    text += kNames[bit];
  }
  return text;
}

std::string_view SoeErrorText(std::uint16_t code) {
  return NameIn(kErrors, code);
}

}  // namespace ecaudit::mailbox
