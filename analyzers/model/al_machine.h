/// in: AL requests and status reads of one slave.  out: AlRequestJudged, AlAnswered, ... (model_events.h).
///
/// Replays the AL state machine of the slave's family (esc-reference 5, the family's manual): which states it may be
/// in, what it must answer to a request, and whether what was read agrees. Between two status reads the slave may be
/// in several states: the one last read, and those that requests since then lead to.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "analyzers/model/model_events.h"
#include "decoder/base/event_sink.h"
#include "decoder/device/device_description.h"
#include "decoder/track/events.h"

namespace ecaudit::model {

/// How long a slave may take (esc-reference 5.7, configurable).
struct AlTimeouts {
  std::int64_t to_preop_ns = 3'000'000'000;
  std::int64_t to_safeop_or_op_ns = 10'000'000'000;
  std::int64_t downwards_ns = 5'000'000'000;

  /// @param target  the state requested: a value of esc::AlState  @param down  from a higher one
  [[nodiscard]] std::int64_t To(std::uint8_t target, bool down) const {
    if (down) return downwards_ns;
    const bool early = target == static_cast<std::uint8_t>(esc::AlState::PREOP) ||
                       target == static_cast<std::uint8_t>(esc::AlState::BOOT);
    return early ? to_preop_ns : to_safeop_or_op_ns;
  }
};

/// Rises that no request of the capture asked for. No slave rises by itself: the capture does not hold all requests (a
/// filter chose its packets), and what looks like a fall may have been asked for, too.
class UnaskedRises {
 public:
  void Add(FrameNo frame) {
    if (first_ == 0) first_ = frame;
    ++count_;
  }
  /// The frame that proves it for a drop to `state`; 0: none. The request of one rise may lie before the capture: it
  /// does not explain a slave in INIT, which may have been switched off.
  [[nodiscard]] FrameNo Proof(std::uint8_t state) const {
    const bool init = (state & static_cast<std::uint8_t>(esc::AlState::INIT)) != 0;
    return count_ > (init ? 1U : 0U) ? first_ : 0;
  }

 private:
  FrameNo first_ = 0;
  std::uint64_t count_ = 0;
};

class AlMachine {
 public:
  /// @param sink receives the conclusions; must outlive the machine
  AlMachine(SlaveId slave, EventSink& sink) : slave_(slave), sink_(sink) {}

  /// The family's table to evaluate by; may change when the identity becomes known. Never null.
  void SetFamily(const device::DeviceDescription& family) { family_ = &family; }
  void SetTimeouts(const AlTimeouts& timeouts) { timeouts_ = timeouts; }
  [[nodiscard]] const AlTimeouts& timeouts() const { return timeouts_; }
  /// Register 0x0141 bit 0: such a slave echoes the acknowledge bit as error bit (esc-reference 5.3).
  void SetDeviceEmulation(bool emulation) {
    emulation_ = emulation;
    quiet_ = false;
  }

  /// A request leaves the master; OnRequest() shows later whether the slave accepts it.
  void OnRequestSent(const FrameRef& frame, esc::AlWord control);
  void OnRequest(const track::AlRequest& request);
  void OnStatus(const track::AlStatusRead& read);
  /// Nothing is waited for, and this read shows what the last one reported: only Repeat() is due.
  [[nodiscard]] bool Repeats(const track::AlStatusRead& read) const {
    return quiet_ && read.status.state() == read_state_ && !read.status.bit4() && read.error_bit_known;
  }
  [[nodiscard]] bool RepeatsState(std::uint8_t state) const { return quiet_ && state == read_state_; }
  void Repeat(FrameNo frame) {
    ++polls_;
    ++status_reads_;
    if (requests_ > 0) ++reads_after_request_;
    last_seen_ = frame;
  }
  void OnStatusCode(const track::AlStatusCodeRead& read);
  /// The master was silent, or the capture has a gap: what the next read shows may have been asked for unseen.
  void OnPause() {
    quiet_ = false;
    paused_ = true;
  }
  /// The capture certainly misses packets before this frame; Forget() follows where the slave may be another since.
  void OnGap(const track::CaptureGap& gap);
  /// Another device is there now: what the one before could do does not apply to it.
  void OnOtherDevice() {
    emulation_.reset();
    own_status_ = false;
    quiet_ = false;
  }
  /// The state is not known any more (contradicting broadcast, slave gone).
  void Forget(const FrameRef& frame);

