/// What slaves signalled in the event field of the datagrams, and what is known of their event registers.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "decoder/base/ids.h"

namespace ecaudit {

/// One bit of the ECAT event field over the whole capture.
struct EventBitSummary {
  std::uint8_t bit = 0;  ///< as in 0x0210
  std::string name;      ///< "DL status"; "bit 13" where it has no meaning
  std::uint64_t raised = 0;
  std::uint64_t frames = 0;  ///< returned frames that carried it
  FrameRef first, last;      ///< of them
  bool from_start = false;   ///< set in the first frame that returned
  bool at_end = false;       ///< set in the last one
  bool inferred = false;     ///< of one slave: concluded from the read that made it go
};

/// An event register as last known.
struct EventRegister {
  std::uint32_t value = 0;
  std::uint32_t known_bits = 0;    ///< a read may have covered a part only
  std::vector<std::string> names;  ///< of the bits set
  bool inferred = false;
  FrameNo frame = 0;  ///< 0: a broadcast before the slave was met showed it
};

struct EventSummary {
  std::vector<EventBitSummary> signalled;     ///< bits known to be this slave's
  std::optional<EventRegister> ecat_mask;     ///< 0x0200
  std::optional<EventRegister> ecat_request;  ///< 0x0210
  std::optional<EventRegister> al_mask;       ///< 0x0204
  std::optional<EventRegister> al_request;    ///< 0x0220
};

}  // namespace ecaudit
