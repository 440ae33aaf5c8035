/// in: the working counter of a datagram with a logical address, and who has a part in it.  out: what it shows of these
/// slaves: whether they gave their inputs and took their outputs.
///
/// One table weighs what stands for and against reading the counter at all; the number itself is then taken apart.
/// Where it leaves the inputs open, the states of the slaves are asked (inputs_given.h).
///
/// Source: esc-reference 2.1: +1 a slave that is read, +2 a slave that is written by LRW, +1 by LWR.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "analyzers/model/exchange.h"
#include "analyzers/model/logical_expectation.h"
#include "decoder/base/evidence.h"
#include "decoder/track/events.h"
#include "decoder/track/network.h"

namespace ecaudit::model {

/// What is known of all slaves with inputs, and of all with outputs in the datagram.
struct ExchangeOfAll {
  Exchange inputs = Exchange::kUnknown;
  Exchange outputs = Exchange::kUnknown;

  friend bool operator==(const ExchangeOfAll&, const ExchangeOfAll&) = default;
};

enum class CounterFact : std::uint8_t {
  kNeverReturns,   ///< the capture has outbound frames only
  kReturned,       ///< the datagram came back, and did not go round
  kCounted,        ///< the counter is not 0
  kEniCounter,     ///< the ENI states which counter it expects
  kEniCounterMet,  ///< ... and it is this one
  kMappingKnown,   ///< it is known of every slave, by FMMUs or by the ENI, what it has in the datagram
  kFull,           ///< the counter is at least what all known slaves count together
  kPossible,       ///< some slaves can count so
};

/// How the counter is read.
enum class CounterReading : std::uint8_t {
  kNothing,      ///< it shows nothing
  kTakenAsSent,  ///< nothing comes back: outputs are taken to have arrived
  kNobody,       ///< no slave took part
  kAllFit,       ///< it fits that all took part
  kByNumber,     ///< see ByNumber()
};

inline constexpr auto kReadCounter = [] {
  using F = CounterFact;
  return std::to_array<EvidenceRow<F, CounterReading>>({
      {{F::kNeverReturns}, {}, CounterReading::kTakenAsSent},
      {{}, {F::kReturned}, CounterReading::kNothing},
      {{}, {F::kCounted}, CounterReading::kNobody},
      // The ENI counts slaves that need not be known otherwise (mailbox states mapped by FMMU).
      {{F::kEniCounter, F::kEniCounterMet}, {}, CounterReading::kAllFit},
      {{F::kEniCounter}, {}, CounterReading::kNothing},
      {{F::kFull}, {F::kMappingKnown}, CounterReading::kAllFit},
      {{}, {F::kMappingKnown}, CounterReading::kNothing},
      {{F::kPossible}, {}, CounterReading::kByNumber},
      {{}, {}, CounterReading::kNothing},
  });
}();

/// A working counter, and how many slaves can have made it.
struct SlavesCounted {
  unsigned inputs = 0;   ///< slaves that can count for inputs, one each
  unsigned outputs = 0;  ///< slaves that can count for outputs, `step` each
  unsigned step = 1;
  unsigned wkc = 0;

  /// wkc = i + step * o with i <= inputs and o <= outputs: which o are possible?
  [[nodiscard]] constexpr unsigned least_outputs() const { return wkc > inputs ? (wkc - inputs + step - 1) / step : 0; }
  [[nodiscard]] constexpr unsigned most_outputs() const { return outputs < wkc / step ? outputs : wkc / step; }
  [[nodiscard]] constexpr bool possible() const { return least_outputs() <= most_outputs(); }
  [[nodiscard]] constexpr bool full() const { return wkc >= inputs + step * outputs; }
};

/// Takes a possible number apart: kYes where each way to come to it has all, kNo where each has none.
[[nodiscard]] ExchangeOfAll ByNumber(const SlavesCounted& counted);

/// What the ENI adds to what FMMUs show of a datagram.
struct EniCounts {
  bool any = false;                      ///< some slave's place is the ENI's
  unsigned inputs = 0;                   ///< slaves whose inputs are
  unsigned outputs = 0;                  ///< slaves whose outputs are
  std::optional<std::uint16_t> counter;  ///< that it expects
};

/// @param network, slaves  whose states are asked where the number leaves the inputs open
[[nodiscard]] ExchangeOfAll CountExchange(const track::LogicalAccess& access, const LogicalExpectation& expectation,
                                          const EniCounts& eni, const track::Network& network,
                                          const std::deque<SlaveModel>& slaves);

}  // namespace ecaudit::model
