/// Who may write which part of the slave's memory, by the family's manual.
#pragma once

#include <cstdint>
#include <string>

#include "decoder/base/ids.h"

namespace ecaudit::device {

/// What one side (EtherCAT master, or the drive's processor) may do.
enum class Access : std::uint8_t {
  kUnknown,  ///< not documented
  kNone,
  kRead,
  kWrite,
  kReadWrite,
};

/// One register, or one buffer, of the family's register table.
struct RegisterRight {
  EscAddress address = 0;
  std::uint32_t length = 0;  ///< bytes; for a buffer the largest size the manual allows
  bool buffer = false;       ///< process-data or mailbox memory: its place depends on the sync managers
  std::string name;
  Access ecat = Access::kUnknown;   ///< what the master may do (see `note` where this differs from print)
  Access drive = Access::kUnknown;  ///< what the drive's processor may do
  std::string printed_ecat;         ///< what the manual prints, where `ecat` corrects it; else empty
  std::string printed_length;       ///< likewise ("512..1024")
  std::string note;
  std::string source;

  [[nodiscard]] bool Covers(EscAddress at) const { return at >= address && at - address < static_cast<int>(length); }
  /// True when the manual lets the master read but not write.
  [[nodiscard]] bool read_only() const { return ecat == Access::kRead; }
};

}  // namespace ecaudit::device
