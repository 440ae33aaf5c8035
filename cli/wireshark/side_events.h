/// Events and the phase of clocks into a side file, in the order of frames.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "analyzers/options/slave_names.h"
#include "analyzers/sync/sync_model.h"
#include "cli/wireshark/side_file.h"
#include "decoder/track/network.h"

namespace ecaudit::cli {

/// Rows of a section that arrive out of order by a number of frames.
class SideOrder {
 public:
  /// @param wait  how many frames a row may come too late; 0: none does
  SideOrder(SideFile& side, SideSection section, FrameNo wait) : side_(side), section_(section), wait_(wait) {}

  /// `line` begins with the frame.
  void Add(FrameNo frame, std::string line);
  void End();
  /// Rows that came too late for their place.
  [[nodiscard]] std::uint64_t too_late() const { return too_late_; }

 private:
  static constexpr std::size_t kMostWaiting = 16'384;

  struct Row {
    FrameNo frame = 0;
    std::uint64_t number = 0;
    std::string line;
    bool operator<(const Row& other) const {
      return frame != other.frame ? frame < other.frame : number < other.number;
    }
  };
  void WriteFirst();
  void Write(FrameNo frame, std::string_view line);

  SideFile& side_;
  SideSection section_;
  FrameNo wait_;
  std::set<Row> waiting_;
  std::uint64_t number_ = 0;
  FrameNo newest_ = 0;
  FrameNo written_ = 0;
  std::uint64_t too_late_ = 0;
};

class SideEvents {
 public:
  SideEvents(SideFile& side, const track::Network& network, const SlaveNames& names)
      : side_(side), network_(network), names_(names) {}

  /// A line of the events in the format kJsonAndText.
  void Take(std::string_view line);
  void On(const sync::PhaseMeasured& event);
  void End();
  [[nodiscard]] std::uint64_t too_late() const {
    return sdo_and_others_.too_late() + clocks_.too_late() + states_too_late_;
  }

 private:
  void TakeState(FrameNo frame, const std::string& slave, std::string row);

  SideFile& side_;
  const track::Network& network_;
  SlaveNames names_;
  static constexpr FrameNo kLongestWait = 20'000;  ///< from an SDO request to what becomes of it

  SideOrder sdo_and_others_{side_, SideSection::kEvents, kLongestWait};
  SideOrder clocks_{side_, SideSection::kClocks, 0};
  std::map<std::string, std::string> states_;  ///< the last line of each slave
  FrameNo last_state_ = 0;
  std::uint64_t states_too_late_ = 0;
};

}  // namespace ecaudit::cli
