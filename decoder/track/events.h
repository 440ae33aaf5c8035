/// out of decoder/: Event, facts about one slave or the bus. Nothing here is evaluated.
///
/// Each event names the frames it rests on, and is published in the order in which it became known; those of the
/// mailboxes (mailbox/events.h) and every SlaveAccess (access.h) as well. What an event refers to is valid during the
/// call.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "decoder/base/ids.h"
#include "decoder/base/known.h"
#include "decoder/base/time.h"
#include "decoder/bus/transaction.h"
#include "decoder/esc/al.h"
#include "decoder/mailbox/events.h"
#include "decoder/track/access.h"
#include "decoder/track/sii_tracker.h"

namespace ecaudit::track {

/// A slave was met for the first time.
struct SlaveFound {
  SlaveId slave = kNoSlave;
  FrameRef frame;
};

/// A slave took, or reported, its configured station address (0x0010).
struct AddressAssigned {
  SlaveId slave = kNoSlave;
  FrameRef frame;
  StationAddress address = 0;
  SlaveId duplicate_of = kNoSlave;  ///< another slave at a known position that answers to the same address
};

/// The number of slaves that passed a frame on, counted by the position counter; emitted when it changes.
struct SlaveCount {
  std::uint16_t count = 0;
  std::uint16_t previous = 0;  ///< meaningless when `first`
  bool first = false;
  FrameRef frame;
};

/// A slave answered at a position, and since slaves joined or left, it is unknown which one.
struct PlaceUnknown {
  FrameRef frame;
};

/// The master wrote AL Control (0x0120) of one slave.
struct AlRequest {
  SlaveId slave = kNoSlave;
  FrameRef sent;
  FrameRef returned;
  esc::AlWord control;
  Acceptance acceptance = Acceptance::kUnknown;
  bool broadcast = false;

  [[nodiscard]] const FrameRef& frame() const { return sent.seen() ? sent : returned; }
};

/// A broadcast wrote AL Control of all slaves on the bus. AlRequest of each slave that is known comes before.
struct AlRequestOfAll {
  FrameRef frame;
  esc::AlWord control;
  Acceptance acceptance = Acceptance::kUnknown;
};

/// A write of AL Control is in flight; AlRequest follows when the frame comes back or is lost.
struct AlRequestSent {
  SlaveId slave = kNoSlave;
  FrameRef frame;
  esc::AlWord control;
};

/// AL Status (0x0130) of one slave was read, alone or by a broadcast whose result shows it.
struct AlStatusRead {
  SlaveId slave = kNoSlave;
  FrameRef frame;
  esc::AlWord status;
  std::optional<esc::AlWord> before;         ///< last status read, if any
  std::optional<std::uint16_t> status_code;  ///< 0x0134, when the same access covered it
  bool error_bit_known = true;               ///< false: from a broadcast that some slave answered with the error bit
  FrameRef sent = {};                        ///< the frame that asked for it; number 0 if it is not in the capture

  /// What was sent after this frame, the answer does not show: the slave had given it before.
  [[nodiscard]] FrameNo asked() const { return sent.seen() ? sent.number : frame.number; }
  [[nodiscard]] bool changed() const { return !before || before->raw != status.raw; }
};

/// A broadcast showed all of `slaves` once more in the state that the last AlStatusRead of each reported; none of them
/// where it showed, as before, several states, or that some slave has its error bit (terminals without a processor echo
/// acknowledges). Masters poll so in every cycle; unless a subscriber handles it for all of them, AlStatusRead of each
/// slave follows.
struct AlPoll {
  FrameRef frame;
  esc::AlWord status;
  std::span<const SlaveId> slaves;
  mutable bool each_wanted = false;  ///< a subscriber needs the event of each slave
  mutable bool taken = false;        ///< no further event is needed
};

/// A broadcast read of AL Status that all known slaves counted for, before the events of each of them.
struct AlStatusOfAll {
  FrameRef frame;
  esc::AlWord status;        ///< OR of all: state and error bit
  std::uint16_t slaves = 0;  ///< who counted
};

/// AL Status Code (0x0134) of one slave was read.
struct AlStatusCodeRead {
  SlaveId slave = kNoSlave;
  FrameRef frame;
  std::uint16_t code = 0;
};

/// A broadcast read of AL Status contradicts what was known of this slave, or it was gone for a while: its state is
/// unknown from here on.
struct AlStateForgotten {
  SlaveId slave = kNoSlave;
  FrameRef frame;
  bool may_be_set_up_anew = true;  ///< false: its registers and objects are presumed to be as they were
};

/// What the EEPROM (SII), object 1018h, ESI or ENI states a slave is.
struct IdentityLearned {
  enum class Source : std::uint8_t { kEeprom, kObject1018, kEsi, kEni };
  SlaveId slave = kNoSlave;
  FrameRef frame;
  Source source = Source::kEeprom;
  std::optional<std::uint32_t> vendor_id, product_code, revision, serial;
  std::string model;  ///< type of the device in the vendor's words (EEPROM, 1008h; untrusted text); empty: not known
};

/// The EEPROM, object 1008h, ESI or ENI gave a slave its name (untrusted text).
struct NameLearned {
  SlaveId slave = kNoSlave;
  FrameRef frame;
  std::string name;
};

/// A datagram with a logical address came back (or was sent, in an outbound-only capture).
struct LogicalAccess {
  wire::Command command = wire::Command::LRW;
  std::uint32_t address = 0;
  FrameRef sent;
  FrameRef returned;
  ByteSpan sent_data;      ///< empty when the outbound copy is not captured
  ByteSpan returned_data;  ///< empty when the return is not captured
  std::uint16_t length = 0;
  std::uint16_t wkc = 0;  ///< of the returned copy
  std::uint16_t sent_wkc =
      0;                     ///< of the outbound copy: not 0 downstream of slaves that took part before it was captured
  bool circulating = false;  ///< circulating bit of the returned copy
  bool assumed = false;      ///< outbound-only capture: wkc means nothing
  /// How many slaves were examined for it; see slave_work.h.
  mutable std::uint64_t told = 0;

