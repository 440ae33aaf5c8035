/// Where the process data of one slave and direction lie in one kind of datagram, and their values in one such
/// datagram.
///
/// Outputs are read from what the master sent, inputs from what came back, and only when the working counter shows that
/// the slave gave them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "analyzers/model/exchange.h"
#include "analyzers/model/process_data.h"
#include "analyzers/model/slave_model.h"
#include "decoder/base/bytes.h"
#include "decoder/base/ids.h"
#include "decoder/wire/command.h"

namespace ecaudit::model {

/// Consecutive bits of a buffer, and where they lie in the datagram.
struct BitRun {
  std::uint32_t in_buffer = 0;  ///< from the first bit of the slave's memory that is mapped
  std::uint32_t in_datagram = 0;
  std::uint32_t bits = 0;
};

/// Where the process data of one slave and direction lie in one kind of datagram.
struct ImagePart {
  /// A signal that this datagram makes known.
  struct Place {
    std::uint32_t object = 0;  ///< index << 8 | subindex
    std::uint16_t signal = 0;  ///< number in layout->signals
    std::uint16_t bits = 0;
    std::uint32_t bit = 0;  ///< first bit in ProcessCycle::data: in the datagram, or after it (split_signals.h)
  };

  std::uint64_t serial = 0;           ///< no two parts ever made have the same
  SlaveId slave = kNoSlave;           ///< kNoSlave: not met, known from the ENI only
  const SlaveModel* model = nullptr;  ///< never null
  device::PdoDirection direction = device::PdoDirection::kRx;
  bool by_eni = false;                    ///< the place is the ENI's
  const ProcessLayout* layout = nullptr;  ///< never null; `places` is empty unless layout->known()
  std::string reason;                     ///< why there are no places although the layout is known; else empty
  std::vector<BitRun> runs;               ///< sorted by in_buffer; all that is mapped, also what no signal fills
  std::vector<Place> places;              ///< in the order of the layout, gaps left out
  std::uint32_t bits = 0;                 ///< sum of the runs
  bool incomplete = false;  ///< places are left out because another datagram did not bring its bits of the signal
  bool covered = false;  ///< outputs: inputs of some slave lie over them, so that the returned copy does not show them

  /// Null when the object is not mapped here.
  [[nodiscard]] const Place* Find(std::uint16_t index, std::uint8_t subindex) const;
};

/// One slave's data of one direction in one datagram. Valid during the call that hands it over.
struct ProcessCycle {
  const ImagePart& part;
  Exchange exchange = Exchange::kUnknown;
  const FrameRef& sent;
  const FrameRef& returned;
  wire::Command command = wire::Command::NOP;
  /// The datagram's data: of the copy sent for outputs, of the copy returned for inputs. Empty when that copy is
  /// missing, or the slave gave nothing (inputs whose exchange is neither kYes nor kInferred). Signals that do not lie
  /// in one piece follow after.
  ByteSpan data;
  bool lost = false;  ///< the frame never came back: it is unknown whether the slave took or gave them

  [[nodiscard]] const FrameRef& frame() const { return returned.seen() ? returned : sent; }
  [[nodiscard]] bool has_data() const { return !data.empty(); }
  /// The bits of a signal as unsigned little-endian number, at most 64; nothing without data.
  [[nodiscard]] std::optional<std::uint64_t> Value(const ImagePart::Place& place) const;
  [[nodiscard]] std::optional<std::uint64_t> Value(std::uint16_t index, std::uint8_t subindex) const;
  /// All mapped bits of the slave, packed, appended to `out`.
  void AppendRaw(std::vector<std::uint8_t>& out) const;
};

// What the working counter shows for certain of a slave that is met, for listeners that need no more; published after
// the ProcessCycle itself.

/// Inputs that the slave gave.
struct InputsGiven {
  const ProcessCycle& cycle;  ///< has_data()
};
/// Outputs that the slave took.
struct OutputsTaken {
  const ProcessCycle& cycle;  ///< has_data()
};
/// The slave did not count.
struct ProcessDataMissed {
  const ProcessCycle& cycle;
};

/// Bits at any place; see ExtractBits().
[[nodiscard]] std::uint64_t ExtractAnyBits(ByteSpan data, std::uint64_t bit, unsigned count);

/// Bits [bit, bit + count) of `data`, bit 0 of a byte first; 0 where they do not lie inside. At most 64.
[[nodiscard]] inline std::uint64_t ExtractBits(ByteSpan data, std::uint64_t bit, unsigned count) {
  // Control and status words, positions and modes, of every slave in every cycle.
  if (bit % 8 == 0) {
    const std::size_t byte = static_cast<std::size_t>(bit / 8);
    if (count == 16) return LittleEndian<std::uint16_t>(data, byte);
    if (count == 32) return LittleEndian<std::uint32_t>(data, byte);
    if (count == 8) return LittleEndian<std::uint8_t>(data, byte);
  }
  return ExtractAnyBits(data, bit, count);
}

}  // namespace ecaudit::model
