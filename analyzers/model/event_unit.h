/// in: the ECAT event field of the frames that came back, accesses to the event registers.  out: EventBitChanged; what
/// the slaves signalled to the master, bit by bit, and what is known of their event registers.
///
/// The field is the OR of all slaves. Whose a bit is follows from the masks 0x0200, where all slaves but one have it
/// masked out, or from what makes it go: reading DL Status, AL Status or the latch registers of one slave.
///
/// Source: esc-reference 1.6, 4.4.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "analyzers/model/model_events.h"
#include "decoder/base/event_sink.h"
#include "decoder/track/events.h"
#include "decoder/track/network.h"

namespace ecaudit::model {

class EventUnit {
 public:
  static constexpr unsigned kBits = 16;

  /// One bit of the field, over the whole capture.
  struct Story {
    std::uint64_t raised = 0;  ///< times it appeared; set from the first frame on counts as well
    std::uint64_t frames = 0;  ///< that carried it
    FrameRef first, last;      ///< of them
    bool from_start = false;   ///< set in the first frame that returned
    bool at_end = false;       ///< set in the last one
    bool inferred = false;     ///< of a slave: some of it is known only by the read that made it go
  };
  using Stories = std::array<Story, kBits>;

  /// An event register as it was read last.
  struct Reading {
    std::uint32_t value = 0;
    std::uint32_t read = 0;  ///< mask of the bits that the read covered
    FrameRef frame;
  };
  struct Slave {
    std::vector<Story> signalled;  ///< what is known to be this slave's, by bit; empty: nothing
    FrameRef mask_frame;  ///< last access that showed 0x0200; not seen where a broadcast did before the slave was met
    std::optional<Reading> ecat_request;  ///< 0x0210, not masked
    std::optional<Reading> al_mask;       ///< 0x0204
    std::optional<Reading> al_request;    ///< 0x0220
  };

  /// @param network, sink must outlive this
  EventUnit(const track::Network& network, EventSink& sink) : network_(network), sink_(sink) {}

  void OnSlave(SlaveId slave);
  void OnField(const track::EventFieldChanged& event);
  void OnAccess(const track::SlaveAccess& access) {
    // Events are answered, and their registers accessed, at the start-up mostly; mailboxes are accessed all the time.
    if (access.address >= kRegistersEnd) return;
    if (network_.event_field().bits != 0 && !access.read.empty()) RememberReader(access);
    if (access.address < kEventsEnd) LearnRegisters(access);
  }
  /// The capture has ended.
  void Finish();

  /// All slaves together.
  [[nodiscard]] const Stories& field() const { return field_; }
  [[nodiscard]] const Slave& slave(SlaveId id) const { return slaves_[id]; }

 private:
  static constexpr EscAddress kEventsEnd = 0x0224;
  static constexpr EscAddress kRegistersEnd = 0x1000;

  /// A bit that is set now.
  struct Pending {
    std::uint64_t frames = 0;  ///< of the runs before the last one
    FrameRef first;
    SlaveId slave = kNoSlave;
  };
  /// Who was read last, of those whose read answers one kind of event.
  struct Reader {
    FrameNo frame = 0;
    SlaveId slave = kNoSlave;  ///< kNoSlave: several in that frame
  };
  static constexpr std::size_t kAnswers = 3;

  void RememberReader(const track::SlaveAccess& access);
  void LearnRegisters(const track::SlaveAccess& access);
  void End(unsigned bit, const track::EventFieldRun& run, const FrameRef* gone);
  [[nodiscard]] SlaveId OnlyCandidate(unsigned bit) const;
  [[nodiscard]] SlaveId OnlySlave() const;

  const track::Network& network_;
  EventSink& sink_;
  Stories field_;
  std::array<Pending, kBits> pending_;
  std::array<Reader, kAnswers> readers_;
  std::deque<Slave> slaves_;
};

}  // namespace ecaudit::model
