/// Addresses of the ESC registers that the program looks into by itself; register_map.h describes what each holds.
/// Sync managers and FMMUs have theirs in sync_manager.h and fmmu.h.
///
/// Source: esc-reference 4.
#pragma once

#include "decoder/base/ids.h"

namespace ecaudit::esc {

inline constexpr EscAddress kEscType = 0x0000;
inline constexpr EscAddress kFmmuCount = 0x0004;         ///< how many the slave controller has
inline constexpr EscAddress kSyncManagerCount = 0x0005;  ///< likewise
inline constexpr EscAddress kRamSize = 0x0006;           ///< of the process RAM, KiB
inline constexpr EscAddress kEscFeatures = 0x0008;
inline constexpr EscAddress kStationAddress = 0x0010;
inline constexpr EscAddress kStationAlias = 0x0012;
inline constexpr EscAddress kDlStatus = 0x0110;
inline constexpr EscAddress kAlControl = 0x0120;
inline constexpr EscAddress kAlStatus = 0x0130;
inline constexpr EscAddress kAlStatusCode = 0x0134;
inline constexpr EscAddress kEscConfiguration = 0x0141;

// Events: masks and requests.
inline constexpr EscAddress kEcatEventMask = 0x0200;
inline constexpr EscAddress kAlEventMask = 0x0204;
inline constexpr EscAddress kEcatEventRequest = 0x0210;
inline constexpr EscAddress kAlEventRequest = 0x0220;

inline constexpr EscAddress kWatchdogDivider = 0x0400;
inline constexpr EscAddress kProcessWatchdog = 0x0420;

// EEPROM interface.
inline constexpr EscAddress kEepromConfiguration = 0x0500;
inline constexpr EscAddress kEepromControl = 0x0502;  ///< the command is in the upper byte
inline constexpr EscAddress kEepromAddress = 0x0504;
inline constexpr EscAddress kEepromData = 0x0508;
inline constexpr EscAddress kEepromEnd = 0x0510;

// Distributed clocks.
inline constexpr EscAddress kDcFirst = 0x0900;
inline constexpr EscAddress kReceiveTimes = 0x0900;   ///< writing any value latches them
inline constexpr EscAddress kReceiveTimesBytes = 16;  ///< of ports 0 to 3
inline constexpr EscAddress kSystemTime = 0x0910;
inline constexpr EscAddress kReceiveTimeCore = 0x0918;
inline constexpr EscAddress kSystemTimeOffset = 0x0920;
inline constexpr EscAddress kSystemTimeDelay = 0x0928;
inline constexpr EscAddress kSystemTimeDifference = 0x092C;
inline constexpr EscAddress kSpeedCounterStart = 0x0930;
inline constexpr EscAddress kSpeedCounterDifference = 0x0932;
inline constexpr EscAddress kCyclicUnitControl = 0x0980;
inline constexpr EscAddress kDcActivation = 0x0981;
inline constexpr EscAddress kDcStartTime = 0x0990;
inline constexpr EscAddress kSync0Cycle = 0x09A0;
inline constexpr EscAddress kSync1Cycle = 0x09A4;
inline constexpr EscAddress kLatchControl = 0x09A8;
inline constexpr EscAddress kLatchStatus = 0x09AE;
inline constexpr EscAddress kLatchTimes = 0x09B0;
inline constexpr EscAddress kDcEnd = 0x0A00;

}  // namespace ecaudit::esc
