/// Everything one capture's analysis found: plain data, complete, without text formatting. Writers read only this.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "analyzers/options/slave_names.h"
#include "analyzers/result/coverage.h"
#include "analyzers/result/cycle_summary.h"
#include "analyzers/result/dc_summary.h"
#include "analyzers/result/esi_demand.h"
#include "analyzers/result/event_summary.h"
#include "analyzers/result/finding.h"
#include "analyzers/result/latch_summary.h"
#include "analyzers/result/progress.h"
#include "analyzers/result/run_summary.h"
#include "analyzers/result/startup_summary.h"
#include "analyzers/result/topology_summary.h"
#include "decoder/base/ids.h"
#include "decoder/bus/frame_ledger.h"
#include "decoder/capture/frame_source.h"

namespace ecaudit {

enum class DirectionSeen : std::uint8_t { kNone, kBoth, kOutbound, kReturned };

/// How good the capture's own clock is.
struct TimestampQuality {
  std::int64_t resolution_ns = 0;     ///< step the stamps really use; 0 when there are none
  std::uint64_t backwards = 0;        ///< packets stamped earlier than the packet before
  std::uint64_t identical_pairs = 0;  ///< outbound and returned copy with the same stamp
  std::uint64_t pairs = 0;
  std::uint64_t without = 0;  ///< packets without a stamp
};

struct CaptureSummary {
  capture::CaptureInfo file;
  std::uint64_t packets = 0;
  std::uint64_t ethercat_frames = 0;  ///< frames of EtherCAT type 1, readable at least in part
  std::uint64_t datagrams = 0;
  std::uint64_t outbound_frames = 0;
  std::uint64_t returned_frames = 0;
  std::uint64_t unknown_direction_frames = 0;
  std::uint64_t foreign_frames = 0;    ///< EtherCAT frames of senders that are not this bus's master
  std::uint64_t other_end_frames = 0;  ///< came back at the other end of a redundant line, where no slave took part
  std::uint64_t other_packets = 0;     ///< no EtherCAT, or another EtherCAT type
  bus::FrameLedger frames;             ///< what became of the outbound frames
  std::uint64_t malformed_frames = 0;
  std::uint64_t padded_frames = 0;     ///< their EtherCAT length covers more than their datagrams
  std::uint64_t cut_frames = 0;        ///< cut by the snap length
  std::uint64_t crc_error_frames = 0;  ///< marked bad by the probe or the capture
  std::uint64_t may_be_ethercat = 0;   ///< packets that are, or may have been, EtherCAT frames; ...
  std::uint64_t unusable = 0;          ///< ... and of these those that could not be used
  FrameRef origin;                     ///< first packet of the file with a time stamp: seconds count from there
  FrameRef first;                      ///< first packet of the range with a time stamp
  FrameRef last;
  bool earlier_left_out = false;            ///< the range leaves out packets before it, and they were not evaluated
  std::optional<std::int64_t> duration_ns;  ///< from `first` to `last`, without what the clock jumped between
  DirectionSeen direction = DirectionSeen::kNone;
  TimestampQuality timestamps;
  bool complete = true;  ///< false: damaged file, or the analysis was stopped early
};

/// How often the slave models foretold something, and how often it came true.
struct PredictionCount {
  static constexpr std::size_t kMaxDeviations = 16;
  std::uint64_t made = 0;
  std::uint64_t held = 0;
  std::vector<FrameNo> deviations;  ///< the first frames in which it did not
};

struct PredictionSummary {
  PredictionCount al_answers;        ///< answers to state requests
  PredictionCount mailbox_accesses;  ///< whether a mailbox takes or gives a message
  PredictionCount working_counters;  ///< of datagrams with a logical address
};

/// What the last broadcast reads of AL Status show that all slaves counted for.
struct BusAlSummary {
  std::uint16_t status = 0;  ///< OR of all: state and error bit
  FrameRef first, last;      ///< reads that show it
  std::uint64_t reads = 0;
};

struct BusSummary {
  std::optional<std::uint16_t> slave_count;  ///< as the last broadcast showed
  std::optional<BusAlSummary> al;
  CycleSummary cycle;
  BusDcSummary dc;
  std::uint64_t lost_frames = 0;
  std::uint64_t duplicated_frames = 0;
  std::uint64_t unanswered_at_end = 0;  ///< outbound frames still in flight when the capture ends
  std::vector<EventBitSummary> events;  ///< bits that any slave raised
  PredictionSummary predictions;
  std::vector<RunSummary> runs;  ///< one at least
  TopologySummary topology;
  std::vector<CyclicDatagram> cyclic_datagrams;  ///< bounded; by command and address
  StartupSummary startup;  ///< what was sent to all slaves at once before the first one reached OP
};

/// One step of a slave's AL history as it was seen.
struct AlStep {
  enum class Kind : std::uint8_t { kRequest, kState };
  Kind kind = Kind::kState;
  FrameRef frame;
  std::uint16_t from = 0;  ///< AL status before (bit 4 error), 0 when unknown
  std::uint16_t to = 0;    ///< AL status, or AL control for a request
  std::optional<std::uint16_t> status_code;
  bool refused_by_wkc = false;  ///< request: no slave took it
  bool echo = false;            ///< state: the error bit only echoes an acknowledge (slaves without a processor)
};

struct Identity {
  std::optional<std::uint32_t> vendor_id, product_code, revision, serial;
  FrameNo since = 0;
};

/// A sync manager as last known.
struct SyncManagerSummary {
  std::uint8_t number = 0;
  std::uint16_t start = 0;
  std::uint16_t length = 0;
  std::uint8_t control = 0;
  bool mailbox = false;      ///< one-buffer mode; else three-buffer mode
  bool ecat_writes = false;  ///< direction: the master writes, the slave reads
  bool enabled = false;
  bool inferred = false;  ///< not every byte was seen on the wire
  FrameNo since = 0;      ///< last frame that showed something about it
};

/// An FMMU as last known.
struct FmmuSummary {
  std::uint8_t number = 0;
  std::uint32_t logical_start = 0;
  std::uint16_t length = 0;
  std::uint8_t logical_start_bit = 0;
  std::uint8_t logical_stop_bit = 0;
  std::uint16_t physical_start = 0;
  std::uint8_t physical_start_bit = 0;
  bool reads = false;
  bool writes = false;
  bool active = false;
  bool inferred = false;
  FrameNo since = 0;
};

/// One entry of the process data.
struct MappedObject {
  std::uint16_t pdo = 0;
  std::uint16_t index = 0;  ///< 0: a gap
  std::uint8_t subindex = 0;
  std::uint16_t bits = 0;
  std::uint32_t bit_offset = 0;  ///< in the buffer of its sync manager
  std::uint8_t sync_manager = 0;
  std::string name;            ///< empty when unknown (untrusted text)
  bool name_inferred = false;  ///< from another family of the same maker
  std::string variable;        ///< what the ENI file calls it; empty: nothing (untrusted text)
};

/// The process data of one direction at the end of the capture.
struct PdoSummary {
  enum class Source : std::uint8_t { kUnknown, kObserved, kDefault, kEni };
  Source source = Source::kUnknown;
  std::string reason;               ///< why it is not known, or what contradicts it; else empty
  std::vector<std::uint16_t> pdos;  ///< as assigned
  std::vector<MappedObject> objects;
  std::optional<std::uint32_t> bytes;  ///< unset when the contents are not all known
  std::uint64_t exchanged = 0;         ///< datagrams in which the slave took or gave them
  FrameNo first = 0, last = 0;         ///< the first and the last of them
  FrameNo since = 0;
};

/// What went through the mailboxes of one slave.
struct MailboxSummary {
  struct Messages {
    std::string protocol;  ///< "CoE", "error"
    std::uint64_t requests = 0;
    std::uint64_t responses = 0;
  };
  std::uint64_t requests = 0;   ///< messages of the master, repetitions left out
  std::uint64_t responses = 0;  ///< messages of the slave, unasked ones included, repetitions left out
  std::uint64_t sdo_uploads = 0;
  std::uint64_t sdo_downloads = 0;
  std::uint64_t aborts = 0;  ///< SDO transfers aborted by either side
  std::uint64_t emergencies = 0;
  std::uint64_t error_replies = 0;
  std::uint64_t unanswered = 0;       ///< requests without an answer, gaps of the capture left out
  std::vector<Messages> by_protocol;  ///< by type number; those that were used
};

/// One step in the life of a drive, in words.
struct DriveStep {
  enum class Kind : std::uint8_t { kCommand, kState, kMode, kWarning, kFault };
  Kind kind = Kind::kState;
  FrameRef frame;
  std::string text;                       ///< "Switched on -> Operation enabled (status word 0x0237, transition 4)"
  std::string from;                       ///< states: the state before; empty when unknown
  std::string to;                         ///< states: the state now; "unknown" for a word that fits none
  std::optional<std::uint16_t> word;      ///< control word of a command, status word of a state or warning
  std::vector<std::uint8_t> transitions;  ///< commanded, or taken; numbers of CiA 402
  FrameNo command_frame = 0;              ///< states: the control word that asked for it, 0: the drive by itself
  std::optional<TimeNs> reaction;         ///< states: from that control word
  bool by_sdo = false;
  bool inferred = false;
};

/// What was seen of a drive.
struct DriveSummary {
  std::uint8_t axis = 0;                                   ///< 0: the first
  std::string state;                                       ///< as last shown; empty when unknown
  std::optional<std::uint16_t> status_word, control_word;  ///< last ones
  std::vector<std::string> status_bits, control_bits;      ///< names of the bits set
  std::optional<std::int8_t> mode_requested, mode_shown;
  std::string mode_requested_name, mode_shown_name;  ///< empty where the family has none
  bool by_sdo = false;                               ///< the status word was read through the mailbox
  std::uint64_t faults = 0;                          ///< times the drive went into a fault
  std::vector<std::string> enabled;                  ///< each time the drive was enabled, in words; bounded
  std::vector<DriveStep> history;                    ///< bounded; later steps are counted in history_left_out
  std::uint64_t history_left_out = 0;
};

struct SlaveSummary {
  SlaveId id = kNoSlave;
  SlavePos position = 0;
  bool position_inferred = false;
  std::optional<StationAddress> station_address;
  std::optional<StationAddress> alias;
  Identity identity;
  std::string name;                        ///< from EEPROM, 1008h, ESI or ENI; empty when never seen (untrusted text)
  std::string profile;                     ///< "generic", "kollmorgen-akd-2011", ...
  std::string profile_source;              ///< "EEPROM identity", "option --profile", "default", ... in words
  std::optional<std::uint16_t> al_status;  ///< last observed AL Status
  std::optional<std::uint16_t> al_status_code;  ///< last observed AL Status Code
  bool al_echo = false;                         ///< the error bit of al_status only echoes an acknowledge
  std::vector<AlStep> al_history;               ///< bounded; later steps are counted in al_history_left_out
  std::uint64_t al_history_left_out = 0;
  std::vector<SyncManagerSummary> sync_managers;  ///< those that were ever set
  std::vector<FmmuSummary> fmmus;                 ///< likewise
  PdoSummary rx_pdo;                              ///< master to slave
  PdoSummary tx_pdo;                              ///< slave to master
  std::optional<DriveSummary> drive;              ///< unset when no control or status word was seen
  std::vector<DriveSummary> further_axes;         ///< those after the first one that was seen
  Ladder progress;                                ///< how far the slave got
  std::vector<AxisLadder> axes;                   ///< how far each of its axes got, those of which something was seen
  std::optional<DcSummary> dc;                    ///< unset when nothing was seen of its distributed clocks
  std::optional<LatchSummary> latch;              ///< unset when no latch word was seen
  std::optional<LatchSummary> touch_probe;        ///< 60B8h and 60B9h, where they were seen
  MailboxSummary mailbox;
  EventSummary events;
  StartupSummary startup;              ///< steps of the master up to OP; `seen` is false where the capture holds none
  std::vector<EsiDemand> esi_demands;  ///< what its ESI requires of this start-up; empty without an ESI
  std::optional<Reason>
      not_evaluated;  ///< why too little of it was evaluated for the verdict "pass"; unset: enough was

