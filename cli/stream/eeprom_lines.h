/// EEPROM accesses as few lines: reads of neighbouring words become one, and when the master turns to other things, one
/// line shows what the words read so far contain.
#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "cli/stream/event_output.h"
#include "decoder/track/sii_tracker.h"

namespace ecaudit::cli {

class EepromLines {
 public:
  explicit EepromLines(EventOutput& output) : output_(output) {}

  void On(const track::EepromRead& event);
  void On(const track::EepromWrite& event);
  void On(const track::EepromError& event);
  /// The master does something else with this slave: reading has ended for now.
  void Pause(SlaveId slave);
  void End();

 private:
  struct Slave {
    FrameRef first, last;             ///< of the current run
    std::uint32_t address = 0;        ///< word address of its first word
    std::vector<std::uint8_t> bytes;  ///< low byte first; empty: no run
    FrameRef last_read;               ///< of all reads
    std::uint32_t shown_words = 0;    ///< words known at the last contents line
  };

  Slave& At(SlaveId slave);
  void Flush(SlaveId id, Slave& slave);
  /// Ends runs that were not continued for a while.
  void FlushIdle(FrameNo now);
  /// @param at_end  false: more may come, and what is new may be too little for another line
  void WriteContents(SlaveId id, Slave& slave, bool at_end);

  EventOutput& output_;
  std::deque<Slave> slaves_;
  std::vector<SlaveId> open_;  ///< slaves with an open run
};

}  // namespace ecaudit::cli
