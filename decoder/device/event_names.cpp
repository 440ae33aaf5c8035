#include "decoder/device/event_names.h"

#include "decoder/esc/register_text.h"

namespace ecaudit::device {

std::string EventBitName(const DeviceDescription& family, EscAddress address, unsigned bit) {
  for (const RegisterBits& row : family.event_bits) {
    if (row.address < address || row.first != row.last || row.name == "reserved") continue;
    if ((row.address - address) * 8U + row.first == bit) return row.name;
  }
  return esc::EventBitName(address, bit);
}

}  // namespace ecaudit::device
