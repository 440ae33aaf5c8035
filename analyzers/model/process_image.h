/// in: datagrams with process data; FMMUs, sync managers and PDOs of the slaves.  out: ProcessCycle, the values of one
/// slave and direction in one datagram.
///
/// Where a slave's data lie follows from its sync managers and FMMUs, byte- or bit-wise. Where those are not in the
/// capture, an ENI file gives the place, also of slaves that only process data reach. Outputs are read from what the
/// master sent, inputs from what came back, and only when the working counter shows that the slave gave them.
///
/// Source: esc-reference 2.1, 6, 7; ETG.2100 (cyclic commands, process image).
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "analyzers/model/exchange.h"
#include "analyzers/model/exchange_count.h"
#include "analyzers/model/logical_expectation.h"
#include "analyzers/model/logical_kinds.h"
#include "analyzers/model/process_data.h"
#include "analyzers/model/profile_choice.h"
#include "analyzers/model/slave_model.h"
#include "analyzers/model/split_signals.h"
#include "decoder/base/event_sink.h"
#include "decoder/track/network.h"

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

/// Process data in a datagram with a logical address, without a known owner.
struct ProcessDataUnplaced {
  const track::LogicalAccess& access;
};

class ProcessSink {
 public:
  virtual ~ProcessSink() = default;
  virtual void On(const ProcessCycle& cycle) = 0;
};

class ProcessImage {
 public:
  /// @param network, slaves must outlive this
  /// @param choice decides what slaves are that only the ENI names; must outlive this
  /// @param eni null: none; must outlive this
  ProcessImage(const track::Network& network, const std::deque<SlaveModel>& slaves, ProfileChoice& choice,
               const device::EniConfig* eni)
      : network_(network), slaves_(slaves), choice_(choice), eni_(eni) {}

  /// Hands each slave's part in the datagram to `sink`, in the order of the slaves, outputs first.
  /// @return false when no slave's place in it is known
  bool Read(const track::LogicalAccess& access, const LogicalExpectation& expectation, ProcessSink& sink);
  /// The same for a datagram that reads or writes a slave's process data buffer itself (FPRD, FPWR, ...).
  bool Read(const track::SlaveAccess& access, ProcessSink& sink);
  /// What was done since this was asked last, in slaves that were updated.
  [[nodiscard]] std::uint64_t TakeWork() { return std::exchange(work_, 0); }
  /// The slave's PDOs may be others now. Its FMMUs and sync managers are checked without this call.
  void OnLayoutChanged(SlaveId slave);

 private:
  /// Of all that decides where the process data lie.
  struct Version {
    std::uint64_t mapping = 0;  ///< track::Network::mapping_version()
    std::uint64_t layouts = 0;

    friend bool operator==(const Version&, const Version&) = default;
  };
  /// Signals of one part that do not lie in one piece.
  struct Split {
    std::size_t part = 0;  ///< number in Entry::parts
    ImagePart alone;       ///< the part without what needs another datagram
    SplitSignals signals;
  };
  struct Entry {
    LogicalKind kind;              ///< of a direct one: the slave and the address in its memory
    Version version;               ///< what it rests on
    std::vector<ImagePart> parts;  ///< by slave; those of the ENI at the end
    std::vector<Split> splits;
    EniCounts eni;
  };
  /// A slave of the ENI that was not met.
  struct Unmet {
    std::unique_ptr<track::SlaveState> state;
    std::unique_ptr<SlaveModel> model;
  };
  // What takes about as long as updating a slave does, or how many times as long.
  static constexpr std::uint64_t kLooksPerSlave = 16;
  static constexpr std::uint64_t kMakingPart = 2;
  static constexpr std::size_t kMaxParts = 8'192;  ///< of all entries but the one at hand

  [[nodiscard]] Version version() const { return {network_.mapping_version(), layout_changes_}; }
  [[nodiscard]] bool ChangedSince(const Version& version, SlaveId slave) const;
  Entry& Find(const LogicalKind& kind, bool& found);
  void BuildLogical(Entry& entry);
  void RefreshLogical(Entry& entry);
  void Clear(Entry& entry);
  void MakeRoom(const Entry& kept);
  static void Replace(Entry& entry, SlaveId slave, Entry& fresh);
  void AddSlave(Entry& entry, SlaveId slave);
  void FindCovered(Entry& entry);
  void BuildDirect(Entry& entry, SlaveId slave, EscAddress address);
  void Add(Entry& entry, ImagePart part);
  void AddMapped(Entry& entry, SlaveId slave, device::PdoDirection direction);
  void AddByEni(Entry& entry);
  void AddByEni(Entry& entry, std::size_t number, device::PdoDirection direction, std::uint32_t image_offset);
  [[nodiscard]] bool FindModel(ImagePart& part, std::size_t number);
  void Deliver(Entry& entry, std::size_t part, ProcessCycle& cycle, ProcessSink& sink);
  [[nodiscard]] const SlaveModel& UnmetSlave(std::size_t number);

  const track::Network& network_;
  const std::deque<SlaveModel>& slaves_;
  ProfileChoice& choice_;
  const device::EniConfig* eni_;
  EventSink no_events_;
  SharedLimits unmet_limits_;
  std::vector<Unmet> unmet_;  ///< by number in the ENI, made when needed
  std::uint64_t layout_changes_ = 0;
  std::vector<std::uint64_t> layout_changed_;  ///< of each slave that ever changed: layout_changes_ after it
  Version version_;                            ///< that fragments_ belong to
  std::uint64_t parts_made_ = 0;
  std::uint64_t work_ = 0;  ///< see TakeWork()
  LogicalKinds<Entry> entries_;
  SignalFragments fragments_;
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
