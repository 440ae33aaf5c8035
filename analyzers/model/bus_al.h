/// in: broadcast reads of AL Status that all slaves counted for, and what single slaves show.  out: BusAlChanged.
///
/// Such a read is the OR of all slaves: it does not show which of them is in which state, but what no slave was in
/// before, and no request was for, some slave went to by itself. As soon as a slave shows that by itself, the change
/// is its own.
///
/// keeps: the last such read, what was requested since all agreed, and one change that no slave has owned up to.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "analyzers/model/al_machine.h"
#include "analyzers/model/model_events.h"
#include "decoder/base/event_sink.h"
#include "decoder/track/events.h"
#include "decoder/track/network.h"

namespace ecaudit::model {

class BusAlUnit {
 public:
  /// What all slaves show together.
  struct Shown {
    esc::AlWord status;  ///< OR of all, bits 0 to 4
    FrameRef first, last;
    std::uint64_t polls = 0;
    std::uint16_t slaves = 0;  ///< who counted
  };

  /// All arguments must outlive the unit.
  BusAlUnit(const track::Network& network, const EventSink& events) : network_(network), events_(events) {}

  /// As the last read showed it; unset when there was none.
  [[nodiscard]] const std::optional<Shown>& shown() const { return shown_; }

  /// A state that all slaves were in, also those not met yet, with no request since.
  struct Common {
    FrameRef frame;  ///< the last known to show it
    std::uint8_t state = 0;
    bool error_of_some = false;  ///< it is not known which slave has the error bit, if any
  };
  [[nodiscard]] std::optional<Common> common() const;

  /// Broadcasts show that some slave refused what was asked for last.
  [[nodiscard]] bool refused() const { return refused_.has_value(); }

  void On(const track::AlStatusOfAll& read) {
    const bool same = shown_ && shown_->status.raw == read.status.raw && shown_->slaves == read.slaves;
    if (!same && requested_ != 0 && AllFollowed()) requested_ = 0;
    if (requested_ != 0 || refused_) NoteRefusal(read);
    if (same) {
      shown_->last = read.frame;
      ++shown_->polls;
    } else {
      Change(read);
    }
    paused_ = false;
  }
  void On(const track::AlStatusRead& read) {
    if (waits_ + waits_for_init_ > 0) NoteAnswer(read);
    if (open_) Compare(read);
    if (read.status.bit4() && read.error_bit_known) refused_.reset();  // that slave is reported by itself
  }
  /// A state is asked for.  @param of_all of all slaves, by a broadcast; else of one that they hide
  void OnRequest(esc::AlWord control, track::Acceptance acceptance, const FrameRef& frame, bool of_all);
  /// One slave is asked for a state, by itself or with all others.
  void OnAsked(SlaveId slave, esc::AlWord control, track::Acceptance acceptance);
  /// No master sent anything for long, and the capture may have a gap there.
  void OnPause() {
    ReportRefusal(false);
    Close();
    paused_ = true;
  }
  /// What happened in a capture gap, or between two runs, is unknown.
  void Forget();
  void Finish() {
    ReportRefusal(true);
    Close();
  }

 private:
  void Change(const track::AlStatusOfAll& read);
  void Open(const track::AlStatusOfAll& read, std::uint8_t fallen);
  void NoteRefusal(const track::AlStatusOfAll& read);
  [[nodiscard]] bool NoSlaveHadError(std::uint16_t slaves, FrameNo since) const;
  [[nodiscard]] bool Agreed() const;
  [[nodiscard]] bool SomeoneShowsError() const;
  void ReportRefusal(bool over);
  void Await(SlaveId slave, std::uint8_t state);
  void NoteAnswer(const track::AlStatusRead& read);
  [[nodiscard]] bool AllFollowed() const;
  [[nodiscard]] bool Settled() const;
  void NoteRise(const track::AlStatusOfAll& read);
  void Compare(const track::AlStatusRead& read);
  /// The open change is reported, because no slave showed it by itself.
  void Close();
  [[nodiscard]] std::uint8_t ShownBySlaves() const;

  const track::Network& network_;
  const EventSink& events_;
  std::optional<Shown> shown_;
  std::uint8_t requested_ = 0;  // states asked for since all agreed on one of them
  FrameRef requested_at_;
  esc::AlWord control_;              // of the last request
  std::vector<std::uint8_t> asked_;  // of each slave: the state that it was asked for and has not shown by itself
  std::size_t waits_ = 0;            // slaves that were asked for another state than INIT so, ...
  std::size_t waits_for_init_ = 0;   // ... and for INIT
  std::uint8_t asked_of_all_ = 0;    // state that a broadcast asked for last, also those who are not met
  bool acknowledging_ = false;       // some request since had the acknowledge bit, which may be echoed
  std::optional<BusAlRefused> refused_;
  UnaskedRises unasked_;
  std::optional<BusAlChanged> open_;
  FrameRef before_open_;          ///< the last read before it
  bool paused_ = false;           // no such read since a pause
  std::uint8_t unexplained_ = 0;  // bits of the open change that no slave showed
  std::vector<SlaveId> excluded_;
};

}  // namespace ecaudit::model
