#include "tests/perf/long_run.h"

#include <algorithm>
#include <cmath>

#include "samples/builder/scenarios/scenario.h"

namespace ecaudit::perf {
namespace {

constexpr int kCyclesAPiece = 1000;
constexpr double kTwoPi = 6.283185307179586;
/// A frame takes about a microsecond a slave there and back; a cycle has room for it and for one that is not cyclic.
constexpr TimeNs kCycleASlave = 4'000;
// Bits of the status word.
constexpr std::uint16_t kOperationEnabled = 0x0037;
constexpr std::uint16_t kToggle = 0x0400;

/// RxPDO 1720h: control word, position, latch control, torque, digital outputs.
void Command(samples::Story& story, std::size_t axis, std::uint16_t control, std::int32_t position) {
  samples::Bytes outputs = samples::LeBytes(control);
  samples::AppendLe(outputs, position);
  outputs.resize(12, 0);
  story.master.SetOutputs(axis, std::move(outputs));
}

/// All axes follow a sine, and their status words toggle: the process data change in every cycle.
void Move(samples::Story& story, int cycle) {
  for (std::size_t axis = 0; axis < story.bus.size(); ++axis) {
    const double phase = kTwoPi * cycle / 2000.0 + static_cast<double>(axis);
    Command(story, axis, 0x0F, static_cast<std::int32_t>(std::lround(10'000.0 * std::sin(phase))));
    story.bus.slave(axis).drive().ShowInstead(cycle % 2 == 0 ? kOperationEnabled : kOperationEnabled | kToggle);
  }
}

/// The PDOs with everything that rules look at: status word, latches, actual values.
void AssignPdos(samples::Story& story, std::size_t axis) {
  const auto assign = [&](std::uint16_t assignment, std::uint16_t pdo) {
    story.master.Download(axis, assignment, 0, {0});
    story.master.Download(axis, assignment, 1, samples::LeBytes(pdo));
    story.master.Download(axis, assignment, 0, {1});
  };
  assign(0x1C12, 0x1720);
  assign(0x1C13, 0x1B20);
  for (std::uint8_t subindex = 0; subindex <= 10; ++subindex) story.master.Upload(axis, 0x1B20, subindex);
}

void StartUp(samples::Story& story, TimeNs cycle_ns) {
  const std::size_t axes = story.bus.size();
  story.master.Scan();
  story.master.BringToPreop();
  for (std::size_t axis = 0; axis < axes; ++axis) AssignPdos(story, axis);
  story.master.SetUpClocks();
  story.master.BringToSafeop();
  for (std::size_t axis = 0; axis < axes; ++axis) {
    story.master.StartSync0(axis, static_cast<std::uint32_t>(cycle_ns));
  }
  // Half a cycle behind SYNC0, whose pulses stand at whole cycles.
  story.master.WaitUntil((story.master.now() / cycle_ns + 1) * cycle_ns + cycle_ns / 2);
  story.master.BringToOp({.cycle = cycle_ns, .distributes_time = true, .reads_al_status = true});
  for (const int control : {0x06, 0x07, 0x0F}) {
    for (std::size_t axis = 0; axis < axes; ++axis) Command(story, axis, static_cast<std::uint16_t>(control), 0);
    story.master.Cycles(6);
  }
}

void StartTerminals(samples::Story& story, TimeNs cycle_ns) {
  story.master.Scan();
  story.master.BringToPreop();
  story.master.BringToSafeop();
  story.master.BringToOp({.cycle = cycle_ns, .reads_al_status = true});
}

}  // namespace

std::uint64_t WriteLongRun(const LongRun& run, const std::function<void(const samples::Bytes&)>& write) {
  samples::MasterWay way;
  way.time = {.command = samples::Cmd::ARMW, .in_front = true};
  samples::Story story(way);
  story.capture.style.format = run.format;
  for (std::size_t i = 0; i < run.slaves; ++i) {
    samples::SlaveDescription slave = run.terminals ? samples::InputTerminal() : samples::AkdDrive();
    slave.esc.clock_ppb = static_cast<std::int64_t>(i) * 1'000;
    story.Add(std::move(slave));
  }
  if (run.terminals) {
    StartTerminals(story, std::max(run.cycle_ns, kCycleASlave * static_cast<TimeNs>(run.slaves)));
  } else {
    StartUp(story, run.cycle_ns);
  }
  std::uint64_t packets = story.capture.written();
  write(story.capture.Flush());
  for (int cycle = 0; packets < run.frames;) {
    const std::uint64_t wanted = (run.frames - packets + 1) / 2;  // two packets a cycle
    const int end = cycle + static_cast<int>(std::min<std::uint64_t>(wanted, kCyclesAPiece));
    for (; cycle < end; ++cycle) {
      if (run.moving && !run.terminals) Move(story, cycle);
      story.master.Cycles(1);
    }
    packets += story.capture.written();
    write(story.capture.Flush());
  }
  return packets;
}

samples::Bytes MakeLongRun(const LongRun& run) {
  samples::Bytes file;
  WriteLongRun(run, [&](const samples::Bytes& piece) { samples::AppendBytes(file, piece); });
  return file;
}

}  // namespace ecaudit::perf
