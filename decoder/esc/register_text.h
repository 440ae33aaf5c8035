/// Register contents as text for people: field names, values, units.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "decoder/base/bytes.h"
#include "decoder/esc/fmmu.h"
#include "decoder/esc/register_map.h"
#include "decoder/esc/sync_manager.h"

namespace ecaudit::esc {

/// How an access reached the ESC.
enum class AccessKind : std::uint8_t {
  REQUEST,  ///< a read on its way out: its data mean nothing
  READ,     ///< data that came back
  WRITE,    ///< data the master wrote
};

/// What the text of some registers depends on.
struct RegisterContext {
  std::optional<std::uint16_t> watchdog_divider;  ///< 0x0400, for watchdog times in ms
};

/// "0x1800 1024 bytes, mailbox, ECAT writes, PDI irq, enabled"; "all 0". What the slave adds (full, deactivated)
/// follows when `with_status`.
[[nodiscard]] std::string Describe(const SyncManager& sm, bool with_status);
/// "logical 0x00000000 +17 -> 0x1100 write, active"; with bit numbers ("0x09000000.0 1 bit -> 0x080d.0") where it does
/// not map whole bytes; "all 0".
[[nodiscard]] std::string Describe(const Fmmu& fmmu);

/// What the bytes show, without the register's name: "PREOP+ERR", "0x001d invalid output configuration",
/// "1.000 ms (1000000 ns)". Fields that lie outside the bytes are left out; where no field lies inside, the bytes
/// follow in hexadecimal with their place ("bytes 2-3: 0a0b").
/// @param hit where the bytes begin; hit.reg must not be null
/// @param bytes from there on; only those inside the register count
[[nodiscard]] std::string DescribeValue(const RegisterHit& hit, ByteSpan bytes, AccessKind kind = AccessKind::READ,
                                        const RegisterContext& context = {});
/// The same with the register's name: "AL Status: PREOP+ERR", "SM0 Start: 0x1800". "" when hit.reg is null.
[[nodiscard]] std::string DescribeRegister(const RegisterHit& hit, ByteSpan bytes, AccessKind kind = AccessKind::READ,
                                           const RegisterContext& context = {});

/// One line about the data of a datagram with an ESC address: its registers, sync managers and FMMUs, joined by "; ".
/// Runs that are all 0 are drawn together; after kMaxDescribed parts the rest is counted ("5 more"). Process RAM is
/// named with its size only. For REQUEST only names are given, AccessName(), and `bytes` counts by its size.
[[nodiscard]] std::string DescribeAccess(EscAddress address, ByteSpan bytes, AccessKind kind);
inline constexpr std::size_t kMaxDescribed = 8;

/// Name of one bit of an event register, as it stands in the register map: "DL status", "SM1"; "bit 13" where it has
/// none.
/// @param address 0x0200 or 0x0210 (16 bits), 0x0204 or 0x0220 (32 bits)
[[nodiscard]] std::string EventBitName(EscAddress address, unsigned bit);

/// The event field of a datagram (0x0210 of all slaves, ORed): "DL status, SM1"; "" for 0.
[[nodiscard]] std::string DescribeEvents(std::uint16_t irq);

}  // namespace ecaudit::esc
