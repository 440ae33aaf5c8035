#include "decoder/device/emergency_codes.h"

namespace ecaudit::device {

const EmergencyCode* EmergencyTable::Find(std::uint16_t code) const {
  const EmergencyCode* best = nullptr;
  // Sorted by first code, so everything after the first greater one cannot contain `code`.
  for (const EmergencyCode& row : codes) {
    if (row.code > code) break;
    if (code > row.last_code) continue;
    if (best == nullptr || row.last_code - row.code < best->last_code - best->code) best = &row;
  }
  return best;
}

}  // namespace ecaudit::device
