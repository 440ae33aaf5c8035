/// Captures of the lab as packets in memory, so that tests can change their time stamps.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "analyzers/analysis.h"
#include "decoder/capture/capture_reader.h"
#include "tests/support/folders.h"
#include "tests/support/memory_source.h"

namespace ecaudit::test {

/// "lab/dc.pcapng"; empty when the lab's captures are absent.
inline std::vector<Packet> LoadPackets(const std::string& name) {
  const auto path = std::filesystem::path(test::SharedDir()) / "captures" / name;
  if (!std::filesystem::exists(path)) return {};
  auto source = capture::OpenCapture(path.string());
  if (!source) return {};
  std::vector<Packet> packets;
  capture::CapturedFrame frame;
  while ((*source)->Next(frame) == capture::ReadStatus::kFrame) {
    Packet packet;
    packet.bytes.assign(frame.bytes.begin(), frame.bytes.end());
    packet.time = frame.time;
    packet.has_time = frame.has_time;
    packet.link_type = frame.link_type;
    packet.interface_index = frame.interface_index;
    packet.original_length = frame.original_length;
    packets.push_back(std::move(packet));
  }
  return packets;
}

inline AnalysisResult AnalysePackets(std::vector<Packet> packets, const AnalysisOptions& options = {}) {
  MemorySource source(std::move(packets));
  return Analyse(source, options);
}

}  // namespace ecaudit::test
