/// What a rule may lack: the subjects of reasons (result/reason.h) that several rules share. A rule's own stand in its
/// file.
///
/// A text is a noun phrase with its article that goes on as "... is not in the capture" or "... may have changed in a
/// capture gap".
#pragma once

#include "analyzers/result/argument.h"

namespace ecaudit::what {

inline constexpr Word kHistory{"history", "what this rests on"};
inline constexpr Word kAlState{"al-state", "the AL state of the slave"};
inline constexpr Word kAlStateBefore{"al-state-before", "the AL state before the request"};
inline constexpr Word kAlStatusAfter{"al-status-after-request", "AL Status after a request"};
inline constexpr Word kAlStatus{"al-status", "AL Status (0x0130)"};
inline constexpr Word kAlStatusCode{"al-status-code", "the AL status code (0x0134)"};
inline constexpr Word kStatusWord{"status-word", "the status word (6041h)"};
inline constexpr Word kControlWord{"control-word", "the control word (6040h)"};
inline constexpr Word kDriveWords{"drive-words", "the status word and the mode of operation of the drive", true};
inline constexpr Word kIdentityAndMapping{"identity-and-mapping", "the identity of the slave and its mapping", true};
inline constexpr Word kMapping{"mapping", "the PDO assignment and mapping", true};
inline constexpr Word kProcessDataOwner{"process-data-owner", "the mapping of process data to slaves"};
inline constexpr Word kSyncManagersAndFmmus{"sync-managers-and-fmmus", "the sync managers and FMMUs of the slave",
                                            true};
inline constexpr Word kFmmus{"fmmus", "the FMMUs of the slave", true};
inline constexpr Word kFmmusOfAll{"fmmus-of-all", "the FMMUs of all slaves", true};
inline constexpr Word kSyncManagers{"sync-managers", "the sync managers of the slave", true};
inline constexpr Word kMailboxAnswers{"mailbox-answers", "the answers of the slave's mailbox", true};
inline constexpr Word kSoeState{"soe-state", "the state of a Sercos drive (S-0-0135)"};
inline constexpr Word kTouchProbe{"touch-probe", "the touch probe (60B8h)"};
inline constexpr Word kProcessDataTiming{"process-data-timing", "the timing of the process data"};
inline constexpr Word kPauseOfDrive{"pause", "the process data of the enabled drive", true};
inline constexpr Word kWorkingDuringPause{"frames-in-pause", "frames sent in a pause", true};
inline constexpr Word kProcessFrames{"process-data-frames", "frames with process data", true};
inline constexpr Word kSync0Cycle{"sync0-cycle", "the SYNC0 cycle (0x09A0)"};

}  // namespace ecaudit::what
