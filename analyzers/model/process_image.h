/// in: datagrams with process data; FMMUs, sync managers and PDOs of the slaves.  out: ProcessCycle, the values of one
/// slave and direction in one datagram.
///
///   ImageParts       which slaves have a part in a datagram, and where (image_places.h)
///   CountExchange()  whether they gave and took their data
///   SignalFragments  what other datagrams have of a signal
#pragma once

#include <deque>

#include "analyzers/model/image_part.h"
#include "analyzers/model/image_parts.h"
#include "analyzers/model/logical_expectation.h"
#include "analyzers/model/split_signals.h"
#include "decoder/track/events.h"
#include "decoder/track/network.h"

namespace ecaudit::model {

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
  /// See ImageParts.
  ProcessImage(const track::Network& network, const std::deque<SlaveModel>& slaves, ProfileChoice& choice,
               const device::EniConfig* eni)
      : network_(network), slaves_(slaves), parts_(network, slaves, choice, eni) {}

  /// Hands each slave's part in the datagram to `sink`, in the order of the slaves, outputs first.
  /// @return false when no slave's place in it is known
  bool Read(const track::LogicalAccess& access, const LogicalExpectation& expectation, ProcessSink& sink);
  /// The same for a datagram that reads or writes a slave's process data buffer itself (FPRD, FPWR, ...).
  bool Read(const track::SlaveAccess& access, ProcessSink& sink);
  /// What was done since this was asked last, in slaves that were updated.
  [[nodiscard]] std::uint64_t TakeWork() { return parts_.TakeWork(); }
  /// The slave's PDOs may be others now. Its FMMUs and sync managers are checked without this call.
  void OnLayoutChanged(SlaveId slave) { parts_.OnLayoutChanged(slave); }

 private:
  void Deliver(DatagramParts& datagram, std::size_t part, ProcessCycle& cycle, ProcessSink& sink);

  const track::Network& network_;
  const std::deque<SlaveModel>& slaves_;
  ImageParts parts_;
  SignalFragments fragments_;
};

}  // namespace ecaudit::model