  /// The error bit that the last read showed is the echo of an acknowledge.
  [[nodiscard]] bool echoes() const { return echo_; }
  /// It was seen in SAFEOP or OP at some time.
  [[nodiscard]] bool operated() const { return operated_; }
  /// The frame that showed the state read last.
  [[nodiscard]] FrameNo since() const { return since_; }
  /// The frame that confirmed it last.
  [[nodiscard]] FrameNo last_seen() const { return last_seen_; }
  /// States the slave may be in now; empty: unknown.
  [[nodiscard]] StateSet possible() const {
    return pending_.empty() ? possible_ : PossibleBefore(std::numeric_limits<FrameNo>::max());
  }
  /// True when the last thing known of the slave is that it is in `state`, without error and with no request open.
  [[nodiscard]] bool SettledIn(esc::AlState state) const {
    return possible_ == StateSet::Of(static_cast<std::uint8_t>(state)) && error_ == Error::kNo && !open_ &&
           pending_.empty();
  }
  /// What the capture shows of this slave, for rules that report where they could not evaluate.
  /// The request that the slave has neither followed nor refused so far, although AL Status was read; null: none.
  [[nodiscard]] const AlRequestRecord* waits_for() const {
    return open_ && !overdue_reported_ && polls_ > 0 ? &*open_ : nullptr;
  }
  /// How the master looks for what it waits_for().
  struct Wait {
    std::uint64_t polls = 0;    ///< reads of AL Status
    FrameRef since, last_poll;  ///< from the request to the last of them
  };
  [[nodiscard]] Wait wait() const { return {polls_, waiting_since_, last_poll_}; }
  [[nodiscard]] std::uint64_t requests() const { return requests_; }  ///< taken by the slave
  /// Frame of the last request that the slave took since the last restart; 0: none.
  [[nodiscard]] FrameNo last_request() const { return control_ ? control_since_ : 0; }
  [[nodiscard]] std::uint64_t status_reads() const { return status_reads_; }
  [[nodiscard]] std::uint64_t reads_after_request() const { return reads_after_request_; }

 private:
  enum class Error : std::uint8_t { kUnknown, kNo, kYes };

  [[nodiscard]] bool LegalFrom(std::uint8_t from, std::uint8_t target) const;
  AlRequestRecord Assess(const track::AlRequest& request) const;
  void Open(const AlRequestRecord& record);
  [[nodiscard]] bool Explains(const track::AlStatusRead& read) const;
  [[nodiscard]] bool NonePendingFor(const track::AlStatusRead& read) const;
  void LearnEmulation(const track::AlStatusRead& read);
  [[nodiscard]] bool IsEcho(const track::AlStatusRead& read) const;
  [[nodiscard]] bool MayBeAcknowledgedError(const track::AlStatusRead& read) const;
  void AddPending(esc::AlWord control, const FrameRef& sent);
  void RemovePending(FrameNo sent);
  void DropOldPending(const FrameRef& frame);
  void DropPendingReached(std::uint8_t state, FrameNo before);
  void DropPendingBefore(FrameNo request);
  [[nodiscard]] bool MayHaveBeenAcknowledged(FrameNo before) const;
  [[nodiscard]] StateSet PossibleBefore(FrameNo request) const;
  [[nodiscard]] AlChangedByItself ChangedByItself(const track::AlStatusRead& read, esc::AlWord before) const;
  void OnStateOnly(const track::AlStatusRead& read);
  void OnNoState(const track::AlStatusRead& read);
  void NoteRise(const track::AlStatusRead& read);
  [[nodiscard]] bool IsQuiet(std::uint8_t state) const;
  [[nodiscard]] esc::AlWord Before() const;
  void MayBeIn(std::uint8_t state);
  void OnError(const track::AlStatusRead& read);
  void ReportGivenUp(const AlRequestRecord& next) const;
  [[nodiscard]] bool FellBefore(const track::AlStatusRead& read) const;
  [[nodiscard]] const AlRequestRecord* HighestUnread() const;
  void ReportStanding(const track::AlStatusRead& read, bool certain);
  [[nodiscard]] AlAnswered RefusedBy(const track::AlStatusRead& read, const AlRequestRecord& request) const;
  void PublishRefusal(const AlAnswered& event, std::optional<std::uint16_t> code);
  [[nodiscard]] bool WentOnUnacknowledged() const;
  [[nodiscard]] bool MayPrecede(const track::AlStatusRead& read) const;
  void OnNoError(const track::AlStatusRead& read);
  void CheckOverdue(const track::AlStatusRead& read);
  void Resume(const track::AlStatusRead& read);
  void ReportCode(const FrameRef& frame, std::uint16_t code);

