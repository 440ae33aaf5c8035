/// One sync manager: 8 bytes at 0x0800 + 8 * n (esc-reference 4.9, 6).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "decoder/base/bytes.h"
#include "decoder/base/ids.h"

namespace ecaudit::esc {

inline constexpr EscAddress kSyncManagerBase = 0x0800;
inline constexpr std::size_t kSyncManagerBytes = 8;
inline constexpr std::size_t kMaxSyncManagers = 16;

/// Address of sync manager `n`, 0-15.
[[nodiscard]] constexpr EscAddress SyncManagerAddress(std::size_t n) {
  return static_cast<EscAddress>(kSyncManagerBase + n * kSyncManagerBytes);
}

/// Control bits 1:0.
enum class SmMode : std::uint8_t {
  BUFFERED = 0,   ///< three buffers, always accessible: process data
  RESERVED1 = 1,  ///< not allowed
  MAILBOX = 2,    ///< one buffer, strict alternation of write and read
  RESERVED3 = 3,  ///< not allowed
};

/// Control bits 3:2.
enum class SmDirection : std::uint8_t {
  ECAT_READS = 0,   ///< the slave writes, the master reads: inputs, mailbox in
  ECAT_WRITES = 1,  ///< the master writes, the slave reads: outputs, mailbox out
  RESERVED2 = 2,    ///< not allowed
  RESERVED3 = 3,    ///< not allowed
};

struct SyncManager {
  std::uint16_t start = 0;   ///< first byte of the buffer in ESC memory
  std::uint16_t length = 0;  ///< bytes of one buffer
  std::uint8_t control = 0;
  std::uint8_t status = 0;  ///< written by the ESC
  std::uint8_t activate = 0;
  std::uint8_t pdi_control = 0;  ///< written by the slave's processor

  /// @param bytes the eight register bytes; nothing when there are fewer, bytes after them are ignored
  [[nodiscard]] static constexpr std::optional<SyncManager> Decode(ByteSpan bytes) {
    if (bytes.size() < kSyncManagerBytes) return std::nullopt;
    return SyncManager{LittleEndian<std::uint16_t>(bytes, 0),
                       LittleEndian<std::uint16_t>(bytes, 2),
                       bytes[4],
                       bytes[5],
                       bytes[6],
                       bytes[7]};
  }

  [[nodiscard]] constexpr SmMode mode() const { return static_cast<SmMode>(control & 0x03U); }
  [[nodiscard]] constexpr bool mailbox() const { return mode() == SmMode::MAILBOX; }
  [[nodiscard]] constexpr bool buffered() const { return mode() == SmMode::BUFFERED; }
  [[nodiscard]] constexpr SmDirection direction() const { return static_cast<SmDirection>(control >> 2U & 0x03U); }
  [[nodiscard]] constexpr bool ecat_writes() const { return direction() == SmDirection::ECAT_WRITES; }
  [[nodiscard]] constexpr bool ecat_reads() const { return direction() == SmDirection::ECAT_READS; }
  [[nodiscard]] constexpr bool ecat_irq() const { return (control & 0x10U) != 0; }  ///< event to 0x0210
  [[nodiscard]] constexpr bool pdi_irq() const { return (control & 0x20U) != 0; }   ///< event to 0x0220
  [[nodiscard]] constexpr bool watchdog_trigger() const { return (control & 0x40U) != 0; }

  [[nodiscard]] constexpr bool irq_write() const { return (status & 0x01U) != 0; }  ///< buffer completely written
  [[nodiscard]] constexpr bool irq_read() const { return (status & 0x02U) != 0; }   ///< buffer completely read
  [[nodiscard]] constexpr bool mailbox_full() const { return (status & 0x08U) != 0; }
  /// Last written buffer 0-2 in three-buffer mode; 3: none yet.
  [[nodiscard]] constexpr std::uint8_t last_buffer() const { return status >> 4U & 0x03U; }
  [[nodiscard]] constexpr bool read_buffer_open() const { return (status & 0x40U) != 0; }
  [[nodiscard]] constexpr bool write_buffer_open() const { return (status & 0x80U) != 0; }

  [[nodiscard]] constexpr bool enabled() const { return (activate & 0x01U) != 0; }
  [[nodiscard]] constexpr bool repeat_request() const { return (activate & 0x02U) != 0; }
  [[nodiscard]] constexpr bool latch_ecat() const { return (activate & 0x40U) != 0; }
  [[nodiscard]] constexpr bool latch_pdi() const { return (activate & 0x80U) != 0; }

  [[nodiscard]] constexpr bool deactivated_by_pdi() const { return (pdi_control & 0x01U) != 0; }
  [[nodiscard]] constexpr bool repeat_acknowledge() const { return (pdi_control & 0x02U) != 0; }
  /// Enabled by the master and not locked by the slave.
  [[nodiscard]] constexpr bool active() const { return enabled() && !deactivated_by_pdi(); }

  /// First address after the one buffer that the master addresses; up to 0x1FFFE, hence 32 bits.
  [[nodiscard]] constexpr std::uint32_t end() const { return std::uint32_t{start} + length; }
  /// Bytes of memory taken: three buffers in three-buffer mode. A length of 1 is not buffered (esc-reference 6.2).
  [[nodiscard]] constexpr std::uint32_t occupied_bytes() const {
    return buffered() && length > 1 ? 3U * length : length;
  }
  [[nodiscard]] constexpr std::uint32_t occupied_end() const { return std::uint32_t{start} + occupied_bytes(); }
  /// True when the access [address, address + bytes) touches the buffer the master addresses.
  [[nodiscard]] constexpr bool Touches(EscAddress address, std::size_t bytes) const {
    return bytes != 0 && length != 0 && address < end() && address + bytes > start;
  }
  /// True when the occupied memory of both has bytes in common; neither activation is considered.
  [[nodiscard]] constexpr bool Overlaps(const SyncManager& other) const {
    return occupied_bytes() != 0 && other.occupied_bytes() != 0 && start < other.occupied_end() &&
           other.start < occupied_end();
  }
  /// Same settings by the master (status and PDI control, which it cannot write, are left out).
  [[nodiscard]] constexpr bool SameSettings(const SyncManager& other) const {
    return start == other.start && length == other.length && control == other.control && activate == other.activate;
  }

  friend constexpr bool operator==(const SyncManager&, const SyncManager&) = default;
};

/// Sync managers 0 and 1 carry the mailbox. A higher one in the same mode is process data with one buffer: it counts
/// only when the slave has filled or emptied the buffer since the last access (esc-reference 6.2).
[[nodiscard]] constexpr bool IsMailbox(std::size_t n, const SyncManager& manager) {
  return n < 2 && manager.mailbox();
}
[[nodiscard]] constexpr bool IsOneBuffer(std::size_t n, const SyncManager& manager) {
  return n >= 2 && manager.mailbox();
}
/// With three buffers or with one.
[[nodiscard]] constexpr bool IsProcessData(std::size_t n, const SyncManager& manager) {
  return manager.buffered() || IsOneBuffer(n, manager);
}

}  // namespace ecaudit::esc
