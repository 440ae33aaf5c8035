#include "decoder/esc/datagram_text.h"

#include "decoder/base/text.h"
#include "decoder/esc/al.h"
#include "decoder/esc/register_addresses.h"
#include "decoder/esc/register_text.h"

namespace ecaudit::esc {

std::string DescribeDatagram(const wire::DatagramView& datagram, bool returned) {
  const wire::Command command = datagram.command();
  if (!wire::IsDefined(datagram.command_byte()) || command == wire::Command::NOP) return "";
  const ByteSpan data = datagram.data();
  if (wire::IsLogical(command)) {
    return "logical " + Hex(datagram.logical_address(), 8) + ", " + std::to_string(data.size()) +
           (data.size() == 1 ? " byte" : " bytes");
  }
  const EscAddress address = datagram.ado();
  const bool reads = wire::Reads(command);
  // What ARMW and FRMW write is what the addressed slave put in, so outbound they are reads like others.
  const bool distributes = command == wire::Command::ARMW || command == wire::Command::FRMW;
  const bool writes = wire::Writes(command) && !distributes;
  const std::uint16_t wkc = datagram.wkc();

  if (!returned) {
    return DescribeAccess(address, data, writes ? AccessKind::WRITE : AccessKind::REQUEST);
  }
  if (!reads) return DescribeAccess(address, data, AccessKind::WRITE) + (wkc == 0 ? " (not accepted)" : "");
  if (wkc == 0) {
    const std::string name = DescribeAccess(address, data, AccessKind::REQUEST);
    return (name.empty() ? Hex(address) : name) + " (no answer)";
  }
  const bool ored = wire::IsBroadcast(command) && wkc > (writes ? 3 : 1);
  std::string text = DescribeAccess(address, data, AccessKind::READ);
  if (!ored) return text;
  if (address == kAlStatus && !data.empty()) {
    // State 14 does not exist: some slaves are in one state, some in another.
    const AlWord status{data[0]};
    const std::string one = StateName(status.state());
    const std::size_t at = text.find(one);
    if (at != std::string::npos) text.replace(at, one.size(), OredStatesText(status.state()));
  }
  return text + " (all slaves ORed)";
}

}  // namespace ecaudit::esc