  SlaveId slave_;
  EventSink& sink_;
  const device::DeviceDescription* family_ = nullptr;
  AlTimeouts timeouts_;
  std::optional<bool> emulation_;
  bool own_status_ = false;  ///< AL Status showed what no mere copy of AL Control can: the slave has a processor

  StateSet possible_;            ///< without what the requests on their way may do
  FrameNo since_ = 0;            ///< frame that showed the state last read
  FrameNo last_seen_ = 0;        ///< last frame that confirmed it
  FrameNo last_asked_ = 0;       ///< and the frame that asked, where the slave was not quiet
  std::uint8_t read_state_ = 0;  ///< state last read, 0 unknown
  Error error_ = Error::kUnknown;
  FrameNo error_since_ = 0;
  bool echo_ = false;            ///< the error bit shown is the echo of an acknowledge
  bool error_reported_ = false;  ///< as kRefused or AlChangedByItself: its code is wanted
  std::optional<std::uint16_t> error_code_;
  enum class Standing : std::uint8_t { kNo, kMaybe, kYes };
  Standing standing_ = Standing::kNo;  ///< the error bit was there when the slave was first read
  bool began_ = false;                 ///< the slave was seen without error, or its error was reported before
  FrameNo well_until_ = 0;             ///< last frame without error before it was lost from sight; 0: it was not

  std::optional<AlRequestRecord> open_;  ///< taken by the slave, not answered yet
  static constexpr std::size_t kMaxEarlier = 3;
  std::vector<AlRequestRecord> earlier_;  ///< taken before open_ and never seen answered: they may explain a state
  std::optional<esc::AlWord> control_;    ///< AL Control as the slave took it last
  FrameNo control_since_ = 0;
  std::uint64_t polls_ = 0;  ///< status reads since open_
  FrameRef waiting_since_;   ///< open_, or the first read after a pause in which the state may have been read unseen
  FrameRef last_poll_;
  bool overdue_reported_ = false;
  /// What was waited for when the capture began to miss packets.
  struct Interrupted {
    AlRequestRecord request;
    std::uint8_t state = 0;
    FrameRef since, last_poll;
    FrameNo gap = 0;  ///< the first frame after it
  };
  std::optional<Interrupted> interrupted_;
  bool acknowledged_ = false;  ///< an error that is or may be set was acknowledged, and not seen gone yet
  /// To the first request after which the slave was seen, an acknowledge: its error, which may be older.
  std::optional<AlAnswered> unclear_;

  /// A request whose fate is not known: it is on its way, was lost, or was taken by some of the slaves of a broadcast.
  /// Also one that the slave should ignore, since it may explain what happens where the slave does not.
  struct Pending {
    esc::AlWord control;
    FrameRef sent;
  };
  static constexpr std::size_t kMaxPending = 8;
  std::vector<Pending> pending_;  ///< oldest first

  bool paused_ = false;     ///< since the last read of the status
  FrameRef watched_since_;  ///< first read of the status since the capture began, or since the slave was out of sight
  std::uint64_t reads_since_ = 0;
  bool asked_ = false;  ///< a request was sent since then
  FrameRef no_state_;   ///< the first of the last reads that showed a value that is none of the five
  UnaskedRises unasked_;
  bool operated_ = false;  ///< was seen in SAFEOP or OP
  bool quiet_ = false;     ///< another read of the same status would change nothing but counters

  std::uint64_t requests_ = 0;
  std::uint64_t status_reads_ = 0;
  std::uint64_t reads_after_request_ = 0;
};

}  // namespace ecaudit::model
