#include <utility>

#include "samples/builder/scenarios/scenario.h"

namespace ecaudit::samples {

Story::Story(const MasterWay& way) : bus(kPowerOn), master(bus, capture, kPowerOn + 500'000'000, way) {}

Expectation& Story::Expect(std::string rule, int slave, const FrameIds& frame, std::string why) {
  Noted& noted = noted_.emplace_back();
  noted.finding.rule = std::move(rule);
  noted.finding.slave = slave;
  noted.finding.why = std::move(why);
  noted.frame = frame;
  return noted.finding;
}

void Story::Command(std::size_t position, std::uint16_t control, std::int32_t target) {
  Bytes outputs = LeBytes(target);
  AppendLe(outputs, control);
  master.SetOutputs(position, std::move(outputs));
}

void Story::EnableDrive(std::size_t position) {
  for (const int control : {0x06, 0x07, 0x0F}) {
    Command(position, static_cast<std::uint16_t>(control));
    master.Cycles(6);
  }
}

void Story::DisableDrive(std::size_t position, std::int32_t target) {
  for (const int control : {0x07, 0x06}) {
    Command(position, static_cast<std::uint16_t>(control), target);
    master.Cycles(6);
  }
}

void Story::Move(std::size_t position, std::int32_t from, std::int32_t to, int cycles) {
  for (int i = 1; i <= cycles; ++i) {
    Command(position, 0x0F, from + (to - from) * i / cycles);
    master.Cycles(1);
  }
}

Sample Story::Finish() const {
  Sample sample;
  sample.extension = capture.style.format == FileFormat::kPcapNg ? "pcapng" : "pcap";
  sample.file = capture.Encode();
  sample.packets = capture.written();
  for (const Noted& noted : noted_) {
    Expectation& one = sample.expected.emplace_back(noted.finding);
    one.sent = noted.frame.sent ? capture.Number(*noted.frame.sent) : 0;
    one.returned = noted.frame.returned ? capture.Number(*noted.frame.returned) : 0;
    if (noted.finding.until_frame.returned) one.until = capture.Number(*noted.finding.until_frame.returned);
  }
  return sample;
}

}  // namespace ecaudit::samples
