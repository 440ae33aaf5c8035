/// in: broadcast reads of AL Status that everybody counted for, and what single slaves show.  out: BusAlChanged.
///
/// Such a read is the OR of all slaves: which of them is in which state it does not tell, but what nobody was in
/// before, and nobody was asked for, some slave went to by itself. As soon as a slave shows that by itself, the change
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
  /// What all slaves say together.
  struct Told {
    esc::AlWord status;  ///< OR of all, bits 0 to 4
    FrameRef first, last;
    std::uint64_t polls = 0;
    std::uint16_t slaves = 0;  ///< who counted
  };

  /// All arguments must outlive the unit.
  BusAlUnit(const track::Network& network, const EventSink& events) : network_(network), events_(events) {}

  /// As the last read showed it; unset when there was none.
  [[nodiscard]] const std::optional<Told>& told() const { return told_; }

  /// A state that everybody was in, also slaves that were not met yet, with no request since.
  struct Common {
    FrameRef frame;  ///< the last known to show it
    std::uint8_t state = 0;
    bool error_of_some = false;  ///< whose error bit it shows, if anybody's, is not known
  };
  [[nodiscard]] std::optional<Common> common() const;

  /// Broadcasts show that some slave refused what was asked for last.
  [[nodiscard]] bool refused() const { return refused_.has_value(); }

  void On(const track::AlStatusOfAll& read) {
    const bool same = told_ && told_->status.raw == read.status.raw && told_->slaves == read.slaves;
    if (!same && requested_ != 0 && AllFollowed()) requested_ = 0;
    if (requested_ != 0 || refused_) NoteRefusal(read);
    if (same) {
      told_->last = read.frame;
      ++told_->polls;
    } else {
      Change(read);
    }
    paused_ = false;
  }
  /// So many reads showed what the next one shows.
  void OnSkipped(std::uint64_t count) {
    if (told_) told_->polls += count;
    if (refused_) refused_->reads += count;
  }
  void On(const track::AlStatusRead& read) {
    if (waits_ + waits_for_init_ > 0) NoteAnswer(read);
    if (open_) Compare(read);
    if (read.status.bit4() && read.error_bit_known) refused_.reset();  // that slave is told of by itself
  }
  /// A state is asked for.  @param of_all of all slaves, by a broadcast; else of one that they hide
  void OnRequest(esc::AlWord control, track::Acceptance acceptance, const FrameRef& frame, bool of_all);
  /// One slave is asked for a state, by itself or with all others.
  void OnAsked(SlaveId slave, esc::AlWord control, track::Acceptance acceptance);
  /// Nobody sent anything for long, and the capture may have a hole there.
  void OnPause() {
    TellRefusal();
    Close();
    paused_ = true;
  }
  /// What happened in a hole, or between two runs, nobody knows.
  void Forget();
  void Finish() {
    TellRefusal();
    Close();
  }

 private:
  void Change(const track::AlStatusOfAll& read);
  void Open(const track::AlStatusOfAll& read, std::uint8_t fallen);
  void NoteRefusal(const track::AlStatusOfAll& read);
  [[nodiscard]] bool NobodyHadError(std::uint16_t slaves, FrameNo since) const;
  [[nodiscard]] bool Agreed() const;
  [[nodiscard]] bool SomeoneShowsError() const;
  void TellRefusal();
  void Await(SlaveId slave, std::uint8_t state);
  void NoteAnswer(const track::AlStatusRead& read);
  [[nodiscard]] bool AllFollowed() const;
  [[nodiscard]] bool Settled() const;
  void NoteRise(const track::AlStatusOfAll& read);
  void Compare(const track::AlStatusRead& read);
  /// The open change is told, for nobody owned up to it.
  void Close();
  [[nodiscard]] std::uint8_t ShownBySlaves() const;

  const track::Network& network_;
  const EventSink& events_;
  std::optional<Told> told_;
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
