/// in: an axis, moment by moment.  out: what keeps it from Operation enabled although the master asks for it.
///
/// Asking is bit 3 of the control word: it rises while the drive is not enabled, or it is set when the slave comes to
/// OP. A quick stop (bit 2 taken away from an enabled drive) is none, and neither is 0x0006.
///
/// Source: CIA402, state machine.
#pragma once

#include <bitset>
#include <cstdint>
#include <optional>

#include "analyzers/progress/axis_view.h"
#include "analyzers/progress/lasting.h"

namespace ecaudit::progress {

class EnableCheck {
 public:
  void Step(const AxisView& now, AxisRecords& out);
  /// 6040h was written by SDO and taken.
  void OnSdoControl(const AxisView& now, std::uint16_t word, const FrameRef& frame);
  /// The drive followed a command while bit 9 (remote) of its status word was 0.
  void OnFollowedWithoutRemote(AxisRecords& out);
  void Forget();
  /// Something is going on: the next moment matters also where nothing changes.
  [[nodiscard]] bool active() const {
    return by_sdo_ || dip_ ||
           Lasting::AnyActive(reset_stands_, reset_missing_, fault_stays_, bit_missing_, shutdown_missing_, asked_,
                              quick_stop_, not_ready_, not_in_op_, disabled_, swapped_);
  }

  /// The master asks for Operation enabled, by what the capture shows.
  [[nodiscard]] bool wanted() const { return wanted_; }
  [[nodiscard]] const FrameRef& enabled_since() const { return enabled_since_; }  ///< of the last time
  [[nodiscard]] bool ever_enabled() const { return enabled_since_.seen(); }
  /// Bit 9 of its status word shows nothing: the drive followed a command while it was 0.
  [[nodiscard]] bool ignores_remote() const { return ignores_remote_; }
  /// Bit 9 of this status word shows that the drive does not act on the control word.
  [[nodiscard]] bool IsLocal(std::uint16_t status) const {
    return !ignores_remote_ && (status >> kRemoteBit & 1U) == 0;
  }

 private:
  enum class Wish : std::uint8_t { kNone, kStands, kShown };

  void FollowWish(const AxisView& now);
  void Values(const AxisView& now, AxisRecords& out);
  void Attempts(const AxisView& now, AxisRecords& out);
  void Drops(const AxisView& now, AxisRecords& out);
  void Dips(const AxisView& now, AxisRecords& out);
  void FollowDip(const AxisView& now);
  void InFault(const AxisView& now, AxisRecords& out);
  void OnTheWay(const AxisView& now, AxisRecords& out);
  void Disabled(const AxisView& now, AxisRecords& out);
  void Swapped(const AxisView& now, AxisRecords& out);
  void FollowSdo(const AxisView& now, AxisRecords& out);

  Wish wish_ = Wish::kNone;
  bool wanted_ = false;
  FrameRef enabled_since_;
  bool had_voltage_ = false;
  bool ignores_remote_ = false;
  // In the fault at hand.
  bool fault_began_ = false;  ///< in the capture
  std::uint32_t resets_ = 0;
  FrameRef last_reset_;
  Lasting reset_stands_, reset_missing_, fault_stays_;
  Lasting bit_missing_, shutdown_missing_, asked_, quick_stop_, not_ready_, not_in_op_;
  // Values of the low byte of the control word since the drive was enabled last.
  std::bitset<256> values_;
  std::size_t value_count_ = 0;
  FrameRef first_value_;
  // Times that bit 3 rose without success.
  std::uint32_t attempts_ = 0;
  FrameRef first_attempt_;
  FrameRef attempt_;  ///< the one at hand
  TimeNs longest_ = 0;
  bool hasty_ = false;
  static constexpr std::uint32_t kDrops = 3;
  std::uint32_t drops_ = 0;
  FrameRef first_drop_;
  /// A word that is not whole, between two that are, while the drive is enabled.
  struct Dip {
    std::uint16_t word = 0;
    FrameRef since;
    FrameRef until;  ///< not seen(): it is still there
  };
  std::optional<Dip> dip_;
  Lasting dipped_;
  FrameRef asked_last_;      ///< bit 3 was set in Not ready to switch on last
  TimeNs asked_before_ = 0;  ///< in attempts that the master gave up
  struct SdoWord {
    std::uint16_t word = 0;
    FrameRef frame;
  };
  std::optional<SdoWord> by_sdo_;
  // In Switch on disabled.
  FrameRef shutdown_;          ///< Shutdown is sent since then
  FrameRef first_shutdown_;    ///< it was sent there first
  TimeNs shutdown_sent_ = 0;   ///< how long it was sent at most, before another word; 0: never
  bool shutdown_due_ = false;  ///< it was sent for longer than a drive needs
  FrameRef last_wish_;         ///< bit 3 was set there last
  Lasting disabled_;
  Lasting swapped_;
  bool swapped_before_ = false;  ///< 0x0600 or 0x0700 came
};

}  // namespace ecaudit::progress
