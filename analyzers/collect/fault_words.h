/// in: process data without a known owner.  out: why the verdict cannot be "pass" although no finding
/// stands: from the first cycle on a word of them reads like the status word of a drive in a fault.
///
/// A capture that starts mid-run holds neither FMMUs nor mapping, and a machine that stands in Fault looks like
/// one that stands still. That such a word is a status word is a guess, which makes no finding; but it is no machine of
/// which the report may state that nothing is wrong.
///
/// keeps: at most kMost such words.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "analyzers/collect/collector.h"
#include "analyzers/model/process_image.h"
#include "analyzers/wiring/event_bus.h"
#include "decoder/device/drive_profile.h"

namespace ecaudit {

class FaultWords final : public Collector {
 public:
  static constexpr std::size_t kMost = 32;
  static constexpr std::size_t kMostDatagrams = 16;
  /// A word that reads like this in fewer cycles may be anything.
  static constexpr std::uint64_t kLeastCycles = 8;

  explicit FaultWords(EventBus& bus);

  void On(const model::ProcessDataUnplaced& event);
  void Summarise(AnalysisResult& result) override;

 private:
  struct Datagram {
    wire::Command command = wire::Command::NOP;
    std::uint32_t address = 0;
    std::uint16_t length = 0;
  };
  struct Word {
    std::uint8_t datagram = 0;
    std::uint16_t at = 0;     ///< byte in the datagram
    std::uint16_t value = 0;  ///< as last seen in a fault
    bool left = false;        ///< the fault was reset
    bool dropped = false;     ///< it showed what no status word shows
    std::uint64_t cycles = 0;
    FrameRef first, last;
  };
  [[nodiscard]] bool InFault(std::uint16_t word) const;
  void Begin(const track::LogicalAccess& access);
  void FollowWord(Word& word, const track::LogicalAccess& access) const;

  const device::DriveProfile* drive_ = nullptr;  ///< the standard's
  std::array<Datagram, kMostDatagrams> datagrams_{};
  std::size_t used_ = 0;
  std::array<Word, kMost> words_{};
  std::size_t found_ = 0;
};

}  // namespace ecaudit
