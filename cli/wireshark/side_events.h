/// Events and the phase of clocks into a side file, in the order of frames.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <utility>

#include "analyzers/options/slave_names.h"
#include "analyzers/sync/sync_model.h"
#include "cli/stream/event_record.h"
#include "cli/wireshark/side_file.h"
#include "decoder/track/network.h"

namespace ecaudit::cli {

/// Lines that arrive out of order by a number of frames.
class SideOrder {
 public:
  /// @param wait  how many frames a line may come too late; 0: none does
  /// @param write  gets each line, in the order of frames
  SideOrder(FrameNo wait, std::function<void(FrameNo, std::string_view)> write)
      : wait_(wait), write_(std::move(write)) {}

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

  FrameNo wait_;
  std::function<void(FrameNo, std::string_view)> write_;
  std::set<Row> waiting_;
  std::uint64_t number_ = 0;
  FrameNo newest_ = 0;
  FrameNo written_ = 0;
  std::uint64_t too_late_ = 0;
};

class SideEvents final : public EventSink {
 public:
  SideEvents(SideFile& side, const track::Network& network, const SlaveNames& names)
      : side_(side), network_(network), names_(names) {}

  void Begin(const EventTable& /*table*/) override {}
  /// In any order of frames.
  void Row(const EventRecord& row) override;
  void On(const sync::PhaseMeasured& event);
  void End() override;
  [[nodiscard]] std::uint64_t too_late() const {
    return sdo_and_others_.too_late() + clocks_.too_late() + states_.too_late();
  }

 private:
  /// `line` begins with its frame.
  void Write(SideSection section, FrameNo frame, std::string_view line);
  void WriteState(FrameNo frame, std::string_view line);

  SideFile& side_;
  const track::Network& network_;
  SlaveNames names_;
  static constexpr FrameNo kLongestWait = 20'000;  ///< from an SDO request to what becomes of it

  SideOrder sdo_and_others_{kLongestWait,
                            [this](FrameNo frame, std::string_view line) { Write(SideSection::kEvents, frame, line); }};
  SideOrder clocks_{0, [this](FrameNo frame, std::string_view line) { Write(SideSection::kClocks, frame, line); }};
  SideOrder states_{kLongestWait, [this](FrameNo frame, std::string_view line) { WriteState(frame, line); }};
  std::array<FrameNo, kSideSections> written_{};                      ///< frame of the last line, by section
  std::map<std::string, std::string, std::less<>> last_state_lines_;  ///< by slave
};

}  // namespace ecaudit::cli
