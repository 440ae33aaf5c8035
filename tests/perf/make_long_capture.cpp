// ecaudit_make_long_capture SLAVES FRAMES FILE [moving|terminals]: a healthy capture of that length; FILE.pcap or
// FILE.pcapng. Without a kind: drives that hold their position.
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <string_view>

#include "tests/perf/long_run.h"

int main(int argc, char** argv) {
  using namespace ecaudit;
  perf::LongRun run;
  const std::string_view kind = argc == 5 ? argv[4] : "";
  run.terminals = kind == "terminals";
  run.moving = kind == "moving";
  const bool understood = argc == 4 || run.terminals || run.moving;
  if (understood) {
    run.slaves = static_cast<std::size_t>(std::strtoul(argv[1], nullptr, 10));
    run.frames = std::strtoull(argv[2], nullptr, 10);
  }
  const std::size_t most = run.terminals ? 1400 : 100;  // that fit into the process data of one frame
  if (run.slaves == 0 || run.slaves > most || run.frames == 0 || !understood) {
    std::fprintf(stderr, "usage: ecaudit_make_long_capture SLAVES FRAMES FILE.pcap|FILE.pcapng [moving|terminals]\n");
    return 2;
  }
  const std::string path = argv[3];
  run.format = path.ends_with(".pcap") ? samples::FileFormat::kPcapNano : samples::FileFormat::kPcapNg;
  std::ofstream file(path, std::ios::binary | std::ios::trunc);
  const std::uint64_t packets = perf::WriteLongRun(run, [&](const samples::Bytes& piece) {
    file.write(reinterpret_cast<const char*>(piece.data()), static_cast<std::streamsize>(piece.size()));
  });
  file.close();
  if (!file) {
    std::fprintf(stderr, "cannot write %s\n", path.c_str());
    return 1;
  }
  std::printf("%s: %llu frames\n", path.c_str(), static_cast<unsigned long long>(packets));
  return 0;
}
