/// What a report draws over time: plain data, of constant size whatever the length of the capture.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "decoder/base/ids.h"

namespace ecaudit {

/// Values over time in buckets of equal width: the least and the most of each, so that no peak is lost.
struct TimeSeries {
  struct Bucket {
    double least = 0, most = 0;  ///< meaningless when count is 0
    std::uint64_t count = 0;
    std::uint32_t any = 0, all = 0;  ///< of values as bits: set in at least one value, set in each
  };
  TimeNs start = 0;  ///< of the first bucket, capture clock
  TimeNs width = 0;  ///< of a bucket, ns
  std::vector<Bucket> buckets;

  [[nodiscard]] bool empty() const { return buckets.empty(); }
};

/// One value as one frame carried it.
struct CloseValue {
  FrameNo frame = 0;
  TimeNs time = 0;  ///< capture clock
  double value = 0;
};

/// One entry of the process data over time.
struct SignalSeries {
  bool output = false;  ///< master to slave
  std::uint16_t index = 0;
  std::uint8_t subindex = 0;
  std::uint16_t bits = 0;
  std::string name;  ///< empty when unknown (untrusted text)
  bool name_inferred = false;
  std::string unit;     ///< of the values below; empty: none, or unknown
  bool scaled = false;  ///< divided by the documented scale; else as on the wire
  TimeSeries values;
  std::vector<CloseValue> close;  ///< every value around findings, in the order of frames
  std::string variable;           ///< what the ENI file calls it; empty: nothing (untrusted text)
  bool word = false;              ///< a field of bits: Bucket::any and Bucket::all have a meaning
};

/// One SDO transfer in words.
struct SdoRow {
  FrameRef request, response;  ///< not seen() where it is not in the capture
  bool download = false;
  bool complete_access = false;
  std::optional<std::uint16_t> index;  ///< unset when the capture does not show the object
  std::uint8_t subindex = 0;
  std::string name;     ///< of the object; empty when unknown (untrusted text)
  std::string value;    ///< for people: "106 (0x6a)"; empty when it has none (untrusted text)
  std::string outcome;  ///< "completed", "aborted", ...
  std::optional<std::uint32_t> abort_code;
  std::string abort_text;
  std::optional<TimeNs> duration;
};

/// Datagrams, one after the other, in which a slave did the same with its process data.
struct ExchangeRun {
  enum class Kind : std::uint8_t {
    kTaken,    ///< the slave took or gave them
    kMissing,  ///< it did not count
    kUnclear,  ///< the working counter is short, and does not show whose part is missing
  };
  Kind kind = Kind::kTaken;
  FrameRef first, last;
  std::uint64_t count = 0;
};

/// The exchange of one direction over time. Between two runs there is a pause, or another kind begins.
struct ExchangeLane {
  std::vector<ExchangeRun> runs;
  bool left_out = false;  ///< later ones: the last run goes on as if nothing had changed
};

struct SlaveTimeline {
  SlaveId slave = kNoSlave;              ///< kNoSlave: known from the ENI file only, by its process data
  std::optional<SlavePos> eni_position;  ///< these three only then
  std::optional<StationAddress> eni_address;
  std::string eni_name;  ///< untrusted text
  std::vector<SignalSeries> signals;
  ExchangeLane outputs, inputs;
  TimeSeries mailbox;  ///< messages of both directions: count of each bucket
  std::vector<SdoRow> sdos;
  std::uint64_t sdos_left_out = 0;
  TimeSeries phase_us;       ///< end of the frames with process data after the last SYNC0, in OP
  TimeSeries difference_ns;  ///< magnitude of 0x092C as the master read it
};

struct Timeline {
  TimeSeries frames;                    ///< numbers of the frames with answers: which frames belong to a time
  TimeSeries lost;                      ///< frames that did not return: count of each bucket
  TimeSeries cycle_us;                  ///< interval between process data of the cyclic datagram
  std::vector<CloseValue> cycle_close;  ///< each interval around findings, by the frame that ends it
  std::vector<SlaveTimeline> slaves;    ///< those of which there is something
  bool signals_left_out = false;        ///< there are more signals than series
};

}  // namespace ecaudit