  [[nodiscard]] bool op_requested() const {
    constexpr std::uint16_t kOp = 8;
    return std::ranges::any_of(
        al_history, [](const AlStep& step) { return step.kind == AlStep::Kind::kRequest && (step.to & 0xFU) == kOp; });
  }
};

/// A store of the analysis that was full: what it keeps, and what it left out.
struct ReachedLimit {
  std::string what;  ///< "findings that are listed one by one"
  std::uint64_t limit = 0;
  std::uint64_t left_out = 0;  ///< at least this many
};

struct AnalysisResult {
  SlaveNames slave_names;  ///< what sentences call its slaves
  CaptureSummary capture;
  BusSummary bus;
  std::vector<SlaveSummary> slaves;  ///< by position
  std::vector<Finding> findings;     ///< as they are read: reading_order.h
  std::vector<NotEvaluable> not_evaluable;
  std::vector<CaptureAdvice> capture_next;  ///< the most valuable first
  std::vector<RuleCoverage> coverage;       ///< all rules, by id; not those that a command left out
  std::vector<ReachedLimit> limits;         ///< docs/SECURITY.md has a table of all
  std::string cut;                          ///< why no verdict can be better than "limited"; empty: nothing

  [[nodiscard]] const SlaveSummary* slave(SlaveId id) const {
    for (const SlaveSummary& s : slaves) {
      if (s.id == id) return &s;
    }
    return nullptr;
  }
  /// Not empty.
  [[nodiscard]] std::uint32_t NumberOf(FindingIndex finding) const {
    return findings[finding].number != 0 ? findings[finding].number : finding + 1;
  }
};

}  // namespace ecaudit
