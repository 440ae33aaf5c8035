/// The devices of the samples. None of them is a real device: timing and defaults are invented, identity and layout of
/// the drive follow the public manual.
#pragma once

#include "samples/builder/simulated_slave.h"

namespace ecaudit::samples {

inline constexpr std::uint16_t kAkdMailboxOut = 0x1800;
inline constexpr std::uint16_t kAkdMailboxIn = 0x1C00;
inline constexpr std::uint16_t kAkdMailboxBytes = 128;
inline constexpr std::uint16_t kAkdOutputs = 0x1100;
inline constexpr std::uint16_t kAkdInputs = 0x1140;

/// A drive like the Kollmorgen AKD: vendor 0x6A, product 0x00414B44, fixed PDOs 1701h, 1702h, 1720h, 1721h, 1B01h,
/// 1B20h, 1B21h (assigned by default: 1701h and 1B01h), latch words. Its mailboxes are 128 bytes, to keep the samples
/// small.
[[nodiscard]] SlaveDescription AkdDrive();
/// A terminal without processor and mailbox: one byte of inputs, AL Status echoes AL Control.
[[nodiscard]] SlaveDescription InputTerminal();
/// The servo drive of samples/descriptions/acme-servo.esi.xml: PDOs 1600h and 1A00h, no drive behind its objects.
[[nodiscard]] SlaveDescription AcmeServo();

}  // namespace ecaudit::samples
