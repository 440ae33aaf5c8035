#include "analyzers/model/process_image.h"

#include <algorithm>

#include "analyzers/model/exchange_count.h"
#include "decoder/esc/register_map.h"

namespace ecaudit::model {

/// Hands the cycle over with the signals put together that do not lie in one piece.
void ProcessImage::Deliver(DatagramParts& datagram, std::size_t part, ProcessCycle& cycle, ProcessSink& sink) {
  const auto split = std::find_if(datagram.splits.begin(), datagram.splits.end(),
                                  [part](const DatagramParts::Split& s) { return s.part == part; });
  if (split == datagram.splits.end() || !cycle.has_data()) return sink.On(cycle);
  bool whole = true;
  const Sighting where{cycle.part.slave, cycle.part.direction, cycle.sent, cycle.returned, cycle.exchange};
  cycle.data = split->signals.Gather(cycle.data, where, fragments_, whole);
  if (whole) return sink.On(cycle);
  if (split->alone.places.empty()) {
    cycle.data = {};
    return sink.On(cycle);
  }
  sink.On(ProcessCycle{split->alone, cycle.exchange, cycle.sent, cycle.returned, cycle.command, cycle.data});
}

bool ProcessImage::Read(const track::LogicalAccess& access, const LogicalExpectation& expectation, ProcessSink& sink) {
  DatagramParts& datagram = parts_.OfLogical({access.command, access.address, access.length});
  if (parts_.TakeMoved()) fragments_.Clear();
  if (datagram.parts.empty()) return false;
  const ExchangeOfAll counted = CountExchange(access, expectation, datagram.eni, network_, slaves_);
  const bool lost = !access.returned.seen() && !access.assumed;
  const bool given = counted.inputs == Exchange::kYes || counted.inputs == Exchange::kInferred;
  const ByteSpan inputs = given ? access.returned_data : ByteSpan();
  for (std::size_t n = 0; n < datagram.parts.size(); ++n) {
    const ImagePart& part = datagram.parts[n];
    const bool is_input = part.direction == device::PdoDirection::kTx;
    const ByteSpan data = is_input             ? inputs
                          : access.sent.seen() ? access.sent_data
                          : part.covered       ? ByteSpan()
                                               : access.returned_data;
    ProcessCycle cycle{
        part, is_input ? counted.inputs : counted.outputs, access.sent, access.returned, access.command, data, lost};
    if (datagram.splits.empty()) {
      sink.On(cycle);
    } else {
      Deliver(datagram, n, cycle, sink);
    }
  }
  return true;
}

bool ProcessImage::Read(const track::SlaveAccess& access, ProcessSink& sink) {
  const std::size_t length = std::max(access.written.size(), access.read.size());
  if (access.address < esc::kProcessRam || access.broadcast || length == 0 || access.slave >= slaves_.size()) {
    return false;
  }
  const DatagramParts& datagram = parts_.OfMemory(access, static_cast<std::uint16_t>(length));
  if (parts_.TakeMoved()) fragments_.Clear();
  for (const ImagePart& part : datagram.parts) {
    ProcessCycle cycle{part, Exchange::kUnknown, access.sent, access.returned, access.command, {}};
    switch (access.acceptance) {
      case track::Acceptance::kAccepted:
        cycle.exchange = Exchange::kYes;
        break;
      case track::Acceptance::kRefused:
        cycle.exchange = Exchange::kNo;
        break;
      case track::Acceptance::kAssumed:
        cycle.exchange = Exchange::kInferred;
        break;
      case track::Acceptance::kUnknown:
        break;
    }
    if (part.direction == device::PdoDirection::kRx) {
      cycle.data = access.written;
    } else if (access.acceptance == track::Acceptance::kAccepted) {
      cycle.data = access.read;
    }
    sink.On(cycle);
  }
  return !datagram.parts.empty();
}

}  // namespace ecaudit::model
