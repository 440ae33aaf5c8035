#include "tests/support/trace_file.h"

#include <utility>

#include "samples/builder/capture_writer.h"

namespace ecaudit::test {
namespace {

samples::WrittenCapture CaptureOf(const Trace& trace) {
  samples::WrittenCapture capture;
  for (const Packet& packet : trace.Packets()) {
    samples::WrittenPacket written;
    written.bytes = packet.bytes;
    written.time = packet.time;
    written.original_length = packet.original_length;
    written.interface_index = packet.interface_index;
    written.simple = !packet.has_time;
    if (capture.interfaces.size() <= packet.interface_index) capture.interfaces.resize(packet.interface_index + 1U);
    capture.interfaces[packet.interface_index].link_type = packet.link_type;
    capture.packets.push_back(std::move(written));
  }
  return capture;
}

}  // namespace

samples::Bytes PcapNgOf(const Trace& trace) {
  return samples::EncodePcapNg(CaptureOf(trace));
}

samples::Bytes PcapOf(const Trace& trace) {
  return samples::EncodePcap(CaptureOf(trace), true);
}

}  // namespace ecaudit::test