  [[nodiscard]] const FrameRef& frame() const { return returned.seen() ? returned : sent; }
};

/// A broadcast or configured-address datagram came back; outbound-only: a broadcast write, assumed, `returned` unseen.
struct Answered {
  wire::Command command = wire::Command::NOP;
  std::uint16_t adp = 0;  ///< as sent, as far as it is known
  EscAddress address = 0;
  std::uint16_t length = 0;
  std::uint16_t wkc = 0;
  std::uint16_t sent_wkc = 0;  ///< of the outbound copy: not 0 downstream of slaves that counted before it was captured
  bool circulating = false;    ///< circulating bit of the returned copy
  std::optional<std::uint16_t> slaves_passed;  ///< by the position counter of this very datagram, where it has one
  SlaveId slave = kNoSlave;  ///< addressed slave; kNoSlave for broadcasts and addresses of no known slave
  FrameRef sent;
  FrameRef returned;
  ByteSpan sent_data;
  ByteSpan returned_data;

  [[nodiscard]] MemoryRange range() const { return MemoryRange::Of(address, length); }
};

/// Frames, one after the other, that came back with the same ECAT event field: what the slaves have in 0x0210, as far
/// as their masks 0x0200 let it through, ORed over the slaves and the datagrams of a frame.
struct EventFieldRun {
  std::uint16_t bits = 0;    ///< without those that the master itself had sent set
  std::uint64_t frames = 0;  ///< returned frames; 0 before the first one
  FrameRef first, last;      ///< meaningful where bits are set
  bool all_read = false;     ///< bits are set, and a datagram of the last frame reads at all slaves
};

/// The ECAT event field is another one than in the frame that returned before. Precedes all else from this frame.
struct EventFieldChanged {
  const EventFieldRun& before;
  std::uint16_t bits = 0;  ///< as in EventFieldRun
  FrameRef frame;          ///< the first with them
};

/// It is not known yet whether the slave accepts what this writes to its registers: a frame sent later came back first.
/// SlaveAccess still follows.
struct WriteDoubtful {
  const SlaveAccess& access;
};

/// The capture misses frames between this one and those before. Precedes all else from this frame.
struct CaptureGap {
  FrameRef frame;        ///< the first after the capture gap
  bool certain = false;  ///< false: the master may as well have been silent ...
  bool skip = false;  ///< ... or, here, have skipped numbers: the indices skip, and both copies of all frames are there
  bool likely = false;  ///< ... for the first time lately: frames are missing most likely
  FrameRef before;      ///< the last one with a time stamp before it; not seen(): none, or another recording begins

  /// From the last frame before it to the first one after it; nullopt where the clock does not show it.
  [[nodiscard]] std::optional<TimeNs> length() const {
    if (!frame.has_time || !before.has_time || frame.time < before.time) return std::nullopt;
    return Elapsed(before.time, frame.time);
  }
  /// So short that a slave is hardly set up again in it, or asked for another state than before.
  [[nodiscard]] bool is_short() const {
    constexpr TimeNs kShort = 500'000'000;
    const auto ns = length();
    return certain && ns && *ns <= kShort;
  }
};

/// Another run of the bus: what was measured and learned before does not apply to what follows. Precedes all else from
/// this frame. A master that only shuts the bus down begins one, too, in which nothing happens.
struct RunBegan {
  enum class Reason : std::uint8_t {
    kClock,        ///< the clock jumps, and nothing shows that frames go on: another recording was appended
    kInitialised,  ///< the master requests INIT of all slaves, or clears their addresses, when some had left INIT
  };
  FrameRef frame;
  Reason reason = Reason::kInitialised;
};

struct FrameLost {
  const wire::FrameView& sent;
  bus::Loss loss;
  bool followed_by_other = false;  ///< the packet directly after it in the capture was no EtherCAT frame
  /// How many slaves were examined for process data in it; see slave_work.h.
  mutable std::uint64_t told = 0;
};

struct FrameDuplicated {
  const wire::FrameView& returned;
  FrameNo original = 0;
};

/// A master that numbers its frames sent one again, byte for byte, although it was answered or before its answer came.
struct FrameRepeated : bus::RepeatedFrame {};

struct FrameUnusable {
  const wire::FrameView& frame;
  bus::Unusable reason;
  bool own_master = false;  ///< from a sender that is a master of this bus
};

}  // namespace ecaudit::track
